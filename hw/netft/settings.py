"""How a sensor on Ethernet is spoken to."""

from dataclasses import dataclass

from palpate.errors import InvalidValueError, check_positive, positive
from palpate.hw.ft_stream.streamed_sensor import StreamSettings
from palpate.hw.netft.rdt import CALIBRATION_PORT, RDT_PORT, OnRobotCommand
from palpate.hw.netft.status import NET_BOX, StatusWords
from palpate.spatial import Wrench


@dataclass(frozen=True, slots=True)
class Scales:
    """What one count is worth.

    Attributes:
        force: Newtons per count; 1 if the counts are raw channels for a sensor file that calibrates.
        moment: Newton metres per count; likewise.
    """

    force: float
    moment: float

    def __post_init__(self) -> None:
        """Refuse what cannot be.

        Raises:
            InvalidValueError: Not above 0.
        """
        check_positive(self, force="N per count", moment="N m per count")


ONROBOT_SCALES = Scales(1.0 / 10_000.0, 1.0 / 100_000.0)
"""Default divisors of OnRobot HEX: 10 000 per N, 100 000 per N m."""

ONROBOT_PERIODS = (0.001, 0.254)
"""Least and largest [s]; the command carries whole milliseconds."""

ONROBOT_FILTERS = (None, 500.0, 150.0, 50.0, 15.0, 5.0, 1.5)
"""Cut-off [Hz] of each value of the filter command; None: no filter."""


@dataclass(frozen=True, slots=True)
class StreamRequest:
    """What is sent before the stream is asked for.

    Attributes:
        command: Of `Command` or `OnRobotCommand`.
        value: In the place of the number of records.
    """

    command: int
    value: int


@dataclass(frozen=True, slots=True)
class NetFtSettings:
    """How the box is asked and its records are read.

    Attributes:
        stream: How the stream is watched.
        scales: Of a count; None: ask the box itself, as every ATI box allows.
        status_words: What its status bits mean.
        first: Sent before the stream is asked for.
        patience: For each step of asking for the calibration [s].
        rdt_port: UDP; another only in tests.
        calibration_port: TCP; another only in tests.
    """

    stream: StreamSettings
    scales: Scales | None = None
    status_words: StatusWords = NET_BOX
    first: tuple[StreamRequest, ...] = ()
    patience: float = 1.0
    rdt_port: int = RDT_PORT
    calibration_port: int = CALIBRATION_PORT

    def __post_init__(self) -> None:
        """Refuse what cannot be.

        Raises:
            InvalidValueError: A port or time that cannot be.
        """
        positive("patience", self.patience, "s")
        for name, port in (("rdt_port", self.rdt_port), ("calibration_port", self.calibration_port)):
            if not 0 < port < 65536:
                raise InvalidValueError(f"{name} = {port}: must be a port, 1 to 65535")


def onrobot_settings(
    noise: Wrench, *, period: float = 0.002, cutoff: float | None = None, rdt_port: int = RDT_PORT
) -> NetFtSettings:
    """Return the settings for an OnRobot HEX (formerly OptoForce) on its Ethernet box.

    Args:
        noise: Standard deviation of one reading at rest [N, N m].
        period: Between records [s], whole milliseconds.
        cutoff: Of the box's filter [Hz], one of `ONROBOT_FILTERS`; None: no filter.
        rdt_port: UDP; another only in tests.

    Raises:
        InvalidValueError: A period or cut-off that the box does not have.
    """
    least, most = ONROBOT_PERIODS
    if not least <= period <= most:
        raise InvalidValueError(f"period = {period!r} s: must be {least:g} to {most:g} s")
    if cutoff not in ONROBOT_FILTERS:
        raise InvalidValueError(f"cutoff = {cutoff!r} Hz: must be one of {ONROBOT_FILTERS}")
    first = (
        StreamRequest(OnRobotCommand.PERIOD, round(1000.0 * period)),
        StreamRequest(OnRobotCommand.FILTER, ONROBOT_FILTERS.index(cutoff)),
    )
    stream = StreamSettings(noise, silent_after=max(0.04, 4.0 * period))
    return NetFtSettings(stream, ONROBOT_SCALES, first=first, rdt_port=rdt_port)
