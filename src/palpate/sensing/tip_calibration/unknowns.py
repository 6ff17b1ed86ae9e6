"""What is to be found by touches: the tip, the skin, how the sensor is mounted, and where the targets are.

Every unknown has a typed value and a standard deviation of how wrong that may be. Where touches tell nothing, the
typed value and that deviation are what remains, and it is said.
"""

import math
from dataclasses import dataclass, field

import numpy as np
from scipy.spatial.transform import Rotation

from palpate.errors import FloatArray, InvalidValueError, check_not_negative, check_positive, vector
from palpate.sensing.tip_calibration.shapes import TipShape
from palpate.sensing.tip_calibration.targets import TargetKind, TouchTarget, across
from palpate.surfaces.compliant import LINEAR
from palpate.surfaces.near_sphere import COUNTS

ANY_STIFFNESS = 20e3
"""[N/m] to start from where no skin is typed: a rubber skin of a millimetre on a tip of 8 mm."""


@dataclass(frozen=True, slots=True, eq=False)
class TypedTip:
    """A fingertip as typed from a drawing, and how wrong that may be.

    Attributes:
        shape: Its family and sizes.
        center: Sensor frame, shape (3,) [m].
        rotation: Columns are the tip's axes in sensor coordinates, shape (3, 3).
        stiffness: Of the skin [N/m^(1/exponent)]; see `palpate.surfaces.CompliantTip`.
        exponent: Of its law.
        share: Of the indentation, how much the tip takes: 1 on a hard target; MuJoCo has contacts halfway, 0.5.
        center_sd: Of `center`, each axis [m].
        rotation_sd: About each axis [rad].
        stiffness_sd: Of its logarithm.
        exponent_sd: Of `exponent`; 0 if it is known.
        mount_turn_sd: Of the sensor's orientation on the flange, about each axis [rad]; 0 if it is known.
        mount_shift_sd: Of the sensor's place on the flange, each axis [m]; 0 if it is known.
        deviation_degree: Highest degree of the field of deviations: 0 (none), 2 or 3.
        deviation_sd: Of its coefficients [m].
    """

    shape: TipShape
    center: FloatArray = field(default_factory=lambda: np.zeros(3))
    rotation: FloatArray = field(default_factory=lambda: np.eye(3))
    stiffness: float = ANY_STIFFNESS
    exponent: float = LINEAR
    share: float = 1.0
    center_sd: float = 3e-3
    rotation_sd: float = 0.15
    stiffness_sd: float = 1.5
    exponent_sd: float = 0.0
    mount_turn_sd: float = 0.0
    mount_shift_sd: float = 0.0
    deviation_degree: int = 0
    deviation_sd: float = 2e-4

    def __post_init__(self) -> None:
        object.__setattr__(self, "center", vector("center", self.center, 3, "m"))
        check_positive(
            self, stiffness="N/m", exponent="", center_sd="m", rotation_sd="rad", stiffness_sd="", deviation_sd="m"
        )
        check_not_negative(self, exponent_sd="", mount_turn_sd="rad", mount_shift_sd="m")
        if not 0.0 <= self.share <= 1.0:
            raise InvalidValueError(f"share = {self.share}: must lie between 0 and 1")
        if self.deviation_degree and self.shape.deviated is None:
            raise InvalidValueError(
                f"deviation_degree = {self.deviation_degree}: there is no {self.shape.kind} with deviations, only "
                "spheres have them"
            )
        if self.deviation_degree not in COUNTS:
            raise InvalidValueError(
                f"deviation_degree = {self.deviation_degree}: must be one of {', '.join(map(str, COUNTS))}"
            )


@dataclass(frozen=True, slots=True)
class Unknown:
    """One number that is to be found.

    Attributes:
        name: With its unit; of a target, with the target's name before.
        typed: Where it starts.
        sd: How wrong that may be.
    """

    name: str
    typed: float
    sd: float


AXES = ("x", "y", "z")


