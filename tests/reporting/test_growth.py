"""How a map grew: only ever more of it, better known, and a picture that says so."""

import dataclasses

import numpy as np
import pytest

from mapping.raster import RADIUS, sphere_cap
from palpate.controllers.paths import Mark, PathEvent
from palpate.experiments.explore import explore
from palpate.experiments.explore.config import ExploreConfig
from palpate.experiments.explore.growth_picture import growth_picture
from palpate.experiments.explore.map_growth import SHARES, MapGrowth, map_growth
from palpate.experiments.explore.report import exploration_report
from palpate.experiments.explore.snapshots_picture import snapshots_picture
from palpate.mapping import SurfaceMap
from palpate.mapping.mesh_figures import MeshFigures, triangle_areas, voxel_for
from palpate.mapping.surface_map.mesh import surface_mesh
from palpate.reporting.plots import plots
from palpate.runtime.shown_plan import PlanChange, ShownMark, ShownPlan
from support.drawn import panels as drawn_panels
from support.explore_runs import pictures, section

GREW = "How the map grew"
pytestmark = pytest.mark.slow  # they look at runs that take seconds


@pytest.fixture(scope="module")
def exploration():
    config = ExploreConfig(object="ellipsoid", speed=0.05, width=0.014, depth=0.01, force_noise=0.01)
    return explore(config)


@pytest.fixture(scope="module")
def growth(exploration) -> MapGrowth:
    assert exploration.growth is not None
    return exploration.growth


def test_more_and_more_is_known(growth, exploration):
    """Area never shrinks, path length, time and contacts neither, and the end is the map that was made."""
    curve = growth.curve
    for value in (curve.time, curve.contacts, curve.path_length):
        assert (np.diff(value) >= 0.0).all()
    assert (np.diff(curve.area) >= -0.02 * curve.area[-1]).all(), "but for ragged edges"
    whole = MeshFigures.of(exploration.map.mesh)
    assert curve.area[-1] == pytest.approx(whole.area, rel=0.05)
    assert curve.middle[-1] == pytest.approx(whole.middle, rel=0.1)
    known = np.isfinite(curve.middle)
    assert (curve.middle <= curve.tail)[known].all()
    assert (known == (curve.area > 0.0)).all()
    assert curve.contacts[-1] == len(exploration.cloud)


def test_snapshots_show_shares_of_the_path(growth):
    curve = growth.curve
    assert curve.path_length / curve.path_length[-1] == pytest.approx(SHARES, abs=0.01)
    for moment, each in enumerate(growth.snapshots):
        done = float(np.linalg.norm(np.diff(each.done[:, :2], axis=0), axis=1).sum())
        assert done <= curve.path_length[moment] + 1e-3
        assert len(each.mesh.triangles) == 0 or curve.area[moment] > 0.0
    assert not len(growth.snapshots[-1].to_go), "nothing is left at the end"
    middle = growth.snapshots[SHARES.index(0.3)]
    assert middle.to_go[0] == pytest.approx(middle.done[-1]), "it goes on from where the tip is"


