"""A fingertip sent over an object: how well force is held and surface found, against the simulation's truth.

What is measured is scene, sensing and palpate's own controller together, on one raster of three rows.
"""

from dataclasses import dataclass, field

import mujoco
import numpy as np

from palpate.controllers import (
    ExploreController,
    ExploreParameters,
    Raster,
    force_gain,
    series_stiffness,
    tracking_delay,
)
from palpate.controllers.paths import Follow
from palpate.errors import InvalidValueError
from palpate.runtime import Command, Finger, Touch
from palpate.runtime.data import Observation, Phase, Sample
from palpate.sensing.compensation import SensorPayload
from palpate.sim import (
    ArmCarrier,
    Carrier,
    ContactLaw,
    EllipsoidObject,
    Fidelity,
    MujocoBackend,
    Scene,
    SceneObject,
    SeededSensor,
    SphereObject,
    Stage,
    Tip,
    build_scene,
)
from palpate.sim.friction.law import FrictionLaw
from palpate.sim.presets import EXPLORE
from palpate.surfaces import Sphere

PERIOD = 1e-3  # [s]: 1 kHz
RADIUS = 0.008  # [m]
TIP = Tip(Sphere(RADIUS))
RASTER = Raster(0.02, 0.004, 0.002)  # [m]
CLEARANCE = 0.001  # of the start over the object [m]
TOUCH_FORCE = 0.1  # [N]: below every force that is asked for
TOUCH_SIGMAS = 7.0  # of the sensor's noise, as in palpate's own explorations
DOWN = (0.0, 0.0, -1.0)
LONGEST = 20_000  # periods; none takes a third of it
SPHERE, ELLIPSOID = SphereObject(0.04), EllipsoidObject((0.05, 0.04, 0.03))


@dataclass(frozen=True, slots=True)
class Touching:
    """One way to simulate a tip on an object.

    Attributes:
        fidelity: How the scene is computed.
        law: Contact of tip and object.
        carrier: What carries the tip.
        sensor: Behind it.
        payload: What sensing takes the tip for; nothing: weight and inertia stay in the wrench.
        plant: Friction by the friction plant instead of MuJoCo's.
        every_collision: Whether every shape may hit every other, besides the explicit pair.
        period: Of control [s].
    """

    fidelity: Fidelity = EXPLORE.fidelity
    law: ContactLaw = EXPLORE.law
    carrier: Carrier = EXPLORE.carrier
    sensor: SeededSensor = field(default_factory=SeededSensor)
    payload: SensorPayload = field(default_factory=lambda: SensorPayload(TIP.mass, TIP.center_of_mass))
    plant: FrictionLaw | None = None
    every_collision: bool = False
    period: float = PERIOD

    def scene(self, target: SceneObject, start: tuple[float, float, float]) -> Scene:
        """Build it."""
        scene = build_scene(TIP, target, self.law, start, self.carrier, self.fidelity, self.plant)
        if self.every_collision:
            let_everything_collide(scene.model)
        return scene

    def backend(self, scene: Scene) -> MujocoBackend:
        """Return a back end with its sensor."""
        return MujocoBackend(scene, self.period, self.sensor)


def let_everything_collide(model: mujoco.MjModel) -> None:
    """Switch collisions of all shapes on, besides the explicit pairs, which stay as they are.

    MuJoCo leaves out shapes fixed to one another, parents and children, and pairs that are explicit already.
    """
    model.geom_contype[:], model.geom_conaffinity[:] = 1, 1
    model.body_contype[:], model.body_conaffinity[:] = 1, 1  # the broad phase works per body


