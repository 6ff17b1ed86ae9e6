"""Which of the requested changes of live parameters took effect, and when."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from palpate.runtime.live import Change


@dataclass(frozen=True, slots=True)
class ChangeOutcome:
    """One change that was requested, and when it took effect.

    Attributes:
        asked: What was asked for; its time counts from the first period [s].
        unit: Of its value, "" for a ratio.
        made: When it took effect, counted likewise [s]; None: the run was over before.
        early: Whether that was before what it changes had begun.
    """

    asked: Change
    unit: str
    made: float | None
    early: bool = False

    @property
    def what(self) -> str:
        """The change as text, with the time at which it took effect or should have."""
        asked = self.asked
        return f"{asked.name} to {asked.value:g} {self.unit}".rstrip() + f" after {self.made or asked.time:.4g} s"


def change_outcomes(
    asked: Sequence[Change],
    made: Sequence[Change],
    units: Mapping[str, str],
    *,
    first: float,
    work: float | None,
) -> tuple[ChangeOutcome, ...]:
    """Return when each change took effect.

    Args:
        asked: Before the run; times count from its first period.
        made: As recorded, in order, on the clock of the run.
        units: Of the parameters, by name.
        first: Time of the first period [s].
        work: When what it changes began, on the same clock [s]: the sweep, or the holding; None if it never did.
    """
    outcomes = []
    for each in sorted(asked, key=lambda change: change.time):
        found = next((done for done in made if _fulfils(done, each, first)), None)
        when = None if found is None else found.time - first
        early = found is not None and (work is None or found.time < work)
        outcomes.append(ChangeOutcome(each, units.get(each.name, ""), when, early))
    return tuple(outcomes)


def _fulfils(done: Change, asked: Change, first: float) -> bool:
    # of two in one period only the later one is made
    late_enough = done.time - first >= asked.time - 1e-9
    return late_enough and (done.name, done.value) == (asked.name, asked.value)


def change_sentences(outcomes: Sequence[ChangeOutcome], duration: float, work: str) -> tuple[str, ...]:
    """Return when the changes took effect, in sentences.

    Args:
        outcomes: Of the changes.
        duration: Of the run [s].
        work: What an early one came before, as in "the force was held".
    """
    kinds = (
        (
            f"Changed before {work}:",
            [each for each in outcomes if each.early],
            "; times count from the start of the run, landing included.",
        ),
        ("Changed:", [each for each in outcomes if each.made is not None and not each.early], "."),
        ("NOT changed:", [each for each in outcomes if each.made is None], f"; the run took {duration:.1f} s."),
    )
    return tuple(f"{begin} {', '.join(each.what for each in some)}{end}" for begin, some, end in kinds if some)


def change_rows(outcomes: Sequence[ChangeOutcome]) -> tuple[tuple[str, str], ...]:
    """Return the changes as settings, name and value."""
    return tuple(
        ("change while running", each.what + ("" if each.made is not None else ": not reached"))
        for each in outcomes
    )
