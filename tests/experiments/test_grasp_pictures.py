"""Pictures of a grasp: what is played is what was, forces balance, and what is held has its size."""

import numpy as np
import pytest

from palpate.experiments.grasp.config import GraspConfig
from palpate.experiments.grasp.held_mesh import held_mesh
from palpate.experiments.grasp.moments_picture import MOMENTS, moments_picture, worst_moment
from palpate.experiments.grasp.pictures import over_time
from palpate.reporting.limit_surface_panel import load_sizes
from palpate.reporting.marks import Line, Moving
from palpate.reporting.solids import Arrows, Placed
from support.drawn import panels
from support.grasp_runs import run_grasp


@pytest.fixture(scope="module")
def grasp():
    return run_grasp(rise=0.3)


def test_what_is_played_begins_with_the_lift_and_shows_the_worst_moment_first(grasp):
    picture = moments_picture(grasp)
    space, *surfaces = picture.panels
    worst, truth = worst_moment(grasp), grasp.truth
    assert MOMENTS <= len(picture.steps) <= MOMENTS + 1
    assert picture.steps[picture.step] == f"{truth.time[worst]:.3f} s, hold, the worst"
    borne = grasp.carried & truth.touching.all(axis=1)
    assert load_sizes(grasp.planned.true, truth.loads[worst]).max() == pytest.approx(
        load_sizes(grasp.planned.true, truth.loads[borne]).max()
    )
    rings = [mark for panel in surfaces for mark in panel.marks if isinstance(mark, Moving)]
    assert [len(ring.x) for ring in rings] == [len(picture.steps)] * truth.fingers
    arrows = {mark.name: mark for mark in space.marks if isinstance(mark, Arrows)}
    assert all(len(mark.starts) == len(picture.steps) for mark in arrows.values())


def test_forces_in_space_hold_the_object_and_end_at_its_surface(grasp):
    picture = moments_picture(grasp)
    space, step = picture.panels[0], picture.step
    arrows = {mark.name: mark for mark in space.marks if isinstance(mark, Arrows)}
    pushes, loads = arrows["contact force"], arrows["weight and pull"]
    rest = pushes.along[step].sum(axis=0) + loads.along[step].sum(axis=0)
    assert np.linalg.norm(rest) < 0.05 * np.linalg.norm(pushes.along[step], axis=1).max()
    ends = pushes.starts[step] + pushes.along[step]
    moment = np.cross(ends, pushes.along[step]).sum(axis=0) + np.cross(loads.starts[step], loads.along[step]).sum(
        axis=0
    )
    assert np.abs(moment[1:]).max() < 0.05 * np.abs(np.cross(ends, pushes.along[step])).max()
    body = next(mark for mark in space.marks if isinstance(mark, Placed) and mark.surface.name == "object")
    seen = body.at(step).vertices[:, 0]
    assert np.sort(ends[:, 0]) == pytest.approx([seen.min(), seen.max()], abs=5e-4)


def test_what_is_seen_over_time_is_seen_on_one_axis(grasp):
    grip, slip, spin = panels(over_time(grasp))
    assert grip.x == slip.x == spin.x
    assert grip.x.run_time
    (largest,) = (mark for mark in slip.marks if isinstance(mark, Line))
    assert np.nanmax(largest.y) == pytest.approx(1e3 * grasp.slip_aloft)
    assert np.isfinite(largest.y).tolist() == grasp.aloft.tolist()


@pytest.mark.parametrize(
    ("held", "half"),
    [
        (GraspConfig(object="box", size=(0.06, 0.05, 0.04)), (0.03, 0.025, 0.02)),
        (GraspConfig(object="cylinder", size=(0.02, 0.05), fingers=3), (0.025, 0.02, 0.02)),
        (GraspConfig(object="sphere", size=(0.03,), fingers=3), (0.03, 0.03, 0.03)),
    ],
)
def test_what_is_held_has_its_size_and_its_outside_out(held, half):
    vertices, triangles = held_mesh(held)
    assert np.abs(vertices).max(axis=0) == pytest.approx(half, rel=0.01)
    a, b, c = vertices[triangles].swapaxes(0, 1)
    volume = np.einsum("ij,ij->i", a, np.cross(b, c))
    assert volume.min() > -1e-12
    assert volume.sum() > 0.0
