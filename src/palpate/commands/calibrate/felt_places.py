"""What a calibration means for contacts: how well a place and a force are felt on a round fingertip."""

from dataclasses import dataclass

import numpy as np

from palpate.errors import FloatArray
from palpate.sensing.ft import CalibrationFit
from palpate.sensing.ft.payload import TWO_SIDED
from palpate.sensing.solver import contacts_from_wrenches
from palpate.sensing.uncertainty import UncertaintyStatus, contacts_uncertainties
from palpate.surfaces import Sphere

FORCES = (0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0)
"""[N]"""

USED_RANGE = 0.02, 0.8
"""Share of the sensor's smallest force range that contacts are felt at."""

TILTS = (0.0, 30.0, 60.0)
"""[degrees] of the contact's normal from the fingertip's front."""

AROUND = 8
"""Directions of each tilt."""


@dataclass(frozen=True, slots=True)
class FeltAt:
    """How well contacts of one force are felt, 95 % of them, the worst of all directions.

    Attributes:
        force: Pressed with [N].
        place: Radius of the circle on the tip [m]; NaN where it cannot be told.
        place_of_calibration: Likewise, of what no averaging of readings makes less.
        normal_force: Half-width [N].
    """

    force: float
    place: float
    place_of_calibration: float
    normal_force: float


def felt_places(fit: CalibrationFit, tip: Sphere, ranges: FloatArray) -> tuple[FeltAt, ...]:
    """Return how well contacts are felt with a calibration, by force.

    Args:
        fit: The calibration.
        tip: The fingertip, in the sensor frame.
        ranges: Of the sensor [N, N m].
    """
    low, high = (share * float(ranges[:3].min()) for share in USED_RANGE)
    return tuple(_felt_at(fit, tip, force) for force in FORCES if low <= force <= high)


def _felt_at(fit: CalibrationFit, tip: Sphere, force: float) -> FeltAt:
    normals = _normals(np.asarray(tip.center))
    pushed = -force * normals
    wrenches = np.hstack([pushed, np.cross(tip.center + tip.radius * normals, pushed)])
    both, lasting, forces = [], [], []
    for wrench in wrenches:
        contact = contacts_from_wrenches(tip, wrench[None])
        calibration = fit.calibration_covariance(wrench)
        whole = contacts_uncertainties(tip, contact, calibration + fit.noise)
        told = whole.status[0] == UncertaintyStatus.VALID
        both.append(_radius(whole.centroid[0]) if told else np.nan)
        lasting.append(_radius(contacts_uncertainties(tip, contact, calibration).centroid[0]))
        forces.append(TWO_SIDED * float(np.sqrt(whole.normal_force[0])))
    return FeltAt(force, max(both), max(lasting), max(forces))


def _radius(covariance: FloatArray) -> float:
    return TWO_SIDED * float(np.sqrt(max(np.linalg.eigvalsh(covariance)[-1], 0.0)))


def _normals(center: FloatArray) -> FloatArray:
    """Return outward normals around the front of a tip, which looks away from the sensor, shape (n, 3)."""
    length = float(np.linalg.norm(center))
    front = center / length if length > 0.0 else np.array([0.0, 0.0, 1.0])
    side = np.linalg.svd(front[None])[2][1:]
    rows = [front]
    for tilt in np.radians(TILTS[1:]):
        for angle in 2.0 * np.pi * np.arange(AROUND) / AROUND:
            across = np.cos(angle) * side[0] + np.sin(angle) * side[1]
            rows.append(np.cos(tilt) * front + np.sin(tilt) * across)
    return np.array(rows)
