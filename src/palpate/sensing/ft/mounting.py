"""How a sensor is turned on its flange, from static poses of the flange.

At rest and without contact, with a the specific force in the flange's frame (up, length g), R from flange to
sensor coordinates, and m, h = m c the payload's mass and first moment in the sensor frame, the sensor shows
    force  = bias_f - A a,   A = m R
    moment = bias_m + B a,   B = -[h]x R
(`palpate.sensing.ft.payload`, turned). Both are linear in A and B, so that their zeros may drift and jump as
there, and A and B with their information are all that the poses say of m, R and h: 18 numbers for 7 unknowns,
found by Gauss-Newton. The 11 that are left over check it: A is a rotation but for its length, and B a cross
product in the same frame. A sensor whose axes are mirrored, swapped or of other gains does not pass; which axes it
has is told by the one of 48 (orders and signs) that does.

The rotation from weights in a handful of poses, without drift: Bagge Carlson 2019, "On the calibration of
force/torque sensors in robotics", arXiv 1904.06158.
"""

import itertools
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import Rotation
from scipy.special import chdtrc

from palpate.errors import FloatArray, InvalidValueError
from palpate.estimation import Assumption, BrokenAssumption, Verdict
from palpate.sensing.ft.arrays import finite_rows, named_axes, same_length
from palpate.sensing.ft.payload import (
    SMALLEST_SPREAD,
    IdentifiedPayload,
    identify_payload,
    noise_variance,
    theta_covariance,
)
from palpate.sensing.ft.zero_drift import explained

FEWEST_POSES = 12
"""Of 18 numbers and two zeros that may drift: six opposite pairs."""

RARE = 1e-4
"""Probability of what is left over beyond which A and B are not of one rotation."""

LEFT_OVER = 11
"""18 numbers less 7 unknowns."""

SURE = 5.0
"""Standard deviations from nothing at which a force's axis has a sign."""

WELL_KNOWN = np.radians(1.0)
"""[rad] Standard deviation of a mounting from which on it is none: drawings are better."""

STEPS, HALVINGS = 50, 20
"""Of Gauss-Newton; five without any halving are the rule."""

SMALL_STEP = 1e-12
"""Square of a step in standard deviations that ends it."""

CLEARLY = 0.3
"""Of what axes as read leave over, as a root mean square, below which others are meant."""

REMEDY = "correct that in the driver or the file"

SIGNED_AXES = [
    np.eye(3)[list(order)] * np.array(signs)[:, None]
    for order in itertools.permutations(range(3))
    for signs in itertools.product((1.0, -1.0), repeat=3)
]
"""All orders and signs of three axes, right-handed and left-handed."""


@dataclass(frozen=True, slots=True, eq=False)
class IdentifiedMounting:
    """How a sensor is turned on its flange, and what it carries.

    Attributes:
        rotation_flange_sensor: From sensor to flange coordinates: its columns are the sensor's axes, shape (3, 3).
        rotation_covariance: Of a small rotation vector in the sensor frame, shape (3, 3) [rad^2].
        payload: What it carries and its bias; their uncertainty includes that of the rotation.
        left_over_chi2: What the poses contradict, over its 11 degrees of freedom: about 1.
        verdict: Whether all of it can be relied on.
    """

    rotation_flange_sensor: FloatArray
    rotation_covariance: FloatArray
    payload: IdentifiedPayload
    left_over_chi2: float
    verdict: Verdict

    @property
    def rotation_sd(self) -> FloatArray:
        """Standard deviation about each axis of the sensor, shape (3,) [rad]."""
        return np.asarray(np.sqrt(np.diag(self.rotation_covariance)))


def identify_mounting(
    specific_force_flange: npt.ArrayLike,
    wrench: npt.ArrayLike,
    *,
    force_sd: float,
    moment_sd: float,
    gravity_sd: float = 0.0,
) -> IdentifiedMounting:
    """Return how a sensor is turned on its flange, with mass, centre of mass and bias.

    Args:
        specific_force_flange: At rest in the flange's frame, shape (n, 3) [m/s^2], n >= 12, in the order in which
            the poses were taken; see `palpate.sensing.ft.poses`.
        wrench: What the sensor showed, in its own frame, shape (n, 6) [N, N m].
        force_sd: As in `identify_payload`.
        moment_sd: Likewise.
        gravity_sd: Likewise.

    Raises:
        InvalidValueError: As in `identify_payload`; too few poses, all in one plane; a mass lost in the noise; or
            axes that no right-handed sensor has, which are named.
    """
    a = finite_rows("specific_force_flange", specific_force_flange, 3, "m/s^2")
    rows = finite_rows("wrench", wrench, 6, "N, N m")
    same_length("specific_force_flange", a, "wrench", rows)
    if len(a) < FEWEST_POSES:
        raise InvalidValueError(f"{len(a)} poses: give {FEWEST_POSES} or more, best opposite ones in turn")
    _refuse_flat(a)
    design = np.einsum("nc,rs->nrsc", a, np.eye(3)).reshape(len(a), 3, 9)
    model = explained((-design, rows[:, :3], force_sd), (design, rows[:, 3:], moment_sd))
    force, moment, zero = model.force, model.moment, model.zero
    given = _Given(
        force.theta.reshape(3, 3),
        moment.theta.reshape(3, 3),
        _inverse(theta_covariance(force, noise_variance(force, zero, force_sd), zero)),
        _inverse(theta_covariance(moment, noise_variance(moment, zero, moment_sd), zero)),
    )
    _refuse_left_handed(given)
    found = _solved(given)
    if chdtrc(LEFT_OVER, found.left_over) < RARE:
        _refuse_named(given, found)
    payload = identify_payload(
        a @ found.rotation.T, rows, force_sd=force_sd, moment_sd=moment_sd, gravity_sd=gravity_sd
    )
    payload = _with_rotation(payload, found, (a @ found.rotation.T).mean(axis=0))
    broken = (*_contradicted(given, found), *_loose(found))
    return IdentifiedMounting(
        rotation_flange_sensor=found.rotation.T,
        rotation_covariance=found.covariance[1:4, 1:4],
        payload=payload,
        left_over_chi2=found.left_over / LEFT_OVER,
        verdict=Verdict(broken).and_also(payload.verdict.broken),
    )


