"""What every report says besides its pictures: numbers and words, no drawing."""

from dataclasses import dataclass
from typing import Protocol

from palpate.reporting.data import KeyFigure

NOTHING = "Nothing has to be done."
"""Said where there is no advice."""


@dataclass(frozen=True, slots=True)
class Story:
    """What every report says, in the order in which it does.

    Attributes:
        title: Heading.
        asked: What was asked for, a sentence without its full stop; "" to say nothing.
        outcome: How it ended, a sentence or more.
        figures: Most important first.
        advice: What to do now, a sentence or two each; none where nothing has to be done.
        repeat: What is repeated, and the command that does so.
        settings: Name and value with unit of each setting.
        footer: In what frame, and of what, the numbers are: a sentence or more.
    """

    title: str
    asked: str
    outcome: str
    figures: tuple[KeyFigure, ...]
    advice: tuple[str, ...] = ()
    repeat: tuple[tuple[str, str], ...] = ()
    settings: tuple[tuple[str, str], ...] = ()
    footer: str = ""


class RunReport(Protocol):
    """What the data of a run's report have in common; see `Story` for each."""

    @property
    def title(self) -> str:
        """Heading."""
        ...

    @property
    def asked(self) -> str:
        """What was asked for."""
        ...

    @property
    def outcome(self) -> str:
        """How it ended."""
        ...

    @property
    def summary(self) -> tuple[KeyFigure, ...]:
        """Key figures."""
        ...

    @property
    def advice(self) -> tuple[str, ...]:
        """What to do now."""
        ...

    @property
    def repeat(self) -> tuple[tuple[str, str], ...]:
        """What is repeated, and how."""
        ...

    @property
    def settings(self) -> tuple[tuple[str, str], ...]:
        """Name and value of each setting."""
        ...


def story_of(report: RunReport, footer: str) -> Story:
    """Return what the report of a run says.

    Args:
        report: Its data.
        footer: In what frame, and of what, the numbers are.
    """
    return Story(
        report.title,
        report.asked,
        report.outcome,
        report.summary,
        report.advice,
        report.repeat,
        report.settings,
        footer,
    )
