"""Several things in one scene: each is touched, with its own surface."""

import mujoco
import numpy as np
import pytest

from palpate.errors import InvalidValueError
from palpate.runtime.data import Command
from palpate.sim import ContactLaw, MujocoBackend, Stage, Tip, build_scene
from palpate.sim.objects.fixed_pieces import FixedPieces
from palpate.sim.objects.posed import PosedGeom
from palpate.surfaces import Sphere

SPHERE, BOX = mujoco.mjtGeom.mjGEOM_SPHERE, mujoco.mjtGeom.mjGEOM_BOX
PLATE = PosedGeom(BOX, np.array([0.03, 0.03, 0.005]), np.array([-0.05, 0.0, -0.005]), np.eye(3))
BALL = PosedGeom(SPHERE, np.array([0.01, 0.0, 0.0]), np.array([0.05, 0.0, 0.02]), np.eye(3))
POST = PosedGeom(SPHERE, np.array([0.01, 0.0, 0.0]), np.array([0.0, 0.0, 0.02]), np.eye(3))
RADIUS, STIFFNESS = 0.008, 20e3


def pressed_at(x, top):
    """Force on a tip that came down 4 mm onto what has its top there [N], and how deep it is in that [m]."""
    start = top + RADIUS + 0.002
    pieces = FixedPieces((PLATE, BALL), (POST,))
    scene = build_scene(Tip(Sphere(RADIUS)), pieces, ContactLaw(STIFFNESS), (x, 0.0, start), Stage())
    force, weight = 0.0, 9.80665 * scene.tip.mass
    with MujocoBackend(scene) as backend:
        sample = backend.start()
        while force < 1.0 and sample.arm.position_base_tip[2] > start - 0.004:
            sample = backend.step(Command((0.0, 0.0, -0.005)))
            force = sample.wrenches[0].wrench[2] + weight
        for _ in range(300):
            sample = backend.step(Command())
    return sample.wrenches[0].wrench[2] + weight, top + RADIUS - sample.arm.position_base_tip[2]


@pytest.mark.slow
@pytest.mark.parametrize(("x", "top"), [(-0.05, 0.0), (0.05, 0.03)])
def test_each_presses_by_the_law_of_the_scene(x, top):
    force, depth = pressed_at(x, top)
    assert force > 0.5
    assert force == pytest.approx(STIFFNESS * depth, rel=0.01)


@pytest.mark.slow
def test_what_is_only_seen_is_passed_through():
    force, _ = pressed_at(0.0, 0.03)
    assert abs(force) < 0.01


def test_the_surface_is_that_of_all_of_them():
    pieces = FixedPieces((PLATE, BALL))
    points = np.array([[-0.05, 0.0, 0.004], [0.05, 0.0, 0.05], [0.05, 0.0, 0.02]])
    np.testing.assert_allclose(pieces.signed_distance(points), [0.004, 0.02, -0.01], atol=1e-12)
    assert (pieces.top, pieces.bottom) == pytest.approx((0.03, -0.01))
    height = pieces.height(np.array([-0.05, 0.05, 0.0]), np.zeros(3))
    np.testing.assert_allclose(height, [0.0, 0.03, np.nan], atol=1e-12)
    with pytest.raises(InvalidValueError, match="there are none"):
        FixedPieces(())
