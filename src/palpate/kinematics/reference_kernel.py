"""One control period of the reference of an arm's tip, compiled: `palpate.kinematics.reference` has the method.

What it remembers is one array: joint references (n), their feed-forward (n) and the pose of the tip's reference
(position, rotation by rows). Vectors and rotations are tuples, by the functions that Python code uses.
"""

import math
from collections.abc import Callable
from typing import Any

from palpate.compiling import njit
from palpate.kinematics.kernel import INVALID, POSE, POSITION, joint_motion, tip_frame
from palpate.kinematics.pose import newton_factor, rotation_from_rotvec, rotvec_from_rotation, times, transposed
from palpate.spatial import ZERO, add, add_scaled, dot, scale, subtract

RECOVERY = 20.0
"""[1/s] at which joint references come back to the tip's reference after damping kept them from it: 50 ms, in
which a whole following-error limit of 1 mm asks for 20 mm/s."""

ASIDE = 2.0
"""Times the following-error limit: how far a reference may be from the tip at right angles to the wanted
direction. An arm yields askew: pushing straight at a wall without friction, a UR5e with its tip down is off to the
side by half to twice as much as ahead (by its compliance, over its workspace)."""

MAX_LEAD = math.hypot(1.0, ASIDE)
"""Times the following-error limit: how far a reference may be from the tip at all; the bound for one that shall
not move."""


def _inlined(function: Callable[..., Any]) -> Any:
    """Compile what Python code calls, too."""
    return njit(error_model="numpy")(function)


_add, _add_scaled, _dot = _inlined(add), _inlined(add_scaled), _inlined(dot)
_scale, _subtract = _inlined(scale), _inlined(subtract)
_times, _transposed, _newton_factor = _inlined(times), _inlined(transposed), _inlined(newton_factor)
_rotation, _rotvec = _inlined(rotation_from_rotvec), _inlined(rotvec_from_rotation)


@njit(error_model="numpy")
def _vector(row, at):
    return (row[at], row[at + 1], row[at + 2])


@njit(error_model="numpy")
def _matrix(row, at):
    return (_vector(row, at), _vector(row, at + 3), _vector(row, at + 6))


@njit(error_model="numpy")
def _norm(a):
    return math.hypot(math.hypot(a[0], a[1]), a[2])


@njit(error_model="numpy")
def _limit_norm(a, longest):
    length = _norm(a)
    return a if length <= longest else _scale(longest / length, a)


@njit(error_model="numpy")
def _turned(rotation, turn):
    if turn == ZERO:
        return rotation
    turned = _times(_rotation(turn), rotation)
    return _times(turned, _newton_factor(_times(_transposed(turned), turned)))


@njit(error_model="numpy")
def _limited_shift(here, actual, wanted, limit):
    """The reference's shift in this period, and whether it is as wanted: unless that is too far ahead."""
    ahead = _subtract(_add(here, wanted), actual)
    if _norm(ahead) <= limit:
        return wanted, True
    square = _dot(wanted, wanted)
    if square == 0.0:
        return _subtract(_add(actual, _limit_norm(ahead, MAX_LEAD * limit)), here), False
    along = _scale(_dot(ahead, wanted) / square, wanted)
    aside = _subtract(ahead, along)
    if _norm(along) <= limit and _norm(aside) <= ASIDE * limit:
        return wanted, True
    kept = _add(_limit_norm(along, limit), _limit_norm(aside, ASIDE * limit))
    return _subtract(_add(actual, kept), here), False


@njit(error_model="numpy")
def _limited_turn(here, actual, wanted, limit):
    """The reference's turn in this period, and whether it is as wanted: unless that is too far ahead."""
    ahead = _rotvec(_times(_turned(here, wanted), _transposed(actual)))
    if _norm(ahead) <= limit:
        return wanted, True
    kept = _times(_rotation(_limit_norm(ahead, limit)), actual)
    return _rotvec(_times(kept, _transposed(here))), False


@njit(error_model="numpy")
def _share(moved, wanted):
    """Share of a wanted displacement that was made, 0 to 1; 1 if none was wanted."""
    square = _dot(wanted, wanted)
    return min(max(_dot(moved, wanted) / square, 0.0), 1.0) if square > 0.0 else 1.0


@njit(error_model="numpy")
def _write(twist, v, w):
    for i in range(3):
        twist[i], twist[3 + i] = v[i], w[i]


@njit(error_model="numpy", cache=True)
def move_reference(chain, bounds, home, settings, limits, period, actual_position, twist, state):
    """Move the references by one period; return how the joints move, as `joint_motion` does.

    Args:
        chain: Of the arm, with bounds, home and settings as `joint_motion` takes them.
        bounds: Likewise.
        home: Likewise.
        settings: Likewise.
        limits: Of the following error [m, rad], shape (2,).
        period: Of control [s].
        actual_position: Where the joints really are [rad or m], shape (n,).
        twist: Wanted (v, w) of the tip in the base [m/s, rad/s], shape (6,).
        state: Of the reference, see above, shape (2 n + 12,); written.
    """
    n = len(home)
    joints, feed_forward = state[:n], state[n : 2 * n]
    total = 0.0
    for i in range(6):
        total += twist[i]
    if not math.isfinite(total):
        feed_forward[:] = 0.0
        return joint_motion(chain, bounds, home, settings, joints, twist)
    velocity, angular_velocity = _vector(twist, 0), _vector(twist, 3)
    wanted_shift, wanted_turn = _scale(period, velocity), _scale(period, angular_velocity)
    here, rotation = _vector(state, 2 * n), _matrix(state, 2 * n + 3)
    actual, held = tip_frame(chain, actual_position), tip_frame(chain, joints)
    shift, shifted = _limited_shift(here, _vector(actual, 0), wanted_shift, limits[0])
    turn, turned = _limited_turn(rotation, _matrix(actual, 3), wanted_turn, limits[1])
    behind = _subtract(here, _vector(held, 0))
    turned_behind = _rotvec(_times(rotation, _transposed(_matrix(held, 3))))
    asked = twist.copy()
    _write(
        asked,
        _add_scaled(_scale(1.0 / period, shift), RECOVERY, behind),
        _add_scaled(_scale(1.0 / period, turn), RECOVERY, turned_behind),
    )
    motion = joint_motion(chain, bounds, home, settings, joints, asked)
    part, limit = motion[POSE + n + 6], motion[POSE + n + 8]
    if limit == INVALID:
        feed_forward[:] = 0.0
        return motion
    feed_forward[:] = motion[POSE : POSE + n]
    if not (shifted and turned):
        _write(
            asked,
            _scale(_share(shift, wanted_shift), velocity),
            _scale(_share(turn, wanted_turn), angular_velocity),
        )
        feed_forward[:] = joint_motion(chain, bounds, home, settings, joints, asked)[POSE : POSE + n]
    for k in range(n):
        joints[k] += period * motion[POSE + k]
    if limit == POSITION:
        # what a range forbids is forgotten, or it would hold the joint at its end when all else wants back
        shift = _subtract(_scale(part, _add(shift, behind)), behind)
        turn = _subtract(_scale(part, _add(turn, turned_behind)), turned_behind)
    else:
        shift, turn = _scale(part, shift), _scale(part, turn)
    here, rotation = _add(here, shift), _turned(rotation, turn)
    for i in range(3):
        state[2 * n + i] = here[i]
        for j in range(3):
            state[2 * n + 3 + 3 * i + j] = rotation[i][j]
    return motion
