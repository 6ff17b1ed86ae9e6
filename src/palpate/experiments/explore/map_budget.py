"""Systematic error of a whole map: what repetition does not average out, from the finger's specification."""

import math
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import uniform_filter1d
from scipy.signal import lfilter

from palpate.errors import FloatArray
from palpate.runtime import FingerDescription, SensorFinger
from palpate.runtime.log import Record
from palpate.sensing.solver import contacts_from_wrenches
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

DAMPED_MASS = 5.0
"""ASSUMPTION: contacts are damped as is critical for so much mass [kg] at most, that of the simulated stage:
compression follows the force within 2 sqrt(mass compliance), 0.1 s at 2 kN/m and 0.03 s at 20 kN/m."""

AVERAGED = 1e-3
"""Path over which contacts are averaged in a map [m], at the least: changes of the force cancel there."""

LEAST_TILT = 2.5e-3
"""[rad] that normals may always be off: what a tip of 8 mm rolls in a period of 1 ms at 20 mm/s."""

ROUND, NO_TIP = 2.0, 1.0
"""Curvature of tip and object together over that of the tip, the object nowhere sharper than the tip; and without
the tip's, which means over stretches take off where it is noise (`palpate.mapping.surface_map.stretches`)."""


@dataclass(frozen=True, slots=True)
class MapBudget:
    """Constant offset along the normal that 95 % of maps stay within, by where it comes from.

    A fingertip that is known touches with its surface, wherever on it the contact is computed: lateral
    errors of the contact count in second order only, through the curvature of tip and object.

    Attributes:
        calibration: Of the sensor: gain, cross-talk and zero [m]. 0 for a sensor without known ranges, which is
            taken for perfect but for its noise.
        noise: Mean of the error by white noise, as a lateral error of the contact shifts it outwards [m].
        compression: Of tip and object during changes of the force [m]: compression is known for a steady force,
            and follows changes with a delay; with the unknown share of the steady compression.
        tilt: How far all normals may be off in one direction by the sensor's calibration [rad]; no part of the
            total.
        shown: By assumptions that the run itself disproved: a zero that moved, another stiffness (see
            `palpate.experiments.explore.assumption_check`) [m].
    """

    calibration: float
    noise: float
    compression: float
    tilt: float
    shown: float = 0.0

    @property
    def total(self) -> float:
        """What has a sign is added; calibration and compression are unknown independently [m]."""
        return math.hypot(self.calibration, self.compression) + self.noise + self.shown


def map_budget(
    record: Record,
    finger: FingerDescription,
    *,
    kept: np.ndarray[tuple[int], np.dtype[np.bool_]],
    set_force: FloatArray,
    half_compliance: float,
    force_noise: float = 0.0,
    moment_noise: float = 0.0,
) -> MapBudget:
    """Return the budget of a scan.

    Tip size and stiffness are taken as known: errors of these are the user's to add.

    Args:
        record: Of the run.
        finger: That felt it; a `SensorFinger` has a sensor file, any other a perfect sensor.
        kept: Which periods gave a point of the map, shape (n,).
        set_force: Normal force asked for, shape (n,) [N].
        half_compliance: Of tip and object together, half their compression per force [m/N].
        force_noise: Standard deviation of each force component [N], where no sensor file gives it.
        moment_noise: Likewise [N m].
    """
    felt = np.flatnonzero(kept)
    if not len(felt):
        return MapBudget(0.0, 0.0, 0.0, LEAST_TILT)
    compliance = 2.0 * half_compliance
    unsteady = float(np.percentile(np.abs(_unsteady(record, felt, set_force, compliance)), PERCENT))
    compression = compliance * math.hypot(unsteady, COMPRESSION_SHARE * float(np.median(set_force[felt])))
    asked = record.wrench[felt[np.unique(np.linspace(0, len(felt) - 1, ASKED).round().astype(int))]]
    if isinstance(finger, SensorFinger):
        noise = np.diag(np.square(finger.sensor.noise))
        unknown = _calibration_covariance(asked, np.array(finger.sensor.axis_limits))
    else:
        noise, unknown = white_noise(force_noise, moment_noise), np.zeros((6, 6))
    contacts = contacts_from_wrenches(finger.surface, asked)
    calibrated = contacts_uncertainties(finger.surface, contacts, unknown)
    pressed = DEVIATIONS * compliance * float(np.sqrt(np.nanmedian(calibrated.normal_force)))
    return MapBudget(
        calibration=math.hypot(SIDEWAYS * _rise(calibrated, ROUND), pressed),
        noise=_rise(contacts_uncertainties(finger.surface, contacts, noise), NO_TIP),
        compression=compression,
        tilt=LEAST_TILT + float(np.sqrt(SIDEWAYS * np.nanmedian(_trace(calibrated.normal)))),
    )


def _unsteady(
    record: Record,
    felt: np.ndarray[tuple[int], np.dtype[np.intp]],
    set_force: FloatArray,
    compliance: float,
) -> FloatArray:
    """Return the force that compression lags behind, averaged as a map averages contacts, shape (n,) [N]."""
    change = record.normal_force[felt] - set_force[felt]
    period = float(np.median(np.diff(record.time)))
    speed = float(np.median(np.linalg.norm(record.velocity[felt], axis=1)))
    within = 2.0 * math.sqrt(DAMPED_MASS * compliance)
    share = -math.expm1(-period / within)
    followed, _ = lfilter([share], [1.0, share - 1.0], change, zi=[(1.0 - share) * change[0]])
    averaged = min(AVERAGED / speed, within) if speed > 0.0 else within
    return np.asarray(uniform_filter1d(change - followed, max(1, round(averaged / period))))


def _calibration_covariance(wrenches: FloatArray, ranges: FloatArray) -> FloatArray:
    """Return the covariance (6, 6) of what calibration and zero leave at a typical wrench of these (n, 6)."""
    load = float(np.sqrt(np.median(np.square(wrenches / ranges).sum(axis=1))))
    share = UNIFORM * np.hypot(CALIBRATION_SHARE * load, ZERO_SHARE)
    sd: FloatArray = share * ranges
    return np.diag(sd * sd)


def _rise(uncertain: ContactUncertainties, bend: float) -> float:
    """Return the mean gap of tip and object at the estimated contact [m]."""
    # turn times shift: curvature of the tip times squared distance, without asking the surface for its curvature
    return 0.5 * bend * float(np.nanmedian(np.sqrt(_trace(uncertain.centroid) * _trace(uncertain.normal))))


def _trace(covariance: FloatArray) -> FloatArray:
    return np.asarray(np.maximum(np.trace(covariance, axis1=1, axis2=2), 0.0))
