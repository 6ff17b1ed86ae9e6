"""Rows back as samples and commands: the inverse of `row_packer`, bit for bit."""

import math
from collections.abc import Iterator

from palpate.errors import FloatArray
from palpate.runtime.data import ArmSample, Command, HandSample, Phase, Sample, WrenchSample
from palpate.runtime.log.period_codec import PeriodCodec
from palpate.spatial import Vector

_AT_ONCE = 1024
"""Rows that are turned into Python numbers at once: memory against speed."""

_NOTHING = slice(0, 0)


def samples_of(codec: PeriodCodec, rows: FloatArray) -> Iterator[Sample]:
    """Yield the sample of each row."""
    at, layout = codec.columns, codec.heading.layout
    time, arm_time = at["time"].start, at["arm.time"].start
    position, velocity, rotation = at["arm.position"], at["arm.velocity"], at["arm.rotation"]
    turning = at["arm.angular_velocity"]
    force = at.get("arm.tip_force")
    joints, hand_joints = at.get("arm.joint_position", _NOTHING), at.get("hand.joint_position", _NOTHING)
    hand_time = at["hand.time"].start if layout.hand_joints is not None else None
    fingers = [
        (at[f"{name}.time"].start, at[f"{name}.reading"], at[f"{name}.acceleration"])
        for name in (f"finger_{index}" for index in range(len(layout.channels)))
    ]
    for row in _numbers(rows):
        a, b, c, d, e, f, g, h, i = row[rotation]
        yield Sample(
            row[time],
            ArmSample(
                row[arm_time],
                _vector(row[position]),
                ((a, b, c), (d, e, f), (g, h, i)),
                _vector(row[velocity]),
                tuple(row[joints]),
                _vector(row[turning]),
                None if force is None else _vector(row[force]),
            ),
            tuple(
                WrenchSample(row[when], tuple(row[reading]), _vector(row[acceleration]))
                for when, reading, acceleration in fingers
            ),
            None if hand_time is None else HandSample(row[hand_time], tuple(row[hand_joints])),
        )


def commands_of(codec: PeriodCodec, rows: FloatArray) -> Iterator[Command]:
    """Yield the command of each row."""
    at = codec.columns
    velocity, turning = at["command.velocity"], at["command.angular_velocity"]
    grips = at["command.grip_force"].start
    count, phase = at["command.grip_count"].start, at["command.phase"].start
    fingers = at.get("command.finger_velocity", _NOTHING).start
    moving = at["command.finger_velocity_count"].start if fingers else None
    phases = [Phase[name] for name in codec.heading.codes.phases]
    for row in _numbers(rows):
        given = int(row[count])
        grip_force = None if given < 0 else tuple(row[grips : grips + given])
        moved = -1 if moving is None else int(row[moving])
        finger_velocity = None if moved < 0 else _velocities(row[fingers : fingers + moved])
        yield Command(
            _vector(row[velocity]), phases[int(row[phase])], grip_force, _vector(row[turning]), finger_velocity
        )


def _numbers(rows: FloatArray) -> Iterator[list[float]]:
    for start in range(0, len(rows), _AT_ONCE):
        yield from rows[start : start + _AT_ONCE].tolist()


def _velocities(numbers: list[float]) -> tuple[Vector | None, ...]:
    each = (_vector(numbers[i : i + 3]) for i in range(0, len(numbers), 3))
    return tuple(None if all(map(math.isnan, velocity)) else velocity for velocity in each)


def _vector(three: list[float]) -> Vector:
    x, y, z = three
    return (x, y, z)
