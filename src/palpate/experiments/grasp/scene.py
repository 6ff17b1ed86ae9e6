"""What is simulated of a grasp: object, table, sensors, and what pulls."""

from dataclasses import dataclass

import numpy as np

from palpate.experiments.grasp.config import GraspConfig
from palpate.experiments.grasp.surface import rubbed_by_plant, true_surface
from palpate.kinematics.pose import Pose
from palpate.robots.hand_description import HandDescription
from palpate.robots.hand_task import HandTask
from palpate.sim import Box, CylinderObject, Lift, SceneObject, SphereObject, TurningStage
from palpate.sim.friction.law import FrictionLaw
from palpate.sim.hand.contact import GraspContact
from palpate.sim.hand.load import ObjectLoad, RampLoad, ShakenLoad, SumOfLoads
from palpate.sim.hand.scene import HeldObject
from palpate.sim.objects.table import Table
from palpate.sim.sensor.model import SeededSensor, SensorModel
from palpate.sim.sensor.presets import NET_BOX_LATENCY, NET_BOX_RATE
from palpate.sim.sensor.stages import Quantisation, SampleClock, Saturation, WhiteNoise, alike
from palpate.sim.sensor.temperature import ThermalDrift, WarmUp
from palpate.spatial import ZERO, Matrix, Vector, Wrench, rotate, scale

BRISTLE = 5e3
"""[N/m] Of the friction plant: what it bears with objects of 50 g and more and this time step."""

RATED: Wrench = (25.0, 25.0, 35.0, 0.25, 0.25, 0.25)
"""ATI Nano17, calibration SI-25-0.25 [N, N m]: a grip of 12 N would be all of SI-12-0.12."""

STEP = alike(1 / 160, 1e-3 / 32)
"""Its resolution [N, N m]."""

WARMING = WarmUp(rise=10.0, time_constant=1e5)
"""What drift is simulated with: as good as steady for as long as a run lasts; ten minutes take off 0.3 %."""

MOMENT_DRIFT = 0.01
"""Drift of a moment over that of a force [m]: as the ranges of such a sensor are, 0.25 N m and 25 N."""

COMES_UP = 0.3
"""[s] In which the pull comes up to its first value, and in which it goes away at the end."""

RESTS = 0.2
"""[s] From there to where it grows."""

HELD_AFTER = 0.5
"""[s] For which the whole pull is held."""

UPRIGHT: Matrix = ((0.0, 0.0, -1.0), (0.0, 1.0, 0.0), (1.0, 0.0, 0.0))
"""Turns a lying cylinder's axis, x, to z."""


@dataclass(frozen=True, slots=True)
class PullTimes:
    """When it is pulled.

    Attributes:
        begin: When the pull comes up [s].
        grows: When it grows, or shakes [s].
        end: When all of it was held for a while, and goes away [s].
    """

    begin: float
    grows: float
    end: float

    @property
    def gone(self) -> float:
        """When nothing pulls any more [s]."""
        return self.end + COMES_UP


def pull_times(config: GraspConfig, begin: float) -> PullTimes:
    """Return when it is pulled, if that begins at a time [s]."""
    grows = begin + COMES_UP + RESTS
    return PullTimes(begin, grows, grows + config.rising + HELD_AFTER)


def load_of(config: GraspConfig, times: PullTimes) -> ObjectLoad | None:
    """Return what pulls at the object; None: nothing."""
    if config.load == "none":
        return None
    at = scale(config.offset, _across(config))
    before = (0.0, 0.0, -config.pull_before)
    pulls: tuple[ObjectLoad, ...]
    if config.load == "shake":
        swing = (0.0, config.largest_pull, config.largest_pull)
        pulls = (ShakenLoad(swing, config.shake_frequency, times.grows, times.grows + config.rising, at),)
        most = before
    else:
        growth = (0.0, 0.0, config.pull_before - config.largest_pull)
        pulls = (RampLoad(ZERO, growth, times.grows, config.rising, at),)
        most = (0.0, 0.0, -config.largest_pull)
    away = (0.0, 0.0, -most[2])
    return SumOfLoads(
        (
            RampLoad(ZERO, before, times.begin, COMES_UP, at),
            *pulls,
            RampLoad(ZERO, away, times.end, COMES_UP, at),
        )
    )


def _across(config: GraspConfig) -> Vector:
    """Unit vector along the base frame's y, across the line of two fingers, in the object's frame."""
    return rotate(_pose(config).inverse().rotation, (0.0, 1.0, 0.0))


def shape_of(config: GraspConfig) -> SceneObject:
    """Return what is held."""
    size = config.sizes
    if config.object == "box":
        return Box((size[0], size[1], size[2]))
    return CylinderObject(size[0], size[1]) if config.object == "cylinder" else SphereObject(size[0])


def _pose(config: GraspConfig) -> Pose:
    return Pose(ZERO, UPRIGHT) if config.object == "cylinder" else Pose()


def task_of(config: GraspConfig, hand: HandDescription, times: PullTimes | None = None) -> HandTask:
    """Return what a hand is to hold.

    Args:
        config: What was asked for.
        hand: That holds it.
        times: When it is pulled; None: it is not.
    """
    true = true_surface(config)
    mu, e = true.friction, true.spin_length
    law = FrictionLaw(
        mu,
        mu,
        spin_length=e,
        load_exponent=true.load_exponent,
        norm_exponent=true.norm_exponent,
        stiffness=BRISTLE,
    )
    return HandTask(
        hand.geometry,
        HeldObject(shape_of(config), config.mass, _pose(config)),
        GraspContact(friction=mu, spin_length=e),
        Table(-config.half_height),
        TurningStage() if config.known == "nudged" else Lift(),
        law if rubbed_by_plant(config) else None,
        sensor_of(config),
        None if times is None else load_of(config, times),
        hand.period,
    )


def sensor_of(config: GraspConfig) -> SeededSensor:
    """Return the sensor behind each fingertip: of the Nano17's class, with noise and drift."""
    signs = np.random.default_rng((config.seed, 7)).choice([-1.0, 1.0], 6)
    rates = np.array(alike(config.drift, MOMENT_DRIFT * config.drift))
    a, b, c, d, e, f = (signs * rates * WARMING.time_constant / WARMING.rise).tolist()
    model = SensorModel(
        name="Nano17 SI-25-0.25, calibrated",
        rated=RATED,
        thermal_drift=ThermalDrift((a, b, c, d, e, f), WARMING) if config.drift else None,
        noise=WhiteNoise(alike(config.force_noise, config.moment_noise)),
        quantisation=Quantisation(STEP),
        saturation=Saturation(RATED),
        clock=SampleClock(NET_BOX_RATE),
        latency=NET_BOX_LATENCY,
    )
    return SeededSensor(model, 3 * config.seed)
