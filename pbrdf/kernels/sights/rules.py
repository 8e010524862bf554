"""Gauss-Legendre rules on (0, 1) for cells of directions."""

from collections import namedtuple

import numpy as np

# First edge of dphi; nodes and weights (rules, most nodes) and the nodes of each rule
Rules = namedtuple("Rules", "left sizes nodes weights")
SIZES = (4, 6, 12)

NODES = np.zeros((len(SIZES), max(SIZES)))
WEIGHTS = np.zeros_like(NODES)
for _rule, _size in enumerate(SIZES):
    _x, _w = np.polynomial.legendre.leggauss(_size)
    NODES[_rule, :_size] = 0.5 + 0.5 * _x
    WEIGHTS[_rule, :_size] = 0.5 * _w


def rules_from(left):
    """Rules for cells of dphi that begin at `left`."""
    return Rules(left, np.array(SIZES), NODES, WEIGHTS)
