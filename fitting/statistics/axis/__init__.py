"""Statistics along one axis: structure function, autocorrelation, rounding, scatter."""
