"""A run of the turning hand: close, lift, turn; watched by what really happens, material point by point."""

import math

import mujoco
import numpy as np
from scipy.spatial.transform import Rotation

from palpate.controllers.grip.belief import KnownSurface
from palpate.controllers.grip.grip_plan import CommonGrip
from palpate.controllers.grip.lift import LiftController, LiftParameters
from palpate.controllers.grip.shared_grip import SharedGrip
from palpate.controllers.grip.slip_safe import SlipSafeGrip
from palpate.controllers.grip.turn import TurnInHand, TurnParameters
from palpate.friction.limit_surface import LimitSurface
from palpate.kinematics.pose import Pose
from palpate.runtime.data import Phase
from palpate.runtime.touch import Finger, Touch
from palpate.sensing.compensation import SensorPayload
from palpate.sim import CylinderObject, Lift, SphereObject, white_noise
from palpate.sim.friction.law import FrictionLaw
from palpate.sim.hand.backend import HandBackend
from palpate.sim.hand.contact import GraspContact
from palpate.sim.hand.scene import HeldObject, build_grasp_scene
from palpate.sim.hand.turning_hand import turning_hand
from palpate.sim.objects.table import Table

PERIOD, MASS, RADIUS = 1e-3, 0.1, 0.03
KNOWN = LimitSurface(0.5, 0.004)
LIFT = LiftParameters(height=0.01, hold_time=0.3)
BRISTLES = FrictionLaw(0.5, 0.5, spin_length=0.004, stiffness=5e3)
UPRIGHT = Pose(rotation=((0.0, 0.0, -1.0), (0.0, 1.0, 0.0), (1.0, 0.0, 0.0)))
CYLINDER = HeldObject(CylinderObject(RADIUS, 0.06), MASS, UPRIGHT)
SPHERE = HeldObject(SphereObject(RADIUS), MASS)


def touch_of(hand):
    """The touch of a hand's fingers."""
    tip = Finger(hand.tip.surface, SensorPayload(hand.tip.mass, hand.tip.center_of_mass))
    return Touch(*[tip] * hand.fingers)


class Turned:
    """A run up to the lifted object; `turn` continues it.

    Attributes:
        true: Turn of the object [rad].
        moved: Largest way of a tip's material over the object's at a contact since the turn began [m].
        slip, spin: Largest way [m] and angle [rad] there without elastic motion. Only a friction plant separates
            the two; by MuJoCo's friction all motion is slip.
        off: Largest difference between the turn that touch reports and the true one [rad].
        sunk: Descent of the object in the hand [m].
    """

    def __init__(self, target=CYLINDER, load=None, friction=BRISTLES, offset=0.0, need=None, shared=False):
        self.hand, belief = turning_hand(), KnownSurface(KNOWN)
        scene = build_grasp_scene(
            self.hand,
            target,
            GraspContact(friction=0.5, spin_length=0.004),
            carrier=Lift(),
            table=Table(-RADIUS),
            palm=(offset, 0.0, self.hand.depth + self.hand.tip_along),
            friction=friction,
        )
        self.backend = HandBackend(scene, PERIOD, sensor=white_noise(0.01, 1e-4, seed=1), load=load)
        self.touch, fingers = touch_of(self.hand), self.hand.fingers
        plan = CommonGrip(fingers, belief, PERIOD, need=need)
        if shared:
            plan = SharedGrip(fingers, belief, PERIOD, self.hand)
        self.grip = SlipSafeGrip(fingers, belief, PERIOD, plan=plan)
        self.now = self.touch.sense(self.backend.start())
        lift = LiftController(self.grip, PERIOD, LIFT)
        assert self.carry_out(lift)[-1].phase is Phase.DONE

    def carry_out(self, controller, watch=lambda: None):
        """Run a controller to its end; returns its commands."""
        controller.start(self.now)
        commands = [controller.step(self.now)]
        while not commands[-1].phase.is_final:
            self.now = self.touch.sense(self.backend.step(commands[-1]))
            commands.append(controller.step(self.now))
            watch()
        return commands

    def turn(self, *angles, watch=lambda run: None):
        """Turn until the controller ends; returns the turn of the object [rad]."""
        self.controller = TurnInHand(self.grip, self.hand, PERIOD, TurnParameters(angles))
        begin = before = self._world()
        self.true = 0.0
        n, self.moved, self.off = self.hand.fingers, 0.0, 0.0
        ways, slips = np.zeros((n, 4)), np.zeros((n, 2))

        def compare():
            nonlocal before, ways, slips
            world = self._world()
            ways = ways + [relative(before, world, i) for i in range(n)]
            for i, contact in enumerate(self.backend.rubbing):
                slips[i] += (PERIOD * math.hypot(*contact.slip_velocity), PERIOD * abs(contact.slip_spin))
            before = world
            turn = world[0][0] @ begin[0][0].T
            self.true = math.atan2(turn[1, 0] - turn[0, 1], turn[0, 0] + turn[1, 1])
            self.off = max(self.off, abs(self.controller.turn - self.true))
            self.moved = max(self.moved, np.linalg.norm(ways[:, :3], axis=1).max())
            if not self.backend.rubbing:
                slips[:] = np.maximum(
                    slips, np.transpose([np.linalg.norm(ways[:, :3], axis=1), np.abs(ways[:, 3])])
                )
            watch(self)

        self.commands = self.carry_out(self.controller, compare)
        self.slip, self.spin = slips.max(axis=0)
        self.sunk = begin[0][1][2] - before[0][1][2]
        return self.true

    def _world(self):
        """Pose of the object, poses of the tips, and contacts: hand frame, which does not turn."""
        truth, palm, flat = self.backend.truth(), self.now.arm.position_base_tip, np.zeros(9)
        assert all(finger.touching for finger in truth.fingers)
        mujoco.mju_quat2Mat(flat, truth.quat_wxyz)
        contacts = [np.subtract(finger.position, palm) for finger in truth.fingers]
        pose = flat.reshape(3, 3), np.subtract(truth.position, palm)
        return pose, self.hand.sensor_poses(truth.joint_position), contacts


def relative(before, after, i):
    """Motion of a tip's material over the object's at a contact: way [m] along x, y, z, and angle [rad]."""
    (r0, p0), tips0, points0 = before
    (r1, p1), tips1, points1 = after
    middle = 0.5 * (points0[i] + points1[i])
    q0, q1 = np.array(tips0[i].rotation), np.array(tips1[i].rotation)
    on_tip, on_object = q0.T @ (middle - tips0[i].position), r0.T @ (middle - p0)
    way = (q1 @ on_tip + tips1[i].position) - (r1 @ on_object + p1)
    normal = (p1 - points1[i]) * (1.0, 1.0, 0.0)
    normal /= np.linalg.norm(normal)
    angle = Rotation.from_matrix((q1 @ q0.T) @ (r1 @ r0.T).T).as_rotvec() @ normal
    return [*(way - normal * (normal @ way)), angle]
