"""What became of a retreat is told wherever a trip is."""

from dataclasses import replace

import pytest

from palpate.experiments.explore import explore
from palpate.experiments.explore.config import ExploreConfig
from palpate.experiments.explore.report import outcome as exploration_outcome
from palpate.experiments.regulate.report import outcome as regulation_outcome
from palpate.runtime import Ending, Trip
from support.regulate_runs import regulated

AFTER = "backed off 5.0 mm within 0.31 s, felt at most 31 N and 0 N at the end"
TRIP = Trip(1.25, "contact force", "31 N", "20 N")


@pytest.mark.slow
@pytest.mark.parametrize("aftermath", ["", AFTER], ids=["stood still", "retreated"])
def test_a_result_and_its_reports_tell_of_the_retreat(aftermath):
    exploration = explore(ExploreConfig(width=0.006, depth=0.002))
    regulation = regulated(duration=0.2)
    trip = replace(TRIP, aftermath=aftermath)
    run = replace(exploration.run, ending=Ending.TRIPPED, trip=trip)
    said = f"{TRIP}; {AFTER}" if aftermath else str(TRIP)
    assert run.why == said
    assert str(run).startswith(f"stopped by the supervisor ({said}) after ")
    for told in (
        exploration_outcome(replace(exploration, run=run)),
        regulation_outcome(replace(regulation, run=run)),
    ):
        assert told.startswith(f"Stopped by the supervisor: {said}; the robot is at rest.")
    assert replace(run, trip=None).why == ""
