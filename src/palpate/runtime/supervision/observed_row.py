"""An observation as a row of float64: what guards and comparisons look at, once per period, compiled.

The first `HEADER` numbers are the same in every row; behind them stand joints and fingers, where a `RowLayout`
says. The row before it stands behind it in the same array.
"""

import struct
from collections.abc import Callable
from dataclasses import dataclass
from math import nan

import numpy as np

from palpate.errors import FloatArray
from palpate.runtime.data import Observation
from palpate.sensing.contact import ContactStatus
from palpate.sensing.ft.health import HEALTHY, HealthCheck, SampleHealth
from palpate.spatial import Vector

FINGERS, JOINTS, HAND_JOINTS, HAND_TIME = 0, 1, 2, 3
"""Places of counts, of the hand's joints -1 without one, and of its time stamp [s]."""

TIME, ARM_TIME = 4, 5
"""Of the period, and of the arm [s]."""

POSITION, ROTATION, VELOCITY, TURN = 6, 9, 18, 21
"""Of the tip, in base coordinates: three numbers [m], nine, row by row, three [m/s], three [rad/s]."""

ARM_FORCE, HAS_ARM_FORCE = 24, 27
"""What the arm itself measures, three numbers [N], and 1 if it does."""

HEADER = 28

FINGER_TIME, FORCE, MOMENT, NORMAL_FORCE, SPIN, NORMAL, TANGENTIAL = 0, 1, 4, 7, 8, 9, 12
"""Places among a finger's numbers, see `FingerObservation` and `Contact`; vectors have three."""

EXPLAINED, TOUCHING, FAULTY, OVERLOADED = 15, 16, 17, 18
"""1 if a contact explains the wrench; if it touches; if its sensor cannot be believed; if that bears too much."""

FINGER = 19
"""Numbers of a finger."""

TOO_MUCH = (HealthCheck.SATURATED, HealthCheck.OVERLOAD_AXIS, HealthCheck.OVERLOAD_COMBINED)
"""What a force/torque sensor says of too large a load; it works all the same."""

_NO_FORCE: Vector = (nan, nan, nan)
_SOUND = (False, False)
_OK = ContactStatus.OK
_FINGER = "9d24s24s4d"  # arrays of a contact come as bytes, at a third of the cost of their numbers

Take = Callable[[Observation], None]


@dataclass(frozen=True, slots=True)
class RowLayout:
    """Where the numbers of an observation stand.

    Attributes:
        fingers: How many,
        joints: of the arm,
        hand_joints: and of the hand, -1 if there is none.
    """

    fingers: int
    joints: int
    hand_joints: int

    @classmethod
    def of(cls, now: Observation) -> "RowLayout":
        """Return the layout for an observation."""
        return cls(
            len(now.fingers), len(now.arm.joint_position), -1 if now.hand is None else len(now.hand.joint_position)
        )

    @property
    def size(self) -> int:
        """Length of a row."""
        return self.finger(self.fingers)

    def before(self, place: int) -> int:
        """Return where a number of the header, or a finger's time, stands of the last period."""
        return self.size + place

    def joint(self, index: int) -> int:
        """Return where an arm's joint stands; the hand's follow."""
        return HEADER + index

    def finger(self, index: int, part: int = 0) -> int:
        """Return where a part of a finger stands."""
        return HEADER + self.joints + max(self.hand_joints, 0) + FINGER * index + part

    def each_finger(self, part: int) -> range:
        """Return where a part of all fingers stands."""
        return range(self.finger(0, part), self.finger(self.fingers, part), FINGER)


