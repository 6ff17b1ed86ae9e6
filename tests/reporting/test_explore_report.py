"""The report on an exploration: figures that mean something, and whatever is missing, the rest is told."""

import functools
import io
from dataclasses import replace

import numpy as np
import pytest
from rich.console import Console

from palpate.experiments.explore import explore
from palpate.experiments.explore.config import ExploreConfig
from palpate.experiments.explore.report import exploration_report
from palpate.mapping.primitives.sphere import SphereShape
from palpate.reporting.page import report_page
from palpate.reporting.terminal import key_figures
from reporting.test_report import parsed
from support.explore_runs import pictures, section, untrue

pytestmark = pytest.mark.slow  # they look at runs that take seconds


@functools.cache
def exploration(name):
    return explore(ExploreConfig(object=name, speed=0.05, width=0.03, depth=0.03, spacing=0.006))


def figures(report):
    return {figure.name: figure for figure in report.figures}


@pytest.mark.parametrize("name", ["sphere", "ellipsoid", "box", "cylinder"])
def test_the_table_fits_80_columns(name):
    report = exploration_report(exploration(name))
    console = Console(width=80, record=True, file=io.StringIO())
    console.print(key_figures(report.title, report.outcome, report.figures))
    rows = [
        line for line in console.export_text().splitlines() if line.startswith("\N{BOX DRAWINGS LIGHT VERTICAL}")
    ]
    assert len(rows) == len(report.figures)  # none wrapped


def test_a_sphere_has_a_radius_with_a_band_that_holds_it():
    found = exploration("sphere")
    figure = figures(exploration_report(found))["shape"]
    assert figure.value == "sphere"
    assert figure.note.startswith("radius 40")
    assert figure.note.endswith(" mm")
    shape = found.map.shape
    assert isinstance(shape.fit.shape, SphereShape)
    assert abs(shape.fit.shape.radius - 0.04) <= shape.sizes_band[0] < 1e-4


@pytest.mark.parametrize("name", ["ellipsoid", "cylinder"])
def test_the_shape_is_named_and_its_sizes_are_inside_their_bands(name):
    shape = exploration(name).map.shape
    assert shape.kind.value == name
    true = {"ellipsoid": [0.05, 0.04, 0.03], "cylinder": [0.03]}[name]
    assert (np.abs(shape.fit.shape.sizes - true) <= shape.sizes_band).all()


def test_the_flat_top_of_a_box_is_a_plane():
    assert figures(exploration_report(exploration("box")))["shape"].value == "plane"


@pytest.mark.parametrize(("name", "title"), [("ellipsoid", "of an ellipsoid"), ("box", "of a box")])
def test_grammar(name, title):
    assert title in exploration_report(exploration(name)).title


def test_nothing_mapped_nothing_said():
    told = exploration_report(replace(exploration("sphere"), map=None))
    assert not {"shape", "map to true surface, RMS"} & set(figures(told))
    assert not {"The map", "How the map grew", "Which shape it is"} & {each.heading for each in told.sections}


def select(found, kept):
    """An exploration of which only some contacts are known."""
    return replace(found, cloud=found.cloud.select(kept), point_error=found.point_error[kept])


CUTS = {
    "everything": (lambda found: found, 8),
    "nothing-felt": (lambda its: select(replace(its, map=None), np.zeros(len(its.cloud), bool)), 4),
    "one-contact": (lambda found: select(found, np.arange(len(found.cloud)) == 0), 7),
    "no-scan": (lambda its: replace(its, record=replace(its.record, phase=np.full(len(its.record), "x"))), 7),
    "no-error": (lambda found: replace(found, point_error=np.zeros(len(found.cloud))), 7),
}  # fmt: skip
"""What is done to a whole exploration, and how many pictures there are of it at least."""


@pytest.mark.parametrize("cut", CUTS)
def test_whatever_is_missing_the_rest_is_reported(cut):
    change, least = CUTS[cut]
    html = report_page(exploration_report(change(exploration("sphere"))))
    checker = parsed(html)
    assert checker.tags.count("figure") == checker.tags.count("figcaption") >= least
    assert "nan" not in " ".join(checker.text).lower().split()
    assert len(html) < 4_000_000, "small enough to send"


def test_what_only_the_simulation_knows_is_told_of_a_simulation_alone():
    found = exploration("sphere")
    told = exploration_report(untrue(found))
    assert "true" not in pictures(told, "The surface")["Touched surface"].caption
    assert not pictures(told, "Errors of single points")
    assert section(told, "Over time").parts
