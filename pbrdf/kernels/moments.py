"""Running mean and scatter of tallies over independent samples of the surface."""

from pbrdf.kernels import jit


@jit(allocates=False)
def add_sample(flux, scale, count, mean, scatter, mean_total, scatter_total):
    """Add the `count`-th sample to the running moments (Welford) and clear its tally.

    flux            tally of the sample (wavelengths, bounces, cells)
    mean, scatter   the same shape; mean_total, scatter_total (wavelengths, cells) of all
    bounces
    """
    for w in range(flux.shape[0]):
        for cell in range(flux.shape[2]):
            total = 0.0
            for b in range(flux.shape[1]):
                value = flux[w, b, cell] * scale
                total += value
                change = value - mean[w, b, cell]
                mean[w, b, cell] += change / count
                scatter[w, b, cell] += change * (value - mean[w, b, cell])
            change = total - mean_total[w, cell]
            mean_total[w, cell] += change / count
            scatter_total[w, cell] += change * (total - mean_total[w, cell])
