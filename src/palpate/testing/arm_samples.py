"""Checks of states of an arm: SI units, base frame, time stamps of the moment of sampling."""

import math
from collections.abc import Sequence

import numpy as np

from palpate.errors import FloatArray, shown
from palpate.kinematics.pose import rotvec_from_rotation, times, transposed
from palpate.runtime.data import ArmSample
from palpate.runtime.standstill_check import REST_SPEED
from palpate.spatial import Vector, norm
from palpate.testing.nonconformity import Inspection
from palpate.testing.wrenches import MAX_RESTAMPED_SHARE, restamped_runs

MAX_SAMPLE_AGE = 0.1
"""Largest age of a sample [s] that a supervisor should accept."""

MAX_REACH = 5.0
"""Largest distance from base to tip [m]: no arm is longer (Fanuc M-2000iA/1700L: 4.7 m); more is another unit."""

MIN_DIRECTION_COSINE = 0.8
"""Smallest cosine of the angle between two motions that should be equal, 37 degrees: finds mixed-up frames."""

MAX_RATIO_SIMULATED, MAX_RATIO_REAL = 2.0, 20.0
"""Largest ratio of the lengths of two motions that should be equal: millimetres make 1000, degrees 57. In real
time an emulator on a busy computer falls behind its own clock; a ratio of ten has been observed."""

POSITION_TOLERANCE = 5e-5
"""Error of positions that needs no further check [m]: repeatability of an arm (UR5e, data sheet: 0.03 mm)."""

ROTATION_TOLERANCE = 1e-4
"""Error of rotations that needs no further check [rad]."""

ORTHONORMALITY_TOLERANCE = 1e-6
"""Largest entry of R'R - I: an arm's own numbers may have single precision."""


def examine_arm(inspection: Inspection, samples: Sequence[ArmSample]) -> bool:
    """Examine numbers, frames and stamps of successive states; return whether their motion can be examined."""
    plain = all(
        _is_vector(vector)
        for arm in samples
        for vector in (arm.position_base_tip, arm.velocity_base_tip, arm.angular_velocity_base_tip)
    )
    if not inspection.require(
        plain and all(math.isfinite(arm.time) for arm in samples),
        "numbers",
        shown(samples[-1], 300),
        "a finite time, and position and velocities as plain tuples of three finite floats",
        "return tuple(array.tolist()): arrays can be changed later, and a log keeps plain numbers",
    ):
        return False
    R = np.array([arm.rotation_base_tip for arm in samples])
    turned = (
        R.shape[1:] == (3, 3) and np.abs(np.swapaxes(R, 1, 2) @ R - np.eye(3)).max() <= ORTHONORMALITY_TOLERANCE
    )
    inspection.require(
        turned and (np.linalg.det(R) > 0.0).all(),
        "rotation",
        f"rotation_base_tip = {shown(samples[-1].rotation_base_tip, 120)}",
        "an orthonormal matrix with determinant 1",
        "maps tip to base coordinates, columns are the tip's axes; rotvec or quaternion have to be converted",
    )
    far = max(norm(arm.position_base_tip) for arm in samples)
    inspection.require(
        far <= MAX_REACH,
        "units of length",
        f"the tip is {far:.4g} m from the base",
        f"less than {MAX_REACH:g} m",
        "give positions in metres, not in millimetres",
    )
    times_ = np.array([arm.time for arm in samples])
    inspection.require(
        (np.diff(times_) >= 0.0).all(),
        "time stamps of the arm",
        f"one goes back by {-np.diff(times_).min(initial=0.0):.3g} s",
        "stamps that never go back",
        "stamp each state when it was sampled, on one monotonic clock",
    )
    _examine_repeats(inspection, samples)
    return bool(turned)


def _is_vector(value: object) -> bool:
    return (
        isinstance(value, tuple)
        and len(value) == 3
        and all(isinstance(v, float) and math.isfinite(v) for v in value)
    )


def _examine_repeats(inspection: Inspection, samples: Sequence[ArmSample]) -> None:
    """A state that is repeated while the arm moves was sampled once: its stamp must be repeated, too."""
    moving = [(arm.time, arm.position_base_tip) for arm in samples if norm(arm.velocity_base_tip) > REST_SPEED]
    restamped = restamped_runs(moving)
    inspection.require(
        restamped <= MAX_RESTAMPED_SHARE * len(moving),
        "time stamps of the arm",
        f"{restamped} times in {len(moving)} states of the moving arm one is repeated with a later stamp",
        "the stamp of the moment at which a state was sampled, also when it is reported again",
        "stamp it where it arrives from the device, not where it is logged or returned",
    )


