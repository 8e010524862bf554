"""Solvers: they know an objective and no physics."""
