"""Slip of a held tool, from the place where it touches a thing that stands still."""

from palpate.spatial import ZERO, Matrix, Vector


class PlaceWatch:
    """Tells when a place that should stand still has moved. One call of `step` per period."""

    moved: Vector = ZERO
    """[m] how far, when the alarm is raised."""

    def __init__(self, period: float, false_alarm_time: float = 3600.0) -> None:
        """Take the period [s], and how long it takes on average, or longer, from one false alarm to the next [s]."""

    def start(self) -> None:
        """Something else is touched now, or the same again."""

    def step(self, place: Vector, covariance: Matrix) -> bool:
        """Take where the tool is felt to touch, base frame [m], its covariance [m^2]; return whether it has moved."""
        raise NotImplementedError
