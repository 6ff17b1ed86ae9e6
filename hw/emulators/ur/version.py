"""Which controller is emulated."""

from dataclasses import dataclass

from palpate.errors import InvalidValueError


@dataclass(frozen=True, slots=True)
class ControllerVersion:
    """Software of a UR controller.

    Attributes:
        major: 3 for CB3, 5 for e-Series, 10 for PolyScope X.
        minor: Of the release.
        bugfix: Of the release.
        build: Of the release.
    """

    major: int = 5
    minor: int = 14
    bugfix: int = 0
    build: int = 1

    def __post_init__(self) -> None:
        parts = (self.major, self.minor, self.bugfix, self.build)
        if any(not 0 <= part < 2**32 for part in parts) or self.major not in (3, 5, 10):
            raise InvalidValueError(f"controller version {parts}: major must be 3, 5 or 10, the others 0 or above")

    @property
    def rate(self) -> float:
        """Controller cycles per second: 125 of a CB3, 500 of all later ones."""
        return 125.0 if self.major < 5 else 500.0

    @property
    def has_dashboard(self) -> bool:
        """Whether there is a dashboard server; PolyScope X has none."""
        return self.major < 10

    def __str__(self) -> str:
        return f"{self.major}.{self.minor}.{self.bugfix}.{self.build}"
