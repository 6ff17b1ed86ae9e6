"""Systematic error of a whole map: what repetition does not average out, from the finger's specification."""

from dataclasses import dataclass

import numpy as np

from palpate.errors import FloatArray
from palpate.runtime import FingerDescription, SensorFinger
from palpate.runtime.log import Record
from palpate.sensing.solver import contacts_from_wrenches
from palpate.sensing.tip_uncertainty import EXACT, TipUncertainty
from palpate.sensing.uncertainty import ContactUncertainties, contacts_uncertainties, white_noise

CALIBRATION_SHARE = 0.01
"""ASSUMPTION: a full load on one axis shows on another as up to this share of its own full load; makers claim 1 to
2 % for all errors together (see `palpate.sim.sensor.presets`)."""

ZERO_SHARE = 1e-3
"""ASSUMPTION: of the full load, by which zero may have moved since it was last found: two kelvin of 0.05 %/K (see
`palpate.sim.sensor.presets`)."""

UNIFORM = 3.0**-0.5
"""Standard deviation of what lies anywhere between -1 and 1: a maker's limit is no standard deviation."""

ASKED = 200
"""Contacts that are asked, evenly over the scan."""

DEVIATIONS = 1.96
"""Standard deviations that hold 95 % of an error."""

SIDEWAYS = 3.0
"""Of the trace of the covariance in a plane: holds 95 % of squared distances (chi^2 of two degrees, 5.99 / 2)."""

PERCENT = 95.0
"""Of the scan, the budget for changes of the force holds so much."""

COMPRESSION_SHARE = 5e-3
"""ASSUMPTION: of the compression at the set force, which is not known better: even in simulation, whose stiffness
is exact, what slides presses by more than by penetration, 0.2 % in a scan of a sphere."""

LEAST_TILT = 2.5e-3
"""[rad] that normals may always be off: what a tip of 8 mm rolls in a period of 1 ms at 20 mm/s."""

ROUND = 2.0
"""Curvature of tip and object together over that of the tip: an object nowhere sharper than the tip."""


@dataclass(frozen=True, slots=True)
class MapBudget:
    """Largest constant offset along the normal that is left, by where it comes from.

    A fingertip that is known touches with its surface, wherever on it the contact is computed: lateral
    errors of the contact count in second order only, through the curvature of tip and object.

    Attributes:
        calibration: Of the sensor: gain, cross-talk and zero [m]. 0 for a sensor without known ranges, which is
            taken for perfect but for its noise.
        noise: Mean of the error by white noise, as a lateral error of the contact shifts it outwards [m].
        compression: Of tip and object during changes of the force [m]: compression is known for a steady force,
            and within milliseconds depends on damping; plus the unknown share of the steady compression.
        tip: Of the fingertip that has another size, place or stiffness than is said [m].
        tilt: How far all normals may be off in one direction by the sensor's calibration and the tip [rad]; no
            part of the total.
        aside: Standard deviation of where contacts lie sideways, by the sensor's calibration [m]; no part of the
            total.
        shown: By assumptions that the run itself disproved: a zero that moved, another stiffness (see
            `palpate.experiments.explore.assumption_check`) [m].
    """

    calibration: float
    noise: float
    compression: float
    tip: float
    tilt: float
    aside: float = 0.0
    shown: float = 0.0

    @property
    def total(self) -> float:
        """The sum: all of them may have one sign [m]."""
        return self.felt + self.tip

    @property
    def felt(self) -> float:
        """The sum without the tip, which shifts all points alike [m]: the fit of a shape counts that by itself."""
        return self.calibration + self.noise + self.compression + self.shown


def map_budget(
    record: Record,
    finger: FingerDescription,
    *,
    kept: np.ndarray[tuple[int], np.dtype[np.bool_]],
    set_force: FloatArray,
    half_compliance: float,
    force_noise: float = 0.0,
    moment_noise: float = 0.0,
    tip: TipUncertainty = EXACT,
) -> MapBudget:
    """Return the budget of a scan.

    Args:
        record: Of the run.
        finger: That felt it; a `SensorFinger` has a sensor file, any other a perfect sensor.
        kept: Which periods gave a point of the map, shape (n,).
        set_force: Normal force asked for, shape (n,) [N].
        half_compliance: Of tip and object together, half their compression per force [m/N].
        force_noise: Standard deviation of each force component [N], where no sensor file gives it.
        moment_noise: Likewise [N m].
        tip: How well the fingertip is known.
    """
    felt = np.flatnonzero(kept)
    if not len(felt):
        return MapBudget(0.0, 0.0, 0.0, 0.0, LEAST_TILT)
    compliance = 2.0 * half_compliance
    change = np.abs(record.normal_force[felt] - set_force[felt])
    unsteady = compliance * float(np.percentile(change, PERCENT))
    compression = unsteady + COMPRESSION_SHARE * compliance * float(np.median(set_force[felt]))
    asked = record.wrench[felt[np.unique(np.linspace(0, len(felt) - 1, ASKED).round().astype(int))]]
    if isinstance(finger, SensorFinger):
        noise = np.diag(np.square(finger.sensor.noise))
        unknown = _calibration_covariance(asked, np.array(finger.sensor.axis_limits))
    else:
        noise, unknown = white_noise(force_noise, moment_noise), np.zeros((6, 6))
    contacts = contacts_from_wrenches(finger.surface, asked)
    calibrated = contacts_uncertainties(finger.surface, contacts, unknown)
    pressed = DEVIATIONS * compliance * float(np.sqrt(np.nanmedian(calibrated.normal_force)))
    modelled = contacts_uncertainties(finger.surface, contacts, np.zeros((6, 6)), tip)
    outwards = np.einsum("ki,kij,kj->k", contacts.normal, modelled.centroid, contacts.normal)
    tilted = _trace(calibrated.normal) + _trace(modelled.normal)
    return MapBudget(
        calibration=SIDEWAYS * _rise(calibrated) + pressed,
        noise=_rise(contacts_uncertainties(finger.surface, contacts, noise)),
        compression=compression,
        tip=SIDEWAYS * _rise(modelled) + DEVIATIONS * float(np.sqrt(np.nanmedian(outwards))),
        aside=float(np.sqrt(0.5 * np.nanmedian(_trace(calibrated.centroid)))),
        tilt=LEAST_TILT + float(np.sqrt(SIDEWAYS * np.nanmedian(tilted))),
    )


def _calibration_covariance(wrenches: FloatArray, ranges: FloatArray) -> FloatArray:
    """Return the covariance (6, 6) of what calibration and zero leave at a typical wrench of these (n, 6)."""
    load = float(np.sqrt(np.median(np.square(wrenches / ranges).sum(axis=1))))
    share = UNIFORM * np.hypot(CALIBRATION_SHARE * load, ZERO_SHARE)
    sd: FloatArray = share * ranges
    return np.diag(sd * sd)


def _rise(uncertain: ContactUncertainties) -> float:
    """Return the mean gap of tip and object at the estimated contact [m]."""
    # turn times shift: curvature of the tip times squared distance, without asking the surface for its curvature
    return 0.5 * ROUND * float(np.nanmedian(np.sqrt(_trace(uncertain.centroid) * _trace(uncertain.normal))))


def _trace(covariance: FloatArray) -> FloatArray:
    return np.asarray(np.maximum(np.trace(covariance, axis1=1, axis2=2), 0.0))
