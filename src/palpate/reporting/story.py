"""What every report says besides its pictures: numbers and words, no drawing."""

from dataclasses import dataclass

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
