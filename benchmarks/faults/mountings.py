"""Wrongly mounted sensor on a tip that moves down onto a plate."""

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from faults.dead_sensor import Distorted
from faults.kind import Moment, Verdict, Workshop
from faults.on_the_loop import FORCE_EXCESS
from palpate.runtime import Finger, Limits, Supervisor, Touch, run
from palpate.runtime.data import Command, Phase
from palpate.runtime.result import Ending
from palpate.sensing.compensation import SensorPayload
from palpate.sim import ArmCarrier, Box, ContactLaw, Fidelity, MujocoBackend, Stage, Tip, build_scene, white_noise
from palpate.surfaces import Sphere

PERIOD, TIP, K, LIMIT, SPEED = 1e-3, 0.008, 20e3, 20.0, 0.01
PLATE = Box((0.2, 0.2, 0.04))

ROTATIONS = Rotation.create_group("O").as_matrix()
"""The 24 rotations that map axes to axes."""

WRONG = [matrix for matrix in ROTATIONS if not np.allclose(matrix, np.eye(3))]


def name_of(rotation):
    """Return where the true axes are shown: +x-z+y."""
    return "".join(f"{'+' if row.sum() > 0 else '-'}{'xyz'[int(np.abs(row).argmax())]}" for row in rotation)


class TurnedSensor(Distorted):
    """Sensor whose true axes are turned against those of the robot file."""

    def __init__(self, backend, rotation):
        super().__init__(backend)
        self.rotation = rotation

    def shown(self, sample):
        wrenches = []
        for each in sample.wrenches:
            force, moment = np.reshape(each.wrench, (2, 3)) @ self.rotation.T
            acceleration = tuple((self.rotation @ each.acceleration).tolist())
            wrenches.append(replace(each, wrench=(*force.tolist(), *moment.tolist()), acceleration=acceleration))
        return replace(sample, wrenches=tuple(wrenches))


class Plunge:
    """Controller that moves down at a speed [m/s], without end or until contact."""

    def __init__(self, phase, stops, speed=SPEED):
        self.phase, self.stops, self.speed = phase, stops, speed

    def start(self, first):
        pass

    def step(self, now):
        if self.stops and now.fingers[0].touching:
            return Command(phase=Phase.DONE)
        return Command((0.0, 0.0, -self.speed), self.phase)


class Slide(Plunge):
    """Controller that moves down until contact and 0.2 mm further, then sideways."""

    def __init__(self):
        super().__init__(Phase.SCAN, stops=True)
        self.floor = None

    def step(self, now):
        x, _, z = now.arm.position_base_tip
        if self.floor is None and now.fingers[0].touching:
            self.floor = z - 2e-4
        if self.floor is None or z > self.floor:
            return Command((0.0, 0.0, -SPEED), Phase.APPROACH)
        return Command(phase=Phase.DONE) if x > 0.01 else Command((SPEED, 0.0, 0.0), Phase.SCAN)


def over_plate(carrier, clearance):
    """Return a tip at this distance [m] above a plate, and its touch."""
    start = (0.0, 0.0, PLATE.top + TIP + clearance)
    scene = build_scene(Tip(Sphere(TIP)), PLATE, ContactLaw(stiffness=K), start, carrier, Fidelity(0.5e-3))
    backend = MujocoBackend(scene, PERIOD, white_noise(3.1e-3, 1.6e-5, seed=1))
    return backend, Touch(Finger(Sphere(TIP), SensorPayload(scene.tip.mass)))


def plunged(rotation, phase, arm, stops=False, speed=SPEED):
    """Return how a plunge onto a plate ended, and the largest true force [N]."""
    return moved(Plunge(phase, stops, speed), rotation, arm)


def moved(controller, rotation, arm):
    """Return how a motion ended, and the largest true force [N]."""
    backend, touch = over_plate(ArmCarrier() if arm else Stage(), 0.001)
    forces = []

    def watch(sample, now, command):
        forces.append(float(np.linalg.norm(backend.truth().force)))

    # gravity does not reveal the wrong mounting at rest: the payload is turned with the sensor
    turned, supervisor = TurnedSensor(backend, rotation), Supervisor(Limits(force=LIMIT))
    result = run(turned, touch, controller, supervisor, duration=2.0, observers=(watch,))
    return result, max(forces)


@dataclass(frozen=True, slots=True, eq=False)
class Mounted:
    """A plunge with this mounting, as an approach or without one, on stage or arm; the speed is random.

    Attributes:
        rotation: Of what is shown against what is true.
    """

    rotation: np.ndarray

    def __call__(self, moment: Moment, workshop: Workshop) -> Verdict:
        """See `Trial`."""
        approach, arm = bool(moment.seed & 1), bool(moment.seed & 2)
        speed = 0.005 + 0.015 * moment.share
        result, force = plunged(self.rotation, Phase.APPROACH if approach else Phase.SCAN, arm, speed=speed)
        problems = []
        if result.ending is not Ending.TRIPPED:
            problems.append(f"ended with {result.ending.value}")
        if not result.at_rest:
            problems.append("not reported at rest")
        if force > FORCE_EXCESS * LIMIT:
            where = f"{'arm' if arm else 'stage'}, {'approach' if approach else 'scan'}, {1e3 * speed:.0f} mm/s"
            problems.append(f"true force {force:.1f} N at a limit of {LIMIT:g} N ({where})")
        return Verdict(result.why[:60] or result.ending.value, tuple(problems))
