"""A pin in a hand, and what its sensor reads of contacts along it whose loads change by themselves."""

import numpy as np
from scipy.spatial.transform import Rotation

from palpate.kinematics.pose import Pose
from palpate.sensing.held import ExternalWrenches, HeldTool
from palpate.sensing.uncertainty import white_noise
from palpate.surfaces import Capsule

RADIUS = 0.003
PIN = Capsule(RADIUS, 0.08)
"""80 mm long, from z = 3 mm down to -80 mm."""

NOISE, ZERO = white_noise(3.1e-3, 1.6e-5), white_noise(1e-2, 1e-4)
"""Of a Nano17: its resolution as noise, and zeros that have drifted for minutes."""

HAND = Pose((0.0, 0.0, -0.06))
"""Of the sensor in the pin's frame."""

IN_HAND = HeldTool(PIN, HAND.inverse())
"""The pin, as it is believed to be held."""


def changing(rng, n, size):
    """A sum of three slow sines of random phase and root mean square `size`, shape (n,)."""
    t, phase = np.linspace(0.0, 1.0, n), rng.uniform(0.0, 2 * np.pi, 3)
    return (
        size * np.sqrt(2.0 / 3.0) * np.sin(2 * np.pi * np.arange(1, 4)[:, None] * t + phase[:, None]).sum(axis=0)
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
        wrench[:, 3:] += np.cross(RADIUS * normal + [0.0, 0.0, height], f)
        wrench[:, 3:] += changing(rng, n, spin)[:, None] * normal
    true = ExternalWrenches.measured(wrench, NOISE).seen_from(HAND).wrench
    noise = rng.normal(size=(n, 6)) @ np.sqrt(NOISE) + rng.normal(size=6) @ np.sqrt(ZERO)
    return ExternalWrenches.measured(true + noise, NOISE, ZERO).seen_from(HAND.inverse())


def touching(rng, slip, normal, place, rate=500.0, force=1.0):
    """The pin touches a point that stands still, while its hand moves and it slips in the hand.

    Yields the wrench that the sensor reads in each period, and the pose of the hand in the base.

    Args:
        rng: Of noise, drift and motion.
        slip: By period, of the pin's frame in the hand: shift (3) [m] and rotation vector (3), shape (n, 6).
        normal: Of the pin where it touches, in its frame.
        place: Where, in its frame [m].
        rate: [Hz]
        force: Normal force [N].
    """
    n = len(slip)
    drift = np.cumsum(rng.normal(size=(n, 6)), axis=0) * np.sqrt(np.diag(ZERO) / (60.0 * rate))  # ZERO in a minute
    noise = rng.normal(size=(n, 6)) @ np.sqrt(NOISE)
    push, sway = (
        force * (1.0 + changing(rng, n, 0.05)),
        np.stack([changing(rng, n, 0.05) for _ in range(6)], axis=1),
    )
    thing = np.array([0.4, 0.1, 0.2])
    across = np.linalg.svd(normal[None])[2][1:]
    for i in range(n):
        held = Rotation.from_rotvec(slip[i, 3:]).as_matrix()
        turn = Rotation.from_rotvec(sway[i, :3]).as_matrix()
        in_hand = np.array(IN_HAND.pose.position) + slip[i, :3] + held @ place
        f = held @ (-push[i] * normal + 0.3 * force * sway[i, 3:5] @ across)
        felt = np.concatenate((f, np.cross(in_hand, f))) + noise[i] + drift[i]
        pose = Pose(tuple((thing - turn @ in_hand).tolist()), tuple(map(tuple, turn.tolist())))
        yield tuple(felt.tolist()), pose
