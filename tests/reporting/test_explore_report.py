"""The report on an exploration: its metrics, the growth of its map, and reports of runs that lack something."""

import functools
import io
import re
from dataclasses import replace

import numpy as np
import pytest
from rich.console import Console

from mapping.raster import RADIUS, sphere_cap
from palpate.controllers.paths import Mark, PathEvent
from palpate.experiments.explore import explore
from palpate.experiments.explore.config import ExploreConfig
from palpate.experiments.explore.experiment import Explore
from palpate.experiments.explore.map_growth import (
    PATH_SHARES,
    MapGrowth,
    growth_figure,
    map_growth,
    snapshots_figure,
)
from palpate.mapping import SurfaceMap
from palpate.mapping.mesh_metrics import MeshMetrics, triangle_areas, voxel_for
from palpate.mapping.surface_map.mesh import surface_mesh
from palpate.reporting.page import report_page
from palpate.reporting.plots import plots
from palpate.reporting.report import quantity_table
from palpate.runtime.shown_plan import PlanChange, ShownMark, ShownPlan
from reporting.test_report import parsed
from support.drawn import panels as drawn_panels
from support.explore_runs import pictures, section, untrue

GREW = "How the map grew"
pytestmark = pytest.mark.slow  # they look at runs that take seconds


@functools.cache
def exploration(name):
    return explore(ExploreConfig(object=name, speed=0.05, width=0.03, depth=0.03, spacing=0.006))


def metrics(report):
    return {metric.name: metric for metric in report.metrics}


@pytest.mark.parametrize(
    ("name", "title", "shape", "sizes", "note"),
    [
        ("sphere", "of a sphere", "sphere", [0.04], r"radius 40.* mm"),
        ("ellipsoid", "of an ellipsoid", "ellipsoid", [0.05, 0.04, 0.03], ".*"),
        ("box", "of a box", "plane", None, ".*"),
        ("cylinder", "of a cylinder", "cylinder", [0.03], ".*"),
    ],
)
def test_each_object_is_named_with_sizes_inside_their_bands_in_a_table_of_80_columns(
    name, title, shape, sizes, note
):
    found = exploration(name)
    report = Explore().report(found)
    assert title in report.title
    console = Console(width=80, record=True, file=io.StringIO())
    console.print(quantity_table(report.metrics, report.title, report.outcome))
    rows = [line for line in console.export_text().splitlines() if line.startswith("\u2502")]
    assert len(rows) == len(report.metrics), "a row is wrapped"
    metric = metrics(report)["shape"]
    assert metric.value == shape
    assert re.fullmatch(note, metric.note)
    if sizes:
        assert (np.abs(found.map.shape.fit.shape.sizes - sizes) <= found.map.shape.sizes_band).all()
    if shape == "sphere":
        assert found.map.shape.sizes_band[0] < 1e-4


def test_without_a_map_its_figures_and_sections_are_left_out():
    report = Explore().report(replace(exploration("sphere"), map=None))
    assert not {"shape", "map to true surface, RMS"} & set(metrics(report))
    assert not {"The map", GREW, "Which shape it is"} & {each.heading for each in report.sections}


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
    html = report_page(Explore().report(change(exploration("sphere"))))
    checker = parsed(html)
    assert checker.tags.count("figure") == checker.tags.count("figcaption") >= least
    assert "nan" not in " ".join(checker.text).lower().split()
    assert len(html) < 4_000_000, "small enough to send"


def test_a_report_of_a_real_run_claims_no_truth():
    report = Explore().report(untrue(exploration("sphere")))
    assert "true" not in pictures(report, "The surface")["Touched surface"].caption
    assert not pictures(report, "Errors of single points")
    assert section(report, "Over time").parts


@pytest.fixture(scope="module")
def noisy():
    """An exploration of a small patch with a noisy force."""
    return explore(ExploreConfig(object="ellipsoid", speed=0.05, width=0.014, depth=0.01, force_noise=0.01))


@pytest.fixture(scope="module")
def growth(noisy) -> MapGrowth:
    return noisy.growth


def test_more_and_more_is_known(growth, noisy):
    """Area never shrinks, path length, time and contacts neither, and the end is the map that was made."""
    curve = growth
    assert (np.diff([curve.time, curve.contacts, curve.path_length]) >= 0.0).all()
    assert (np.diff(curve.area) >= -0.02 * curve.area[-1]).all(), "but for ragged edges"
    whole = MeshMetrics.of(noisy.map.mesh)
    assert curve.area[-1] == pytest.approx(whole.area, rel=0.05)
    assert curve.middle[-1] == pytest.approx(whole.middle, rel=0.1)
    known = np.isfinite(curve.middle)
    assert (curve.middle <= curve.tail)[known].all()
    assert (known == (curve.area > 0.0)).all()
    assert curve.contacts[-1] == len(noisy.cloud)


def test_snapshots_show_shares_of_the_path(growth):
    curve = growth
    assert curve.path_length / curve.path_length[-1] == pytest.approx(PATH_SHARES, abs=0.01)
    for moment, each in enumerate(growth.snapshots):
        done = float(np.linalg.norm(np.diff(each.done[:, :2], axis=0), axis=1).sum())
        assert done <= curve.path_length[moment] + 1e-3
        assert len(each.mesh.triangles) == 0 or curve.area[moment] > 0.0
    assert not len(growth.snapshots[-1].to_go), "nothing is left at the end"
    middle = growth.snapshots[PATH_SHARES.index(0.3)]
    assert middle.to_go[0] == pytest.approx(middle.done[-1]), "it goes on from where the tip is"


