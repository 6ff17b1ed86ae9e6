"""Results show themselves in a notebook, and runs how far they have got."""

from palpate.experiments.kit.registry import experiment_named
from palpate.experiments.kit.script import perform
from reporting.test_report import parsed


def test_a_notebook_shows_the_outcome_with_one_picture_and_a_bar_while_it_runs(capsys):
    experiment, seen = experiment_named("regulate"), []
    config = experiment.Config(duration=0.5)
    found = perform(experiment, config, observers=(lambda *period: seen.append(period),), progress=True)
    assert len(seen) > 500
    shown = parsed(found._repr_html_())
    assert shown.tags.count("img") == 1
    assert experiment.report(found).outcome in shown.text
    assert perform(experiment, config).run.duration == found.run.duration, "a bar changes nothing"