class Exploration:
    """A run, period by period: `observe`, `decide` and `act` in turns."""

    def __init__(self, choice: Touching, target: SceneObject, force: float, speed: float) -> None:
        x, y = RASTER.corners()[0]
        start = (x, y, target.top + RADIUS + CLEARANCE)
        self.choice, self.target, self.force = choice, target, force
        self.backend = choice.backend(choice.scene(target, start))
        lag, response, stiffness = _servos(choice.carrier, start)
        sensor = choice.sensor.model
        parameters = ExploreParameters(
            force=force,
            speed=speed,
            gain=force_gain(
                series_stiffness(choice.law.stiffness, stiffness),
                tracking_delay(choice.period, response, sensor.delay),
            ),
            lead=tracking_delay(choice.period, lag, sensor.delay),
        )
        # half of the compression is the tip's: it is sensed as so much smaller
        self.half_compliance = 0.5 / choice.law.stiffness
        sensed = Sphere(RADIUS - force * self.half_compliance)
        touch_force = max(TOUCH_FORCE, TOUCH_SIGMAS * max(sensor.noise_sd[:3]))
        self.touch = Touch(Finger(sensed, choice.payload, touch_force, touch_force / 2.0))
        self.controller = ExploreController(parameters, Follow(RASTER), choice.period)
        self.sample: Sample = self.backend.start()
        self.observation: Observation = self.touch.sense(self.sample)
        self.controller.start(self.observation)

    def step(self) -> Command:
        """Run one whole period."""
        command = self.controller.step(self.observation)
        self.sample = self.backend.step(command)
        self.observation = self.touch.sense(self.sample)
        return command

    def row(self) -> tuple[float, ...]:
        """Return what is of interest: touching, true force, sensed normal, sensed point, sensed normal force."""
        truth, contact = self.backend.truth(), self.observation.fingers[0].contact
        origin = self.sample.arm.position_base_tip
        rotation = np.array(self.sample.arm.rotation_base_tip)
        n = rotation @ contact.normal
        c = rotation @ contact.centroid + origin
        return (float(truth.touching), *truth.force, *n.tolist(), *c.tolist(), contact.normal_force)


@dataclass(frozen=True, slots=True)
class Explored:
    """What came of one or more runs.

    Attributes:
        done: Whether all of them reached their end.
        force_rms: Of the true normal force's error while scanning [N].
        point_rms: Distance of the points found to the true surface [m].
        touching: Least share of the time in contact while scanning.
    """

    done: bool
    force_rms: float
    point_rms: float
    touching: float


REFUSED = Explored(False, float("nan"), float("nan"), float("nan"))
"""What comes of a scene that cannot be built."""


def explore(choice: Touching, target: SceneObject, force: float, speed: float) -> Explored:
    """Run an exploration."""
    try:
        run = Exploration(choice, target, force, speed)
    except InvalidValueError:
        return REFUSED
    rows, ended = [], False
    try:
        for _ in range(LONGEST):
            command = run.step()
            if command.phase == Phase.SCAN:
                rows.append(run.row())
            if command.phase in (Phase.DONE, Phase.LOST):
                ended = command.phase == Phase.DONE
                break
    except (ArithmeticError, InvalidValueError):  # diverged, or a bristle that the step cannot follow
        return REFUSED
    if not rows:
        return REFUSED
    table = np.array(rows)
    touching, force_now = table[:, 0] > 0.0, table[:, 1:4]
    n, c, felt = table[:, 4:7], table[:, 7:10], table[:, 10]
    error = -np.sum(force_now * n, axis=1) - force
    # the object's own half of the compression, and the tip's beyond that at the set force
    offset = run.half_compliance * (2.0 * felt - force)
    distance = target.signed_distance(c - offset[:, None] * n)[touching]
    return Explored(ended, rms(error), rms(distance), float(touching.mean()))


def rms(values: np.ndarray) -> float:
    """Return the root mean square; NaN of nothing."""
    return float(np.sqrt(np.mean(np.square(values)))) if values.size else float("nan")


def _servos(carrier: Carrier, start: tuple[float, float, float]) -> tuple[float, float, float]:
    """How a carrier lags a ramp [s], its delay in force control [s] and its stiffness [N/m]."""
    if isinstance(carrier, ArmCarrier):
        arm = carrier.arm
        return 0.0, arm.lead, arm.push(carrier.joint_start(start), DOWN) / arm.following_error_limit.distance
    assert isinstance(carrier, Stage)
    return carrier.lag, carrier.lag, carrier.stiffness(TIP.mass)
