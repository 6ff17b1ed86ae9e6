"""One run of a sweep: the one function that every worker calls, whoever runs it."""

import platform
import time
import traceback
from dataclasses import dataclass
from typing import Any

from palpate.commands.sweep.record import RunRecord, RunStatus
from palpate.commands.sweep.swept import EXPERIMENTS
from palpate.experiments.kit.versions import versions


@dataclass(frozen=True, slots=True, eq=False)
class RunCase:
    """What a worker is given.

    Attributes:
        run: Number of the run.
        digest: Of what is asked.
        experiment: Name.
        config: Of the experiment, with its seed.
        keep: Whether report and log are written, into the folder of the configuration.
    """

    run: int
    digest: str
    experiment: str
    config: Any
    keep: bool = False


def attempt(case: RunCase) -> RunRecord:
    """Do a run. What it raises is told in its record; figures depend on the configuration alone."""
    began = time.perf_counter()
    try:
        carrier = EXPERIMENTS[case.experiment].carrier
        began = time.perf_counter()  # the first run of a process imports for seconds: that is not its own
        found = carrier.carry_out(case.config, case.keep)
    except Exception as error:
        return RunRecord(
            run=case.run,
            digest=case.digest,
            seed=case.config.seed,
            status=RunStatus.FAILED,
            message=one_line("".join(traceback.format_exception_only(error))),
            traceback=traceback.format_exc(),
            duration=time.perf_counter() - began,
            host=platform.node(),
            versions=versions(),
        )
    return RunRecord(
        run=case.run,
        digest=case.digest,
        seed=case.config.seed,
        status=RunStatus.DONE if found.done else RunStatus.UNFINISHED,
        message="" if found.done else one_line(found.ending),
        duration=time.perf_counter() - began,
        host=platform.node(),
        figures=dict(found.figures),
        versions=versions(),
    )


def without_result(case: RunCase, status: RunStatus, error: str, trace: str = "") -> RunRecord:
    """Return the record of a run that could not write its own."""
    return RunRecord(
        run=case.run,
        digest=case.digest,
        seed=case.config.seed,
        status=status,
        message=one_line(error),
        traceback=trace,
    )


def one_line(text: str) -> str:
    """Return a text without line breaks."""
    return " ".join(text.split())
