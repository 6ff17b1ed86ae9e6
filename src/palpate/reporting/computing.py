"""How a run kept time: a section that every report of a run ends with."""

from collections.abc import Iterator

from palpate.reporting.picture import Picture
from palpate.reporting.report import Pictures, Section, TextTable
from palpate.reporting.timing_picture import timing_picture
from palpate.runtime import Distribution, RunTiming

_MICRO = 1e6


def computing(timing: RunTiming) -> Section:
    """Return the section on how long periods took to compute, how old samples were, how deadlines were kept."""

    def draw() -> Iterator[Picture | None]:
        yield timing_picture(timing)

    return Section("Computing", (TextTable(_timing_rows(timing)), Pictures(draw)))


def _timing_rows(timing: RunTiming) -> tuple[tuple[str, str, str, str], ...]:
    """Return rows (name, value, unit, note): what was computed, and, in real time, how deadlines were kept."""
    rows = [
        _row("computing a period, 99 %", timing.compute_spread),
        _row("age of the oldest sample, 99 %", timing.age_spread),
    ]
    if len(timing.lateness):
        rows += [
            _row("start to start of a period, 99 %", timing.period_spread),
            _row("waking up late, 99 %", timing.lateness_spread),
            ("overruns", str(timing.overruns), "", "deadlines that passed before the work was done"),
        ]
    else:
        rows.append(("slower than real time", str(timing.slow_periods), "periods", "simulated: none was late"))
    if timing.note:
        rows.append(("system", "", "", timing.note))
    return tuple(row for row in rows if row[1] or row[3])


def _row(name: str, spread: Distribution) -> tuple[str, str, str, str]:
    if spread.count == 0:
        return (name, "", "", "")
    note = f"median {_MICRO * spread.p50:.0f}, max {_MICRO * spread.largest:.0f} µs of {spread.count}"
    return (name, f"{_MICRO * spread.p99:.0f}", "µs", note)