@dataclass(frozen=True, slots=True, eq=False)
class TargetPlaces:
    """Where m targets are at some values of the unknowns: shapes (..., m, 3) [m] and (..., m, 3), base frame."""

    place: FloatArray
    direction: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Unknowns:
    """All of them in order, and what their values mean.

    Args:
        tip: The typed tip.
        targets: What was touched.
    """

    tip: TypedTip
    targets: tuple[TouchTarget, ...]
    each: tuple[Unknown, ...] = field(init=False)
    blocks: dict[str, slice] = field(init=False)

    def __post_init__(self) -> None:
        tip, shape = self.tip, self.tip.shape
        blocks: dict[str, slice] = {}
        each: list[Unknown] = []

        def add(block: str, unknowns: list[Unknown]) -> None:
            blocks[block] = slice(len(each), len(each) + len(unknowns))
            each.extend(unknowns)

        sizes = zip(shape.names, shape.sizes, shape.size_sd, strict=True)
        add("size", [Unknown(name, value, sd * value) for name, value, sd in sizes])
        add(
            "center",
            [Unknown(f"center_{a}_m", c, tip.center_sd) for a, c in zip(AXES, tip.center.tolist(), strict=True)],
        )
        turned = [i for i in range(3) if i not in shape.round_about]
        add("rotation", [Unknown(f"turn_{AXES[i]}_rad", 0.0, tip.rotation_sd) for i in turned])
        add("stiffness", [Unknown("log_stiffness", math.log(tip.stiffness), tip.stiffness_sd)])
        add("exponent", [Unknown("exponent", tip.exponent, tip.exponent_sd)] if tip.exponent_sd else [])
        count = COUNTS[tip.deviation_degree]
        add("deviations", [Unknown(f"deviation_{i}_m", 0.0, tip.deviation_sd) for i in range(count)])
        add(
            "mount_turn",
            [Unknown(f"mount_turn_{a}_rad", 0.0, tip.mount_turn_sd) for a in AXES] if tip.mount_turn_sd else [],
        )
        add(
            "mount_shift",
            [Unknown(f"mount_shift_{a}_m", 0.0, tip.mount_shift_sd) for a in AXES] if tip.mount_shift_sd else [],
        )
        for i, target in enumerate(self.targets):
            places = range(len(target.free_directions))
            tilts = range(0 if target.kind is TargetKind.POINT else 2)
            add(f"place {i}", [Unknown(f"{target.name}: place_{k}_m", 0.0, target.place_sd) for k in places])
            add(f"tilt {i}", [Unknown(f"{target.name}: tilt_{k}_rad", 0.0, target.direction_sd) for k in tilts])
        object.__setattr__(self, "each", tuple(each))
        object.__setattr__(self, "blocks", blocks)

    @property
    def typed(self) -> FloatArray:
        """Values to start from."""
        return np.array([unknown.typed for unknown in self.each])

    @property
    def sd(self) -> FloatArray:
        """How wrong they may be."""
        return np.array([unknown.sd for unknown in self.each])

    def of(self, block: str, values: FloatArray) -> FloatArray:
        """Return the values of one block, shape (..., k) of (..., P)."""
        return values[..., self.blocks[block]]

    def rotation(self, values: FloatArray) -> FloatArray:
        """Return the tip's axes in sensor coordinates, (..., 3, 3): the typed ones, turned about their own."""
        turn = np.zeros((*values.shape[:-1], 3))
        turn[..., [i for i in range(3) if i not in self.tip.shape.round_about]] = self.of("rotation", values)
        return np.asarray(self.tip.rotation @ Rotation.from_rotvec(turn).as_matrix())

    def skin(self, values: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return stiffness [N/m^(1/exponent)] and exponent of the skin, shape (...)."""
        exponent = self.of("exponent", values)
        stiffness = np.exp(self.of("stiffness", values)[..., 0])
        return stiffness, exponent[..., 0] if exponent.shape[-1] else np.full_like(stiffness, self.tip.exponent)

    def places(self, values: FloatArray) -> TargetPlaces:
        """Return where the targets are."""
        place, direction = np.zeros((2, *values.shape[:-1], len(self.targets), 3))
        for i, target in enumerate(self.targets):
            place[..., i, :] = np.array(target.place) + self.of(f"place {i}", values) @ target.free_directions
            direction[..., i, :] = target.unit
            if target.kind is not TargetKind.POINT:
                tilted = target.unit + self.of(f"tilt {i}", values) @ across(target.unit)
                direction[..., i, :] = tilted / np.linalg.norm(tilted, axis=-1, keepdims=True)
        return TargetPlaces(place, direction)

    def mounted(
        self, values: FloatArray, rotation: FloatArray, position: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Return where the sensor really is, from where it was believed.

        Args:
            values: Shape (K, P).
            rotation: Of the sensor frame, shape (n, 3, 3).
            position: Likewise, shape (n, 3).

        Returns:
            Shapes (K, n, 3, 3) and (K, n, 3).
        """
        turn, shift = self.of("mount_turn", values), self.of("mount_shift", values)
        turned, moved = np.tile(rotation, (len(values), 1, 1, 1)), np.tile(position, (len(values), 1, 1))
        if shift.shape[1]:
            moved = moved + np.einsum("nij,kj->kni", rotation, shift)
        if turn.shape[1]:
            turned = turned @ Rotation.from_rotvec(turn).as_matrix()[:, None]
        return turned, moved
