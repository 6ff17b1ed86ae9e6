"""Simulated back ends for tests: started, moved, and the angle between orientations."""

import math
from typing import Any

from palpate.kinematics.pose import rotvec_from_rotation, times, transposed
from palpate.runtime.data import Command
from palpate.sim import MujocoBackend
from palpate.sim.hand.backend import HandBackend
from palpate.spatial import ZERO


def started(scene, **options) -> Any:
    """Return a started back end over a scene of a tip or of a hand."""
    backend = HandBackend(scene, **options) if hasattr(scene, "hand") else MujocoBackend(scene, **options)
    backend.start()
    return backend


def move(backend, periods, velocity=ZERO, rate=ZERO):
    """Command a velocity [m/s] and a rate of turning [rad/s] for some periods; return the last sample."""
    for _ in range(periods):
        sample = backend.step(Command(velocity, angular_velocity_base_tip=rate))
    return sample


def angle_between(after, before):
    """Return the angle from one orientation to another [rad]."""
    return math.hypot(*rotvec_from_rotation(times(after, transposed(before))))
