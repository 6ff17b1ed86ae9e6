"""How a run kept time: a section that every report of a run ends with."""

from collections.abc import Iterator
from typing import TYPE_CHECKING

from palpate.reporting.report import Pictures, Section, TextTable
from palpate.reporting.timing_table import timing_rows
from palpate.runtime import RunTiming

if TYPE_CHECKING:
    from palpate.reporting.style import Picture


def computing(timing: RunTiming) -> Section:
    """Return the section on how long periods took to compute, and whether deadlines were kept."""

    def draw() -> "Iterator[Picture | None]":
        from palpate.reporting.timing_picture import timing_picture  # with matplotlib

        yield timing_picture(timing)

    return Section("Computing", (TextTable(timing_rows(timing)), Pictures(draw)))
