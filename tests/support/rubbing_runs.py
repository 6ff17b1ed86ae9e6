"""A finger that rubs and turns on a plate in MuJoCo, by the simplest of controllers: for tests and benchmarks."""

import math
from dataclasses import dataclass

import numpy as np

from palpate.friction.rubbing.stroke import RubbingStroke, TwoWay
from palpate.runtime.data import Command
from palpate.sensing.compensation import SensorPayload, contact_wrench
from palpate.sim import Box, ContactLaw, MujocoBackend, Tip, TurningStage, build_scene
from palpate.sim.friction.law import FrictionLaw
from palpate.sim.sensor.model import SeededSensor, SensorModel
from palpate.sim.sensor.stages import SampleClock, WhiteNoise, alike
from palpate.sim.sensor.temperature import TemperatureProfile, ThermalDrift
from palpate.surfaces import Sphere

PERIOD = 2e-3
PLATE = Box((0.2, 0.2, 0.04))
RADIUS, CENTER = 0.008, (0.001, -0.002, -0.02)
TIP = Tip(Sphere(RADIUS, center=CENTER))
STIFFNESS = 4e3
"""Of a rubber fingertip [N/m]; a tilt of 2 degrees at 20 mm/s would be 3 N/s, which force control follows."""

MOVED, FASTEST_FRICTION, LEAST_LIFT = 0.26, 300.0, 0.06
"""MuJoCo's friction is along b_f v + a, not along the slip v: with the usual lift-off speed of 1 m/s, b_f is 2/s,
and the tangential force of a twist is anything. Impedance 0.05 of 5 kg moves D = 0.26 kg with the contact; b_f =
f_n / (D mu lift-off speed) up to 300/s (0.15 of a time step), lift-off at three times the strokes' speed."""

LONGEST = 60.0
"""[s]: how long drift is described."""


@dataclass(frozen=True)
class Place:
    """A surface, how it is touched, and what is wrong with the touch.

    `tilt` is a rotation vector of the normal as it is taken for [rad]; `origin_error` is by how much the point
    about which moments are told lies off the sensor frame's origin [m].
    """

    friction: float = 0.5
    spin_length: float = 0.003
    force: float = 2.0
    tilt: tuple[float, float] = (0.0, 0.0)
    origin_error: tuple[float, float, float] = (0.0, 0.0, 0.0)
    seed: int = 0
    law: FrictionLaw | None = None
    sensor: SensorModel | None = None


@dataclass(frozen=True)
class Motion:
    """Sliding along `direction` and turning about the normal, both as taken for: angle [rad], m/s, rad/s, s."""

    direction: float = 0.0
    speed: float = 0.0
    spin: float = 0.0
    duration: float = 0.5

    @property
    def back(self):
        return Motion(self.direction, -self.speed, -self.spin, self.duration)


def nano17_class(rng):
    """White noise of 10 mN and 0.1 mN m at 500 Hz, drift of 1 mN/s (and 0.01 mN m/s) in a random direction."""
    way = [*_unit(rng.normal(size=3)) * 1e-3, *_unit(rng.normal(size=3)) * 1e-5]
    drift = ThermalDrift(tuple(float(x) for x in way), TemperatureProfile((0.0, LONGEST), (0.0, LONGEST)))
    return SensorModel(
        name="Nano17 class",
        source="white noise and drift as given",
        noise=WhiteNoise(alike(0.01, 1e-4)),
        clock=SampleClock(500.0),
        thermal_drift=drift,
    )


class Rubber:
    """A run: touches down, then rubs as told."""

    def __init__(self, place: Place):
        self.place, self.force = place, place.force
        rng = np.random.default_rng(place.seed)
        lift = max(LEAST_LIFT, place.force / (MOVED * place.friction * FASTEST_FRICTION))
        law = ContactLaw(STIFFNESS, place.friction, place.spin_length, smallest_force=place.force, lift_speed=lift)
        start = (-CENTER[0], -CENTER[1], PLATE.top + RADIUS - CENTER[2] + 5e-4)
        scene = build_scene(TIP, PLATE, law, start, TurningStage(), friction=place.law)
        sensor = SeededSensor(place.sensor or nano17_class(rng), place.seed)
        self.backend = MujocoBackend(scene, PERIOD, sensor)
        x, y = place.tilt
        self.normal = _unit(np.array([-y, x, -1.0]))
        self.along = _unit(np.array([1.0, 0.0, 0.0]) - self.normal[0] * self.normal)
        self.across = np.cross(self.normal, self.along)
        self.payload = SensorPayload(TIP.mass, TIP.center_of_mass)
        self.inner = 0.0
        self.sample = self.backend.start()
        self.stamp = -1.0
        while self.wrench()[:3] @ self.rotation().T @ self.normal > -0.3:
            self.step(0.003 * self.normal, np.zeros(3))
        self.rub(Motion(duration=0.4))

    def rotation(self):
        return np.array(self.sample.arm.rotation_base_tip)

    def wrench(self):
        """Contact wrench about the wrong origin."""
        given = self.sample.wrenches[0]
        w = np.array(contact_wrench(given.wrench, given.acceleration, self.payload))
        w[3:] -= np.cross(self.place.origin_error, w[:3])
        return w

    def centroid(self, rotation):
        """As taken for."""
        return np.array(CENTER) + RADIUS * rotation.T @ self.normal - self.place.origin_error

    def step(self, velocity, angular_velocity):
        self.sample = self.backend.step(
            Command(tuple(velocity.tolist()), angular_velocity_base_tip=tuple(angular_velocity.tolist()))
        )

    def rub(self, motion: Motion) -> RubbingStroke:
        """Wait for 50 ms, then move; the stroke is recorded from the wait on."""
        rows, way = [], math.cos(motion.direction) * self.along + math.sin(motion.direction) * self.across
        wait = round(0.05 / PERIOD)
        for i in range(wait + round(motion.duration / PERIOD)):
            rotation, wrench = self.rotation(), self.wrench()
            arm, stamp = self.sample.arm, self.sample.wrenches[0].time
            centroid = self.centroid(rotation)
            if stamp > self.stamp:
                self.stamp = stamp
                rows.append(
                    (stamp, wrench, rotation, arm.position_base_tip, arm.velocity_base_tip,
                     arm.angular_velocity_base_tip, centroid)
                )  # fmt: skip
            miss = self.force + wrench[:3] @ rotation.T @ self.normal
            self.inner = min(max(self.inner + 0.03 * miss * PERIOD, -0.01), 0.01)
            moving = float(i >= wait)
            spin = moving * motion.spin * self.normal
            velocity = moving * motion.speed * way - np.cross(spin, rotation @ centroid)
            self.step(velocity + (2e-3 * miss + self.inner) * self.normal, spin)
        return RubbingStroke(*(np.array(column) for column in zip(*rows, strict=True)))

    def press(self, force):
        """Press with another force from now on."""
        self.force = force
        self.rub(Motion(duration=0.3))

    def two_way(self, motion: Motion) -> TwoWay:
        return TwoWay(self.rub(motion), self.rub(motion.back))


def _unit(vector):
    return vector / np.linalg.norm(vector)
