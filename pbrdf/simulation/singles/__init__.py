"""Single bounces over a Gaussian surface by the known law of its slopes."""
