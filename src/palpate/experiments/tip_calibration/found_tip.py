"""The tip that was found, as a robot file has it, and how far it is from the one that was simulated."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from palpate.errors import FloatArray
from palpate.experiments.tip_calibration.config import TipCalibrationConfig
from palpate.experiments.tip_calibration.places import tip_points
from palpate.experiments.tip_calibration.unknown_tip import TipErrors, true_tip
from palpate.robots.fingertip import only_finger
from palpate.robots.robot import Robot
from palpate.robots.surface_entries import CompliantEntry
from palpate.robots.surface_sd_entry import LARGEST_STIFFNESS
from palpate.sensing.tip_calibration import TipFit, TypedTip, tip_shape
from palpate.sensing.tip_uncertainty import STIFFNESS

AXES = "xyz"


def found_points(fit: TipFit, normals: FloatArray) -> FloatArray:
    """Return where on the tip that was found the outward normals are these, sensor frame, both (n, 3) [m]."""
    shape = replace(fit.unknowns.tip.shape, sizes=tuple(fit.sizes.tolist()))
    return tip_points(TypedTip(shape, fit.center, fit.rotation), normals)


def surface_entry(fit: TipFit, robot: Robot) -> Mapping[str, object]:
    """Return what `surface` of a robot file is to say: compliant if it was before."""
    shape = fit.unknowns.tip.shape
    keys: dict[str, object] = {}
    for name, value in zip(shape.names, fit.sizes.tolist(), strict=True):
        stem, axis, unit = name.rpartition("_x_") if "_x_" in name else ("", "", "")
        if axis:  # of three lengths, one a name: the file has one key
            triple = [f"{stem}_{each}_{unit}" for each in AXES]
            values = [fit.sizes[shape.names.index(each)] for each in triple]
            keys[PLURALS.get(f"{stem}_{unit}", f"{stem}_{unit}")] = [_rounded(float(each)) for each in values]
        elif not any(f"_{each}_" in name for each in AXES):
            keys[name] = _rounded(value)
    deviations = fit.unknowns.of("deviations", fit.values).tolist()
    if deviations:
        keys["deviations_m"] = [_rounded(each) for each in deviations]
    entry: dict[str, object] = {"kind": "near_sphere" if deviations else shape.kind, **keys}
    entry["center_m"] = [_rounded(each) for each in fit.center.tolist()]
    if deviations or set(shape.round_about) != {0, 1, 2}:
        entry["rotvec_rad"] = [_rounded(each) for each in Rotation.from_matrix(fit.rotation).as_rotvec().tolist()]
    if not isinstance(only_finger(robot).surface, CompliantEntry):
        return entry
    stiffness, exponent = (float(each) for each in fit.unknowns.skin(fit.values))
    return {"kind": "compliant", "tip": entry, "stiffness_N_per_m": _rounded(stiffness), "exponent": exponent}


PLURALS = {"semi_axis_m": "semi_axes_m"}
"""Keys of lengths that a robot file has together."""


def surface_sd_entry(fit: TipFit) -> Mapping[str, object]:
    """Return what `surface_sd` of a robot file is to say: the covariance, with digits for its correlations."""
    covariance = fit.model_covariance()
    scale = np.ones(len(covariance))
    # of a stiffness that touches did not tell a robot file says no more than that
    scale[STIFFNESS] = min(
        1.0, 0.99 * LARGEST_STIFFNESS / max(float(np.sqrt(covariance[STIFFNESS, STIFFNESS])), 1e-12)
    )
    rows = (scale[:, None] * covariance * scale).tolist()
    return {"covariance": [[float(f"{each:.12g}") for each in row] for row in rows]}


def _rounded(value: float) -> float:
    """Seven digits: a nanometre of a fingertip."""
    return float(f"{value:.7g}")


@dataclass(frozen=True, slots=True, eq=False)
class TrueTip:
    """The tip that is simulated.

    Attributes:
        tip: It, with its stiffness.
    """

    tip: TypedTip

    @classmethod
    def of(cls, config: TipCalibrationConfig, robot: Robot) -> "TrueTip | None":
        """Return it; None on a real robot, or for touches of a file."""
        if robot.file.backend.REAL or not config.moves:
            return None
        typed, errors = only_finger(robot).surface, TipErrors.of(config)
        kind = true_tip(typed, errors) if config.tip_is_other else typed
        surface = kind.surface()
        stiffness = config.stiffness * errors.stiffness
        return cls(
            TypedTip(tip_shape(surface), np.array(kind.center), np.asarray(kind.rotation), stiffness=stiffness)
        )

    def comparable(self, fit: TipFit) -> bool:
        """Return whether a fit is of its family of shapes."""
        return fit.unknowns.tip.shape.kind == self.tip.shape.kind

    def size_error(self, fit: TipFit) -> float:
        """Return by how much the lengths found are off, the worst [m]."""
        lengths = [name.endswith("_m") for name in self.tip.shape.names]
        off = np.abs(fit.sizes - np.array(self.tip.shape.sizes))[lengths]
        return float(off.max())

    def center_error(self, fit: TipFit) -> float:
        """Return how far off the centre is [m]."""
        return float(np.linalg.norm(fit.center - self.tip.center))

    def turn_error(self, fit: TipFit) -> float | None:
        """Return by how much the tip's axes are off [rad]; None of a sphere."""
        round_about = self.tip.shape.round_about
        if len(round_about) == 3:
            return None
        turn = Rotation.from_matrix(self.tip.rotation.T @ fit.rotation).as_rotvec()
        turn[list(round_about)] = 0.0
        return float(np.linalg.norm(turn))

    def stiffness_error(self, fit: TipFit) -> float:
        """Return by which share the stiffness is off."""
        return abs(float(fit.unknowns.skin(fit.values)[0]) / self.tip.stiffness - 1.0)
