"""The minimum grip that holds a load, and the limits of the hand that follow from it."""

import math
from collections.abc import Sequence

import numpy as np
from scipy.optimize import linprog

from palpate.controllers.grip.need import least_grip_of_two
from palpate.errors import FloatArray, InvalidValueError
from palpate.experiments.grasp.config import GraspConfig
from palpate.experiments.grasp.metrics import MAX_GRIP
from palpate.friction.limit_surface import LimitSurface
from palpate.friction.p_norm import p_norm
from palpate.sim.fidelity import GRAVITY
from palpate.spatial import Vector, Wrench

GRIP_TOLERANCE = 1e-3
"""Share of the mean force by which a load may exceed a limit, and by which the minimum may be too small."""

_MAX_ROUNDS = 40
"""Largest number of rounds of cutting planes; never reached, for each about doubles the accuracy."""

_MIN_SPIN_LENGTH = 1e-6
"""Length that scales moments where no finger presses [m]."""

_MIN_LIFT_MARGIN = 0.08
"""Share of grip that a lift takes beyond the minimum, with any margin: the threshold at which the lift
begins, and noise."""

_GRIP_RATE = 15.0
"""Least rate at which the simulated fingers' grip follows a large change [N/s]: position servos whose profile
closes with 5 mm/s."""

_TAKING_UP_TIME = 0.15
"""Time by which taking up any weight exceeds a start with full acceleration [s]."""


def least_grip(
    surface: LimitSurface, load: Wrench, contacts: Sequence[Vector], normals: Sequence[Vector]
) -> float:
    """Return the mean over the fingers of `least_forces` [N]."""
    forces = least_forces(surface, load, contacts, normals)
    return sum(forces) / len(forces)


def least_forces(
    surface: LimitSurface, load: Wrench, contacts: Sequence[Vector], normals: Sequence[Vector]
) -> tuple[float, ...]:
    """Return the normal forces [N] of the least sum with which fingers, all of one material, hold an object.

    For two fingers `least_grip_of_two` is exact. For more, each finger presses with its own force along its
    normal, with a tangential force and a spin torque within the limit surface. The sum is minimised over all
    forces that balance the load: a cone programme, solved by cutting planes. Where e grows with the force, the set
    of possible loads is not convex. Then each round takes e at the forces found before, until both agree. They
    agree at one grip only, for a larger e needs less grip; each round errs by gamma times the error before.

    Args:
        surface: True limit surface of each contact.
        load: Other load on the object than the fingers', about the origin [N, N m].
        contacts: Positions of the contacts [m].
        normals: Unit vectors into the object.

    Returns:
        One force per finger; all infinite if nothing holds the load.
    """
    if len(contacts) == 2:
        return (least_grip_of_two(surface, load, contacts[0], contacts[1]),) * 2
    wrench, at, n = np.array(load), np.array(contacts), np.array(normals)
    before = np.ones(len(contacts))
    least = _least_of_many(surface, before, wrench, at, n)
    while (
        surface.load_exponent
        and np.isfinite(least).all()
        and np.abs(least - before).max() > GRIP_TOLERANCE * least.max()
    ):
        least, before = _least_of_many(surface, least, wrench, at, n), least
    return tuple(least.tolist())


def _least_of_many(
    surface: LimitSurface, pressed: FloatArray, load: FloatArray, contacts: FloatArray, normals: FloatArray
) -> FloatArray:
    """Minimise the sum of f over (per finger f, two tangential components, a torque over e) by cutting planes.

    The vector z of a finger, two tangential components and a torque over e, must lie within the limit surface at
    f: d . z <= mu f for the gradient d of its norm at every point. A round adds the planes that the solution
    before violates, until none is violated by more than `GRIP_TOLERANCE`. e belongs to the forces `pressed` [N].
    """
    mu, power, n = surface.friction, surface.norm_exponent, len(contacts)
    lengths = [surface.spin_length_at(force) for force in pressed.tolist()]
    A = np.zeros((6, 4 * n))
    for i, (p, q) in enumerate(zip(contacts, normals, strict=True)):
        aside = np.cross(q, [0.0, 0.0, 1.0] if abs(q[2]) < 0.9 else [1.0, 0.0, 0.0])
        aside /= np.linalg.norm(aside)
        for k, direction in enumerate((q, aside, np.cross(q, aside))):
            A[:, 4 * i + k] = (*direction, *np.cross(p, direction))
        A[3:, 4 * i + 3] = lengths[i] * q
    e = max(max(lengths), _MIN_SPIN_LENGTH)
    scale = np.array([1.0, 1.0, 1.0, 1.0 / e, 1.0 / e, 1.0 / e])
    planes = [_plane(i, n, d, mu) for i in range(n) for d in (*np.eye(3), *-np.eye(3))]
    forces = np.full(n, math.inf)
    for _ in range(_MAX_ROUNDS):
        found = linprog(
            np.tile([1.0, 0.0, 0.0, 0.0], n),
            A_ub=np.array(planes),
            b_ub=np.zeros(len(planes)),
            A_eq=A * scale[:, None],
            b_eq=-load * scale,
            bounds=[(0.0, None), (None, None), (None, None), (None, None)] * n,
        )
        if not found.success:
            return np.full(n, math.inf)
        x = np.asarray(found.x).reshape(n, 4)
        forces, worst = x[:, 0].copy(), 0.0
        for i, (f, z) in enumerate(zip(forces.tolist(), x[:, 1:], strict=True)):
            size, direction = _norm(z, power) if z.any() else (0.0, z)
            if size > mu * f * (1.0 + 1e-12):
                worst = max(worst, (size - mu * f) / (mu * float(forces.mean())))
                planes.append(_plane(i, n, direction, mu))
        if worst < GRIP_TOLERANCE:
            break
    return forces


