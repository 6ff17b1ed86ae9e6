"""Description and calibration of one force/torque sensor, as one YAML file.

A sensor file is read strictly: a key that is misspelt or has another unit, a value that cannot be, is refused
with the reason and the place. Written files carry comments and read back to exactly the same numbers.
"""

import datetime
import math
from typing import Annotated

import msgspec
import numpy as np

from palpate.errors import InvalidValueError, not_negative, positive
from palpate.sensing.compensation import SensorPayload
from palpate.sensing.ft.calibration_map import CalibrationMap
from palpate.sensing.ft.filter_specs import FilterSpec
from palpate.spatial import ZERO, Vector, Wrench

VERSION = 1
"""Of the file format, under the key `palpate_sensor`."""

LARGEST_FORCE = 1e6
"""[N]. Beyond any sensor for robots: a number in another unit."""

LARGEST_MOMENT = 1e6
"""[N m], likewise."""

LARGEST_MASS = 1000.0
"""[kg]. More than any arm lifts: a number in grams."""

LARGEST_OFFSET = 2.0
"""[m] from a sensor to the centre of what it carries: more is a number in millimetres."""

LARGEST_RATE = 1e6
"""[Hz] of a sensor's samples."""

SLOWEST_DEVICE = 1e-3
"""Of the rate at which it is read: slower, a device gives fewer samples than a touch takes."""

SAME_RATE = 1.05
"""Of the device's rate: one read no faster than that has nothing to repeat, but for the drift of two clocks."""

LARGEST_DELAY = 1.0
"""[s] of a sensor: more is a number in milliseconds."""

LARGEST_CONDITION = 1e8
"""Of the calibration matrix, rows scaled: beyond, half of float64's digits are gone, and with
them a row; a useful sensor has less than 100."""

Row = Annotated[tuple[float, ...], msgspec.Meta(min_length=6, max_length=64)]
"""One entry per raw channel."""

COLDEST, WARMEST = -50.0, 150.0
"""[degrees Celsius] of a sensor: beyond, a number in kelvins or of something else."""


