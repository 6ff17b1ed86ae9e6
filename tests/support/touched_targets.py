"""Touches of a true ellipsoid or sphere, found without the estimator's own equations: closest points by Lagrange's
multiplier, lines by a search along them."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq, minimize_scalar
from scipy.spatial.transform import Rotation

from palpate.errors import FloatArray
from palpate.sensing.tip_calibration import (
    Instrument,
    PlannedTouch,
    TargetKind,
    Touches,
    TouchPlan,
    TouchTarget,
    TypedTip,
)
from palpate.sensing.tip_calibration.shapes import ellipsoid_shape, sphere_shape
from palpate.sensing.tip_calibration.targets import across

NANO17_RANGES = (12.0, 12.0, 17.0, 0.12, 0.12, 0.12)
AXIA80_RANGES = (500.0, 500.0, 900.0, 20.0, 20.0, 20.0)

TARGETS = (
    TouchTarget("plate", TargetKind.PLANE, (0.0, 0.0, 0.0), (0.0, 0.0, 1.0)),
    TouchTarget("rod", TargetKind.LINE, (0.05, 0.0, 0.02), (0.0, 1.0, 0.0), radius=0.002),
    TouchTarget("ball", TargetKind.POINT, (0.0, 0.05, 0.02), radius=0.002),
)


@dataclass(frozen=True, slots=True)
class Instrumented:
    """A kind of sensor: what its readings are worth."""

    instrument: Instrument
    wrench_sd: tuple[float, ...]
    accuracy: float


NANO17 = Instrumented(Instrument(5e-6, NANO17_RANGES, 0.006), (4e-4,) * 3 + (2e-6,) * 3, 0.006)
"""Means of 100 readings of 1/320 N and 1/64 N mm, air and touch; cross-talk up to 1 % of a full load."""

WRIST = Instrumented(Instrument(2e-5, AXIA80_RANGES, 0.002), (0.012,) * 3 + (5e-4,) * 3, 0.002)
"""Means of 200 readings of 0.08 N and 3 N mm; its range is a hundred times the loads."""


@dataclass(frozen=True, slots=True)
class TrueTip:
    """What the tip and the targets really are."""

    semi_axes: tuple[float, float, float]
    center: FloatArray
    rotation: FloatArray
    stiffness: float
    targets: tuple[TouchTarget, ...]
    exponent: float = 1.0
    share: float = 1.0

    def closest(self, point: FloatArray) -> tuple[FloatArray, FloatArray, float]:
        """Return the closest point of the tip, its normal there and the distance, sensor frame."""
        a, y = np.array(self.semi_axes), self.rotation.T @ (point - self.center)

        def beyond(shift: float) -> float:
            return float(np.sum((a * y / (a**2 + shift)) ** 2) - 1.0)

        low = -float(a.min() ** 2) * (1.0 - 1e-9)
        shift = brentq(beyond, low, 1.0, xtol=1e-18, rtol=1e-15)
        x = a**2 * y / (a**2 + shift)
        u = x / a**2 / np.linalg.norm(x / a**2)
        return self.rotation @ x + self.center, self.rotation @ u, float(u @ (y - x))

    def touched(
        self, target: TouchTarget, rotation: FloatArray, position: FloatArray
    ) -> tuple[FloatArray, FloatArray, float]:
        """Return point, normal and distance from a target's core, sensor frame."""
        place = rotation.T @ (np.array(target.place) - position)
        if target.kind is TargetKind.POINT:
            return self.closest(place)
        direction = rotation.T @ target.unit
        if target.kind is TargetKind.PLANE:
            a, v = np.array(self.semi_axes), -self.rotation.T @ direction
            x = self.rotation @ (a**2 * v / np.linalg.norm(a * v)) + self.center
            return x, -direction, float(-direction @ (place - x))

        # where y - x is at right angles to the line: sharper than where the distance is least
        def off(s: float) -> float:
            x, _, _ = self.closest(place + s * direction)
            return float((place + s * direction - x) @ direction)

        nearest = minimize_scalar(
            lambda s: self.closest(place + s * direction)[2], bounds=(-0.05, 0.05), method="bounded"
        ).x
        return self.closest(place + brentq(off, nearest - 2e-3, nearest + 2e-3, xtol=1e-16) * direction)


