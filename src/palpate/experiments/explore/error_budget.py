"""Error budget of a map: offsets left by the finger's specification, and assumptions that the run contradicts.

The sensor's zero and the contact stiffness are measured outside the scan. Before the first touch and after the
last one the tip is in free air, where the sensor shows its zero. While a landing settles, force and position give
the stiffness. The contacts of a scan also show errors of the fingertip's shape and place.
"""

import math
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from palpate.errors import FloatArray
from palpate.estimation import BrokenAssumption
from palpate.mapping.point_normals import point_normals
from palpate.runtime import FingerDescription, Phase, Record, SensorFinger
from palpate.sensing.solver import contacts_from_wrenches
from palpate.sensing.tip_agreement import tip_agreement
from palpate.sensing.tip_uncertainty import EXACT, TipUncertainty
from palpate.sensing.uncertainty import ContactUncertainties, contacts_uncertainties, white_noise

_CALIBRATION_SHARE = 0.01
"""ASSUMPTION: cross-talk between axes, as a share of each axis' full load; makers claim 1 to 2 % for all errors
together (see `palpate.sim.sensor.presets`)."""

_ZERO_SHARE = 1e-3
"""ASSUMPTION: drift of the zero since it was last taken, as a share of full load: two kelvin of 0.05 %/K (see
`palpate.sim.sensor.presets`)."""

_DEVIATIONS_95 = 1.96
"""Standard deviations that hold 95 % of an error."""

_PLANE_TRACE_95 = 3.0
"""Multiple of the trace of a plane covariance that holds 95 % of squared distances (chi^2 with two degrees of
freedom, 5.99 / 2)."""

_BUDGET_PERCENT = 95.0
"""Percentile of an effect over the scan that enters the budget."""

_COMPRESSION_SHARE = 5e-3
"""ASSUMPTION: unknown share of the compression at the set force. Even in simulation with its exact stiffness, a
sliding contact presses by more than its penetration, 0.2 % in a scan of a sphere."""

_MIN_TILT = 2.5e-3
"""Least tilt of normals [rad]: a tip of 8 mm rolls so far in a period of 1 ms at 20 mm/s."""

_FREE_AIR_TIME_S = 0.05
"""Time in free air over which a zero is averaged [s]: the last millimetre of a lift, far off the surface."""

_ZERO_SHIFT_DEVIATIONS = 6.0
"""Standard errors beyond which a zero has moved: noise alone does that once in 1e9 runs."""

MAX_STIFFNESS_RATIO = 1.5
"""Largest ratio of stiffnesses that count as equal: landings are short, and their damping is unknown."""

_MIN_LANDING_PERIODS = 20
"""Least periods of a landing from which its stiffness is estimated."""

_MAX_STIFFNESS_ERROR = 0.1
"""Largest relative standard error of a landing's stiffness at which it counts."""

_MIN_FRICTION_RATIO = 1e-3
"""Least tangential over normal force at which friction gives the sensor's turn about the normal."""