@dataclass(frozen=True, slots=True, eq=False)
class _Given:
    """All that the poses say: A and B, and their information, shapes (3, 3) and (9, 9)."""

    A: FloatArray
    B: FloatArray
    A_information: FloatArray
    B_information: FloatArray

    def with_axes(self, of_force: FloatArray, of_moment: FloatArray) -> "_Given":
        """Return the same, forces and moments in other axes."""
        f, m = np.kron(of_force, np.eye(3)), np.kron(of_moment, np.eye(3))
        return _Given(
            of_force @ self.A, of_moment @ self.B, f @ self.A_information @ f.T, m @ self.B_information @ m.T
        )


@dataclass(frozen=True, slots=True, eq=False)
class _Solved:
    """The seven unknowns.

    Attributes:
        mass: [kg].
        rotation: Flange to sensor coordinates, shape (3, 3).
        first_moment: [kg m].
        covariance: Of (mass, small rotation in the sensor frame, first moment), shape (7, 7).
        left_over: Sum of squares of what they leave, in standard deviations.
    """

    mass: float
    rotation: FloatArray
    first_moment: FloatArray
    covariance: FloatArray
    left_over: float


def _solved(given: _Given) -> _Solved:
    u, _, vt = np.linalg.svd(given.A)
    R = u @ np.diag([1.0, 1.0, np.linalg.det(u @ vt)]) @ vt
    m = float((R * given.A).sum()) / 3.0
    skew = given.B @ R.T
    h = 0.5 * np.array([skew[1, 2] - skew[2, 1], skew[2, 0] - skew[0, 2], skew[0, 1] - skew[1, 0]])
    weight = np.zeros((18, 18))
    weight[:9, :9], weight[9:, 9:] = given.A_information, given.B_information
    left = _left(given, m, R, h)
    for _ in range(STEPS):
        J = np.zeros((18, 7))
        J[:9, 0] = R.ravel()
        for i, axis in enumerate(np.eye(3)):
            J[:9, 1 + i] = (m * _cross(axis) @ R).ravel()
            J[9:, 1 + i] = (-_cross(h) @ _cross(axis) @ R).ravel()
            J[9:, 4 + i] = (-_cross(axis) @ R).ravel()
        information = J.T @ weight @ J
        step = np.linalg.solve(information, J.T @ weight @ left)
        for _ in range(HALVINGS):
            turned = Rotation.from_rotvec(step[1:4]).as_matrix() @ R
            moved = _left(given, m + float(step[0]), turned, h + step[4:])
            if moved @ weight @ moved <= left @ weight @ left:
                m, R, h, left = m + float(step[0]), turned, h + step[4:], moved
                break
            step = 0.5 * step
        else:
            break
        if float(step @ information @ step) < SMALL_STEP:
            break
    return _Solved(m, R, h, _inverse(information), float(left @ weight @ left))


def _left(given: _Given, m: float, R: FloatArray, h: FloatArray) -> FloatArray:
    return np.concatenate([(given.A - m * R).ravel(), (given.B + _cross(h) @ R).ravel()])


def _refuse_flat(a: FloatArray) -> None:
    g = float(np.median(np.linalg.norm(a, axis=1)))
    s, vt = np.linalg.svd(a - a.mean(axis=0), full_matrices=False)[1:]
    tilt = s / (g * np.sqrt(len(a)))
    if tilt[2] < SMALLEST_SPREAD:
        axis = ", ".join(f"{x:.2f}" for x in vt[2])
        raise InvalidValueError(
            f"gravity does not change along ({axis}) of the flange in all {len(a)} poses (by {tilt[2]:.1e} of g, "
            f"{SMALLEST_SPREAD} is needed): turn the flange over, best onto all six sides"
        )


