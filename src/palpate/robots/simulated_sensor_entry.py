"""Simulated force/torque sensors in robot files: what `fingers[].noise` and `fingers[].simulated_sensor` may be.

Plain data: `palpate.robots.simulated_sensor` makes of it what a device does to a load. What is *known* of the
device, a sensor file says (`fingers[].sensor`), or the description that goes with the simulated one.
"""

import msgspec

from palpate.errors import InvalidValueError, not_negative
from palpate.runtime.robot_ranges import at_most, within
from palpate.sensing.ft.preset_sensor import PresetSensor
from palpate.spatial import ZERO, Vector

LARGEST_FORCE, LARGEST_MOMENT = 1e3, 1e3
"""[N, N m] of a simulated sensor: more than the range of any sensor for fingertips and wrists."""

LARGEST_CROSS_TALK = 0.2
"""Of a full load: makers claim 0.01 to 0.02; far beyond, some load would be as good as lost."""

LARGEST_LATENCY = 1.0
"""[s]. More is a number in milliseconds."""

LARGEST_RATE = 1e6
"""[Hz] of a sensor's samples, or its bandwidth."""

LARGEST_LOSS = 0.5
"""Of all samples: a device that loses more is broken."""

LARGEST_SPECIMEN = 2**31
"""More specimens than any maker ever sold."""

SHORTEST_TARE, LONGEST_TARE = 0.1, 60.0
"""[s]. Shorter, there is too little to average; longer, it is a number in another unit."""