@dataclass(frozen=True, slots=True)
class MapBudget:
    """Largest constant offset along the normal that repetition does not average out, by origin.

    A fingertip of known shape touches with its surface: lateral errors of the computed contact count in second
    order only, through the curvature of tip and object.

    Attributes:
        calibration: Offset by the sensor's gain, cross-talk and zero [m]. 0 for a sensor without known ranges,
            which counts as perfect apart from its noise.
        noise: Mean offset by white noise, as a lateral error of the contact shifts it outwards [m].
        compression: Offset by changes of the force, during which compression depends on damping, and by the
            unknown share of the steady compression [m].
        tip: Offset by errors of the fingertip's size, place and stiffness [m].
        tilt: Largest common tilt of all normals by calibration and tip [rad]; no part of the total.
        aside: Standard deviation of the lateral place of contacts by the calibration [m]; no part of the total.
        shown: Offset by assumptions that the run contradicts: a zero that moved, another stiffness [m].
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
        """Sum of all offsets, which may have one sign [m]."""
        return self.felt + self.tip

    @property
    def felt(self) -> float:
        """Sum without the tip [m], which shifts all points alike: the fit of a shape counts it separately."""
        return self.calibration + self.noise + self.compression + self.shown


def map_budget(
    record: Record,
    finger: FingerDescription,
    *,
    kept: npt.NDArray[np.bool_],
    set_force: FloatArray,
    half_compliance: float,
    force_noise: float = 0.0,
    moment_noise: float = 0.0,
    tip: TipUncertainty = EXACT,
    shown: float = 0.0,
) -> MapBudget:
    """Return the budget of a scan.

    Args:
        record: Record of the run.
        finger: Finger that felt; a `SensorFinger` has a sensor file, any other a perfect sensor.
        kept: Periods that gave a point of the map, shape (n,).
        set_force: Target of the normal force, shape (n,) [N].
        half_compliance: Half the compression of tip and object per force [m/N].
        force_noise: Standard deviation of each force component without a sensor file [N].
        moment_noise: Standard deviation of each moment component without a sensor file [N m].
        tip: Uncertainty of the fingertip.
        shown: Offset by assumptions that the run contradicts [m]; see `AssumptionCheck.offset`.
    """
    felt = np.flatnonzero(kept)
    if not len(felt):
        return MapBudget(0.0, 0.0, 0.0, 0.0, _MIN_TILT, shown=shown)
    compliance = 2.0 * half_compliance
    change = np.abs(record.normal_force[felt] - set_force[felt])
    unsteady = compliance * float(np.percentile(change, _BUDGET_PERCENT))
    wrench = record.wrench[_evenly(felt)]
    if isinstance(finger, SensorFinger):
        noise = np.diag(np.square(finger.sensor.noise))
        unknown = _calibration_covariance(wrench, np.array(finger.sensor.axis_limits))
    else:
        noise, unknown = white_noise(force_noise, moment_noise), np.zeros((6, 6))
    contacts = contacts_from_wrenches(finger.surface, wrench)
    calibrated = contacts_uncertainties(finger.surface, contacts, unknown)
    pressed = _DEVIATIONS_95 * compliance * float(np.sqrt(np.nanmedian(calibrated.normal_force)))
    modelled = contacts_uncertainties(finger.surface, contacts, np.zeros((6, 6)), tip)
    outwards = np.einsum("ki,kij,kj->k", contacts.normal, modelled.centroid, contacts.normal)
    tilted = _trace(calibrated.normal) + _trace(modelled.normal)
    return MapBudget(
        calibration=_PLANE_TRACE_95 * _rise(calibrated) + pressed,
        noise=_rise(contacts_uncertainties(finger.surface, contacts, noise)),
        compression=unsteady + _COMPRESSION_SHARE * compliance * float(np.median(set_force[felt])),
        tip=_PLANE_TRACE_95 * _rise(modelled) + _DEVIATIONS_95 * float(np.sqrt(np.nanmedian(outwards))),
        aside=float(np.sqrt(0.5 * np.nanmedian(_trace(calibrated.centroid)))),
        tilt=_MIN_TILT + float(np.sqrt(_PLANE_TRACE_95 * np.nanmedian(tilted))),
        shown=shown,
    )


def _evenly(felt: npt.NDArray[np.intp]) -> npt.NDArray[np.intp]:
    """Return at most 200 contacts, evenly over the scan."""
    spread = np.linspace(0, len(felt) - 1, 200)
    return np.asarray(felt[np.unique(spread.round().astype(int))])


def _calibration_covariance(wrenches: FloatArray, ranges: FloatArray) -> FloatArray:
    """Return the covariance (6, 6) that calibration and zero leave at a typical wrench of these (n, 6)."""
    load = float(np.sqrt(np.median(np.square(wrenches / ranges).sum(axis=1))))
    # a maker's limit is no standard deviation: that of a uniform distribution over -1 to 1 is 3**-0.5
    sd: FloatArray = 3.0**-0.5 * np.hypot(_CALIBRATION_SHARE * load, _ZERO_SHARE) * ranges
    return np.diag(sd * sd)


def _rise(uncertain: ContactUncertainties) -> float:
    """Return the mean gap of tip and object at the estimated contact [m]."""
    # turn times shift is the tip's curvature times squared distance; half of it is the tip's gap, and an object
    # nowhere sharper than the tip adds as much
    return float(np.nanmedian(np.sqrt(_trace(uncertain.centroid) * _trace(uncertain.normal))))


def _trace(covariance: FloatArray) -> FloatArray:
    return np.asarray(np.maximum(np.trace(covariance, axis1=1, axis2=2), 0.0))


@dataclass(frozen=True, slots=True, eq=False)
class AssumptionCheck:
    """Sensor zero and contact stiffness as a run showed them.

    Attributes:
        zero_shift: Change of the sensor's reading in free air between the beginning and the end, sensor frame,
            shape (6,) [N, N m]; zero where it did not exceed its noise, or is unknown.
        stiffness: Contact stiffness by the landings [N/m]; NaN if unknown.
        assumed_stiffness: Contact stiffness that control and map assumed [N/m].
        offset: Offset of the map's points by both [m].
        most_force: Largest measured force [N].
    """

    zero_shift: FloatArray
    stiffness: float
    assumed_stiffness: float
    offset: float
    most_force: float

    @property
    def zero_moved(self) -> float:
        """Length of the force by which the zero moved [N]."""
        return float(np.linalg.norm(self.zero_shift[:3]))

    @property
    def stiffness_differs(self) -> bool:
        """Whether the stiffness by the landings contradicts the assumed one; False if unknown."""
        found, assumed = self.stiffness, self.assumed_stiffness
        return math.isfinite(found) and not assumed / MAX_STIFFNESS_RATIO <= found <= assumed * MAX_STIFFNESS_RATIO


def assumption_check(
    record: Record, finger: FingerDescription, *, stiffness: float, kept: npt.NDArray[np.bool_]
) -> AssumptionCheck:
    """Return sensor zero and contact stiffness as a run showed them.

    Args:
        record: Record of the run.
        finger: Finger that felt.
        stiffness: Assumed contact stiffness [N/m].
        kept: Periods that gave a point of the map, shape (n,).
    """
    shift, force = zero_shift(record), np.linalg.norm(record.wrench[:, :3], axis=1)
    offset = zero_offset(record, finger, shift, kept, 1.0 / stiffness)
    most = float(force.max()) if len(force) else 0.0
    check = AssumptionCheck(shift, landed_stiffness(record), stiffness, offset, most)
    if not (check.stiffness_differs and kept.any()):
        return check
    compression = float(np.median(record.normal_force[kept])) * abs(1.0 / check.stiffness - 1.0 / stiffness)
    return replace(check, offset=offset + compression)


def zero_shift(record: Record) -> FloatArray:
    """Return the change of the sensor's zero, shape (6,) [N, N m]; see `AssumptionCheck`."""
    ground = np.flatnonzero(np.isin(record.phase, (Phase.SETTLE.value, Phase.SCAN.value)))
    if not len(ground):
        return np.zeros(6)
    before, after = record.wrench[: ground[0]], record.wrench[ground[-1] + 1 :]
    count = round(_FREE_AIR_TIME_S / max(float(np.median(np.diff(record.time))), 1e-9)) if len(record) > 1 else 0
    if count < 2 or len(before) < 2 * count or len(after) < 2 * count:
        return np.zeros(6)
    first, last = before[count : 2 * count], after[-count:]
    shift = last.mean(axis=0) - first.mean(axis=0)
    error = np.sqrt((first.var(axis=0) + last.var(axis=0)) / count)
    # a contact that persists is not at rest: its force changes meanwhile
    return np.asarray(shift) if (np.abs(shift) > _ZERO_SHIFT_DEVIATIONS * error).any() else np.zeros(6)


