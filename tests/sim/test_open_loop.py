"""Presses in MuJoCo's threads are those of a back end that is stepped, bit for bit; what cannot be is refused."""

import numpy as np
import pytest

from palpate.errors import SimulationDivergedError
from palpate.runtime.data import Command
from palpate.sim import (
    Box,
    ContactLaw,
    EllipsoidObject,
    Mount,
    ObjectBody,
    SphereObject,
    Table,
    Tip,
    build_scene,
    open_loop,
    rollout_presses,
)
from palpate.surfaces import Ellipsoid, Sphere
from support.simulated import started

TIP = Tip(Sphere(0.008))
BALL = SphereObject(0.04)
PERIODS = 260


def scene(target=BALL, tip=TIP, height=0.0485, law=None, **given):
    return build_scene(tip, target, law or ContactLaw(), (0.0, 0.0, height), **given)


def down_and_aside(runs=3):
    """Down for half of the time, then aside, each run another way."""
    velocity = np.zeros((runs, PERIODS, 3))
    velocity[:, : PERIODS // 2, 2] = -0.012
    velocity[:, PERIODS // 2 :, :2] = np.random.default_rng(0).uniform(-0.02, 0.02, (runs, 1, 2))
    return velocity


def stepped(scene, velocity):
    """The same by a back end, a row for each period."""
    backend = started(scene)
    for each in velocity.tolist():
        sample = backend.step(Command(tuple(each)))
        arm, (felt,), truth = sample.arm, sample.wrenches, backend.truth()
        yield (
            *(sample.time, *arm.position_base_tip, *arm.velocity_base_tip, *felt.wrench, *felt.acceleration),
            *(truth.touching, *truth.position, *truth.force, *truth.torque),
        )


def rows(found):
    """All of it, shape (n, p, numbers)."""
    parts = (
        *(found.time[..., None], found.tip_position, found.tip_velocity, found.wrench, found.acceleration),
        *(found.touching[..., None], found.contact_position, found.force, found.torque),
    )
    return np.concatenate(parts, axis=2)


@pytest.mark.parametrize(
    "scenes",
    [
        scene(),
        [scene(law=ContactLaw(stiffness=stiffness)) for stiffness in (5e3, 20e3, 40e3)],
        scene(EllipsoidObject((0.05, 0.04, 0.03)), Tip(Ellipsoid((0.007, 0.008, 0.01))), 0.0405),
        scene(
            ObjectBody(Box((0.1, 0.1, 0.04)), mass=2.0, mount=Mount.FREE, position=(0.0, 0.0, 0.02)), table=Table()
        ),
    ],
    ids=["a ball", "stiffness by run", "ellipsoids", "a free box"],
)
def test_every_number_is_that_of_a_back_end_that_is_stepped(scenes, monkeypatch):
    velocity = down_and_aside()
    found = rollout_presses(scenes, velocity, threads=2)
    each = scenes if isinstance(scenes, list) else [scenes] * len(velocity)
    wanted = [list(stepped(*pair)) for pair in zip(each, velocity, strict=True)]
    assert found.touching.any()
    np.testing.assert_array_equal(rows(found), np.array(wanted))
    monkeypatch.setattr(open_loop, "LARGEST_BLOCK", 1)  # one run at a time
    np.testing.assert_array_equal(rows(rollout_presses(scenes, velocity, threads=1)), np.array(wanted))


def test_a_simulation_that_diverges_is_named():
    broken = scene()
    broken.model.opt.gravity[2] = -1e12
    with pytest.raises(SimulationDivergedError, match="run 0 diverged at t = "):
        rollout_presses(broken, down_and_aside(1))
