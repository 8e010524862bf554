"""Scene files of the command line tests."""

SCENE = """
[surface]
type = "gaussian"
shape = [32, 32]
spacing_um = 1.0
corr_length_um = 6.0
slope_rms = 0.2

[substrate]
n = 1.5
"""
