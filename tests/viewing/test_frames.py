"""Rows of a view: the same from the loop as from its log, and geometry that fits the arm's."""

import multiprocessing

import mujoco
import numpy as np
import pytest

from palpate.errors import InvalidValueError
from palpate.runtime import Phase
from palpate.sim import ContactLaw, SphereObject, Tip
from palpate.sim.carriers.arm_carrier import ArmCarrier
from palpate.sim.carriers.ur5e import LINKS
from palpate.sim.render.place import ScenePlacement
from palpate.sim.scene import build_scene
from palpate.surfaces import Sphere
from palpate.viewing import Frames, LiveView, Part, Place, ViewScene, frames_of_log
from palpate.viewing.frame_ring import FrameRing, RingReader, RingWriter
from palpate.viewing.plots import extremes
from palpate.viewing.view_scene import link_poses


def observer_without_process(joints=0, capacity=100_000):
    """The observer of a live view, and what its process would read."""
    ring = FrameRing(multiprocessing.get_context("spawn"), joints, capacity)
    view = object.__new__(LiveView)
    view._write, view._finger, view._joints = RingWriter(ring).write, 0, (0.0,) * joints
    return view.observe, RingReader(ring)


def test_a_live_view_sees_what_the_log_says(short_run):
    observe, reader = observer_without_process()
    for period in short_run.periods:
        observe(*period)
    live, logged = reader.read(), frames_of_log(short_run.log)
    # numbers are the ring's and the log's own
    np.testing.assert_array_equal(live.rows[:, 1:-1], logged.rows[:, 1:-1])


def test_frames_are_the_record(short_run):
    frames, record = frames_of_log(short_run.log), short_run.log.record()
    np.testing.assert_array_equal(frames.time, record.time)
    known = record.touching & (record.status == 0)
    np.testing.assert_array_equal(frames.touching, known)
    np.testing.assert_allclose(frames.centroid[known], record.centroid[known], rtol=0, atol=1e-15)
    np.testing.assert_array_equal(frames.normal_force, record.normal_force)
    force = frames.force[known]
    pushing = -np.sum(force * record.normal[known], axis=1)
    np.testing.assert_allclose(pushing, record.normal_force[known], atol=1e-12)
    scanning = record.phase == Phase.SCAN.value
    np.testing.assert_array_equal(frames.scanning, known & scanning)
    assert frames.scanning.sum() > 500
    assert frames.phase(len(frames) - 1).value == record.phase[-1]


def test_the_map_lies_on_the_object(short_run):
    frames = frames_of_log(short_run.log)
    error = short_run.planned.target.signed_distance(frames.centroid[frames.scanning])
    assert np.abs(error).max() < 2e-4  # half the compression of 2 N at 20 kN/m, and what friction adds


def test_no_such_finger(short_run):
    with pytest.raises(InvalidValueError, match="finger = 1: must be from 0 to 0"):
        frames_of_log(short_run.log, 1)


def test_an_arm_that_tells_no_joints_does_not_end_the_run(short_run):
    observe, reader = observer_without_process(joints=6)
    observe(*short_run.periods[0])
    assert (reader.read().joint_position == 0.0).all()


def test_links_are_where_the_simulation_has_them():
    carrier = ArmCarrier()
    scene = build_scene(Tip(Sphere(0.008)), SphereObject(0.03), ContactLaw(), (0.0, 0.0, 0.06), carrier)
    placement, random = ScenePlacement(scene.model), np.random.default_rng(2)
    for _ in range(10):
        joints = tuple(random.uniform(-3.0, 3.0, 6).tolist())
        data = placement.place((0.0, 0.0, 0.0), joints)
        mujoco.mj_kinematics(scene.model, data)
        for name, pose in zip(LINKS, link_poses(carrier.arm.kinematics, joints), strict=True):
            assert data.body(name).xpos == pytest.approx(pose.position, abs=1e-12)
            assert data.body(name).xmat == pytest.approx(np.ravel(pose.rotation), abs=1e-12)


def test_parts_of_links_need_an_arm():
    part = Part(np.zeros((3, 3)), np.array([[0, 1, 2]]), (0, 0, 0), Place.LINK, 2)
    with pytest.raises(InvalidValueError, match="link = 2"):
        ViewScene("no arm", (part,))


def test_rows_too_narrow_are_refused():
    with pytest.raises(InvalidValueError, match="must be"):
        Frames(np.zeros((4, 3)))


@pytest.mark.parametrize("count", [1, 10, 999, 5000])
def test_plots_lose_no_peak(count):
    rows = np.column_stack([np.arange(count), np.random.default_rng(count).normal(size=(count, 2))])
    thin = extremes(rows, 200)
    assert len(thin) <= max(400, 0)
    assert (np.diff(thin[:, 0]) >= 0).all()
    assert (thin.max(axis=0) == rows.max(axis=0)).all()
    assert (thin.min(axis=0) == rows.min(axis=0)).all()
