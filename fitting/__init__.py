"""Surface statistics, image edges, parameters, objective, solvers and results."""
