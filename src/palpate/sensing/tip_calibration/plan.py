"""Which touches tell most about a fingertip.

From all touches that a robot could make, one after the other is taken that lowers the variances of what is wanted
most, each in units of what is wanted of it (A-optimal design, greedily: Fedorov 1972, "Theory of optimal
experiments"; Krause, Singh & Guestrin 2008, J. Machine Learning Research 9). A touch adds three equations, so the
covariance changes by rank three.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from palpate.errors import FloatArray, InvalidValueError, positive
from palpate.sensing.tip_calibration.equations import TouchEquations
from palpate.sensing.tip_calibration.fit import TipFit
from palpate.sensing.tip_calibration.instrument import Instrument
from palpate.sensing.tip_calibration.targets import TargetKind, TouchTarget, across
from palpate.sensing.tip_calibration.touches import Touches
from palpate.sensing.tip_calibration.unknowns import TypedTip, Unknowns
from palpate.spatial import Vector

GOALS = {"size": 2e-5, "center": 2e-5, "rotation": np.radians(0.2), "stiffness": 0.05}
"""What is wanted: 0.02 mm, 0.2 degrees, 5 % (standard deviations)."""

DIRECTIONS = 60
"""In which a point is touched, and angles about a line, at each orientation."""

TILTS = 12
"""Orientations of the sensor besides the upright one."""


@dataclass(frozen=True, slots=True)
class TouchPlan:
    """What a robot can do.

    Attributes:
        rotation: Of the sensor frame in the base frame where it stands upright, rows.
        tip_axis: Along which the finger points, sensor frame.
        widest: Largest angle between that and the tip's normal where it is touched [rad]: the tip's open side.
        steepest: Largest angle between vertical and the direction of a touch [rad]: from above it is 0.
        most_tilt: By which the sensor may be turned about any horizontal axis [rad]; 0: it cannot turn.
        forces: To press with [N].
        wrench_sd: Standard deviation of a reading's mean while it does, shape (6,) [N, N m].
    """

    rotation: tuple[Vector, Vector, Vector] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    tip_axis: Vector = (0.0, 0.0, -1.0)
    widest: float = np.radians(80.0)
    steepest: float = np.radians(70.0)
    most_tilt: float = 0.0
    forces: tuple[float, ...] = (1.0, 3.0)
    wrench_sd: tuple[float, ...] = (1e-3, 1e-3, 1e-3, 5e-6, 5e-6, 5e-6)

    def __post_init__(self) -> None:
        if not self.forces:
            raise InvalidValueError("forces: none given")
        for force in self.forces:
            positive("forces", force, "N")


@dataclass(frozen=True, slots=True, eq=False)
class PlannedTouch:
    """A touch to be made.

    Attributes:
        target: Of which target.
        rotation: Of the sensor frame in the base frame, shape (3, 3).
        normal: Outward normal of the tip where it shall touch, sensor frame, shape (3,).
        force: To press with [N].
        position: Where the sensor's origin is when the tip just touches, base frame, shape (3,) [m].
    """

    target: int
    rotation: FloatArray
    normal: FloatArray
    force: float
    position: FloatArray

    @property
    def direction(self) -> FloatArray:
        """In which the tip approaches, base frame, shape (3,)."""
        return np.asarray(self.rotation @ self.normal)


def candidate_touches(
    tip: TypedTip, targets: tuple[TouchTarget, ...], plan: TouchPlan, values: FloatArray | None = None
) -> list[PlannedTouch]:
    """Return touches that a robot could make.

    Args:
        tip: As typed.
        targets: What there is to be touched.
        plan: What the robot can do.
        values: Of the unknowns, as far as they are known, shape (P,); as typed if not given.
    """
    unknowns = Unknowns(tip, targets)
    values = unknowns.typed if values is None else values
    places = unknowns.places(values)
    found: list[PlannedTouch] = []
    for rotation in _orientations(plan):
        for j, target in enumerate(targets):
            directions = _directions(target.kind, places.direction[j])
            normals = directions @ rotation
            usable = (normals @ np.array(plan.tip_axis) >= np.cos(plan.widest)) & (
                -directions[:, 2] >= np.cos(plan.steepest)
            )
            normals = normals[usable]
            x = _touched(unknowns, values, normals)
            positions = places.place[j] - (x + target.radius * normals) @ rotation.T
            found += [
                PlannedTouch(j, rotation, normal, force, position)
                for normal, position in zip(normals, positions, strict=True)
                for force in plan.forces
            ]
    if not found:
        raise InvalidValueError(
            "no touch is possible: every target would have to be touched from below or with the tip's open side; "
            "are the targets' directions and the tip's axis right?"
        )
    return found


def planned_touches(
    candidates: Sequence[PlannedTouch],
    count: int,
    tip: TypedTip,
    targets: tuple[TouchTarget, ...],
    plan: TouchPlan,
    instrument: Instrument | None = None,
    fit: TipFit | None = None,
) -> tuple[list[PlannedTouch], FloatArray]:
    """Return the touches that tell most, in the order in which they do.

    Args:
        candidates: To choose from, each at most once: touching one place again and again tests nothing.
        count: How many.
        tip: As typed.
        targets: What there is to be touched.
        plan: What the robot can do.
        instrument: What measures.
        fit: What is known from touches so far.

    Returns:
        The touches, and the standard deviations of all unknowns once they are made, shape (P,).
    """
    instrument = instrument or Instrument()
    unknowns = Unknowns(tip, targets)
    values = unknowns.typed if fit is None else fit.values
    foreseen = foreseen_touches(candidates, tip, targets, plan, values)
    rows, noise = _rows(unknowns, foreseen, values, instrument)
    q = rows.shape[2]
    spread = np.eye(q)
    if fit is not None:
        made, made_noise = _rows(unknowns, fit.touches, values, instrument)
        white = np.linalg.inv(np.linalg.cholesky(made_noise)) @ made
        spread = np.linalg.inv(np.eye(q) + np.einsum("nki,nkj->ij", white, white))
    sd = unknowns.sd
    wanted = np.zeros(q)
    for block, goal in GOALS.items():
        wanted[unknowns.blocks[block]] = sd[unknowns.blocks[block]] / goal
    chosen: list[PlannedTouch] = []
    taken = np.zeros(len(candidates), dtype=bool)
    for _ in range(min(count, len(candidates))):
        moved = rows @ spread
        innovation = moved @ rows.transpose(0, 2, 1) + noise
        gains = np.linalg.solve(innovation, moved)
        gain = np.einsum("nki,nki,i->n", moved, gains, wanted**2)
        best = int(np.argmax(np.where(taken, -1.0, gain)))
        taken[best] = True
        chosen.append(candidates[best])
        spread = spread - moved[best].T @ gains[best]
        spread = 0.5 * (spread + spread.T)
    return chosen, sd * np.sqrt(np.diag(spread)[: len(sd)])


def foreseen_touches(
    candidates: Sequence[PlannedTouch],
    tip: TypedTip,
    targets: tuple[TouchTarget, ...],
    plan: TouchPlan,
    values: FloatArray,
) -> Touches:
    """Return what planned touches would feel, without friction."""
    unknowns = Unknowns(tip, targets)
    normal = np.array([c.normal for c in candidates])
    rotation = np.array([c.rotation for c in candidates])
    force = np.array([c.force for c in candidates])
    x = _touched(unknowns, values, normal)
    stiffness, exponent = unknowns.skin(values)
    indentation = (force / stiffness) ** exponent
    pressed = np.array([c.position for c in candidates]) + np.einsum(
        "nij,nj->ni", rotation, indentation[:, None] * normal
    )
    pushing = -force[:, None] * normal
    wrench = np.column_stack([pushing, np.cross(x - tip.share * indentation[:, None] * normal, pushing)])
    n = len(candidates)
    return Touches(
        np.array([c.target for c in candidates]),
        wrench,
        np.tile(plan.wrench_sd, (n, 1)),
        rotation,
        pressed,
        np.arange(float(n)),
    )


def _touched(unknowns: Unknowns, values: FloatArray, normals: FloatArray) -> FloatArray:
    """Where the tip is touched at normals (n, 3), deviations left out, sensor frame, shape (n, 3) [m]."""
    axes = unknowns.rotation(values)
    sizes = np.tile(unknowns.of("size", values), (len(normals), 1))
    places = unknowns.tip.shape.support(sizes, normals @ axes)[1]
    return np.asarray(places @ axes.T + unknowns.of("center", values))


def _rows(
    unknowns: Unknowns, touches: Touches, values: FloatArray, instrument: Instrument
) -> tuple[FloatArray, FloatArray]:
    """Equations of touches in units of the unknowns' deviations (n, 3, q), and their noise (n, 3, 3)."""
    equations = TouchEquations(unknowns, touches, instrument)
    solved = equations.solved(values)
    rows = np.concatenate([equations.jacobian(values), equations.shared(solved)], axis=2)
    return rows, equations.noise(solved, equations.by_place(values), instrument.position_sd)


