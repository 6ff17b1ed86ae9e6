"""Bounds on what a run achieved, for tables of runs: dotted attribute path -> (lowest, highest)."""

from operator import attrgetter
from typing import Any

import numpy as np

INF = float("inf")

Bounds = dict[str, tuple[float, float]]


def below(**limits: float) -> Bounds:
    """Upper bounds of attributes; a double underscore stands for a dot."""
    return {name.replace("__", "."): (-INF, limit) for name, limit in limits.items()}


def above(**limits: float) -> Bounds:
    """Lower bounds of attributes; a double underscore stands for a dot."""
    return {name.replace("__", "."): (limit, INF) for name, limit in limits.items()}


def check_bounds(found: Any, bounds: Bounds, **values: object) -> None:
    """Check every element of each attribute of a result against its bounds, and others against exact values.

    Args:
        found: Result of a run.
        bounds: Lowest and highest value of attributes.
        values: Exact value of attributes; a double underscore stands for a dot.
    """
    paths = {name.replace("__", "."): value for name, value in values.items()}
    assert {path: attrgetter(path)(found) for path in paths} == paths
    for path, (low, high) in bounds.items():
        value = np.asarray(attrgetter(path)(found), float)
        assert ((low <= value) & (value <= high)).all(), f"{path} = {value}: must be from {low} to {high}"
