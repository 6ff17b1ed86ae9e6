"""Grasps whose contacts share more than the object: convex problems and others, for tests and benchmarks."""

import math

import casadi
import numpy as np

from palpate.grasp import GraspContacts

LOAD = np.array([0.2, 0.1, -2.0, 0.002, 0.001, 0.003])
TENDONS = np.zeros((2, 16))
TENDONS[0, [0, 8]], TENDONS[1, [4, 12]] = (0.012, 0.010), (0.011, 0.013)  # [m] of pulley per newton
SHARED = (TENDONS, -0.01, [0.0185, 0.0245])


def ring(n=4, aslant=0.2, **more):
    """n fingers around a ring that hold a weight."""
    angle = np.arange(n) * 2.0 * math.pi / n + aslant
    normals = -np.column_stack([np.cos(angle), np.sin(angle), 0.0 * angle])
    up = np.tile([0.0, 0.0, 1.0], (n, 1))
    frames = np.stack([normals, up, np.cross(normals, up)], axis=2)
    places = -0.03 * normals + 0.004 * np.outer((-1.0) ** np.arange(n), [0.0, 0.0, 1.0])
    return GraspContacts(places, frames, 0.6, 0.004, **({"force_max": 20.0} | more))


def effort(w):
    return casadi.sumsqr(w[:, 0]) + 0.1 * casadi.sumsqr(w[:, 1:3]) + 1e4 * casadi.sumsqr(w[:, 3])


def quartic(w):
    return casadi.sum1(w[:, 0] ** 4) + 0.1 * casadi.sumsqr(w[:, 1:]) * 10.0


CONVEX = {
    "a tendon": (effort, None),
    "linear, a cone and a ball": (
        effort,
        lambda w: [w[0, 0] + w[1, 0] <= 1.8, casadi.norm_2(w[0, 1:3].T) <= 0.5 * w[0, 0], w[1, 0] ** 2 <= 0.8],
    ),
}
OTHERS = {
    "power of four": (quartic, None),
    "product": (effort, lambda w: [w[0, 0] * w[1, 0] <= 0.93 * w[2, 0]]),
    "equation": (effort, lambda w: [w[2, 0] == w[3, 0] ** 2]),
    "not convex": (lambda w: effort(w) - 2.3 * w[0, 0] * w[1, 0], lambda w: [casadi.exp(0.3 * w[0, 0]) <= 2.0]),
}
