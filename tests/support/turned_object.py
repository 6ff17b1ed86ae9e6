"""A run of the turning hand: close, lift, turn; watched by what really happens, material point by point."""

import math

import mujoco
import numpy as np

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
    """What its fingers feel with."""
    tip = Finger(hand.tip.surface, SensorPayload(hand.tip.mass, hand.tip.center_of_mass))
    return Touch(*[tip] * hand.fingers)


class Turned:
    """A run up to the lifted object; `turn` goes on.

    Attributes:
        moved: Largest way of a tip's material over the object's at the contact since the turn began [m].
        spun: Likewise about the normal [rad].
        slip, spin: The same without what contacts give way elastically, added up; only a friction plant knows it
            apart, by MuJoCo's friction it is all slip.
        off: Largest difference between the turn that touch tells and the true one [rad].
    """

    def __init__(
        self,
        target=CYLINDER,
        load=None,
        friction=BRISTLES,
        noise=True,
        seed=1,
        offset=0.0,
        hand=None,
        need=None,
        shared=False,
    ):
        hand = hand or turning_hand()
        scene = build_grasp_scene(
            hand,
            target,
            GraspContact(friction=0.5, spin_length=0.004),
            carrier=Lift(),
            table=Table(-RADIUS),
            palm=(offset, 0.0, hand.depth + hand.tip_along),
            friction=friction,
        )
        sensor = white_noise(0.01, 1e-4, seed=seed) if noise else None
        self.backend = HandBackend(scene, PERIOD, sensor=sensor, load=load)
        self.hand, self.model = hand, scene.model
        self.touch = touch_of(hand)
        belief = KnownSurface(KNOWN)
        plan = CommonGrip(hand.fingers, belief, PERIOD, need=need)
        if shared:
            plan = SharedGrip(hand.fingers, belief, PERIOD, hand)
        self.grip = SlipSafeGrip(hand.fingers, belief, PERIOD, plan=plan)
        lift = LiftController(self.grip, PERIOD, LIFT)
        self.now = self.touch.sense(self.backend.start())
        lift.start(self.now)
        command = lift.step(self.now)
        while not command.phase.is_final:
            self.now = self.touch.sense(self.backend.step(command))
            command = lift.step(self.now)
        assert command.phase is Phase.DONE

    def turn(self, *angles, watch=lambda run: None, **parameters):
        """Turn until the controller ends; returns the turn that really happened [rad]."""
        self.controller = TurnInHand(self.grip, self.hand, PERIOD, TurnParameters(angles, **parameters))
        self.controller.start(self.now)
        begin, before = self._object(), self._world()
        n = self.hand.fingers
        slips, spins = [np.zeros(3) for _ in range(n)], [0.0] * n
        self.moved = self.spun = self.off = self.true = 0.0
        sliding, spinning = np.zeros(n), np.zeros(n)
        self.least, self.most, self.commands = math.inf, 0.0, []
        command = self.controller.step(self.now)
        while not command.phase.is_final:
            self.commands.append(command)
            self.now = self.touch.sense(self.backend.step(command))
            world = self._world()
            for i in range(n):
                way, angle, normal = relative(before, world, i)
                slips[i], spins[i] = slips[i] + way - normal * (normal @ way), spins[i] + angle
                self.moved = max(self.moved, float(np.linalg.norm(slips[i])))
                self.spun = max(self.spun, abs(spins[i]))
            for i, contact in enumerate(self.backend.rubbing):
                sliding[i] += PERIOD * math.hypot(*contact.slip_velocity)
                spinning[i] += PERIOD * abs(contact.slip_spin)
            before = world
            self.true = yaw(self._object()[0] @ begin[0].T)
            grips = [self.pressed(finger) for finger in self.backend.truth().fingers]
            self.least, self.most = min(self.least, *grips), max(self.most, *grips)
            command = self.controller.step(self.now)
            self.off = max(self.off, abs(self.controller.turn - self.true))
            watch(self)
        self.commands.append(command)
        rigid = not self.backend.rubbing
        self.slip = self.moved if rigid else float(sliding.max())
        self.spin = self.spun if rigid else float(spinning.max())
        self.sunk = begin[1][2] - self._object()[1][2]
        self.astray = self._object()[1][:2] - begin[1][:2]
        return self.true

    def pressed(self, finger):
        """The normal force of a finger, from its true force and where it touches."""
        normal = np.subtract(finger.position, self.backend.truth().position)[:2]
        return float(np.dot(finger.force[:2], normal) / np.linalg.norm(normal))

    def _object(self):
        """Rotation and position of the object in the hand frame, which does not turn."""
        truth, flat = self.backend.truth(), np.zeros(9)
        mujoco.mju_quat2Mat(flat, truth.quat_wxyz)
        return flat.reshape(3, 3), np.subtract(truth.position, self.now.arm.position_base_tip)

    def _world(self):
        """Object, tips and contacts, hand frame."""
        truth = self.backend.truth()
        fingers, joints = truth.fingers, truth.joint_position
        assert all(finger.touching for finger in fingers)
        palm = self.now.arm.position_base_tip
        return self._object(), self.hand.sensor_poses(joints), [np.subtract(f.position, palm) for f in fingers]


def relative(before, after, i):
    """How far the tip's material has moved over the object's at a contact: way [m], angle [rad], normal."""
    (r0, p0), tips0, points0 = before
    (r1, p1), tips1, points1 = after
    middle = 0.5 * (points0[i] + points1[i])
    q0, q1 = np.array(tips0[i].rotation), np.array(tips1[i].rotation)
    on_tip = q0.T @ (middle - tips0[i].position)
    on_object = r0.T @ (middle - p0)
    way = (q1 @ on_tip + tips1[i].position) - (r1 @ on_object + p1)
    normal = p1 - points1[i]
    normal[2] = 0.0
    normal /= np.linalg.norm(normal)
    relative_turn = (q1 @ q0.T) @ (r1 @ r0.T).T
    vector = 0.5 * np.array(
        [
            relative_turn[2, 1] - relative_turn[1, 2],
            relative_turn[0, 2] - relative_turn[2, 0],
            relative_turn[1, 0] - relative_turn[0, 1],
        ]
    )
    return way, float(vector @ normal), normal


def yaw(rotation):
    """The angle about z [rad]."""
    return math.atan2(rotation[1, 0] - rotation[0, 1], rotation[0, 0] + rotation[1, 1])