def test_marks_come_when_they_were_made(noisy):
    begin, middle = noisy.record.time[0], noisy.record.time[len(noisy.record.time) // 2]
    mark = ShownMark("edge", (0.0, 0.0, 0.1))
    plans = (
        PlanChange(begin, ShownPlan("stroke", ((0.0, 0.0, 0.0),))),
        PlanChange(middle, ShownPlan("", (), (0.0, 0.0, 1.0), (mark,))),
    )
    grown = map_growth(noisy.cloud, noisy.record, noisy.map.surface, plans)
    for time, each in zip(grown.time, grown.snapshots, strict=True):
        assert tuple(each.marks) == ((mark,) if time >= middle - begin else ())


def test_steps_share_scale_and_frame_and_name_what_they_show(growth):
    marks = tuple(Mark(event, (1e-3 * i, 0.0, 0.1), "why") for i, event in enumerate(PathEvent))
    last = replace(growth.snapshots[-1], marks=marks)
    picture = snapshots_figure(replace(growth, snapshots=(*growth.snapshots[:-1], last)))
    (space,) = drawn_panels(picture)
    (steps,) = space.marks
    assert len(steps.marks) == len(picture.steps) == len(PATH_SHARES)
    colours = [c for marks in steps.marks for mark in marks for c in getattr(mark, "colourings", ())]
    assert {(each.low, each.high) for each in colours} == {(0.0, 1e6 * growth.largest_sd)}
    named = {mark.name for marks in steps.marks for mark in marks}
    assert named == {"map", "path of the tip", "tip", "still to go", *(event.value for event in PathEvent)}
    assert "100 % of the path" in picture.steps[picture.step]
    assert "1 x edge" in picture.caption
    ends = plots(picture)[0]["layout"]["scene"]["xaxis"]["range"]
    assert ends[0] < 1e3 * min(each.done[:, 0].min() for each in growth.snapshots), "the frame of all steps"


def test_the_section_of_growth_has_curves_over_path_length_time_and_contacts(growth, noisy):
    assert set(pictures(Explore().report(noisy), GREW)) == {"Growth of the map", "The map while it grew"}
    panels = drawn_panels(growth_figure(growth))
    assert [panel.x.label for panel in panels[:3]] == ["path length [mm]", "time [s]", "contacts"]
    assert all(np.array_equal(panel.marks[0].y, 1e4 * growth.area) for panel in panels[:3])
    assert len({(mark.colour, mark.dash) for mark in panels[3].marks}) == len(panels[3].marks), "a line each"


def test_where_nothing_counts_as_observed_no_curve_is_drawn(growth, noisy):
    untouched = noisy.cloud.select(np.zeros(len(noisy.cloud), bool))
    assert map_growth(untouched, noisy.record, noisy.map.surface, ()) is None
    empty = tuple(replace(each, mesh=surface_mesh(SurfaceMap())) for each in growth.snapshots)
    nothing = replace(growth, area=0.0 * growth.area, snapshots=empty)
    other = replace(noisy)
    vars(other)["growth"] = nothing  # in the place of what it would compute
    ((title, picture),) = pictures(Explore().report(other), GREW).items()
    assert title == "The map while it grew"
    assert "nothing of the surface counts as observed" in picture.caption
    assert "nan" not in picture.caption + " ".join(picture.steps)


def test_figures_of_a_mesh_are_those_of_its_area():
    """A cap of a sphere: area by its height, and half of it below the median."""
    cloud = sphere_cap(half=0.008, row=0.002)
    mesh = surface_mesh(SurfaceMap.learned(cloud))
    metrics = MeshMetrics.of(mesh)
    x, y = mesh.vertices[:, 0], mesh.vertices[:, 1]
    # the plan of the mesh, stretched by 1 / n_z
    plan = np.ptp(x) * np.ptp(y)
    assert plan * 0.9 < metrics.area < plan * (1.0 + 0.5 * (0.0114 / RADIUS) ** 2) * 1.02
    area, sd = triangle_areas(mesh.vertices, mesh.triangles), mesh.sd[mesh.triangles].mean(axis=1)
    assert area[sd <= metrics.middle].sum() == pytest.approx(0.5 * metrics.area, rel=0.02)
    assert area[sd <= metrics.tail].sum() == pytest.approx(0.95 * metrics.area, rel=0.02)
    bigger = replace(mesh, vertices=3.0 * mesh.vertices)
    assert MeshMetrics.of(bigger).area == pytest.approx(9.0 * metrics.area)


@pytest.mark.parametrize("size", [0.005, 0.05, 0.5])
def test_a_mesh_stays_small(size):
    points = np.random.default_rng(0).uniform(0.0, size, (1000, 3)) * [1.0, 1.0, 0.1]
    voxel = voxel_for(points, 5e-4, 3000)
    assert voxel >= 5e-4
    assert (size / voxel) ** 2 <= 3000
    assert voxel_for(np.zeros((0, 3)), 5e-4, 3000) == 5e-4