class ObservedRow:
    """Takes observations of one layout.

    Attributes:
        layout: Of a row.
        values: The row, and behind it the one before, shape (2 size,).
        take: Writes an observation. Raises ValueError or struct.error if it has another layout, and whatever comes
            up if it is not what its types say.
    """

    __slots__ = ("layout", "take", "values")

    def __init__(self, layout: RowLayout) -> None:
        """Begin with numbers that are none."""
        self.layout = layout
        buffer = bytearray(16 * layout.size)
        self.values: FloatArray = np.frombuffer(buffer)
        self.values[:] = nan
        self.values[FINGERS], self.values[JOINTS] = layout.fingers, layout.joints
        self.values[HAND_JOINTS] = layout.hand_joints
        one = layout.fingers == 1 and layout.hand_joints < 0
        self.take: Take = _one_finger(layout, buffer) if one else _any_fingers(layout, buffer)

    def keep(self) -> None:
        """Make the row the one before."""
        size = self.layout.size
        self.values[size:] = self.values[:size]

    def follow(self, last: "ObservedRow") -> None:
        """Take over the row before; from another layout its header, which is the same."""
        size, whole = self.layout.size, self.layout == last.layout
        count = size if whole else HEADER
        self.values[size : size + count] = last.values[last.layout.size :][:count]


def _one_finger(layout: RowLayout, buffer: bytearray) -> Take:
    """Return what writes observations of an arm with one finger: a single struct, at two thirds of the time."""
    pack = struct.Struct(f"{24 + layout.joints}d{_FINGER}").pack_into

    def take(now: Observation) -> None:
        arm, (finger,) = now.arm, now.fingers
        if now.hand is not None:
            raise ValueError("a hand came")
        force, contact, health = arm.tip_force_base, finger.contact, finger.health
        x, y, z = arm.rotation_base_tip
        pack(
            buffer,
            8 * TIME,
            now.time,
            arm.time,
            *arm.position_base_tip,
            *x,
            *y,
            *z,
            *arm.velocity_base_tip,
            *arm.angular_velocity_base_tip,
            *(_NO_FORCE if force is None else force),
            force is not None,
            *arm.joint_position,
            finger.time,
            *finger.wrench,
            contact.normal_force,
            contact.spin_torque,
            contact.normal.tobytes(),
            contact.tangential_force.tobytes(),
            contact.status is _OK,
            finger.touching,
            *(_SOUND if health is HEALTHY else _faults(health)),
        )

    return take


def _any_fingers(layout: RowLayout, buffer: bytearray) -> Take:
    """Return what writes observations with any number of fingers, and a hand."""
    joints, hand_joints, count = layout.joints, layout.hand_joints, layout.fingers
    pack_arm = struct.Struct(f"{25 + joints + max(hand_joints, 0)}d").pack_into
    pack_finger = struct.Struct(_FINGER).pack_into
    places = [8 * place for place in layout.each_finger(0)]

    def take(now: Observation) -> None:
        arm, hand = now.arm, now.hand
        force = arm.tip_force_base
        hand_count = -1 if hand is None else len(hand.joint_position)
        if len(now.fingers) != count or len(arm.joint_position) != joints or hand_count != hand_joints:
            raise ValueError("joints, fingers or a hand came or went")
        x, y, z = arm.rotation_base_tip
        pack_arm(
            buffer,
            8 * HAND_TIME,
            nan if hand is None else hand.time,
            now.time,
            arm.time,
            *arm.position_base_tip,
            *x,
            *y,
            *z,
            *arm.velocity_base_tip,
            *arm.angular_velocity_base_tip,
            *(_NO_FORCE if force is None else force),
            force is not None,
            *arm.joint_position,
            *(() if hand is None else hand.joint_position),
        )
        for place, finger in zip(places, now.fingers, strict=True):
            contact, health = finger.contact, finger.health
            pack_finger(
                buffer,
                place,
                finger.time,
                *finger.wrench,
                contact.normal_force,
                contact.spin_torque,
                contact.normal.tobytes(),
                contact.tangential_force.tobytes(),
                contact.status is _OK,
                finger.touching,
                *(_SOUND if health is HEALTHY else _faults(health)),
            )

    return take


def row_of(now: Observation, before: Observation | None) -> ObservedRow:
    """Return an observation as a row, with the last one behind it; for whoever asks once."""
    row = ObservedRow(RowLayout.of(now))
    if before is not None:
        last = ObservedRow(RowLayout.of(before))
        last.take(before)
        last.keep()
        row.follow(last)
    row.take(now)
    return row


def _faults(health: SampleHealth) -> tuple[bool, bool]:
    if health.ok:
        return _SOUND
    too_much = health.measure in TOO_MUCH
    return not too_much, too_much