class ProductEntry(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """What of a sensor that is not linear depends on a product of two readings.

    Attributes:
        channels: The two, counted from 0, the lower one first; the same twice: a square.
        column: What it adds to Fx Fy Fz Mx My Mz [N or N m per raw unit squared].
    """

    channels: tuple[int, int]
    column: Wrench = msgspec.field(name="column_N_Nm_per_raw_unit2")


class CalibrationEntry(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """How raw channels become a wrench: wrench = matrix u + sum of column u_i u_j, u = raw - offset.

    Attributes:
        raw_unit: Of the channels ("V", "counts").
        matrix: Six rows (Fx Fy Fz Mx My Mz) of k numbers [N or N m per raw unit].
        offset: What the k channels show without load [raw unit].
        raw_range: Lowest and highest reading of a channel that is not saturated [raw unit].
        condition: Condition number of the calibration, scaled by the ranges; None if not known.
        products: What is beyond a line; none of a linear sensor.
        temperature: At which all this holds [degrees Celsius]; None if not known.
    """

    raw_unit: str
    matrix: Annotated[tuple[Row, ...], msgspec.Meta(min_length=6, max_length=6)] = msgspec.field(
        name="matrix_N_Nm_per_raw_unit"
    )
    offset: Row = msgspec.field(name="offset_raw_unit")
    raw_range: tuple[float, float] = msgspec.field(name="range_raw_unit")
    condition: float | None = None
    products: Annotated[tuple[ProductEntry, ...], msgspec.Meta(max_length=256)] = ()
    temperature: float | None = msgspec.field(name="temperature_C", default=None)

    def __post_init__(self) -> None:
        _one_line("raw_unit", self.raw_unit)
        _ = self.map  # refuses what cannot be
        if self.temperature is not None and not COLDEST <= self.temperature <= WARMEST:
            raise InvalidValueError(
                f"temperature_C = {self.temperature!r}: must be from {COLDEST:g} to {WARMEST:g}"
            )
        low, high = self.raw_range
        if not (math.isfinite(low) and math.isfinite(high) and low < high):
            raise InvalidValueError(f"range_raw_unit = [{low}, {high}]: must be finite, the lower one first")
        for j, zero in enumerate(self.offset):
            if not low < zero < high:
                raise InvalidValueError(
                    f"offset_raw_unit, channel {j + 1}, is {zero:g}: out of range_raw_unit, [{low:g}, {high:g}]"
                )
        if self.condition is not None and not 1.0 <= self.condition <= LARGEST_CONDITION:
            raise InvalidValueError(f"condition = {self.condition!r}: must be from 1 to {LARGEST_CONDITION:g}")

    @property
    def map(self) -> CalibrationMap:
        """The map from raw channels to the wrench."""
        columns = [product.column for product in self.products]
        rows = tuple((*row, *(column[i] for column in columns)) for i, row in enumerate(self.matrix))
        return CalibrationMap(rows, self.offset, tuple(product.channels for product in self.products))


class PayloadEntry(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """What the sensor carries.

    Attributes:
        mass: [kg].
        center_of_mass: In the sensor frame [m].
        mass_sd: Standard deviation of the mass [kg]; 0: taken as exact.
        center_of_mass_sd: Likewise of the centre, per axis [m].
    """

    mass: float = msgspec.field(name="mass_kg", default=0.0)
    center_of_mass: Vector = msgspec.field(name="center_of_mass_m", default=ZERO)
    mass_sd: float = msgspec.field(name="mass_sd_kg", default=0.0)
    center_of_mass_sd: Vector = msgspec.field(name="center_of_mass_sd_m", default=ZERO)

    def __post_init__(self) -> None:
        not_negative("mass_kg", self.mass, "kg")
        _at_most("mass_kg", self.mass, LARGEST_MASS, "kg")
        for x in self.center_of_mass:
            _at_most("center_of_mass_m", x, LARGEST_OFFSET, "m")
        not_negative("mass_sd_kg", self.mass_sd, "kg")
        _at_most("mass_sd_kg", self.mass_sd, LARGEST_MASS, "kg")
        for x in self.center_of_mass_sd:
            not_negative("center_of_mass_sd_m", x, "m")
            _at_most("center_of_mass_sd_m", x, LARGEST_OFFSET, "m")

    @property
    def payload(self) -> SensorPayload:
        """The same, as compensation takes it."""
        return SensorPayload(self.mass, self.center_of_mass)


class ContactEntry(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """When a force counts as contact.

    Attributes:
        touch_force: A force above this [N] for `touch_time` [s] is a touch,
        release_force: and it ends below this [N] for `release_time` [s].
        touch_time: See `touch_force`.
        release_time: See `release_force`.
    """

    touch_force: float = msgspec.field(name="touch_force_N")
    release_force: float = msgspec.field(name="release_force_N")
    touch_time: float = msgspec.field(name="touch_time_s", default=0.0)
    release_time: float = msgspec.field(name="release_time_s", default=0.0)

    def __post_init__(self) -> None:
        positive("touch_force_N", self.touch_force, "N")
        positive("release_force_N", self.release_force, "N")
        for name, time in (("touch_time_s", self.touch_time), ("release_time_s", self.release_time)):
            not_negative(name, time, "s")
            _at_most(name, time, LARGEST_DELAY, "s")
        if self.release_force > self.touch_force:
            raise InvalidValueError(
                f"release_force_N = {self.release_force:g}: must not exceed touch_force_N = {self.touch_force:g}"
            )


class SensorFile(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """One sensor: how it is read, and what is known of it. Units stand in the keys of the file.

    Attributes:
        palpate_sensor: Version of the format.
        model: Maker and model.
        serial_number: Of the sensor.
        date: When this was determined, as YYYY-MM-DD.
        provenance: How, from what, by whom.
        sample_rate: How often it is read [Hz]: for this rate its filters are made.
        device_rate: How often the device itself samples [Hz], if that is less: each reading then comes several
            times. None: every reading is a fresh one.
        device_delay: From the load to the reading that shows it, on the average [s]: filters in the device, its
            transmission to the reader, half a sample of a slower device.
        force_range: Largest force the sensor bears, per axis [N].
        moment_range: Largest moment, per axis [N m].
        noise_force: Standard deviation of a reading, per axis [N].
        noise_moment: Likewise [N m].
        bias_force: What the (calibrated) sensor shows without load and payload [N].
        bias_moment: Likewise [N m].
        payload: What it carries.
        filters: What its wrench passes, in this order.
        contact: When a force counts as contact.
        calibration: How raw channels become a wrench; None if the device gives wrenches.
    """

    palpate_sensor: int = VERSION
    model: str
    serial_number: str
    date: str
    provenance: str
    sample_rate: float = msgspec.field(name="sample_rate_Hz")
    device_rate: float | None = msgspec.field(name="device_rate_Hz", default=None)
    device_delay: float = msgspec.field(name="device_delay_s", default=0.0)
    force_range: Vector = msgspec.field(name="force_range_N")
    moment_range: Vector = msgspec.field(name="moment_range_Nm")
    noise_force: Vector = msgspec.field(name="noise_force_N")
    noise_moment: Vector = msgspec.field(name="noise_moment_Nm")
    bias_force: Vector = msgspec.field(name="bias_force_N", default=ZERO)
    bias_moment: Vector = msgspec.field(name="bias_moment_Nm", default=ZERO)
    payload: PayloadEntry = msgspec.field(default_factory=PayloadEntry)
    filters: Annotated[tuple[FilterSpec, ...], msgspec.Meta(max_length=8)] = ()
    contact: ContactEntry
    calibration: CalibrationEntry | None = None

    def __post_init__(self) -> None:
        if self.palpate_sensor != VERSION:
            raise InvalidValueError(
                f"palpate_sensor = {self.palpate_sensor!r}: this palpate reads version {VERSION}"
            )
        for name in ("model", "serial_number", "provenance"):
            _one_line(name, getattr(self, name))
        _calendar_date(self.date)
        positive("sample_rate_Hz", self.sample_rate, "Hz")
        _at_most("sample_rate_Hz", self.sample_rate, LARGEST_RATE, "Hz")
        if self.device_rate is not None:
            positive("device_rate_Hz", self.device_rate, "Hz")
            if not SLOWEST_DEVICE * self.sample_rate <= self.device_rate <= self.sample_rate:
                raise InvalidValueError(
                    f"device_rate_Hz = {self.device_rate:g}: must be from {SLOWEST_DEVICE:g} of sample_rate_Hz, "
                    f"{self.sample_rate:g}, up to it; leave it out if every reading is a fresh one"
                )
        not_negative("device_delay_s", self.device_delay, "s")
        _at_most("device_delay_s", self.device_delay, LARGEST_DELAY, "s")
        self._check_axes("force", "N", LARGEST_FORCE)
        self._check_axes("moment", "Nm", LARGEST_MOMENT)
        for stage in self.filters:
            stage.section(self.sample_rate)
        if self.calibration is not None:
            _check_rank(self.calibration.matrix, (*self.force_range, *self.moment_range))

    @property
    def repeats(self) -> int:
        """How often the same sample of the device is read, at most."""
        return repeats(self.sample_rate, self.device_rate)

    @property
    def bias(self) -> Wrench:
        """(bias_force, bias_moment) [N, N m]."""
        return (*self.bias_force, *self.bias_moment)

    @property
    def noise(self) -> Wrench:
        """(noise_force, noise_moment) [N, N m]."""
        return (*self.noise_force, *self.noise_moment)

    @property
    def axis_limits(self) -> Wrench:
        """(force_range, moment_range) [N, N m]."""
        return (*self.force_range, *self.moment_range)

    def _check_axes(self, kind: str, unit: str, largest: float) -> None:
        ranges: Vector = getattr(self, f"{kind}_range")
        noises: Vector = getattr(self, f"noise_{kind}")
        biases: Vector = getattr(self, f"bias_{kind}")
        for axis, limit, noise, bias in zip("xyz", ranges, noises, biases, strict=True):
            positive(f"{kind}_range_{unit}, {axis}", limit, unit)
            _at_most(f"{kind}_range_{unit}, {axis}", limit, largest, unit)
            positive(f"noise_{kind}_{unit}, {axis}", noise, unit)
            if noise >= limit:
                raise InvalidValueError(
                    f"noise_{kind}_{unit}, {axis}, is {noise:g}: must be below the range, {limit:g}; another unit?"
                )
            if not abs(bias) <= limit:
                raise InvalidValueError(
                    f"bias_{kind}_{unit}, {axis}, is {bias:g}: must be within the range, {limit:g}; another unit?"
                )


def repeats(sample_rate: float, device_rate: float | None) -> int:
    """Return how often the same sample of a device is read, at most.

    Args:
        sample_rate: At which it is read [Hz].
        device_rate: At which it samples [Hz]; None: whenever it is read.
    """
    if device_rate is None or sample_rate <= SAME_RATE * device_rate:
        return 1
    return math.ceil(sample_rate / device_rate * (1.0 - 1e-12))


def _one_line(name: str, text: str) -> None:
    if not text.strip() or not text.isprintable() or len(text) > 1000:
        raise InvalidValueError(f"{name} = {text[:40]!r}: must be one line of 1 to 1000 printable characters")


def _calendar_date(text: str) -> None:
    try:
        exact = datetime.date.fromisoformat(text).isoformat() == text
    except ValueError:
        exact = False
    if not exact:
        raise InvalidValueError(f"date = {text[:40]!r}: must be a day as YYYY-MM-DD, for instance 2026-01-31")


def _at_most(name: str, value: float, largest: float, unit: str) -> None:
    if not abs(value) <= largest:
        raise InvalidValueError(f"{name} = {value!r}: must be at most {largest:g} {unit} in size; another unit?")


def _check_rank(matrix: tuple[tuple[float, ...], ...], limits: Wrench) -> None:
    with np.errstate(over="ignore", under="ignore"):
        scaled = np.array(matrix) / np.array(limits)[:, None]
        rows = np.linalg.norm(scaled, axis=1)
    if not (np.isfinite(rows).all() and (rows > 0.0).all()):
        bad = int(np.argmin(np.isfinite(rows) & (rows > 0.0)))
        raise InvalidValueError(
            f"calibration.matrix_N_Nm_per_raw_unit, row {bad + 1}, is zero or far beyond the range of the sensor"
        )
    # Rows of unit length, so that a range typed wrong by a factor is not mistaken for a lost row.
    singular = np.linalg.svd(scaled / rows[:, None], compute_uv=False)
    if not singular[-1] * LARGEST_CONDITION > singular[0]:
        raise InvalidValueError(
            "calibration.matrix_N_Nm_per_raw_unit has rank 5 or less: its six rows must be independent; is one "
            "copied twice?"
        )
