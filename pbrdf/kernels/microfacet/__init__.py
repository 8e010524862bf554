"""Kernels of the analytical model: slopes, shadowing, the mirroring facet."""
