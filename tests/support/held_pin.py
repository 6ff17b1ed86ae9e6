"""A pin in a hand, and what its sensor reads of contacts along it whose loads change by themselves."""

import numpy as np

from palpate.kinematics.pose import Pose
from palpate.sensing.held import ExternalWrenches
from palpate.sensing.uncertainty import white_noise
from palpate.surfaces import Capsule

RADIUS = 0.003
PIN = Capsule(RADIUS, 0.08)
"""80 mm long, from z = 3 mm down to -80 mm."""

NOISE, ZERO = white_noise(3.1e-3, 1.6e-5), white_noise(1e-2, 1e-4)
"""Of a Nano17: its resolution as noise, and zeros that have drifted for minutes."""

HAND = Pose((0.0, 0.0, -0.06))
"""Of the sensor in the pin's frame."""


def changing(rng, n, size):
    """A sum of three slow sines of random phase and root mean square `size`, shape (n,)."""
    t, phase = np.linspace(0.0, 1.0, n), rng.uniform(0.0, 2 * np.pi, 3)
    return (
        size
        * np.sqrt(2.0 / 3.0)
        * sum(np.sin(2 * np.pi * k * t + p) for k, p in zip((1, 2, 3), phase, strict=True))
    )


def pressed(rng, heights, angle=0.1, swing=0.1, force=1.0, n=200, spin=1e-4, sides=None):
    """Wrenches of a window of n samples, of contacts at heights on the pin, in its frame.

    Each load changes by itself: its normal force by `swing`, its direction by `angle`, root mean squares,
    and a spin torque comes and goes.
    """
    wrench = np.zeros((n, 6))
    for height, side in zip(heights, sides or [1.0] * len(heights), strict=True):
        share = force / len(heights)
        normal = np.array([side, 0.0, 0.0])
        push = share * (1.0 + changing(rng, n, swing))
        sideways = share * np.stack([np.zeros(n), changing(rng, n, angle), changing(rng, n, angle)], axis=1)
        f = -push[:, None] * normal + sideways
        wrench[:, :3] += f
        wrench[:, 3:] += (
            np.cross(RADIUS * normal + [0.0, 0.0, height], f) + 1e-4 * changing(rng, n, 1.0)[:, None] * normal
        )
    true = ExternalWrenches.measured(wrench, NOISE).seen_from(HAND).wrench
    noise = rng.normal(size=(n, 6)) @ np.sqrt(NOISE) + rng.normal(size=6) @ np.sqrt(ZERO)
    return ExternalWrenches.measured(true + noise, NOISE, ZERO).seen_from(HAND.inverse())
