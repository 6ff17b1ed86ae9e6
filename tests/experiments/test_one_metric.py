"""A metric or a finding that is added to an experiment in one place appears in all places."""

import json

import pytest

from palpate.cli import main
from palpate.commands.compare.runs import compared_metrics, read_runs
from palpate.commands.sweep.attempt import attempt
from palpate.commands.sweep.store import columns_of, rows_of
from palpate.experiments.explore.experiment import Explore
from palpate.experiments.kit.metric import Finding, Metric
from support.sweep_runs import planned

SHORT = {"width": "0.004", "depth": "0.002", "speed": "0.04", "object": "sphere"}

MEAN_FORCE = Metric(
    "mean_force_n",
    "mean of the felt force",
    "N",
    lambda result: float(result.cloud.normal_force.mean()),
    "mN",
    note="a note",
)

FINDING = Finding(lambda result: len(result.cloud) > 0, "It was felt.", "Feel more of it.")


@pytest.fixture
def added(monkeypatch):
    monkeypatch.setattr(Explore, "metrics", (*Explore.metrics, MEAN_FORCE))
    monkeypatch.setattr(Explore, "findings", (*Explore.findings, FINDING))


def explored(out, *more):
    words = [word for name, value in SHORT.items() for word in (f"--{name}", value)]
    return main(["explore", *words, "--out", str(out), *more])


def test_a_metric_is_in_terminal_json_report_sweep_and_comparison(added, tmp_path, capsys):
    explored(tmp_path / "a")
    printed = capsys.readouterr().out
    explored(tmp_path / "b", "--json")
    document = json.loads(capsys.readouterr().out)
    value = document["metrics"][MEAN_FORCE.key]
    assert value == pytest.approx(2.0, rel=0.1)
    assert document["notes"][MEAN_FORCE.key] == "a note"
    row = next(line for line in printed.splitlines() if MEAN_FORCE.meaning in line)
    assert f"{1e3 * value:.0f}" in row
    assert "mN" in row
    page = (tmp_path / "a" / "report.html").read_text()
    for text in (MEAN_FORCE.meaning, "It was felt.", "Feel more of it."):
        assert text in page
    compared = {each.key: each for each in compared_metrics(read_runs((tmp_path / "a", tmp_path / "b")))}
    assert compared[MEAN_FORCE.key].values == (value, value)
    plan = planned("force=1,2", experiment="explore", fixed=[f"{name}={each}" for name, each in SHORT.items()])
    assert MEAN_FORCE.key in columns_of(plan)
    (swept,) = rows_of(plan, [attempt(plan.runs[1].case)])
    assert swept[MEAN_FORCE.key] == pytest.approx(value, rel=1e-6)


def test_no_key_stands_twice_and_every_key_ends_in_its_unit():
    keys = [metric.key for metric in Explore.metrics]
    assert len(set(keys)) == len(keys)
    suffixes = {"m": "_m", "N": "_n", "s": "_s", "N/m": "_n_per_m", "1/m": "_per_m", "": ""}
    assert all(metric.key.endswith(suffixes[metric.unit]) for metric in Explore.metrics)