def _refuse_left_handed(given: _Given) -> None:
    u, s, vt = np.linalg.svd(given.A)
    sd = np.sqrt(np.diag(_inverse(given.A_information)).max())
    if s[2] < SURE * sd:
        raise InvalidValueError(
            f"the weight is lost in the noise along an axis: {s[2]:.2g} +- {sd:.1g} kg. Carry something heavier, "
            "or average more readings of each pose (--averaged)"
        )
    turn = u @ vt
    if np.linalg.det(turn) > 0.0:
        return
    _refuse_named(given, _solved(given.with_axes(-np.eye(3), np.eye(3))))
    # Mirrored alike, forces and moments fit with any left-handed axes: the first moment's sign is free.
    handed = [P for P in SIGNED_AXES if np.linalg.det(P) < 0.0]
    nearest = max(handed, key=lambda P: float(np.trace(P @ turn)))
    raise InvalidValueError(
        f"the sensor's axes are left-handed: two are swapped, one has the wrong sign, or wrenches are not what "
        f"acts on the sensor's tip side but its opposite. With {named_axes(nearest)} for (x, y, z) it would be "
        f"turned by {_angle(nearest @ turn):.3g} degrees, by more with any others: {REMEDY}"
    )


def _refuse_named(given: _Given, as_read: _Solved) -> None:
    """Refuse moments in other axes than forces, if these fit clearly better than those as read."""
    same = np.eye(3)
    tried = [("moments", P, same, P) for P in SIGNED_AXES] + [("forces", P, P, same) for P in SIGNED_AXES]
    found = [
        (_solved(given.with_axes(of_force, of_moment)).left_over, what, P)
        for what, P, of_force, of_moment in tried
    ]
    least = min(each[0] for each in found)
    if least < CLEARLY**2 * as_read.left_over:
        alike = [(what, P) for left_over, what, P in found if left_over <= 2.0 * least]
        what, P = max(alike, key=lambda each: float(np.trace(each[1])))
        raise InvalidValueError(
            f"{what} are in other axes than the other three: with {named_axes(P)} for (x, y, z) they are those of "
            f"one turned sensor; {REMEDY}"
        )


def _contradicted(given: _Given, found: _Solved) -> Iterator[BrokenAssumption]:
    rarity = float(chdtrc(LEFT_OVER, found.left_over))
    if rarity < RARE:
        gains = np.linalg.svd(given.A, compute_uv=False)
        gains /= gains.mean()
        yield BrokenAssumption(
            Assumption.CONSISTENT,
            f"forces and moments are not those of one turned sensor: probability {rarity:.0e}, at least {RARE:g}; "
            f"forces along three axes at right angles are {', '.join(f'{x:.4f}' for x in gains)} of "
            "their mean",
            "gains or cross-talk: calibrate the matrix; else poses are wrong, or something touches",
        )


def _loose(found: _Solved) -> Iterator[BrokenAssumption]:
    sd = float(np.sqrt(np.linalg.eigvalsh(found.covariance[1:4, 1:4])[-1]))
    if sd > WELL_KNOWN:
        yield BrokenAssumption(
            Assumption.CONDITIONED,
            f"the rotation is uncertain by {np.degrees(sd):.2g} degrees, at most {np.degrees(WELL_KNOWN):g}",
            "carry something heavier, average more readings of each pose, or take more poses",
        )


def _with_rotation(payload: IdentifiedPayload, found: _Solved, up: FloatArray) -> IdentifiedPayload:
    """Return a payload whose uncertainty includes that of the rotation.

    Args:
        payload: With the rotation taken as exact.
        found: The unknowns together.
        up: Mean specific force in the sensor frame [m/s^2].
    """
    m, h, P = found.mass, found.first_moment, found.covariance
    center = np.zeros((3, 7))
    center[:, 0], center[:, 4:] = -h / m**2, np.eye(3) / m
    # bias_f = mean force + m u, bias_m = mean moment - u x h
    turning = np.zeros((6, 7))
    turning[:3, 1:4] = -m * _cross(up)
    turning[3:, 1:4] = -_cross(h) @ _cross(up)
    center_covariance = center @ P @ center.T if payload.payload.mass else payload.center_covariance.copy()
    bias_covariance = payload.bias_covariance + turning @ P @ turning.T
    for array in (center_covariance, bias_covariance):
        array.setflags(write=False)
    return replace(
        payload,
        center_covariance=center_covariance,
        bias_covariance=bias_covariance,
    )


def _inverse(matrix: FloatArray) -> FloatArray:
    return np.asarray(np.linalg.inv(matrix))


def _cross(v: FloatArray) -> FloatArray:
    x, y, z = v
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def _angle(rotation: FloatArray) -> float:
    """Return the angle of a rotation [degrees]."""
    return float(np.degrees(np.arccos(np.clip(0.5 * (np.trace(rotation) - 1.0), -1.0, 1.0))))
