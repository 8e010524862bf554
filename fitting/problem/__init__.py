"""A measurement, a model and free parameters made into one problem."""
