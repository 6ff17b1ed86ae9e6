"""A pin of 80 mm in a hand, on one sensor or between two fingers, and what they feel of contacts along it."""

import numpy as np
from scipy.spatial.transform import Rotation

from palpate.kinematics.pose import Pose
from palpate.sensing.held import (
    ExternalWrenches,
    FingersFelt,
    HeldBody,
    HeldTool,
    ObjectMotion,
    external_wrenches,
)
from palpate.sensing.held.wrench_frame import into_matrix
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


GRIP, HANDLE = 10.0, 0.006
"""[N] of each of two fingers, and radius of the handle that they hold 60 mm from the pin's end [m]."""

SENSORS = (
    Pose((0.02, 0.0, -0.06), ((0.0, 0.0, -1.0), (0.0, 1.0, 0.0), (1.0, 0.0, 0.0))),
    Pose((-0.02, 0.0, -0.06), ((0.0, 0.0, 1.0), (0.0, 1.0, 0.0), (-1.0, 0.0, 0.0))),
)
"""Of two fingers in the pin's frame: z towards the pin."""

WEIGHT = HeldBody(mass=0.02, center_of_mass=(0.0, 0.0, -0.04), mass_sd=1e-3, center_of_mass_sd=1e-3)
REST = ObjectMotion.at_rest((0.0, 0.0, 9.81))


def fingers_feel(external):
    """What two soft fingers feel of wrenches (n, 6) on the pin, in their sensors' frames, shape (n, 2, 6)."""
    places = [np.array([side * HANDLE, 0.0, -0.06]) for side in (1.0, -1.0)]
    # three forces and a spin about x, of the object on either finger
    maps = []
    for place in places:
        G = np.zeros((6, 4))
        G[:3, :3] = np.eye(3)
        G[3:, :3] = np.array([np.cross(place, axis) for axis in np.eye(3)]).T
        G[3, 3] = 1.0
        maps.append(G)
    weight = external_wrenches(_unfelt(np.zeros((1, 2, 6))), WEIGHT, REST).wrench
    loads = (external - weight) @ np.linalg.pinv(np.hstack(maps)).T
    felt = np.empty((len(external), 2, 6))
    for j, (side, pose) in enumerate(zip((1.0, -1.0), SENSORS, strict=True)):
        load = loads[:, 4 * j : 4 * j + 4] + [side * GRIP, 0.0, 0.0, 0.0]
        felt[:, j] = load @ maps[j].T @ into_matrix(pose).T
    return felt


def _unfelt(wrench):
    each = (np.array([of] * 2) for of in (NOISE, ZERO, POSES, MATRIX))
    return FingersFelt(wrench, *_POSES, *each)


_POSES = (np.array([pose.rotation for pose in SENSORS]), np.array([pose.position for pose in SENSORS]))
POSES = np.diag([1e-4**2] * 3 + [np.radians(0.2) ** 2] * 3)
"""Covariance of each sensor's pose in the hand: 0.1 mm, 0.2 degrees."""

SCALE = np.array([1.0, 1.0, 1.0, 0.01, 0.01, 0.01])
MATRIX = 1e-3 * np.outer(SCALE, 1.0 / SCALE)
"""Standard deviation of the entries of each sensor's matrix, forces in N and moments in units of 10 mN m: a tenth
of what makers claim for all errors together is usual between axes."""


def measured_by_fingers(rng, external):
    """What two sensors with errors of their own make of wrenches on the pin, as `FingersFelt` believes it."""
    felt = fingers_feel(external)
    for j, believed in enumerate(SENSORS):
        off = np.sqrt(np.diag(POSES)) * rng.normal(size=6)
        turn = Rotation.from_rotvec(off[3:]).as_matrix() @ np.array(believed.rotation)
        place = np.array(believed.position) + off[:3]
        real = Pose(tuple(place.tolist()), tuple(map(tuple, turn.tolist())))
        felt[:, j] = felt[:, j] @ np.linalg.inv(into_matrix(believed)).T @ into_matrix(real).T
        felt[:, j] += felt[:, j] @ (MATRIX * rng.normal(size=(6, 6))).T
        felt[:, j] += rng.normal(size=6) @ np.sqrt(ZERO) + rng.normal(size=felt[:, j].shape) @ np.sqrt(NOISE)
    return _unfelt(felt)


SIDE = (np.array([1.0, 0.0, 0.0]), np.array([RADIUS, 0.0, -0.01]))
END = (np.array([0.0, 0.0, 1.0]), np.array([0.0, 0.0, RADIUS]))
"""Normal and place, in the pin's frame, where it touches."""
