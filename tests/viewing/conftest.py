"""One short recorded exploration for all."""

from dataclasses import dataclass, replace
from typing import Any

import pytest

from palpate.commands.view.command import watched_backend
from palpate.commands.view.scene import plans_of_log
from palpate.experiments.explore.config import ExploreConfig
from palpate.experiments.explore.experiment import Explore
from palpate.experiments.kit.from_log import LoggedRun
from palpate.experiments.kit.recorded_run import RecordedRun
from palpate.experiments.kit.recording import log_writer
from palpate.runtime import Ending
from palpate.runtime.log import Log, log_in, read_log
from support.explore_runs import plan_of


@dataclass(frozen=True)
class Run:
    planned: Any
    periods: list[Any]
    log: Log

    @property
    def scene(self):
        """Without the surface that grows, which a process makes."""
        return replace(self.planned.view(), surface=None)

    @property
    def plans(self):
        return plans_of_log(LoggedRun.of(self.log))


@pytest.fixture(scope="session")
def short_run(tmp_path_factory):
    """Two seconds on an ellipsoid: plan, what observers saw, and the log."""
    folder = tmp_path_factory.mktemp("viewed")
    planned = plan_of(ExploreConfig(object="ellipsoid", width=0.01, depth=0.004, speed=0.05, out=folder))
    periods: list[Any] = []
    log = log_writer(Explore(), planned, folder)
    result = RecordedRun(planned).run((lambda *period: periods.append(period),), (log,))
    assert result.ending is Ending.DONE
    return Run(planned, periods, read_log(log_in(folder)))


@pytest.fixture
def live_run(tmp_path):
    """A plan and its run, which goes as fast as in reality, to be watched."""
    planned = plan_of(ExploreConfig(width=0.01, depth=0.004, speed=0.01, out=tmp_path))
    return planned, RecordedRun(planned, watched_backend(planned, 1.0))
