"""The report on an exploration: key figures that mean something and fit a terminal."""

import dataclasses
import functools
import io

import numpy as np
import pytest
from rich.console import Console

from palpate.experiments.explore import explore
from palpate.experiments.explore.config import ExploreConfig
from palpate.experiments.explore.report import exploration_report
from palpate.mapping.primitives.sphere import SphereShape
from palpate.reporting.terminal import key_figures
from support.explore_runs import section


@functools.cache
def exploration(name):
    return explore(ExploreConfig(object=name, speed=0.08, width=0.03, depth=0.03, spacing=0.006))


def figures(report):
    return {figure.name: figure for figure in report.figures}


@pytest.mark.slow
@pytest.mark.parametrize("name", ["sphere", "ellipsoid", "box", "cylinder"])
def test_the_table_fits_80_columns(name):
    report = exploration_report(exploration(name))
    console = Console(width=80, record=True, file=io.StringIO())
    console.print(key_figures(report.title, report.outcome, report.figures))
    rows = [
        line for line in console.export_text().splitlines() if line.startswith("\N{BOX DRAWINGS LIGHT VERTICAL}")
    ]
    assert len(rows) == len(report.figures)  # none wrapped


@pytest.mark.slow
def test_a_sphere_has_a_radius_with_a_band_that_holds_it():
    found = exploration("sphere")
    figure = figures(exploration_report(found))["shape"]
    assert figure.value == "sphere"
    assert figure.note.startswith("radius 40")
    assert figure.note.endswith(" mm")
    shape = found.map.shape
    assert isinstance(shape.fit.shape, SphereShape)
    assert abs(shape.fit.shape.radius - 0.04) <= shape.sizes_band[0] < 1e-4


@pytest.mark.slow
@pytest.mark.parametrize("name", ["ellipsoid", "cylinder"])
def test_the_shape_is_named_and_its_sizes_are_inside_their_bands(name):
    shape = exploration(name).map.shape
    assert shape.kind.value == name
    true = {"ellipsoid": [0.05, 0.04, 0.03], "cylinder": [0.03]}[name]
    assert (np.abs(shape.fit.shape.sizes - true) <= shape.sizes_band).all()


@pytest.mark.slow
def test_the_flat_top_of_a_box_is_a_plane():
    assert figures(exploration_report(exploration("box")))["shape"].value == "plane"


@pytest.mark.slow
def test_nothing_mapped_nothing_said():
    nothing = dataclasses.replace(exploration("sphere"), map=None)
    told = exploration_report(nothing)
    assert not {"shape", "map to true surface, RMS"} & set(figures(told))
    assert section(told, "The map") is None
    assert section(told, "Which shape it is") is None


@pytest.mark.slow
@pytest.mark.parametrize(("name", "title"), [("ellipsoid", "of an ellipsoid"), ("box", "of a box")])
def test_grammar(name, title):
    assert title in exploration_report(exploration(name)).title
