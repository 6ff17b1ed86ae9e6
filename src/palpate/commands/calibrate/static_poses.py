"""Static poses, as `palpate calibrate payload` and `mounting` read them, with their noise and likely mistakes."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TypedDict, TypeVar

from rich.console import Console

from palpate.commands.calibrate.config import MountingConfig, PayloadConfig
from palpate.commands.calibrate.data import CsvData, MeasuredPoses, measured_poses, read_csv
from palpate.commands.calibrate.steps import loaded, measured, noted, refuse_overwriting, target
from palpate.errors import FloatArray, InvalidValueError
from palpate.estimation import BrokenAssumption
from palpate.experiments.kit.checks import check_file
from palpate.sensing.ft import IdentifiedPayload, SensorFile
from palpate.sensing.ft.pose_mistakes import likely_mistake
from palpate.sensing.ft.poses import GRAVITY_SD, STANDARD_GRAVITY
from palpate.spatial import Vector

Found = TypeVar("Found")


class PoseNoise(TypedDict):
    """Standard deviations of static poses: of forces [N], moments [N m], and of g, relative."""

    force_sd: float
    moment_sd: float
    gravity_sd: float


@dataclass(frozen=True, slots=True, eq=False)
class PoseReadings:
    """Readings of a sensor in static poses, as a file of poses gives them; n poses.

    Attributes:
        sensor: Sensor file before the calibration.
        data: The file.
        wrenches: Calibrated readings, shape (n, 6) [N, N m].
        source: Columns that they come from, in words.
        poses: The poses.
        noise: Standard deviations.
        gravity: Local g [m/s^2].
        up_base: Upward direction in base coordinates.
    """

    sensor: SensorFile
    data: CsvData
    wrenches: FloatArray
    source: str
    poses: MeasuredPoses
    noise: PoseNoise
    gravity: float
    up_base: Vector

    def mistakes(
        self, as_read: IdentifiedPayload | None, identify: Callable[[FloatArray, FloatArray], IdentifiedPayload]
    ) -> tuple[BrokenAssumption, ...]:
        """Return the likely mistake in the orientations, if one explains the readings better.

        Args:
            as_read: Payload that the orientations give as they are; None if they give none.
            identify: Identifies a payload from specific forces and wrenches.
        """
        rotation = self.poses.rotation_sensor_base
        if rotation is None:
            return ()
        found = likely_mistake(
            rotation, self.wrenches, as_read, identify, gravity=self.gravity, up_base=self.up_base
        )
        return () if found is None else (found,)


def read_poses(config: PayloadConfig | MountingConfig) -> PoseReadings:
    """Read the files of a command; that its output can be written is checked before.

    Raises:
        InvalidValueError: A file cannot be read or written, or is wrong.
    """
    sensor = loaded(config.sensor)
    check_file(target(config))
    refuse_overwriting(config.out, config.poses)
    data = read_csv(config.poses)
    rows, source = measured(data, sensor, config.channels)
    gravity = config.gravity or STANDARD_GRAVITY
    poses = measured_poses(data, config.rotation, config.up, gravity)
    root = math.sqrt(config.averaged)
    noise = PoseNoise(
        force_sd=max(sensor.noise_force) / root,
        moment_sd=max(sensor.noise_moment) / root,
        gravity_sd=GRAVITY_SD if config.gravity is None else 0.0,
    )
    return PoseReadings(sensor, data, rows, source, poses, noise, gravity, config.up)


def identified(
    identify: Callable[[FloatArray, FloatArray], Found],
    specific_force: FloatArray,
    wrench: FloatArray,
    mistakes: Callable[[], Sequence[BrokenAssumption]],
) -> Found:
    """Return what poses identify.

    Raises:
        InvalidValueError: They identify nothing; the message names likely mistakes, too.
    """
    try:
        return identify(specific_force, wrench)
    except InvalidValueError as error:
        raise InvalidValueError("; ".join(map(str, (error, *mistakes())))) from None


def zero_moved(found: IdentifiedPayload, console: Console) -> tuple[str, ...]:
    """Note that the zero moved, if it did."""
    if not found.zero.moves:
        return ()
    return noted(
        f"the zero moved by {found.zero_span_force:.2g} N and {found.zero_span_moment:.2g} N m during the poses: "
        "tare before use.",
        console,
    )