def examine_motion(inspection: Inspection, samples: Sequence[ArmSample], velocity: Vector, factor: float) -> None:
    """Examine the later half of the states of an arm that moves with a steady velocity, base frame [m/s].

    `factor` is `MAX_RATIO_SIMULATED` or `MAX_RATIO_REAL`.
    """
    late = samples[len(samples) // 2 :]
    passed = late[-1].time - late[0].time
    if not inspection.require(
        passed > 0.0, "time stamps of the arm", "they stand still", "stamps that advance", "stamp every state"
    ):
        return
    moved = np.subtract(late[-1].position_base_tip, late[0].position_base_tip)
    reported = _integral([arm.time for arm in late], [arm.velocity_base_tip for arm in late])
    wanted = passed * np.array(velocity)
    inspection.require(
        _same(moved, wanted, POSITION_TOLERANCE, factor),
        "commanded velocity",
        f"commanded {_mm(wanted)} mm in {passed:.3g} s, the tip moved by {_mm(moved)} mm",
        "that motion",
        "velocities are in m/s, of the tip frame's origin, in base coordinates",
    )
    inspection.require(
        _same(reported, moved, POSITION_TOLERANCE, factor),
        "reported velocity",
        f"reported velocities make {_mm(reported)} mm, positions changed by {_mm(moved)} mm",
        "the same",
        "velocity_base_tip is in m/s, in base coordinates, and of the same moment as the position",
    )


def examine_turn(inspection: Inspection, samples: Sequence[ArmSample], rate: Vector, factor: float) -> None:
    """Examine the later half of the states of an arm that turns with a steady `rate`, base frame [rad/s]."""
    late = samples[len(samples) // 2 :]
    passed = late[-1].time - late[0].time
    turned = np.array(
        rotvec_from_rotation(times(late[-1].rotation_base_tip, transposed(late[0].rotation_base_tip)))
    )
    reported = _integral([arm.time for arm in late], [arm.angular_velocity_base_tip for arm in late])
    wanted = passed * np.array(rate)
    inspection.require(
        _same(turned, wanted, ROTATION_TOLERANCE, factor),
        "commanded angular velocity",
        f"commanded {wanted.tolist()} rad, the tip turned by {turned.tolist()} rad",
        "that turn",
        "angular velocities are in rad/s, not in degrees, in base coordinates",
    )
    inspection.require(
        _same(reported, turned, ROTATION_TOLERANCE, factor),
        "reported angular velocity",
        f"reported rates make {reported.tolist()} rad, the rotation changed by {turned.tolist()} rad",
        "the same",
        "angular_velocity_base_tip is in rad/s, not in degrees, in base coordinates",
    )


def examine_rest(inspection: Inspection, samples: Sequence[ArmSample], when: str) -> None:
    """Examine speed and positions of an arm that should stand still."""
    speed = norm(samples[-1].velocity_base_tip)
    moved = math.dist(samples[-1].position_base_tip, samples[0].position_base_tip)
    inspection.require(
        speed <= REST_SPEED and moved <= POSITION_TOLERANCE + REST_SPEED * (samples[-1].time - samples[0].time),
        f"rest {when}",
        f"the tip moves with {1e3 * speed:.3g} mm/s, and by {1e3 * moved:.3g} mm meanwhile",
        "a tip at rest",
        "stop the arm itself, and wait until it stands: no command reaches it any more",
    )


def _integral(times_: Sequence[float], vectors: Sequence[Vector]) -> FloatArray:
    return np.asarray(np.trapezoid(np.array(vectors), np.array(times_), axis=0))


def _same(a: FloatArray, b: FloatArray, besides: float, factor: float) -> bool:
    """Return whether two motions agree up to a factor, or differ by at most `besides`."""
    shorter, longer = sorted((float(np.linalg.norm(a)), float(np.linalg.norm(b))))
    aligned = float(a @ b) >= MIN_DIRECTION_COSINE * shorter * longer
    return float(np.linalg.norm(a - b)) <= besides or (aligned and longer <= factor * shorter)


def _mm(vector: FloatArray) -> list[float]:
    return [round(1e3 * v, 3) for v in vector.tolist()]