def test_marks_come_when_they_were_made(exploration):
    record, middle = exploration.record, exploration.record.time[len(exploration.record.time) // 2]
    mark = ShownMark("edge", (0.0, 0.0, 0.1))
    plans = (
        PlanChange(record.time[0], ShownPlan("stroke", ((0.0, 0.0, 0.0),))),
        PlanChange(middle, ShownPlan("", (), (0.0, 0.0, 1.0), (mark,))),
    )
    grown = map_growth(exploration.cloud, record, exploration.map.surface, plans)
    for time, each in zip(grown.curve.time, grown.snapshots, strict=True):
        assert tuple(each.marks) == ((mark,) if time >= middle - record.time[0] else ())


def test_the_report_has_it(exploration):
    assert set(pictures(exploration_report(exploration), GREW)) == {"Growth of the map", "The map while it grew"}


def test_nothing_felt_nothing_grown(exploration):
    nothing = exploration.cloud.select(np.zeros(len(exploration.cloud), bool))
    assert map_growth(nothing, exploration.record, exploration.map.surface, ()) is None
    assert section(exploration_report(dataclasses.replace(exploration, map=None)), GREW) is None


def test_steps_share_scale_and_frame_and_name_what_they_show(growth):
    marks = tuple(Mark(event, (1e-3 * i, 0.0, 0.1), "why") for i, event in enumerate(PathEvent))
    last = dataclasses.replace(growth.snapshots[-1], marks=marks)
    picture = snapshots_picture(dataclasses.replace(growth, snapshots=(*growth.snapshots[:-1], last)))
    (space,) = drawn_panels(picture)
    (steps,) = space.marks
    assert len(steps.marks) == len(picture.steps) == len(SHARES)
    colours = [c for marks in steps.marks for mark in marks for c in getattr(mark, "colourings", ())]
    assert {(each.low, each.high) for each in colours} == {(0.0, 1e6 * growth.largest_sd)}
    named = {mark.name for marks in steps.marks for mark in marks}
    assert named == {"map", "path of the tip", "tip", "still to go", *(event.value for event in PathEvent)}
    assert "100 % of the path" in picture.steps[picture.step]
    assert "1 x edge" in picture.caption
    ends = plots(picture)[0]["layout"]["scene"]["xaxis"]["range"]
    assert ends[0] < 1e3 * min(each.done[:, 0].min() for each in growth.snapshots), "the frame of all steps"


def test_curves_are_over_path_length_time_and_contacts(growth):
    panels = drawn_panels(growth_picture(growth))
    assert [panel.x.label for panel in panels[:3]] == ["path length [mm]", "time [s]", "contacts"]
    assert all(np.array_equal(panel.marks[0].y, 1e4 * growth.curve.area) for panel in panels[:3])
    assert len({(mark.colour, mark.dash) for mark in panels[3].marks}) == len(panels[3].marks), "a line each"


def test_where_nothing_counts_as_observed_no_curve_is_drawn(growth, exploration):
    nothing = dataclasses.replace(growth.curve, area=0.0 * growth.curve.area)
    empty = tuple(dataclasses.replace(each, mesh=surface_mesh(SurfaceMap())) for each in growth.snapshots)
    other = dataclasses.replace(exploration)
    vars(other)["growth"] = MapGrowth(nothing, empty)  # in the place of what it would compute
    drawn = pictures(exploration_report(other), GREW)
    ((title, picture),) = drawn.items()
    assert title == "The map while it grew"
    assert "nothing of the surface counts as observed" in picture.caption
    assert "nan" not in picture.caption + " ".join(picture.steps)


def test_figures_of_a_mesh_are_those_of_its_area():
    """A cap of a sphere: area by its height, and half of it below the median."""
    cloud = sphere_cap(half=0.008, row=0.002)
    mesh = surface_mesh(SurfaceMap.learned(cloud))
    figures = MeshFigures.of(mesh)
    x, y = mesh.vertices[:, 0], mesh.vertices[:, 1]
    # the plan of the mesh, stretched by 1 / n_z
    plan = np.ptp(x) * np.ptp(y)
    assert plan * 0.9 < figures.area < plan * (1.0 + 0.5 * (0.0114 / RADIUS) ** 2) * 1.02
    area, sd = triangle_areas(mesh.vertices, mesh.triangles), mesh.sd[mesh.triangles].mean(axis=1)
    assert area[sd <= figures.middle].sum() == pytest.approx(0.5 * figures.area, rel=0.02)
    assert area[sd <= figures.tail].sum() == pytest.approx(0.95 * figures.area, rel=0.02)
    bigger = dataclasses.replace(mesh, vertices=3.0 * mesh.vertices)
    assert MeshFigures.of(bigger).area == pytest.approx(9.0 * figures.area)


@pytest.mark.parametrize("size", [0.005, 0.05, 0.5])
def test_a_mesh_stays_small(size):
    points = np.random.default_rng(0).uniform(0.0, size, (1000, 3)) * [1.0, 1.0, 0.1]
    voxel = voxel_for(points, 5e-4, 3000)
    assert voxel >= 5e-4
    assert (size / voxel) ** 2 <= 3000
    assert voxel_for(np.zeros((0, 3)), 5e-4, 3000) == 5e-4
