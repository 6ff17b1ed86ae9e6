"""What carrying out a run of a sweep takes, whatever the experiment."""

from collections.abc import Mapping

from palpate.commands.run_told import Recordable, log_writer
from palpate.commands.sweep.swept import Found
from palpate.experiments.kit.figure import FigureValue
from palpate.runtime import Ending, RunResult
from palpate.runtime.log import Sink


def sinks_of(planned: Recordable, keep: bool) -> tuple[Sink, ...]:
    """Return where a run is recorded: nowhere, unless its report and log are kept."""
    return (log_writer(planned),) if keep else ()


def found_in(result: RunResult, figures: Mapping[str, FigureValue]) -> Found:
    """Return what a run came to."""
    return Found(result.ending is Ending.DONE, str(result), figures)
