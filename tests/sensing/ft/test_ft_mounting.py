"""How a sensor is turned on its flange: found from gravity, with honest intervals; wrong axes are refused."""

import itertools

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from palpate.errors import InvalidValueError
from palpate.sensing.ft import identify_mounting, specific_force_from_rotations
from palpate.sim.sensor.presets import WARM_UP, axia80, nano17

SENSORS = {"nano17": (nano17(), 0.030, (0.0005, 0.001, 0.018)), "axia80": (axia80(), 1.2, (0.005, -0.012, 0.045))}
"""What is simulated, and the mass [kg] and centre [m] that it carries."""

AVERAGED, EVERY, POSES = 500, 15.0, 12
"""Readings of each pose, seconds between poses."""


def measured(seed, name, poses=POSES):
    """Specific forces of the flange, wrenches of a warming sensor, its rotation from flange to sensor, noise."""
    rng = np.random.default_rng(seed)
    model, mass, center = SENSORS[name]
    turn = Rotation.random(rng=rng)
    half = Rotation.random(poses // 2, rng=rng)
    over = Rotation.from_rotvec([np.pi, 0.0, 0.0])
    flange = Rotation.concatenate([r for each in half for r in (each, each * over)])
    a = specific_force_from_rotations(flange.inv().as_matrix())
    force = -mass * turn.apply(a)
    time = rng.uniform(0.0, 600.0) + EVERY * np.arange(poses)
    warmth = WARM_UP.rise * (1.0 - np.exp(-time / WARM_UP.time_constant))
    sd = np.array(model.noise_sd) / np.sqrt(AVERAGED)
    zero = np.outer(warmth, model.thermal_drift.per_kelvin) + 0.1 * np.array(model.rated) * rng.normal(size=6)
    wrench = np.hstack([force, np.cross(center, force)]) + zero + sd * rng.normal(size=(poses, 6))
    return a, wrench, turn, {"force_sd": sd[:3].max(), "moment_sd": sd[3:].max()}


@pytest.mark.parametrize("name", SENSORS)
def test_the_rotation_is_within_a_tenth_of_a_degree_and_within_its_intervals(name):
    """A few seeds; many more: benchmarks/trust."""
    angles, inside, seeds = [], [], 10
    for seed in range(seeds):
        a, wrench, turn, noise = measured(seed, name)
        found = identify_mounting(a, wrench, **noise)
        off = (turn * Rotation.from_matrix(found.rotation_flange_sensor)).as_rotvec()
        if found.verdict.ok:
            angles.append(np.degrees(np.linalg.norm(off)))
            inside.append(np.abs(off) <= 1.96 * found.rotation_sd)
            assert found.payload.payload.mass == pytest.approx(SENSORS[name][1], rel=0.01)
    assert len(angles) >= 0.95 * seeds - 1.0
    assert np.quantile(angles, 0.99) < 0.1
    assert 0.93 - 1.0 / seeds <= np.mean(inside) <= 0.98 + 2.0 / seeds


@pytest.mark.slow
@pytest.mark.parametrize("name", SENSORS)
def test_every_left_handed_sensor_is_refused_and_every_right_handed_one_is_a_mounting(name):
    a, wrench, turn, noise = measured(3, name)
    for order in itertools.permutations(range(3)):
        for signs in ((1.0, 1.0, 1.0), (1.0, -1.0, 1.0)):
            P = np.eye(3)[list(order)] * np.array(signs)[:, None]
            other = np.hstack([wrench[:, :3] @ P.T, wrench[:, 3:] @ P.T])
            if np.linalg.det(P) < 0.0:
                with pytest.raises(InvalidValueError, match="left-handed"):
                    identify_mounting(a, other, **noise)
            else:
                found = identify_mounting(a, other, **noise).rotation_flange_sensor
                assert np.degrees((Rotation.from_matrix(P @ turn.as_matrix() @ found)).magnitude()) < 0.2


def test_gains_that_differ_are_reported():
    a, wrench, _, noise = measured(1, "axia80")
    uneven = identify_mounting(a, wrench * [1.02, 1.0, 1.0, 1.0, 1.0, 1.0], **noise)
    assert "not those of one turned sensor" in uneven.verdict.broken[0].finding