def typed_tip(semi_axes: Sequence[float] = (0.008,), **more: object) -> TypedTip:
    """Return a typed sphere (one length) or ellipsoid, 20 mm in front of the sensor."""
    shape = sphere_shape(semi_axes[0]) if len(semi_axes) == 1 else ellipsoid_shape(semi_axes)
    return TypedTip(shape, center=np.array([0.0, 0.0, -0.02]), **more)  # type: ignore[arg-type]


def wrong(
    tip: TypedTip,
    rng: np.random.Generator,
    targets: tuple[TouchTarget, ...] = TARGETS,
    *,
    size: float = 0.05,
    shift: float = 1e-3,
    turn: float = np.radians(3.0),
    stiffness: float = 2.0,
) -> TrueTip:
    """Return a true tip that a typed one is wrong about: the issue's size, centre, tilt and stiffness."""
    sizes = np.resize(tip.shape.sizes, 3) * (
        1.0 + size * rng.uniform(-1.0, 1.0, 3 if len(tip.shape.sizes) > 1 else 1)
    )
    turned = tip.rotation @ Rotation.from_rotvec(turn * rng.uniform(-1.0, 1.0, 3)).as_matrix()
    moved = tuple(
        TouchTarget(
            t.name,
            t.kind,
            tuple((np.array(t.place) + rng.uniform(-1.5e-3, 1.5e-3, 3)).tolist()),  # type: ignore[arg-type]
            tuple((t.unit + rng.uniform(-0.03, 0.03, 2) @ across(t.unit)).tolist())
            if t.direction != (0.0, 0.0, 0.0)
            else t.direction,  # type: ignore[arg-type]
            t.radius,
        )
        for t in targets
    )
    a, b, c = sizes.tolist()
    center = tip.center + shift * rng.uniform(-1.0, 1.0, 3)
    return TrueTip(
        (a, b, c), center, turned, tip.stiffness * stiffness ** rng.uniform(-1.0, 1.0), moved, share=tip.share
    )


def touches(
    true: TrueTip,
    planned: Sequence[PlannedTouch],
    kind: Instrumented,
    rng: np.random.Generator,
    friction: float = 0.1,
) -> Touches:
    """Return what planned touches feel: friction up to `friction`, noise, an error of the sensor's matrix."""
    ranges = np.array(kind.instrument.ranges)
    matrix = np.eye(6) + kind.accuracy * ranges[:, None] / ranges * rng.normal(size=(6, 6))
    wrenches, positions = [], []
    for each in planned:
        target = true.targets[each.target]
        delta = (each.force / true.stiffness) ** true.exponent
        position = each.position - 5e-3 * each.direction  # from outside, however wrong the plan is
        for _ in range(60):
            x, u, distance = true.touched(target, each.rotation, position)
            missing = distance - (target.radius - delta)
            position = position + missing * each.rotation @ u
            if abs(missing) < 1e-14:
                break
        angle = rng.uniform(0.0, 2.0 * np.pi)
        sideways = np.array([np.cos(angle), np.sin(angle)]) @ across(u)
        force = each.force * (-u + friction * rng.uniform(0.0, 1.0) * sideways)
        moment = np.cross(x - true.share * delta * u, force) + 1e-4 * each.force * rng.normal() * u
        noise = np.array(kind.wrench_sd) * rng.normal(size=6)
        wrenches.append(matrix @ np.concatenate([force, moment]) + noise)
        positions.append(position + kind.instrument.position_sd * rng.normal(size=3))
    n = len(planned)
    return Touches(
        np.array([each.target for each in planned]),
        np.array(wrenches),
        np.tile(kind.wrench_sd, (n, 1)),
        np.array([each.rotation for each in planned]),
        np.array(positions),
        np.arange(float(n)),
    )


def robot(kind: Instrumented, most_tilt: float) -> TouchPlan:
    """Return what a robot can do that may tilt the sensor by so much [rad]."""
    return TouchPlan(most_tilt=most_tilt, wrench_sd=kind.wrench_sd)
