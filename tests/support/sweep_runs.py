"""Sweeps of the smallest runs there are, and a runner without processes."""

from dataclasses import dataclass, field, replace

from palpate.commands.sweep import SweepConfig
from palpate.commands.sweep.attempt import attempt
from palpate.commands.sweep.plan import sweep_plan
from palpate.runtime.batch import BatchProgress, Success
from support.tiny_experiment import TINY

SHORT = ("time=0.02", "noise=0.01")
"""A run of a twentieth of a second, whose seed matters."""

TYPED = ["sweep", TINY, "--vary", "force=1,2", "--vary", "speed=0.01,0.02", "--seeds", "2", "--set", *SHORT]
"""Eight of them, as typed."""

NOT_FIGURES = {"duration_s", "host"}
"""Columns that depend on who does a run."""


def planned(*vary, seeds=1, fixed=SHORT, experiment=TINY, **more):
    """The plan of a sweep."""
    config = SweepConfig(experiment, tuple((each,) for each in vary), (tuple(fixed),), seeds, **more)
    return sweep_plan(config)


def config_of(run):
    """What is done in a run."""
    return replace(run.combination.config, seed=run.case.seed)


@dataclass
class InProcess:
    """Does runs one after the other in this process: the plain loop that every other runner must agree with."""

    interrupted_after: int | None = None
    done: list[int] = field(default_factory=list)

    def describe(self):
        return "here"

    def run(self, cases, progress, longest):
        for count, case in enumerate(cases):
            if count == self.interrupted_after:
                raise KeyboardInterrupt
            record = attempt(case)
            self.done.append(case.run)
            outcome = Success(case, record, record.duration)
            progress(BatchProgress(len(cases), count + 1, 0, record.duration, count, outcome))
