"""Objectives of the optimisation of grasp forces."""

from enum import Enum


class Objective(Enum):
    """Objective of the optimisation."""

    MIN_EFFORT = "min_effort"
    """The least sum of f^2 + eps |u|^2: as little as holds the load."""
    MAX_MARGIN = "max_margin"
    """The largest margin to slip of the contact that is nearest to it; below zero the load cannot be held."""
    MIN_PEAK = "min_peak"
    """The least largest normal force."""
    LOAD_FACTOR = "load_factor"
    """The largest multiple of the load that can be held."""
