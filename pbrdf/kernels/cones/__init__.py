"""Kernels of `observe`: cones of source and detector, from the detector's end."""
