"""One period as one row of float64, packed in place: the part of recording that the loop pays for."""

import math
import struct
from collections.abc import Callable
from dataclasses import replace
from enum import Enum
from itertools import chain

from palpate.runtime.data import Command, HandSample, Observation, Phase, Sample
from palpate.runtime.log.fields import Codes, LogGroup, period_groups
from palpate.runtime.log.layout import Layout
from palpate.runtime.truth import TruthSource
from palpate.sensing.ft.health import HEALTHY, HealthCheck
from palpate.spatial import Vector

Pack = Callable[[bytearray, int, Sample, Observation, Command, float, float], int]
"""Writes a period (with its compute time and lateness [s]) into a block at a place; returns where it ends.

Raises whatever comes up where the period does not fit the layout or is not what its types say (struct.error,
ValueError, AttributeError, ...).
"""

_CONTACT_ARRAYS = ("centroid", "normal", "tangential_force")


def _numbers(kind: type[Enum]) -> dict[Enum, int]:
    return {member: number for number, member in enumerate(kind)}


_PHASES, _MEASURES = _numbers(Phase), _numbers(HealthCheck)
_HEALTHY = _MEASURES[HealthCheck.HEALTHY]


def row_packer(layout: Layout) -> Pack:
    """Return what packs periods of one layout but for their truth, in the order of `period_groups`."""
    layout = replace(layout, truth=())
    if len(layout.channels) == 1 and layout.hand_joints is None:
        return one_finger_packer(layout)
    return any_packer(layout)


def with_truth(pack: Pack, truth: TruthSource) -> Pack:
    """Return what packs a period as `pack` does, and what really happened at its sample after it."""
    numbers = struct.Struct(f"{len(truth.truth_columns)}d")
    pack_numbers, size, row = numbers.pack_into, numbers.size, truth.truth_row

    def packed(
        block: bytearray,
        place: int,
        sample: Sample,
        now: Observation,
        command: Command,
        compute_time: float,
        lateness: float,
    ) -> int:
        place = pack(block, place, sample, now, command, compute_time, lateness)
        pack_numbers(block, place, *row())
        return place + size

    return packed


def one_finger_packer(layout: Layout) -> Pack:
    """Return what packs periods of an arm with one finger: a single struct, a quarter quicker than `any_packer`.

    Like that, it is a closure whose variables are its own. A loop that sleeps most of the time finds nothing in
    the caches: every object that is looked at costs.
    """
    row = _struct(*period_groups(layout, Codes()))
    pack_row, size = row.pack_into, row.size
    (channels,) = layout.channels
    has_force = layout.tip_force
    phases, measures, healthy, healthy_number = _PHASES, _MEASURES, HEALTHY, _HEALTHY
    grips_of, no_grip = _padder("grip forces", layout.grips), _nothing(layout.grips)

    def pack(
        block: bytearray,
        place: int,
        sample: Sample,
        now: Observation,
        command: Command,
        compute_time: float,
        lateness: float,
    ) -> int:
        (given,) = sample.wrenches
        (finger,) = now.fingers
        arm, contact, health = sample.arm, finger.contact, finger.health
        # one joint too few must not go unnoticed for one channel too many; the rest is up to the struct
        if len(given.wrench) != channels or sample.hand is not None or command.finger_velocity is not None:
            raise ValueError("channels, a hand or its fingers' velocities came or went")
        if (arm.tip_force_base is None) is has_force:
            raise ValueError("the arm's own force came or went")
        x, y, z = arm.rotation_base_tip
        pack_row(
            block,
            place,
            sample.time,
            arm.time,
            *arm.position_base_tip,
            *x,
            *y,
            *z,
            *arm.velocity_base_tip,
            *arm.angular_velocity_base_tip,
            *arm.joint_position,
            *(arm.tip_force_base or ()),
            given.time,
            *given.wrench,
            *given.acceleration,
            *finger.wrench,
            contact.centroid.tobytes(),
            contact.normal.tobytes(),
            contact.tangential_force.tobytes(),
            contact.normal_force,
            contact.spin_torque,
            contact.condition,
            contact.status,
            finger.touching,
            healthy_number if health is healthy else measures[health.measure],
            compute_time,
            lateness,
            *command.velocity_base_tip,
            *command.angular_velocity_base_tip,
            *(no_grip if command.grip_force is None else grips_of(command.grip_force)),
            phases[command.phase],
        )
        return place + size

    return pack


