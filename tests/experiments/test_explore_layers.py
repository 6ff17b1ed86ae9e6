"""Stiffness and curvature as layers of an explored map: what is known of them, where, and that it is true."""

import re
from dataclasses import replace

import numpy as np
import pytest
import trimesh

from palpate.controllers import SineForce
from palpate.errors import InvalidValueError
from palpate.experiments.explore import explore
from palpate.experiments.explore.config import ExploreConfig
from palpate.experiments.explore.experiment import Explore
from palpate.experiments.explore.report import settings
from palpate.experiments.explore.surface_figure import LAYER_LOOKS
from palpate.experiments.explore.tables import layer_rows
from palpate.mapping.layers import VertexLayer
from palpate.reporting.solids import quantities
from palpate.runtime import Ending
from support.explore_runs import pictures, plan_of, section
from support.run_bounds import above, below, check_bounds

SMALL = ExploreConfig(width=0.012, depth=0.004, spacing=0.004)
OBJECT = 2.0 * SMALL.stiffness
"""Of the object alone: tip and object share the compression by halves."""


@pytest.fixture(scope="module")
def swung():
    """Explored with a force that swings."""
    return explore(replace(SMALL, force_swing=0.5))


@pytest.fixture(scope="module")
def steady():
    """Likewise with a steady one."""
    return explore(SMALL)


# --- stiffness ---


@pytest.mark.slow
def test_the_stiffness_is_that_of_the_object_within_what_is_claimed(swung):
    layer = swung.map.stiffness
    known = np.isfinite(layer.mean)
    assert known.mean() > 0.5
    # the windows of so small a raster are few, and neighbours share them: one estimate
    assert np.abs(layer.mean - OBJECT)[known].max() < 3.0 * layer.sd[known].max()
    assert np.median(layer.mean[known]) == pytest.approx(OBJECT, rel=0.2)


@pytest.mark.slow
def test_an_edge_tells_no_stiffness_though_the_force_errs_there():
    edge = ExploreConfig(object="box", size=(0.03, 0.02, 0.02), strategy="contour", curve="edge", speed=0.04)
    assert np.isnan(explore(edge).map.stiffness.mean).all()


@pytest.mark.slow
def test_where_the_force_does_not_vary_nothing_is_said_of_stiffness(steady):
    assert np.isnan(steady.map.stiffness.mean).all()
    assert not any("stiffness" in row[0] for row in layer_rows(steady.map))
    assert not any("stiffness" in metric.name for metric in Explore().report(steady).metrics)


@pytest.mark.slow
def test_a_softer_object_is_felt_as_softer():
    """The simulated contact is damped, which at 1 Hz passes for a fifth more stiffness where it is soft."""
    layer = explore(replace(SMALL, force_swing=0.5, stiffness=10e3)).map.stiffness
    assert abs(np.nanmedian(layer.mean) - 20e3) < 2.0 * np.nanmedian(layer.sd)
    assert np.nanmedian(layer.sd) < 5e3


@pytest.mark.slow
def test_the_force_follows_its_swing_and_the_points_stay_on_the_surface(swung, steady):
    held = swung.scanning
    time = swung.record.time[held] - swung.record.time[held][0]
    assert swung.set_force[held] == pytest.approx(2.0 + 0.5 * np.sin(2.0 * np.pi * time), abs=1e-9)
    assert (swung.set_force[~held] == 2.0)[: np.argmax(held)].all()
    felt = np.polyfit(swung.set_force[held], swung.true_normal_force[held], 1)[0]
    assert felt == pytest.approx(1.0, abs=0.1)
    bounds = below(force_rms=0.05, point_rms=5e-6) | above(map__covered=0.95)  # 25 um of compression come and go
    check_bounds(swung, bounds, run__ending=Ending.DONE)
    assert swung.map.budget.compression > steady.map.budget.compression


def test_a_force_that_swings_is_told():
    planned = plan_of(replace(SMALL, force_swing=0.5, force_period=2.0))
    assert planned.profile == SineForce(2.0, 0.5, 0.5)
    controller = planned.controller()
    with pytest.raises(InvalidValueError, match="force = 3 N: must lie between 2 and 2 N"):
        controller.live.request("force", 3.0)  # the profile goes its own way


# --- curvature ---


def test_a_ball_is_bent_alike_everywhere_and_in_every_direction(steady):
    """1 / R: from the map and from how normals turned, as sure as they say."""
    layers = {layer.name: layer for layer in steady.map.curvature}
    for name in ("curvature_max", "curvature_min", "curvature_mean", "curvature_rolled"):
        layer = layers[name]
        known = np.isfinite(layer.mean)
        assert known.mean() > 0.9
        assert np.median(layer.mean[known]) == pytest.approx(1.0 / 0.04, rel=0.1)
        assert np.mean(np.abs(layer.mean - 25.0)[known] <= 1.96 * layer.sd[known]) > 0.9
    across = layers["curvature_direction"].value
    along = np.abs(np.sum(across * steady.map.mesh.normals, axis=1))
    assert np.nanmax(along) < 1e-3


# --- what is left of it ---


def test_files_report_and_summary_have_the_layers(swung, tmp_path):
    Explore().files(swung)["map.ply"](tmp_path / "map.ply")
    ply = trimesh.load(tmp_path / "map.ply", process=False)
    data = ply.metadata["_ply_raw"]["vertex"]["data"]
    for layer in (swung.map.friction, swung.map.stiffness, swung.map.curvature[2]):
        np.testing.assert_allclose(np.ravel(data[layer.name]), layer.mean, rtol=1e-5)
        np.testing.assert_allclose(np.ravel(data[f"{layer.name}_sd"]), layer.sd, rtol=1e-5)
    assert np.isfinite(np.ravel(data["curvature_direction_x"])).all()
    report = Explore().report(swung)
    (space,) = pictures(report, "The surface")["Touched surface"].panels
    assert {look.quantity for look in LAYER_LOOKS.values()} <= set(quantities(space.marks))
    assert {layer.name for layer in swung.map.layers if isinstance(layer, VertexLayer)} == set(LAYER_LOOKS)
    rows = {row[0]: row for row in next(p for p in section(report, "The map").parts if hasattr(p, "rows")).rows}
    assert rows["stiffness of the object"][2] == "kN/m"
    assert float(rows["stiffness of the object"][1]) == pytest.approx(40.0, rel=0.2)
    assert {look.quantity for look in LAYER_LOOKS.values()} <= set(rows)
    metrics = {metric.name: metric for metric in report.metrics}
    assert metrics["stiffness of the object"].value == pytest.approx(40.0, rel=0.2)
    assert re.search(r"± [\d.]+, on \d+ %", metrics["stiffness of the object"].note)
    assert metrics["mean curvature of the map"].value == pytest.approx(25.0, rel=0.1)
    assert metrics["true normal force, RMS error"].note == "set 2 N ± 0.5 N"
    assert dict(settings(swung))["normal force"] == "2 N, ± 0.5 N as a sine of 1 s"
