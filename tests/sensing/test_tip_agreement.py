"""A tip that is not what it is said to be shows in its own contacts."""

import numpy as np
import pytest

from palpate.mapping.point_normals import point_normals
from palpate.sensing.solver import contacts_from_wrenches
from palpate.sensing.tip_agreement import TipAgreement, tip_agreement
from palpate.sensing.tip_uncertainty import EXACT, TipUncertainty
from palpate.surfaces import Sphere

TRUE = Sphere(0.008, center=np.array([0.0, 0.0, -0.02]))
OBJECT = 0.04
"""Radius of the sphere that is touched [m]."""


def _slid(believed: Sphere, zero_off: np.ndarray, seed: int = 0) -> TipAgreement | None:
    """Contacts of rows to and fro over a sphere, as a believed tip and a wrong zero have them."""
    rng = np.random.default_rng(seed)
    x, y = np.meshgrid(np.linspace(-0.012, 0.012, 160), np.linspace(-0.006, 0.006, 24))
    to_and_fro = np.where(np.arange(24) % 2, -1.0, 1.0)[:, None]
    up = np.column_stack([x.ravel(), y.ravel(), np.sqrt(OBJECT**2 - x**2 - y**2).ravel()]) / OBJECT
    along = np.column_stack([np.broadcast_to(to_and_fro, x.shape).ravel(), np.zeros((x.size, 2))])
    along -= np.sum(along * up, axis=1)[:, None] * up
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    force = 2.0 * up - 0.6 * along
    centroid = TRUE.center - 0.008 * up
    origin = OBJECT * up - centroid  # of the sensor, which does not turn
    wrench = np.column_stack([force, np.cross(centroid, force)]) + zero_off
    wrench += rng.normal(size=wrench.shape) * ([1e-3] * 3 + [1e-5] * 3)
    felt = contacts_from_wrenches(believed, wrench)
    places = origin + felt.centroid
    found = point_normals(places, felt.normal, radius=2.5e-3, spacing=2e-4, count=600)
    chosen = contacts_from_wrenches(believed, wrench[found.rows])
    return tip_agreement(believed, chosen, found.normal, found.bend)


def test_a_tip_that_is_right_agrees() -> None:
    found = _slid(TRUE, np.zeros(6))
    assert found is not None
    assert not list(found.broken(EXACT, 0.0))
    assert (np.abs([*found.shift, found.size]) < 5.0 * found.sd + 2e-6).all()


WRONG = [  # tip as assumed, error of the zero, what is found [m], within, words of the report
    (Sphere(0.008, center=TRUE.center - [2e-4, 0, 0]), 0.0, [2e-4, 0, 0], 1e-5, "along x of the sensor"),
    (Sphere(0.008, center=TRUE.center - [0, 2e-4, 0]), 0.0, [0, 2e-4, 0], 1e-5, "along y of the sensor"),
    (TRUE, 4e-4, [-2e-4, 0, 0], 3e-5, "tare"),  # 0.4 mN m over 2 N looks like a tip elsewhere
    (Sphere(0.0083, center=TRUE.center), 0.0, -3e-4, 1e-4, ""),  # another size is found by friction
]


@pytest.mark.parametrize(("tip", "zero", "wrong", "within", "words"), WRONG)
def test_a_tip_that_is_wrong_is_found(tip, zero, wrong, within, words) -> None:
    found = _slid(tip, zero * np.eye(6)[4])
    assert found is not None
    shown = found.size if np.ndim(wrong) == 0 else np.where(np.abs(wrong) > 0.0, found.shift, 0.0)
    np.testing.assert_allclose(shown, wrong, atol=within)
    told = next(found.broken(EXACT, 0.0))
    assert words in told.finding + told.remedy
    if np.ndim(wrong) and not zero:
        assert not list(found.broken(TipUncertainty.independent(position=2e-4), 0.0))


def test_too_few_contacts_give_no_agreement() -> None:
    contacts = contacts_from_wrenches(TRUE, np.tile([0.0, 0.0, 2.0, 0.0, 0.0, 0.0], (50, 1)))
    assert tip_agreement(TRUE, contacts, contacts.normal, np.zeros((50, 3, 3))) is None


def test_normals_and_bend_of_an_ellipsoid() -> None:
    rng = np.random.default_rng(1)
    axes = np.array([0.05, 0.04, 0.03])
    spots = rng.uniform(-0.01, 0.01, (4000, 2))
    places = np.column_stack([spots, axes[2] * np.sqrt(1.0 - ((spots / axes[:2]) ** 2).sum(axis=1))])
    normal = places / axes**2
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    tilted = normal + 0.1 * rng.normal(size=normal.shape)
    tilted /= np.linalg.norm(tilted, axis=1, keepdims=True)
    found = point_normals(places, tilted, radius=2.5e-3, spacing=1e-4, count=100)
    inner = np.linalg.norm(spots[found.rows], axis=1) < 7e-3
    np.testing.assert_allclose(found.normal[inner], normal[found.rows][inner], atol=2e-3)
    top = int(np.argmin(np.linalg.norm(spots[found.rows], axis=1)))
    bends = np.linalg.eigvalsh(found.bend[top])
    np.testing.assert_allclose(bends[1:], sorted(axes[2] / axes[:2] ** 2), rtol=0.1)
