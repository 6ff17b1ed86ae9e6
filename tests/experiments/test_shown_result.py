"""Results show themselves in a notebook, and runs how far they have got."""

import pytest

from palpate.experiments.explore.exploration import Exploration
from palpate.experiments.friction.result import FrictionResult
from palpate.experiments.grasp.result import Grasp
from palpate.experiments.kit.registry import experiment_named
from palpate.experiments.kit.script import perform
from palpate.experiments.regulate.result import Regulation
from reporting.test_report import parsed


@pytest.mark.parametrize("kind", [Exploration, FrictionResult, Grasp, Regulation])
def test_a_result_names_its_experiment(kind):
    assert experiment_named(kind.experiment).name == kind.experiment


def test_a_notebook_shows_the_outcome_with_one_picture_and_a_bar_while_it_runs(capsys):
    experiment, seen = experiment_named("regulate"), []
    config = experiment.Config(duration=0.5)
    found = perform(experiment, config, observers=(lambda *period: seen.append(period),), progress=True)
    assert len(seen) > 500
    shown = parsed(found._repr_html_())
    assert shown.tags.count("img") == 1
    assert experiment.report(found).outcome in shown.text
    assert perform(experiment, config).run.duration == found.run.duration, "a bar changes nothing"
