"""What measures touches: an arm and a force/torque sensor."""

from dataclasses import dataclass

from palpate.errors import not_negative, positive
from palpate.sensing.ft.arrays import positive_entries


@dataclass(frozen=True, slots=True)
class Instrument:
    """What measures.

    Attributes:
        position_sd: How exactly the arm's place repeats [m].
        ranges: Of the sensor, shape (6,) [N, N m]; needed for `accuracy` alone.
        accuracy: Standard deviation of every entry of the sensor's matrix, of a full load; a tenth of the maker's
            claim for all errors together is usual between axes.
    """

    position_sd: float = 1e-5
    ranges: tuple[float, ...] = (1.0,) * 6
    accuracy: float = 0.0

    def __post_init__(self) -> None:
        positive("position_sd", self.position_sd, "m")
        positive_entries("ranges", self.ranges, 6, "N, N m")
        not_negative("accuracy", self.accuracy, "")
