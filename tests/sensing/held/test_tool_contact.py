"""Contacts of a held tool: whatever its pose, and covered where that is not quite known."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from palpate.kinematics.pose import Pose
from palpate.sensing import ContactStatus, contact_from_wrench, contacts_from_wrenches
from palpate.sensing.held import ExternalWrenches, HeldTool, felt_in_hand, felt_on_tool, tool_contact
from palpate.sensing.held.wrench_frame import wrench_from
from palpate.sensing.tip_uncertainty import TipUncertainty
from palpate.sensing.uncertainty import UncertaintyStatus, contacts_uncertainties, white_noise
from palpate.surfaces import Capsule, Ellipsoid

NOISE = white_noise(3e-3, 1.6e-5)
TOOLS = {"pin": Capsule(0.003, 0.08), "bulb": Ellipsoid((0.01, 0.012, 0.02), center=(0.0, 0.002, 0.03))}


def touches(tool, rng, n):
    """Wrenches of contacts all over a tool, in its frame: not too much friction or spin."""
    direction = rng.normal(size=(20 * n, 3))
    force = 3.0 * direction / np.linalg.norm(direction, axis=1, keepdims=True)
    arm = rng.uniform((-0.003, -0.003, -0.07), (0.003, 0.003, 0.05), (20 * n, 3))
    wrenches = np.concatenate((force, np.cross(arm, force)), axis=1)
    found = contacts_from_wrenches(tool, wrenches)
    slope = np.linalg.norm(found.tangential_force, axis=1) / found.normal_force
    return wrenches[(found.status == ContactStatus.OK) & (slope < 0.7) & (np.abs(found.spin_torque) < 1e-3)][:n]


def random_pose(rng):
    return Pose(
        tuple((0.1 * rng.normal(size=3)).tolist()),
        tuple(map(tuple, Rotation.random(rng=rng).as_matrix().tolist())),
    )


@pytest.mark.parametrize("kind", TOOLS)
def test_where_it_is_held_does_not_matter_to_where_it_touches(kind):
    rng = np.random.default_rng(0)
    surface = TOOLS[kind]
    alone = touches(surface, rng, 5)
    plain = ExternalWrenches.measured(alone, NOISE)
    here = felt_on_tool(HeldTool(surface), plain)
    pose = random_pose(rng)
    held = HeldTool(surface, pose)
    seen = plain.seen_from(pose.inverse())
    there, in_hand = felt_on_tool(held, seen), felt_in_hand(held, seen)
    R, p = np.array(pose.rotation), np.array(pose.position)
    for name in ("centroid", "normal", "normal_force", "tangential_force", "spin_torque"):
        np.testing.assert_allclose(
            getattr(there.contacts, name), getattr(here.contacts, name), rtol=1e-9, atol=1e-12
        )
        np.testing.assert_allclose(
            getattr(there.uncertainty, name), getattr(here.uncertainty, name), rtol=1e-6, atol=1e-16
        )
    np.testing.assert_allclose(in_hand.contacts.centroid, here.contacts.centroid @ R.T + p, atol=1e-12)
    np.testing.assert_allclose(in_hand.uncertainty.centroid, R @ here.uncertainty.centroid @ R.T, atol=1e-14)
    J = in_hand.uncertainty.jacobians
    np.testing.assert_allclose(
        J.centroid @ seen.noise @ J.centroid.transpose(0, 2, 1),
        in_hand.uncertainty.centroid,
        rtol=0.05,
        atol=1e-10,
    )
    one = tool_contact(held, wrench_from(pose, tuple(alone[0].tolist())))
    np.testing.assert_allclose(one.centroid, here.contacts.centroid[0], atol=1e-12)


@pytest.mark.parametrize("kind", TOOLS)
def test_a_pose_that_is_not_quite_known_is_covered(kind):
    """Tools held a little elsewhere touch; regions of 95 % hold the places, on the tool and in the hand."""
    rng, surface = np.random.default_rng(1), TOOLS[kind]
    L = np.linalg.cholesky(0.5 * np.eye(6) + 0.5) * np.array([[3e-4] * 3 + [0.01] * 3]).T
    held, hit = HeldTool(surface, random_pose(rng), L @ L.T), []
    for wrench in touches(surface, rng, 300):
        e = L @ rng.normal(size=6)
        turn = Rotation.from_rotvec(e[3:]).as_matrix() @ np.array(held.pose.rotation)
        shift = np.array(held.pose.position) + e[:3]
        true = Pose(tuple(shift.tolist()), tuple(map(tuple, turn.tolist())))
        measured = wrench_from(true, tuple(wrench.tolist())) + np.sqrt(np.diag(NOISE)) * rng.normal(size=6)
        wrenches = ExternalWrenches.measured(measured[None], NOISE)
        place = contact_from_wrench(surface, wrench).centroid
        felt = felt_on_tool(held, wrenches), felt_in_hand(held, wrenches)
        if all(each.uncertainty.status[0] == UncertaintyStatus.VALID for each in felt):
            off = [
                each.contacts.centroid - at for each, at in zip(felt, (place, turn @ place + shift), strict=True)
            ]
            T = [np.linalg.svd(each.contacts.normal)[2][1:] for each in felt]
            S = [t @ each.uncertainty.centroid[0] @ t.T for each, t in zip(felt, T, strict=True)]
            hit.append(
                [d[0] @ t.T @ np.linalg.solve(s, t @ d[0]) < 5.99 for d, t, s in zip(off, T, S, strict=True)]
            )
    assert len(hit) > 220
    share = np.mean(hit, axis=0)
    assert 0.92 < share.min() <= share.max() < 0.985


def test_parameters_of_a_tip_that_were_fitted_together_count_together():
    """A tip whose place and size are known as their sum alone, along its normal, is known there."""
    tip = Ellipsoid((0.01, 0.01, 0.01))
    found = felt_on_tool(HeldTool(tip), ExternalWrenches.measured([[0, 0, -2.0, 0.001, 0, 0]], NOISE)).contacts
    n = found.normal[0]
    together = np.zeros((8, 8))
    direction = np.concatenate((n, [0, 0, 0, -1.0, 0]))  # it sits further out, and is smaller by as much
    together = 1e-8 * np.outer(direction, direction)
    apart = TipUncertainty(np.diag(np.diag(together)))
    known = contacts_uncertainties(tip, found, 1e-20 * NOISE, TipUncertainty(together)).centroid[0]
    unknown = contacts_uncertainties(tip, found, 1e-20 * NOISE, apart).centroid[0]
    assert n @ known @ n < 1e-3 * (n @ unknown @ n)