def any_packer(layout: Layout) -> Pack:
    """Return what packs periods with any number of fingers, and a hand: each group has a struct of its own."""
    groups = period_groups(layout, Codes())
    has_hand, has_force = layout.hand_joints is not None, layout.tip_force
    arm, hand, after = _struct(*groups[:2]), _struct(groups[2]), _struct(*groups[-2:])
    pack_arm, arm_size = arm.pack_into, arm.size
    pack_after, after_size = after.pack_into, after.size
    packs = tuple((finger.pack_into, finger.size) for finger in map(_struct, groups[2 + has_hand : -2]))
    phases, measures, healthy, healthy_number = _PHASES, _MEASURES, HEALTHY, _HEALTHY
    grips_of, no_grip = _padder("grip forces", layout.grips), _nothing(layout.grips)
    room = layout.finger_velocities
    velocities_of, no_velocity = (
        _padder("numbers of finger velocities", 3 * room),
        _nothing(3 * room) if room else (),
    )

    def pack_hand(block: bytearray, place: int, state: HandSample | None) -> int:
        if state is None or not has_hand:
            raise ValueError("the hand came or went")
        hand.pack_into(block, place, state.time, *state.joint_position)
        return place + hand.size

    def pack(
        block: bytearray,
        place: int,
        sample: Sample,
        now: Observation,
        command: Command,
        compute_time: float,
        lateness: float,
    ) -> int:
        state = sample.arm
        if (state.tip_force_base is None) is has_force:
            raise ValueError("the arm's own force came or went")
        x, y, z = state.rotation_base_tip
        pack_arm(
            block,
            place,
            sample.time,
            state.time,
            *state.position_base_tip,
            *x,
            *y,
            *z,
            *state.velocity_base_tip,
            *state.angular_velocity_base_tip,
            *state.joint_position,
            *(state.tip_force_base or ()),
        )
        place += arm_size
        if has_hand or sample.hand is not None:
            place = pack_hand(block, place, sample.hand)
        for given, finger, (pack_finger, size) in zip(sample.wrenches, now.fingers, packs, strict=True):
            contact, health = finger.contact, finger.health
            pack_finger(
                block,
                place,
                given.time,
                *given.wrench,
                *given.acceleration,
                *finger.wrench,
                contact.centroid.tobytes(),
                contact.normal.tobytes(),
                contact.tangential_force.tobytes(),
                contact.normal_force,
                contact.spin_torque,
                contact.condition,
                contact.status,
                finger.touching,
                healthy_number if health is healthy else measures[health.measure],
            )
            place += size
        pack_after(
            block,
            place,
            compute_time,
            lateness,
            *command.velocity_base_tip,
            *command.angular_velocity_base_tip,
            *(no_grip if command.grip_force is None else grips_of(command.grip_force)),
            *(no_velocity if command.finger_velocity is None else velocities_of(_flat(command.finger_velocity))),
            phases[command.phase],
        )
        return place + after_size

    return pack


def _nothing(room: int) -> tuple[float, ...]:
    """What stands for a tuple that is None: its room, and a count of -1."""
    return (*(math.nan,) * room, -1.0)


def _padder(name: str, room: int) -> Callable[[tuple[float, ...]], tuple[float, ...]]:
    """Return what fills a tuple up to its room and adds its count."""

    def padded(given: tuple[float, ...]) -> tuple[float, ...]:
        if len(given) > room:
            raise ValueError(f"{len(given)} {name}, with room for {room}")
        return (*given, *(math.nan,) * (room - len(given)), len(given))

    return padded


_STILL: Vector = (math.nan, math.nan, math.nan)
"""Stands for no velocity."""


def _flat(velocities: tuple[Vector | None, ...]) -> tuple[float, ...]:
    return tuple(chain.from_iterable(_STILL if velocity is None else velocity for velocity in velocities))


def _struct(*groups: LogGroup) -> struct.Struct:
    """Native doubles; the arrays of a contact come as bytes, at a third of the cost of their numbers."""
    quantities = [quantity for group in groups for quantity in group.fields]
    formats = ["24s" if x.name in _CONTACT_ARRAYS else f"{x.count}d" for x in quantities]
    return struct.Struct("".join(formats))
