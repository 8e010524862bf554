"""Results, fitted models and tables of reflectance, written and read."""
