"""Scene and hand of a grasp: object, table, sensors, pull, and the options that a robot's hand takes."""

from dataclasses import dataclass, replace

import numpy as np

from palpate.controllers.grip.followed_zeros import FollowedZeros
from palpate.controllers.grip.zero_wander import TipOnSensor, ZeroWander
from palpate.controllers.grip.zeros import SteadyZeros, Zeros
from palpate.errors import InvalidValueError
from palpate.experiments.grasp.config import GraspConfig
from palpate.experiments.grasp.friction_belief import rubbed_by_plant, tip_radius, true_surface
from palpate.experiments.grasp.metrics import MAX_GRIP
from palpate.kinematics.pose import Pose
from palpate.robots.finger_load import noise_of_finger, wander_of_finger
from palpate.robots.hand_description import HandDescription, robots_with_hand, simulated_hand
from palpate.robots.hand_task import HandTask
from palpate.robots.robot import Robot
from palpate.runtime import Finger, FingerDescription
from palpate.runtime.touch import SensorFinger
from palpate.sensing.ft.sensor_file import ContactEntry
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
from palpate.spatial import ZERO, Matrix, Wrench, rotate, scale

_BRISTLE_STIFFNESS = 5e3
"""Stiffness of the friction plant [N/m]: the largest that is stable with objects of 50 g and this time step."""

_SENSOR_RANGE: Wrench = (25.0, 25.0, 35.0, 0.25, 0.25, 0.25)
"""Range of the ATI Nano17, calibration SI-25-0.25 [N, N m]; a grip of 12 N would be all of SI-12-0.12."""

_SENSOR_STEP = alike(1 / 160, 1e-3 / 32)
"""Resolution of that sensor [N, N m]."""

_SLOW_WARM_UP = WarmUp(rise=10.0, time_constant=1e5)
"""Warm-up by which drift is simulated: as good as steady for a run; ten minutes take off 0.3 %."""

_MOMENT_DRIFT = 0.01
"""Drift of a moment over that of a force [m]: as the ranges of such a sensor, 0.25 N m and 25 N."""

_PULL_RISE_TIME = 0.3
"""Time in which the pull rises to its first value, and falls at the end [s]."""

_PULL_REST_TIME = 0.2
"""Time from then until the pull grows [s]."""

_PULL_HOLD_TIME = 0.5
"""Time for which the whole pull is held [s]."""

_UPRIGHT_ROTATION: Matrix = ((0.0, 0.0, -1.0), (0.0, 1.0, 0.0), (1.0, 0.0, 0.0))
"""Rotation of a lying cylinder's axis, x, to z."""


@dataclass(frozen=True, slots=True)
class PullTimes:
    """Times of the pull.

    Attributes:
        begin: Beginning of the pull [s].
        grows: Beginning of its growth, or of its shaking [s].
        end: End of the whole pull, after it was held for a while [s].
    """

    begin: float
    grows: float
    end: float

    @classmethod
    def of(cls, config: GraspConfig, begin: float) -> "PullTimes":
        """Return the times of a pull that begins at a time [s]."""
        grows = begin + _PULL_RISE_TIME + _PULL_REST_TIME
        return cls(begin, grows, grows + config.rising + _PULL_HOLD_TIME)

    @property
    def gone(self) -> float:
        """Time from which nothing pulls any more [s]."""
        return self.end + _PULL_RISE_TIME


def _load(config: GraspConfig, times: PullTimes) -> ObjectLoad | None:
    """Return the pull on the object; None for none."""
    if config.load == "none":
        return None
    across = rotate(_pose(config).inverse().rotation, (0.0, 1.0, 0.0))
    at = scale(config.offset, across)
    growth: ObjectLoad
    if config.load == "shake":
        largest = config.pull_before
        swing = (0.0, config.largest_pull, config.largest_pull)
        growth = ShakenLoad(swing, config.shake_frequency, times.grows, times.grows + config.rising, at)
    else:
        largest = config.largest_pull
        growth = RampLoad(ZERO, (0.0, 0.0, config.pull_before - largest), times.grows, config.rising, at)
    before = RampLoad(ZERO, (0.0, 0.0, -config.pull_before), times.begin, _PULL_RISE_TIME, at)
    away = RampLoad(ZERO, (0.0, 0.0, largest), times.end, _PULL_RISE_TIME, at)
    return SumOfLoads((before, growth, away))


def _pose(config: GraspConfig) -> Pose:
    return Pose(ZERO, _UPRIGHT_ROTATION) if config.object == "cylinder" else Pose()


def task_of(config: GraspConfig, hand: HandDescription, times: PullTimes) -> HandTask:
    """Return the task of a hand: the object, the table, friction, sensors and pull.

    Args:
        config: Options of the grasp.
        hand: Hand that holds the object.
        times: Times of the pull.
    """
    true, size = true_surface(config), config.sizes
    shape: SceneObject
    if config.object == "box":
        shape = Box((size[0], size[1], size[2]))
    else:
        shape = CylinderObject(size[0], size[1]) if config.object == "cylinder" else SphereObject(size[0])
    law = FrictionLaw(
        true.friction,
        true.friction,
        spin_length=true.spin_length,
        load_exponent=true.load_exponent,
        norm_exponent=true.norm_exponent,
        stiffness=_BRISTLE_STIFFNESS,
    )
    return HandTask(
        hand.geometry,
        HeldObject(shape, config.mass, _pose(config)),
        GraspContact(friction=true.friction, spin_length=true.spin_length),
        Table(-config.half_height),
        TurningStage() if config.known == "nudged" else Lift(),
        law if rubbed_by_plant(config) else None,
        sensor_of(config),
        _load(config, times),
        hand.period,
    )


