"""What a step test finds of an arm's servos is what follows from their gains, and is refused of weak motors."""

import numpy as np
import pytest

from palpate.errors import InvalidValueError
from palpate.kinematics import FollowingErrorLimit, Pose
from palpate.sensing.compensation import SensorPayload
from palpate.sim import ArmCarrier, Fidelity, ServoedArm
from palpate.sim.carriers.arm_carrier import LOOKING_DOWN
from palpate.sim.carriers.step_test import step_test
from support.file_arms import GANTRY, own_arm, written

TIP = SensorPayload(0.03, (0.0, 0.0, 0.01))
HEAVY = GANTRY.replace('mass="1"', 'mass="60"').replace("-300 300", "-3000 3000")


def found(model, behind, start, bandwidth, period=1e-3):
    """What the step test finds; stiffness by the servos' gains [N/m] and 2 / w [s]."""
    limit = FollowingErrorLimit(0.002)
    arm = ServoedArm(model, Pose((behind, 0.0, 0.0)), Pose((0.0, 0.0, 0.1), LOOKING_DOWN), bandwidth, limit)
    carrier = ArmCarrier(arm)
    joints = carrier.joint_start(start)
    computed = [arm.push(joints, tuple(axis)) / limit.distance for axis in np.eye(3).tolist()]
    return step_test(carrier, TIP, start, Fidelity(), period), computed, 2.0 / bandwidth


@pytest.mark.parametrize(
    ("name", "behind", "start", "bandwidth"),
    [
        ("panda.xml", -0.45, (0.0, 0.0, 0.03), 130.0),
        ("xarm6.xml", -0.45, (0.02, -0.01, 0.03), 60.0),
        ("sluggish", 0.0, (0.1, -0.1, 0.55), 6.0),
    ],
)
def test_it_finds_what_the_servos_gains_give(name, behind, start, bandwidth, tmp_path):
    """Three slides that carry 180 kg at 6 rad/s are twenty times as slow as the Panda."""
    model = written(tmp_path, HEAVY).read() if name == "sluggish" else own_arm(name)
    servos, stiffness, response = found(model, behind, start, bandwidth)
    assert servos.stiffness == pytest.approx(stiffness, rel=0.006)  # of three digits, and how far it leans
    assert servos.response == pytest.approx([response] * 3, abs=0.4e-3, rel=0.005)
    assert servos.lag == (0.0, 0.0, 0.0)
    assert "N/mm along x, y and z, response" in str(servos)


def test_motors_that_do_not_hold_their_own_weight_are_refused(tmp_path):
    weak = GANTRY.replace("-300 300", "-5 5")
    with pytest.raises(InvalidValueError, match=r"gantry, pushed with .* does not come to rest: .*;"):
        found(written(tmp_path, weak).read(), 0.0, (0.1, -0.1, 0.55), 30.0)