def _orientations(plan: TouchPlan) -> list[FloatArray]:
    """Orientations of the sensor: upright, and tilted about axes all around by all and by half of what it may."""
    upright = np.array(plan.rotation)
    if not plan.most_tilt > 0.0:
        return [upright]
    turns = [np.zeros(3)]
    for i in range(TILTS):
        angle = 2.0 * np.pi * i / TILTS
        share = 1.0 if i % 2 == 0 else 0.5
        turns.append(share * plan.most_tilt * np.array([np.cos(angle), np.sin(angle), 0.0]))
    return [np.asarray(Rotation.from_rotvec(turn).as_matrix() @ upright) for turn in turns]


def _directions(kind: TargetKind, direction: FloatArray) -> FloatArray:
    """Directions in which a target can be touched, base frame, shape (m, 3)."""
    if kind is TargetKind.PLANE:
        return -direction[None]
    i = np.arange(DIRECTIONS)
    if kind is TargetKind.LINE:
        angle = 2.0 * np.pi * i / DIRECTIONS
        first, second = across(direction)
        return np.asarray(np.cos(angle)[:, None] * first + np.sin(angle)[:, None] * second)
    # points spread evenly over the lower half of the sphere (Fibonacci lattice)
    z = -(i + 0.5) / DIRECTIONS
    turn = i * np.pi * (3.0 - np.sqrt(5.0))
    level = np.sqrt(1.0 - z * z)
    return np.column_stack([level * np.cos(turn), level * np.sin(turn), z])
