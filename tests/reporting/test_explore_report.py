"""The report on an exploration: key figures that mean something and fit a terminal."""

import dataclasses
import functools
import io

import pytest
from rich.console import Console

from palpate.experiments.explore import explore
from palpate.experiments.explore_config import ExploreConfig
from palpate.experiments.explore_report import exploration_report
from palpate.reporting import summary_table


@functools.cache
def exploration(name):
    return explore(ExploreConfig(object=name, speed=0.08, width=0.03, depth=0.03, spacing=0.006))


def figures(report):
    return {figure.name: figure for figure in report.summary}


@pytest.mark.parametrize("name", ["sphere", "ellipsoid", "box", "cylinder"])
def test_the_table_fits_80_columns(name):
    report = exploration_report(exploration(name))
    console = Console(width=80, record=True, file=io.StringIO())
    console.print(summary_table(report))
    rows = [
        line for line in console.export_text().splitlines() if line.startswith("\N{BOX DRAWINGS LIGHT VERTICAL}")
    ]
    assert len(rows) == len(report.summary)  # none wrapped


def test_a_sphere_has_a_radius_with_its_standard_deviation():
    figure = figures(exploration_report(exploration("sphere")))["fitted sphere, radius"]
    assert figure.value == pytest.approx(40.0, rel=0.01)
    assert len(figure.text.replace(".", "")) == 5
    assert figure.note.startswith("sd ")
    assert figure.note.endswith(" mm, true 40 mm")


def test_a_box_has_none():
    assert "fitted sphere, radius" not in figures(exploration_report(exploration("box")))


def test_nothing_fitted_nothing_said():
    nothing = dataclasses.replace(exploration("sphere"), sphere=None)
    assert "fitted sphere, radius" not in figures(exploration_report(nothing))


@pytest.mark.parametrize(("name", "title"), [("ellipsoid", "of an ellipsoid"), ("box", "of a box")])
def test_grammar(name, title):
    assert title in exploration_report(exploration(name)).title
