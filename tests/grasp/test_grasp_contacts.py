"""A grasp's contacts: the grasp map is what forces do to the object, and impossible input is refused by name."""

import numpy as np
import pytest

from palpate.errors import InvalidValueError
from palpate.grasp import GraspContacts
from support.grasp_families import around, grasp_of

PLACE = np.array([[0.02, 0.0, 0.0], [-0.02, 0.0, 0.0]])
FRAMES = np.array([[[-1, 0, 0], [0, 0, 1], [0, 1, 0]], [[1, 0, 0], [0, 1, 0], [0, 0, 1]]], float)


def test_the_grasp_map_sums_forces_and_their_moments():
    rng = np.random.default_rng(0)
    grasp = grasp_of(*around(5, rng), 0.5, 0.004, rng)
    forces = rng.normal(size=(5, 4))
    vectors = np.einsum("nij,nj->ni", grasp.frames, forces[:, :3])
    moments = np.cross(grasp.positions, vectors) + forces[:, 3:] * grasp.frames[:, :, 0]
    wrench = np.concatenate([vectors.sum(axis=0), moments.sum(axis=0)])
    np.testing.assert_allclose(grasp.grasp_map @ forces.ravel(), wrench, atol=1e-15)


def test_margins_are_those_of_the_limit_surfaces():
    rng = np.random.default_rng(1)
    grasp = grasp_of(*around(3, rng), 0.5, 0.004, rng, load_exponent=0.25, norm_exponent=1.5)
    forces = np.abs(rng.normal(size=(3, 4))) * [2.0, 0.1, 0.1, 1e-3]
    used = (
        np.hypot(forces[:, 1], forces[:, 2]) ** 1.5 + (forces[:, 3] / (0.004 * forces[:, 0] ** 0.25)) ** 1.5
    ) ** (1 / 1.5)
    np.testing.assert_allclose(grasp.margins(forces), 0.5 * forces[:, 0] - used, rtol=1e-12)


def test_a_part_of_a_grasp_is_one():
    rng = np.random.default_rng(2)
    grasp = grasp_of(*around(4, rng), rng.uniform(0.3, 1.0, 4), 0.004, rng)
    part = grasp.chosen([3, 1])
    np.testing.assert_array_equal(part.friction, grasp.friction[[3, 1]])
    np.testing.assert_array_equal(part.grasp_map[:, 4:], grasp.grasp_map[:, 4:8])


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"positions": np.zeros((0, 3)), "frames": np.zeros((0, 3, 3))}, "at least one contact"),
        ({"positions": np.zeros((2, 2))}, r"must be \(n, 3\)"),
        ({"positions": PLACE * np.nan}, "positions: every entry must be finite"),
        ({"frames": FRAMES[:1]}, r"must be \(2, 3, 3\)"),
        ({"frames": 1.001 * FRAMES}, "contact 0: its frame is not orthonormal"),
        ({"frames": FRAMES[:, :, [0, 2, 1]]}, "contact 0: its frame is a reflection"),
        ({"friction": 0.0}, "contact 0: friction = 0"),
        ({"friction": [0.5, -1.0]}, "contact 1: friction = -1"),
        ({"friction": [0.5, 0.5, 0.5]}, r"must be a number or \(2,\)"),
        ({"spin_length": [0.004, 0.0]}, "contact 1: spin_length = 0"),
        ({"spin_length": np.nan}, "spin_length"),
        ({"force_min": -0.1}, "force_min = -0.1 N: must be finite and at least 0"),
        ({"force_min": [1.0, 3.0], "force_max": 2.0}, "contact 1: force_min = 3 N lies above force_max = 2 N"),
        ({"force_max": np.nan}, "force_max"),
        ({"load_exponent": 0.5}, "load_exponent"),
        ({"norm_exponent": 0.9}, "norm_exponent"),
        ({"actuator_map": np.zeros((2, 1, 4))}, "belong together"),
        ({"actuator_map": np.zeros((2, 1, 3)), "actuator_limit": np.ones((2, 1))}, r"must be \(2, k, 4\)"),
        ({"actuator_map": np.zeros((2, 1, 4)), "actuator_limit": np.zeros((2, 1))}, "above 0"),
    ],
)
def test_what_is_impossible_is_refused_by_name(change, words):
    good = {"positions": PLACE, "frames": FRAMES, "friction": 0.5, "spin_length": 0.004}
    GraspContacts(**good)
    with pytest.raises(InvalidValueError, match=words):
        GraspContacts(**(good | change))


def test_what_is_just_possible_is_not_refused():
    extremes = {"load_exponent": [0.0, 1.0 / 3.0], "norm_exponent": [1.0, 2.0], "force_min": [2.0, 0.0]}
    grasp = GraspContacts(PLACE, FRAMES, 5e-324, 1e300, force_max=[2.0, np.inf], **extremes)
    assert not grasp.is_convex
    assert (grasp.force_min <= grasp.force_max).all()


def test_layouts_of_memory_do_not_matter_and_nothing_given_is_kept():
    places, frames = np.asfortranarray(PLACE), np.asfortranarray(FRAMES)
    grasp = GraspContacts(places, frames, 0.5, 0.004)
    np.testing.assert_array_equal(grasp.frames, FRAMES)
    assert not np.shares_memory(grasp.positions, places)
    for name in ("positions", "frames", "friction", "force_max"):
        assert not getattr(grasp, name).flags.writeable
