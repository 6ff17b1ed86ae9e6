"""One short recorded exploration for all."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from palpate.experiments.explore.config import ExploreConfig
from palpate.experiments.explore.experiment import Explore
from palpate.experiments.kit.recorded_run import RecordedRun
from palpate.experiments.kit.recording import log_writer
from palpate.runtime import Ending
from palpate.runtime.log import Log, read_log
from support.explore_runs import plan_of


@dataclass(frozen=True)
class Run:
    planned: Any
    periods: list[Any]
    path: Path
    log: Log


@pytest.fixture(scope="session")
def short_run(tmp_path_factory):
    """Two seconds on an ellipsoid: plan, what observers saw, and the log."""
    folder = tmp_path_factory.mktemp("viewed")
    planned = plan_of(ExploreConfig(object="ellipsoid", width=0.01, depth=0.004, speed=0.05, out=folder))
    periods: list[Any] = []
    log = log_writer(Explore(), planned, folder)
    result = RecordedRun(planned).run((lambda *period: periods.append(period),), (log,))
    assert result.ending is Ending.DONE
    path = (folder / "latest.mcap").resolve()
    return Run(planned, periods, path, read_log(path))
