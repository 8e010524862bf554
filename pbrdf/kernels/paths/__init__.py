"""Kernels that follow paths over an opaque surface."""