class _Axes(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """A value for each force [N] and each moment [N m], x y z in the sensor frame."""

    force: Vector = msgspec.field(name="force_N")
    moment: Vector = msgspec.field(name="moment_Nm")

    def __post_init__(self) -> None:
        for value in self.force:
            at_most("force_N", value, LARGEST_FORCE, "N")
        for value in self.moment:
            at_most("moment_Nm", value, LARGEST_MOMENT, "N m")


class _Limits(_Axes, frozen=True, kw_only=True):
    """Likewise, above zero."""

    def __post_init__(self) -> None:
        super().__post_init__()
        for key, values in (("force_N", self.force), ("moment_Nm", self.moment)):
            for value in values:
                if not value > 0.0:
                    raise InvalidValueError(f"{key} = {value!r}: must be above 0")


class _Alike(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """One value for the three forces [N] and one for the three moments [N m], 0 or above."""

    force: float = msgspec.field(name="force_N", default=0.0)
    moment: float = msgspec.field(name="moment_Nm", default=0.0)

    def __post_init__(self) -> None:
        for key, value, most, unit in (
            ("force_N", self.force, LARGEST_FORCE, "N"),
            ("moment_Nm", self.moment, LARGEST_MOMENT, "N m"),
        ):
            not_negative(key, value, unit)
            at_most(key, value, most, unit)


class NoiseEntry(_Alike, frozen=True, kw_only=True):
    """White noise of a simulated sensor: standard deviation of a reading, each axis [N, N m]."""


class QuantisationEntry(_Alike, frozen=True, kw_only=True):
    """Steps of its readings, each axis [N, N m]; 0: none."""


class RangeEntry(_Limits, frozen=True, kw_only=True):
    """Full load per axis [N, N m]."""


class SaturationEntry(_Limits, frozen=True, kw_only=True):
    """Where its readings end, per axis [N, N m]."""


class BiasEntry(_Axes, frozen=True, kw_only=True):
    """What it shows without load [N, N m]. Nobody knows it unless the sensor file says it or it is tared."""

    force: Vector = msgspec.field(name="force_N", default=ZERO)
    moment: Vector = msgspec.field(name="moment_Nm", default=ZERO)


class DriftEntry(_Axes, frozen=True, kw_only=True):
    """How its zero moves while it warms up.

    Attributes:
        force: By how much in the end, per axis [N].
        moment: Likewise [N m].
        time_constant: In which 63 % of it are over [s].
    """

    force: Vector = msgspec.field(name="force_N", default=ZERO)
    moment: Vector = msgspec.field(name="moment_Nm", default=ZERO)
    time_constant: float = msgspec.field(name="time_constant_s")

    def __post_init__(self) -> None:
        super().__post_init__()
        within("time_constant_s", self.time_constant, 1e-3, 1e6, "s")


class FirstOrderEntry(
    msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True, tag_field="kind", tag="first_order"
):
    """A single pole; the power is halved at `cutoff` [Hz]."""

    cutoff: float = msgspec.field(name="cutoff_Hz")

    def __post_init__(self) -> None:
        within("cutoff_Hz", self.cutoff, 1e-3, LARGEST_RATE, "Hz")


class SecondOrderEntry(
    msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True, tag_field="kind", tag="second_order"
):
    """A resonance, or a filter of second order.

    Attributes:
        natural_frequency: [Hz].
        damping: Up to 1; sqrt(1/2) is Butterworth's.
    """

    natural_frequency: float = msgspec.field(name="natural_frequency_Hz")
    damping: float = 0.5**0.5

    def __post_init__(self) -> None:
        within("natural_frequency_Hz", self.natural_frequency, 1e-3, LARGEST_RATE, "Hz")
        if not 0.0 < self.damping <= 1.0:
            raise InvalidValueError(f"damping = {self.damping!r}: must be above 0, at most 1")


class SimulatedSensorEntry(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """How a finger's simulated sensor misbehaves: one of a kind, and what of it is to be otherwise.

    Its noise stands beside it (`fingers[].noise`). What is left out is the preset's; 0 takes an imperfection away.

    Attributes:
        preset: Kind of sensor: see `palpate.sim.sensor.presets`.
        specimen: Which one of its kind: the same number has the same cross-talk and drift in every run.
        range: Full load; needed with the preset `perfect`, which has none.
        cross_talk: Largest error that a full load on one axis makes on another, over that one's full load.
        bandwidth: Of structure and filters in the device.
        bias: What it shows without load.
        drift: How that moves.
        quantisation: Steps of its readings.
        saturation: Where they end.
        sample_rate: Of the device's own clock [Hz]; 0: it samples whenever it is read.
        latency: From sampling until it can be read [s].
        lost_share: Of samples that get lost in transit.
        tare: For so long before the run its readings in free air are averaged, to find its bias [s]; 0: never.
    """

    preset: PresetSensor = PresetSensor.PERFECT
    specimen: int = 0
    range: RangeEntry | None = None
    cross_talk: float | None = None
    bandwidth: FirstOrderEntry | SecondOrderEntry | None = None
    bias: BiasEntry | None = None
    drift: DriftEntry | None = None
    quantisation: QuantisationEntry | None = None
    saturation: SaturationEntry | None = None
    sample_rate: float | None = msgspec.field(name="sample_rate_Hz", default=None)
    latency: float | None = msgspec.field(name="latency_s", default=None)
    lost_share: float | None = None
    tare: float = msgspec.field(name="tare_s", default=0.0)

    def __post_init__(self) -> None:
        if not 0 <= self.specimen <= LARGEST_SPECIMEN:
            raise InvalidValueError(
                f"specimen = {self.specimen}: must be a whole number from 0 to {LARGEST_SPECIMEN}"
            )
        for key, value, most, unit in (
            ("cross_talk", self.cross_talk, LARGEST_CROSS_TALK, "of a full load"),
            ("sample_rate_Hz", self.sample_rate, LARGEST_RATE, "Hz"),
            ("latency_s", self.latency, LARGEST_LATENCY, "s"),
            ("lost_share", self.lost_share, LARGEST_LOSS, "of all samples"),
        ):
            if value is not None:
                within(key, value, 0.0, most, unit)
        if self.tare != 0.0:
            within("tare_s", self.tare, SHORTEST_TARE, LONGEST_TARE, "s, or 0")
        if self.preset is PresetSensor.PERFECT and self.range is None and self.cross_talk:
            raise InvalidValueError(
                f"cross_talk = {self.cross_talk:g}: is a share of the full load: give range, or a preset"
            )
