"""Static poses, as `palpate calibrate payload` and `mounting` take them: how noisy they are, what is told."""

import math
from collections.abc import Callable, Sequence
from typing import TypedDict, TypeVar

from rich.console import Console

from palpate.commands.calibrate.config import MountingConfig, PayloadConfig
from palpate.commands.calibrate.steps import noted
from palpate.errors import FloatArray, InvalidValueError
from palpate.estimation import BrokenAssumption
from palpate.sensing.ft import IdentifiedPayload, SensorFile
from palpate.sensing.ft.poses import GRAVITY_SD

Found = TypeVar("Found")


class PoseNoise(TypedDict):
    """Standard deviations of static poses: of forces [N], moments [N m], and of g, relative."""

    force_sd: float
    moment_sd: float
    gravity_sd: float


def pose_noise(config: PayloadConfig | MountingConfig, sensor: SensorFile) -> PoseNoise:
    """Return how noisy averaged readings are, and how well g is known."""
    root = math.sqrt(config.averaged)
    return PoseNoise(
        force_sd=max(sensor.noise_force) / root,
        moment_sd=max(sensor.noise_moment) / root,
        gravity_sd=GRAVITY_SD if config.gravity is None else 0.0,
    )


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