def landed_stiffness(record: Record) -> float:
    """Return the contact stiffness by force = K depth + c rate, the median over all landings [N/m]."""
    settling = (record.phase == Phase.SETTLE.value) & record.touching & (record.status == 0)
    edges = np.flatnonzero(np.diff(np.concatenate([[0], settling.astype(int), [0]])))
    found = [_stiffness(record, slice(a, b)) for a, b in edges.reshape(-1, 2) if b - a >= _MIN_LANDING_PERIODS]
    known = [each for each in found if math.isfinite(each)]
    return float(np.median(known)) if known else math.nan


def _stiffness(record: Record, rows: slice) -> float:
    force = record.normal_force[rows]
    normal = record.normal[rows].mean(axis=0)
    normal /= np.linalg.norm(normal)
    depth, rate = (record.position[rows] - record.position[rows][0]) @ normal, record.velocity[rows] @ normal
    if not np.ptp(depth) > 0.0:
        return math.nan
    columns = np.column_stack([depth - depth.mean(), rate - rate.mean()])
    scale = np.abs(columns).max(axis=0)
    scale[scale == 0.0] = 1.0  # a robot without velocity measurement, or at constant velocity
    columns = columns / scale
    solved, *_ = np.linalg.lstsq(columns, force - force.mean(), rcond=None)
    left = force - force.mean() - columns @ solved
    inverse = np.linalg.pinv(columns.T @ columns)
    error = math.sqrt(float(inverse[0, 0]) * float(left @ left) / (len(force) - 3))
    return float(solved[0] / scale[0]) if error < _MAX_STIFFNESS_ERROR * solved[0] else math.nan


