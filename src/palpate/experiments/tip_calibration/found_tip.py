"""The found tip as robot files state it, the files of a calibration, and the simulated tip."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial
from math import radians
from pathlib import Path, PurePosixPath
from typing import TYPE_CHECKING

import msgspec
import numpy as np
from scipy.spatial.transform import Rotation

from palpate.atomic_file import replacing
from palpate.errors import FloatArray, InvalidValueError
from palpate.experiments.kit.experiment import Writer
from palpate.experiments.tip_calibration.config import TipCalibrationConfig
from palpate.experiments.tip_calibration.findings import NEXT_FILE, ROBOT_FILE, TIP_FILE, TOUCHES_FILE
from palpate.experiments.tip_calibration.places import tip_points
from palpate.experiments.tip_calibration.touches_csv import planned_text, touches_text
from palpate.open_kinds import name_of_kind
from palpate.robots.fingertip import only_finger
from palpate.robots.robot import ROBOT_TEXT, SENSOR_TEXT, Robot
from palpate.robots.surface_entries import CompliantEntry, PlacedSurface, SurfaceKind
from palpate.robots.surface_sd_entry import LARGEST_STIFFNESS
from palpate.robots.surface_text import with_surface
from palpate.sensing.tip_calibration import TipFit, TypedTip, tip_shape
from palpate.sensing.tip_uncertainty import STIFFNESS
from palpate.spatial import ZERO, Vector, as_vector
from palpate.yaml_text import yaml_text

if TYPE_CHECKING:  # results judge the tip that is described here
    from palpate.experiments.tip_calibration.result import TipCalibrationResult

_AXES = "xyz"

_MAX_SIZE_ERROR, _MAX_CENTER_ERROR, _MAX_TURN_ERROR, _MAX_STIFFNESS_FACTOR = 0.05, 1e-3, radians(3.0), 2.0
"""Largest errors that a seed draws: relative, [m] along each axis, [rad], and a factor."""


@dataclass(frozen=True, slots=True)
class TipErrors:
    """Differences of a simulated tip from the typed one.

    Attributes:
        size: Relative error of its lengths.
        center: Offset of its centre, sensor frame [m].
        turn: Rotation, axis times angle, sensor frame [rad].
        stiffness: Factor of its stiffness.
    """

    size: float
    center: Vector
    turn: Vector
    stiffness: float

    @classmethod
    def of(cls, config: TipCalibrationConfig) -> "TipErrors":
        """Return the errors that are typed, or drawn by a seed."""
        if config.unknown_tip is None:
            return cls(config.size_error, config.center_error, ZERO, config.stiffness_ratio)
        rng = np.random.default_rng(config.unknown_tip)
        axis = rng.normal(size=3)
        return cls(
            float(rng.uniform(-_MAX_SIZE_ERROR, _MAX_SIZE_ERROR)),
            as_vector(rng.uniform(-_MAX_CENTER_ERROR, _MAX_CENTER_ERROR, 3)),
            as_vector(_MAX_TURN_ERROR * axis / np.linalg.norm(axis)),
            float(_MAX_STIFFNESS_FACTOR ** rng.uniform(-1.0, 1.0)),
        )


def true_tip(typed: SurfaceKind, errors: TipErrors) -> SurfaceKind:
    """Return the tip that is simulated in the place of the typed one.

    Raises:
        InvalidValueError: If its kind has no lengths and centre that errors could change.
    """
    inner = getattr(typed, "tip", typed)
    if not isinstance(inner, PlacedSurface):
        raise InvalidValueError(
            f"unknown_tip: a fingertip of kind {name_of_kind(typed)} has no sizes that could be wrong; take a "
            "sphere, an ellipsoid, a capsule or a superellipsoid"
        )
    lengths = {name: (1.0 + errors.size) * np.array(getattr(inner, name)) for name, _ in inner.LENGTHS}
    turned = Rotation.from_rotvec(errors.turn) * Rotation.from_rotvec(inner.rotvec)
    return msgspec.structs.replace(
        inner,
        **{name: tuple(value.tolist()) if value.ndim else float(value) for name, value in lengths.items()},
        center=as_vector(np.array(inner.center) + errors.center),
        rotvec=as_vector(turned.as_rotvec()),
    )


def simulated_tip(config: TipCalibrationConfig, robot: Robot) -> TypedTip | None:
    """Return the simulated tip with its stiffness; None on a real robot, or for touches of a file."""
    if robot.file.backend.REAL or not config.moves:
        return None
    typed, errors = only_finger(robot).surface, TipErrors.of(config)
    kind = true_tip(typed, errors) if config.tip_is_other else typed
    stiffness = config.stiffness * errors.stiffness
    shape = tip_shape(kind.surface())
    return TypedTip(shape, np.array(kind.center), np.asarray(kind.rotation), stiffness=stiffness)


def found_points(fit: TipFit, normals: FloatArray) -> FloatArray:
    """Return the points of the found tip with these outward normals, sensor frame, both (n, 3) [m]."""
    shape = replace(fit.unknowns.tip.shape, sizes=tuple(fit.sizes.tolist()))
    return tip_points(TypedTip(shape, fit.center, fit.rotation), normals)


def surface_entry(fit: TipFit, robot: Robot) -> Mapping[str, object]:
    """Return the entry `surface` of a robot file: compliant if it was before."""
    shape = fit.unknowns.tip.shape
    keys: dict[str, object] = {}
    for name, value in zip(shape.names, fit.sizes.tolist(), strict=True):
        stem, axis, unit = name.rpartition("_x_") if "_x_" in name else ("", "", "")
        if axis:  # a key of the file holds three lengths that have a name each
            values = [fit.sizes[shape.names.index(f"{stem}_{each}_{unit}")] for each in _AXES]
            keys["semi_axes_m" if stem == "semi_axis" else f"{stem}_{unit}"] = _rounded(values)
        elif not any(f"_{each}_" in name for each in _AXES):
            keys[name] = _rounded([value])[0]
    deviations = fit.unknowns.of("deviations", fit.values).tolist()
    entry: dict[str, object] = {"kind": "near_sphere" if deviations else shape.kind, **keys}
    if deviations:
        entry["deviations_m"] = _rounded(deviations)
    entry["center_m"] = _rounded(fit.center.tolist())
    if deviations or set(shape.round_about) != {0, 1, 2}:
        entry["rotvec_rad"] = _rounded(Rotation.from_matrix(fit.rotation).as_rotvec().tolist())
    if not isinstance(only_finger(robot).surface, CompliantEntry):
        return entry
    stiffness, exponent = (float(each) for each in fit.unknowns.skin(fit.values))
    return {"kind": "compliant", "tip": entry, "stiffness_N_per_m": _rounded([stiffness])[0], "exponent": exponent}


def _rounded(values: list[float]) -> list[float]:
    """Return numbers to seven digits: a nanometre of a fingertip."""
    return [float(f"{float(value):.7g}") for value in values]


def surface_sd_entry(fit: TipFit) -> Mapping[str, object]:
    """Return the entry `surface_sd` of a robot file: the covariance, with digits for its correlations."""
    covariance = fit.model_covariance()
    scale = np.ones(len(covariance))
    # a robot file states at most this deviation of a stiffness that the touches did not determine
    scale[STIFFNESS] = min(
        1.0, 0.99 * LARGEST_STIFFNESS / max(float(np.sqrt(covariance[STIFFNESS, STIFFNESS])), 1e-12)
    )
    rows = (scale[:, None] * covariance * scale).tolist()
    return {"covariance": [[float(f"{each:.12g}") for each in row] for row in rows]}


def calibration_files(result: "TipCalibrationResult") -> Mapping[str, Writer]:
    """Return the files by name; without touches, only the plan of the next ones."""
    robot, fit, targets = result.robot, result.fit, result.known.targets
    texts = {NEXT_FILE: planned_text(result.next_touches, targets)}
    if result.touches is not None and fit is not None:
        surface, sd = surface_entry(fit, robot), surface_sd_entry(fit)
        texts[TOUCHES_FILE] = touches_text(result.touches, targets)
        texts[TIP_FILE] = yaml_text({"surface": surface, "surface_sd": sd})
        if result.usable:
            texts[ROBOT_FILE] = with_surface(robot.texts[ROBOT_TEXT], 0, surface, sd)
            # sensor files that the robot file names by a path from its own folder
            texts |= {
                finger.sensor: robot.texts[SENSOR_TEXT.format(i)]
                for i, finger in enumerate(robot.file.fingers)
                if finger.sensor is not None and _is_below(PurePosixPath(finger.sensor))
            }
    return {name: partial(_write, text) for name, text in texts.items()}


def _is_below(path: PurePosixPath) -> bool:
    return not path.is_absolute() and ".." not in path.parts


def _write(text: str, path: Path) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    with replacing(path) as file:
        file.write(text.encode())