def sensor_of(config: GraspConfig) -> SeededSensor:
    """Return the simulated sensor behind each fingertip: of the Nano17's class, with noise and drift."""
    signs = np.random.default_rng((config.seed, 7)).choice([-1.0, 1.0], 6)
    rates = np.array(alike(config.drift_rate, _MOMENT_DRIFT * config.drift_rate))
    a, b, c, d, e, f = (signs * rates * _SLOW_WARM_UP.time_constant / _SLOW_WARM_UP.rise).tolist()
    model = SensorModel(
        name="Nano17 SI-25-0.25, calibrated",
        rated=_SENSOR_RANGE,
        thermal_drift=ThermalDrift((a, b, c, d, e, f), _SLOW_WARM_UP) if config.drift else None,
        noise=WhiteNoise(alike(config.force_noise, config.moment_noise)),
        quantisation=Quantisation(_SENSOR_STEP),
        saturation=Saturation(_SENSOR_RANGE),
        clock=SampleClock(NET_BOX_RATE),
        latency=NET_BOX_LATENCY,
    )
    return SeededSensor(model, 3 * config.seed)


def grasp_hand(config: GraspConfig, robot: Robot | None) -> HandDescription:
    """Return the hand of a grasp.

    Args:
        config: Options of the grasp.
        robot: Robot that `config.robot` names; None for the simulated hand.

    Raises:
        InvalidValueError: If the robot has no hand, another number of fingers, or too low a grip limit.
    """
    if robot is None:
        return simulated_hand(config.fingers)
    if not robot.file.backend.has_hand(robot):
        raise InvalidValueError(
            f"robot = {config.robot}: it has no hand of two or three fingers; leave --robot out for the simulated "
            f"hand, or take {robots_with_hand()}, or a robot file with backend.hand"
        )
    count = len(robot.file.fingers)
    if config.fingers != count:
        raise InvalidValueError(f"fingers = {config.fingers}: {config.robot} has {count}; give --fingers {count}")
    if robot.file.limits.grip_force < MAX_GRIP:
        raise InvalidValueError(
            f"limits.grip_force_N = {robot.file.limits.grip_force:g} of {config.robot}: must be at least "
            f"{MAX_GRIP:g} N, which a grasp may ask of a finger"
        )
    return robot.file.backend.described_hand(robot)


def config_on(config: GraspConfig, hand: HandDescription) -> GraspConfig:
    """Return the options for a hand: on a real one, without those that only a simulated hand can follow.

    Raises:
        InvalidValueError: If such an option was given, or the friction of a real object is not given.
    """
    if hand.robot is None or not hand.real:
        return config
    for name in ("friction", "spin_length", "norm_exponent", "load_exponent"):
        if getattr(config, name) is not None:
            raise InvalidValueError(
                f"{name} = {getattr(config, name):g}: is the truth of a simulated object, and {config.robot} is a "
                "robot; give what is believed (--friction-file, or --believed-friction and --believed-spin-length)"
            )
    if config.friction_file is None and not (config.believed_friction and config.believed_spin_length):
        raise InvalidValueError(
            f"robot = {config.robot}: the friction of a real object is unknown; give --friction-file (palpate "
            "friction writes it), or --believed-friction and --believed-spin-length"
        )
    if config.load not in ("ramp", "none"):
        raise InvalidValueError(
            f"load = {config.load}: nothing is simulated that pulls at a real object; leave --load out, and "
            "give --rise for how long it is held"
        )
    if config.plant or config.against_ignoring_spin or config.ignores_spin:
        raise InvalidValueError(
            "plant, controller = coulomb, against_ignoring_spin: are for simulation; leave them out on a robot"
        )
    noises = [noise_of_finger(hand.robot, i) for i in range(config.fingers)]
    return replace(
        config,
        load="none",
        pull=None,
        pull_before=0.0,
        force_noise=max(max(noise[:3]) for noise in noises),
        moment_noise=max(max(noise[3:]) for noise in noises),
        drift=0.0,
    )


def wander_of(config: GraspConfig, hand: HandDescription) -> ZeroWander:
    """Return how fast a sensor's zero may wander: as simulated, or by the robot file of the worst finger."""
    if hand.robot is None or not hand.real:
        return ZeroWander(config.drift_rate, _MOMENT_DRIFT * config.drift_rate)
    rates = [wander_of_finger(hand.robot, i) for i in range(config.fingers)]
    return ZeroWander(max(force for force, _ in rates), max(moment for _, moment in rates))


def zeros_of(config: GraspConfig, hand: HandDescription, fingers: tuple[FingerDescription, ...]) -> Zeros:
    """Return the tracking of the sensors' zeros; a passive one where they do not wander."""
    wander, tip, finger = wander_of(config, hand), hand.geometry.tips[0], fingers[0]
    if wander.force == wander.moment == 0.0:
        return SteadyZeros()
    contact = finger.sensor.contact if isinstance(finger, SensorFinger) else finger
    assert isinstance(contact, ContactEntry | Finger)
    f, m = config.force_noise, config.moment_noise
    return FollowedZeros(
        [each.surface for each in fingers],
        TipOnSensor(tip_radius(tip), tip.center_of_mass),
        wander,
        (f, f, f, m, m, m),
        hand.period,
        contact.touch_force,
        contact.release_force,
    )