def zero_offset(
    record: Record,
    finger: FingerDescription,
    shift: FloatArray,
    kept: npt.NDArray[np.bool_],
    compliance: float,
) -> float:
    """Return the offset of a map's points by a zero that moved [m].

    A contact estimated a distance d off, with a normal turned by a, is off by d a / 2 on the tip. It is off by as
    much on an object of the same curvature. An error of the normal force changes the compression.

    Args:
        record: Record of the run.
        finger: Finger that felt.
        shift: Change of the zero, shape (6,) [N, N m].
        kept: Periods that gave a point of the map, shape (n,).
        compliance: Compliance of tip and object together [m/N].
    """
    felt = np.flatnonzero(kept)
    if not len(felt) or not shift.any():
        return 0.0
    wrench = record.wrench[_evenly(felt)]
    shifted, corrected = (contacts_from_wrenches(finger.surface, each) for each in (wrench, wrench - shift))
    aside = np.linalg.norm(shifted.centroid - corrected.centroid, axis=1)
    turn = np.linalg.norm(shifted.normal - corrected.normal, axis=1)
    pressed = compliance * np.abs(shifted.normal_force - corrected.normal_force)
    return float(np.nanpercentile(aside * turn + pressed, _BUDGET_PERCENT))


def tip_findings(
    record: Record, finger: FingerDescription, *, kept: npt.NDArray[np.bool_], tip: TipUncertainty, place_sd: float
) -> tuple[BrokenAssumption, ...] | None:
    """Return the assumptions about the fingertip that a scan contradicts; None if it cannot judge, as on a line.

    Args:
        record: Record of the run.
        finger: Finger that felt.
        kept: Periods that gave a point of the map, shape (n,).
        tip: Uncertainty of the fingertip's description.
        place_sd: Standard deviation of the lateral place of contacts by the sensor's calibration [m].
    """
    felt = np.flatnonzero(kept)
    # a paraboloid around a contact is good over a third of a tip
    found = point_normals(record.centroid[felt], record.normal[felt], radius=2.5e-3, spacing=2e-4, count=600)
    friction = np.linalg.norm(record.tangential_force[felt[found.rows]], axis=1)
    rubbing = friction > _MIN_FRICTION_RATIO * record.normal_force[felt[found.rows]]
    rows, bend = felt[found.rows][rubbing], found.bend[rubbing]
    if not len(rows):
        return None
    contacts = contacts_from_wrenches(finger.surface, record.wrench[rows])
    base = _axes(record.normal[rows], record.tangential_force[rows])
    turn = _axes(contacts.normal, contacts.tangential_force) @ base.transpose(0, 2, 1)
    normal = np.einsum("nij,nj->ni", turn, found.normal[rubbing])
    agreement = tip_agreement(finger.surface, contacts, normal, turn @ bend @ turn.transpose(0, 2, 1))
    return None if agreement is None else tuple(agreement.broken(tip, place_sd))


def _axes(normal: FloatArray, friction: FloatArray) -> FloatArray:
    """Return axes along normal, friction, and across both, as columns, shape (n, 3, 3)."""
    along = friction / np.linalg.norm(friction, axis=1, keepdims=True)
    return np.asarray(np.stack([normal, along, np.cross(normal, along)], axis=2), dtype=float)
