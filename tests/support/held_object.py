"""Hands that hold an object in simulation: to grip, lift, lead and pull it, and where it is in the hand."""

import math

import mujoco
import numpy as np

from palpate.kinematics.pose import Pose
from palpate.runtime.data import Command
from palpate.sim import Box, Lift
from palpate.sim.hand.hand import two_finger_hand
from palpate.sim.hand.scene import HeldObject, build_grasp_scene
from palpate.sim.objects.table import Table
from support.simulated import angle_between, move, started

BOX = Box((0.06, 0.05, 0.06))


def standing(hand=None, shape=BOX, mass=0.1, carrier=None, sensor=None, load=None, table=-0.03, **scene):
    """Return a started back end: an open hand around an object on a table."""
    target = shape if isinstance(shape, HeldObject) else HeldObject(shape, mass)
    scene = build_grasp_scene(
        hand or two_finger_hand(), target, carrier=carrier or Lift(), table=Table(table), **scene
    )
    return started(scene, sensor=sensor, load=load)


def press(backend, force, seconds=1.0, start=0.0, rate=10.0):
    """Ramp the grip [N] from `start` to `force` at `rate` [N/s] and hold it; return the last sample."""
    n, way = backend.scene.hand.fingers, math.copysign(rate * backend.period, force - start)
    for i in range(math.ceil(abs(force - start) / abs(way))):
        backend.step(Command(grip_force=(start + (i + 1) * way,) * n))
    for _ in range(round(seconds / backend.period)):
        sample = backend.step(Command(grip_force=(force,) * n))
    return sample


def held(force, seconds=1.2, **scene):
    """Return a back end whose object is lifted off its table, at rest."""
    backend = standing(**scene)
    press(backend, force, seconds)
    move(backend, 450, (0.0, 0.0, 0.02))
    move(backend, 450)
    return backend


def normal_force(finger):
    """Force [N] across the axis of the hand."""
    return math.hypot(finger.force[0], finger.force[1])


def wrench_of_fingers(truth):
    """Return the force and the moment about the object's origin that it exerts on the fingers, base frame."""
    forces = [finger.force for finger in truth.fingers]
    moments = [np.cross(np.subtract(f.position, truth.position), f.force) + f.torque for f in truth.fingers]
    return np.concatenate([np.sum(forces, axis=0), np.sum(moments, axis=0)])


def lead_object(backend):
    """Make the object so heavy that no contact changes its velocity, and weightless; the contact law stays."""
    model, body = backend.scene.model, backend.scene.model.body("object").id
    kept = model.body_invweight0.copy(), model.dof_invweight0.copy()
    model.body_mass[body], model.body_inertia[body], model.body_gravcomp[body] = 100.0, [1.0] * 3, 1.0
    mujoco.mj_setConst(model, mujoco.MjData(model))
    model.body_invweight0[:], model.dof_invweight0[:] = kept


def led(backend, periods, *velocity):
    """Yield the truth while the object moves at a twist [m/s, rad/s] that nothing changes."""
    at = int(backend.scene.model.joint("object").dofadr[0])
    for _ in range(periods):
        backend._data.qvel[at : at + 6] = velocity
        backend.step(Command())
        yield backend.truth()


def pull(backend, *force):
    """Apply a force [N] to the object, base frame."""
    backend._data.xfrc_applied[backend.scene.model.body("object").id, :3] = force


def object_in_hand(backend, sample):
    """Return the object's pose in the hand frame."""
    truth, flat = backend.truth(), np.zeros(9)
    mujoco.mju_quat2Mat(flat, truth.quat_wxyz)
    rotation = tuple(map(tuple, flat.reshape(3, 3).tolist()))
    palm = Pose(sample.arm.position_base_tip, sample.arm.rotation_base_tip)
    return palm.inverse() @ Pose(truth.position, rotation)


def slipped(after, before):
    """Return how far the object has moved and turned in the hand [m, rad]."""
    return math.dist(after.position, before.position), angle_between(after.rotation, before.rotation)