def _norm(z: FloatArray, p: float) -> tuple[float, FloatArray]:
    """Return |(|(z_1, z_2)|, z_3)|_p and its gradient, which times z is the norm; z is not 0."""
    force, torque = float(np.hypot(z[0], z[1])), abs(float(z[2]))
    size = p_norm(force, torque, p)
    along = (force / size) ** (p - 1.0) / force if force > 0.0 else 0.0
    about = math.copysign((torque / size) ** (p - 1.0), z[2]) if torque > 0.0 else 0.0
    return size, np.array([along * z[0], along * z[1], about])


def _plane(i: int, n: int, direction: FloatArray, mu: float) -> FloatArray:
    row = np.zeros(4 * n)
    row[4 * i : 4 * i + 4] = (-mu, *direction)
    return row


def load_under(config: GraspConfig, pull: float = 0.0, sideways: float = 0.0) -> Wrench:
    """Return the weight and a pull, about the object's origin, base frame [N, N m].

    Args:
        config: Options of the grasp.
        pull: Pull downwards, beside the line of the contacts [N].
        sideways: Pull to the side [N].
    """
    return (0.0, sideways, -pull - config.mass * GRAVITY, -config.offset * pull, 0.0, 0.0)


def largest_load(config: GraspConfig) -> Wrench:
    """Return weight and pull at their largest, about the object's origin, base frame [N, N m]."""
    if config.load == "none":
        return load_under(config)
    if config.load == "shake":
        return load_under(config, config.pull_before + config.largest_pull, config.largest_pull)
    return load_under(config, max(config.pull_before, config.largest_pull))


def grip_for(config: GraspConfig, surface: LimitSurface, load: Wrench) -> float:
    """Return the largest of the least forces that hold a load at the planned contacts [N], or infinity."""
    contacts: list[Vector] = []
    normals: list[Vector] = []
    for i in range(config.fingers):
        angle = 2.0 * math.pi * i / config.fingers
        x, y = math.cos(angle), math.sin(angle)
        contacts.append((config.half_width * x, config.half_width * y, 0.0))
        normals.append((-x, -y, 0.0))
    return max(least_forces(surface, load, contacts, normals))


def taking_up_time(config: GraspConfig, cautious: LimitSurface, first_grip: float) -> float:
    """Return by how much a lift takes longer because the grip has to rise to the weight [s].

    Args:
        config: Options of the grasp.
        cautious: Weakest surface that the lift is planned with.
        first_grip: Grip at the beginning of the lift [N].
    """
    needed = grip_for(config, cautious, load_under(config))
    grip = min((1.0 + config.margin) * needed, MAX_GRIP)
    return _TAKING_UP_TIME + max(0.0, grip - first_grip) / _GRIP_RATE


def check_weight(config: GraspConfig, cautious: LimitSurface, true: LimitSurface) -> None:
    """Refuse an object that the hand cannot hold even without a pull.

    Args:
        config: Options of the grasp.
        cautious: Weakest surface that the lift is planned with.
        true: True surface of the contacts.

    Raises:
        InvalidValueError: If the weight takes more grip, with the margin, than fingers may press with, by either
            surface.
    """
    weight = load_under(config)
    needs = (
        (grip_for(config, true, weight), true, ""),
        (grip_for(config, cautious, weight), cautious, " (planned with)"),
    )
    least, surface, note = max(needs, key=lambda each: each[0])
    margin = max(config.margin, _MIN_LIFT_MARGIN)
    grip = (1.0 + margin) * least
    if grip > MAX_GRIP:
        most = _rounded_down(config.mass * MAX_GRIP / grip)
        raise InvalidValueError(
            f"mass = {config.mass:g} kg: must be at most {most:g} kg, or the object rougher (--friction); with "
            f"mu = {surface.friction:.3g}{note} and a margin of {100.0 * margin:.3g} % its weight takes "
            f"{grip:.3g} N of each finger, of which at most {MAX_GRIP:g} N is asked"
        )


def _rounded_down(value: float) -> float:
    """Return the value to three digits, never rounded up: a recommended value must be accepted."""
    step = 10.0 ** (math.floor(math.log10(value)) - 2)
    return round(math.floor(value / step) * step, 12)
