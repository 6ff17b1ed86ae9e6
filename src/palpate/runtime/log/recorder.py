"""Hands every period of a run to sinks, for a few microseconds of the loop's time."""

import math
import struct
import time as wall
from collections.abc import Callable
from enum import Enum

from palpate import __version__
from palpate.errors import InvalidValueError
from palpate.runtime.data import Command, Observation, Phase, Sample
from palpate.runtime.live import Change
from palpate.runtime.log.chunk import PERIOD_CHANNEL, PackedRows
from palpate.runtime.log.entries import Event, Level
from palpate.runtime.log.entry_codec import Entry
from palpate.runtime.log.heading import Heading
from palpate.runtime.log.layout import Layout
from palpate.runtime.log.period_codec import PeriodCodec
from palpate.runtime.log.sink import RecordingSummary, Sink
from palpate.sensing.ft.health import Measure

BLOCK_TIME = 0.2
"""Rows wait so long for the sinks [s], by the samples' time. A process that is killed loses these. At 1 kHz the
writer then works in one period of 200: what it costs the loop stays beyond the 99th percentile."""

LARGEST_BLOCK = 2**20
"""Bytes."""


def _numbers(kind: type[Enum]) -> dict[Enum, int]:
    return {member: number for number, member in enumerate(kind)}


_PHASES, _MEASURES = _numbers(Phase), _numbers(Measure)


class Recorder:
    """Packs each period into one row of float64 and hands the rows to the sinks, a block at a time.

    `start` does all that is slow. `record`, `event` and `change` never raise and never wait; what does not fit the
    first sample's layout is dropped, counted and told in the summary. One recorder records one run.
    """

    def __init__(self, *sinks: Sink) -> None:
        """Take the sinks."""
        self._sinks = sinks
        self._summary: RecordingSummary | None = None
        self._layout: Layout | None = None
        self._row = self._first = self._entries = self._lost = 0
        self._misfit: str | None = None

    def start(self, first: Sample, now: Observation, period: float) -> None:
        """Lay out the rows for a run that begins with `first`, and start the sinks.

        Args:
            first: First sample; the later ones must have as many joints, fingers and channels.
            now: What touch made of it.
            period: Control period [s].

        Raises:
            InvalidValueError: It was started already, the sample cannot be laid out, or a sink cannot start.
            OSError: A sink cannot start.
        """
        if self._layout is not None or self._summary is not None:
            raise InvalidValueError("Recorder.start() was called before: make a new recorder for each run")
        if len(now.fingers) != len(first.wrenches):
            raise InvalidValueError(
                f"{len(now.fingers)} fingers observed, {len(first.wrenches)} wrenches sampled: must be as many"
            )
        layout = Layout.of(first)
        heading = Heading(layout, float(period), float(first.time), wall.time_ns(), f"palpate {__version__}")
        self._prepare(layout, heading)
        for sink in self._sinks:
            sink.start(heading)
        self._layout = layout

    def record(
        self, sample: Sample, now: Observation, command: Command, compute_time: float, lateness: float
    ) -> None:
        """Keep one period.

        Args:
            sample: What the devices said.
            now: What touch made of it.
            command: What was commanded, after the supervisor.
            compute_time: That sensing, control and supervision took [s].
            lateness: Of the wake-up that the period began with [s].
        """
        if self._free == 0:
            self._take_new_block()
        block, place = self._block, self._place
        try:
            arm = sample.arm
            row_x, row_y, row_z = arm.rotation_base_tip
            self._pack_arm(
                block,
                place,
                sample.time,
                arm.time,
                *arm.position_base_tip,
                *row_x,
                *row_y,
                *row_z,
                *arm.velocity_base_tip,
                *arm.joint_position,
            )
            place += self._arm_size
            hand = sample.hand
            if hand is not None or self._has_hand:
                self._pack_hand(block, place, hand.time, *hand.joint_position)
                place += self._hand_size
            for given, finger, pack, size in zip(sample.wrenches, now.fingers, self._packs, self._sizes, strict=True):
                contact = finger.contact
                pack(
                    block,
                    place,
                    given.time,
                    *given.wrench,
                    *given.acceleration,
                    *finger.wrench,
                    *contact.centroid.tolist(),
                    *contact.normal.tolist(),
                    *contact.tangential_force.tolist(),
                    contact.normal_force,
                    contact.spin_torque,
                    contact.condition,
                    contact.status,
                    finger.touching,
                    _MEASURES[finger.health.measure],
                )
                place += size
            grip = command.grip_force
            grips = self._no_grip if grip is None else (*grip, *self._padding[len(grip) :], len(grip))
            self._pack_command(
                block,
                place,
                compute_time,
                lateness,
                *command.velocity_base_tip,
                *grips,
                _PHASES[command.phase],
            )
        except Exception as error:  # a recorder must not end a run
            self._drop(error)
            return
        ...
