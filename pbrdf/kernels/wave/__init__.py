"""Kernels of wave optics: amplitudes of one scattering, sums over orders, their matrix."""
