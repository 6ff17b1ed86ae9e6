"""From a configuration to a regulation that can be carried out: everything is checked and built here."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import cast

from palpate.controllers import (
    ForceGain,
    SurfaceFilter,
    force_gain,
    series_stiffness,
    surface_filter,
    tracking_delay,
)
from palpate.controllers.force_profile import ForceProfile
from palpate.controllers.identify import IdentifyController, IdentifyParameters
from palpate.controllers.landing import LandingModel
from palpate.controllers.regulate import RegulateController, RegulateParameters
from palpate.controllers.surface_motion import FASTEST_SURFACE
from palpate.controllers.tangent_motion import TangentMotion, VelocityTable
from palpate.errors import InvalidValueError
from palpate.experiments.explore_config import LEAST_FORCE, TOUCH_DEVIATIONS, TOUCH_FORCE
from palpate.experiments.explore_plan import CLEARANCE, LANDING_SHARE
from palpate.experiments.regulate_config import RegulateConfig
from palpate.experiments.regulate_file import (
    IDENTIFIED_TEXT,
    MOTION_TEXT,
    REGULATION_TEXT,
    Identified,
    identified_text,
    read_identified,
    read_regulation,
    regulation_text,
)
from palpate.experiments.regulate_parts import (
    duration_of,
    motion_of,
    motion_text,
    profile_of,
    read_motion,
    sensor_of,
    shape_of,
    target_of,
    travel_of,
)
from palpate.experiments.robot_in_scene import build
from palpate.experiments.simulated_stage import RobotInScene, Task, only_finger, tip_sizes
from palpate.runtime import FingerDescription, Limits
from palpate.runtime.robot import Robot, load_robot, read_robot
from palpate.sim import MujocoBackend, SceneObject, Target
from palpate.sim.presets import EXPLORE

FASTEST_LANDING = 0.005
"""[m/s], however soft a surface is."""

LANDING_ON_MOTION = 0.0005
"""[m/s]. A surface that goes up and down is then met less than a landing speed times its period below its turning
point, where it is slow: on one of 10 mm and 20 mm/s the peak is 7 N, instead of 15 N at 4 mm/s."""

LIFT, LIFT_SPEED = 0.005, 0.02
"""How far [m] and how fast [m/s] it is lifted from what stands still."""

BEYOND = 0.005
"""How far below where the surface may be it is looked for [m]."""

PRESSED_SHARE = 0.5
"""Identification presses between (1 - this) and (1 + this) of the set force."""


@dataclass(frozen=True, slots=True, eq=False)
class RegulationPlan:
    """A regulation that can be carried out: everything checked and built, nothing moved yet.

    Attributes:
        config: What was asked for.
        robot: What carries it out.
        target: What is pressed on.
        profile: Of the force.
        motion: Of the tip along the surface, by something else.
        parameters: For the controller.
        follow: How the surface's motion is followed.
        finger: For touch.
        limits: For the supervisor.
        backend: The simulated robot.
        ready: The robot as built, with what is known of it.
        expected_duration: About how long it takes [s].
        identified: What pressing has found; None if nothing was pressed.
    """

    config: RegulateConfig
    robot: Robot
    target: Target
    profile: ForceProfile
    motion: TangentMotion
    parameters: RegulateParameters
    follow: SurfaceFilter
    finger: FingerDescription
    limits: Limits
    backend: MujocoBackend
    ready: RobotInScene
    expected_duration: float
    identified: Identified | None = None

    @property
    def period(self) -> float:
        """Of control [s]."""
        return self.backend.period

    def controller(self) -> RegulateController:
        """Return a fresh controller for it."""
        return RegulateController(
            self.parameters, self.profile, self.period, motion=self.motion, follow=self.follow
        )

    def identifier(self) -> IdentifyController:
        """Return a fresh controller that finds out stiffness and delay."""
        force = self.config.force
        low, high = (1.0 - PRESSED_SHARE) * force, (1.0 + PRESSED_SHARE) * force
        return IdentifyController(
            IdentifyParameters(
                low=low,
                high=high,
                swing=0.2 * (high - low),
                sensing_delay=self.finger.pipeline().delay,
                approach_distance=self.parameters.approach_distance,
            ),
            self.period,
        )

    def resting(self) -> MujocoBackend:
        """Return the same robot above the same object, which stands still: to identify it."""
        return _built(self.config, self.robot, target_of(self.config, at_rest=True)).backend

    def with_identified(self, found: Identified) -> "RegulationPlan":
        """Return the plan with gain and filter as pressing has found them."""
        gain = found.gain
        return replace(
            self,
            parameters=replace(self.parameters, gain=gain, damping_time=max(found.damping_time, 0.0)),
            follow=surface_filter(found.contact_stiffness, gain, self.parameters.lead),
            identified=found,
        )

    def texts(self) -> dict[str, str]:
        """Return everything that `plan_from_texts` needs to plan the very same again, by file name."""
        texts = {REGULATION_TEXT: regulation_text(self.config), **self.robot.texts}
        if self.config.motion == "table":
            texts[MOTION_TEXT] = motion_text(cast(VelocityTable, self.motion))
        if self.identified is not None:
            texts[IDENTIFIED_TEXT] = identified_text(self.identified)
        return texts


def plan_from_texts(texts: Mapping[str, str]) -> RegulationPlan:
    """Return the plan that `RegulationPlan.texts` came from, as a log keeps them.

    Raises:
        InvalidValueError: One is missing, or something in one is wrong.
    """
    if REGULATION_TEXT not in texts:
        raise InvalidValueError(f"{REGULATION_TEXT!r} is missing: there are {', '.join(texts) or 'no files'}")
    config = read_regulation(texts[REGULATION_TEXT])
    motion = read_motion(texts[MOTION_TEXT], MOTION_TEXT) if MOTION_TEXT in texts else None
    planned = plan(config, read_robot(texts), motion=motion)
    if IDENTIFIED_TEXT in texts:
        return planned.with_identified(read_identified(texts[IDENTIFIED_TEXT]))
    return planned


def plan(
    config: RegulateConfig,
    robot: Robot | None = None,
    target: Target | None = None,
    motion: TangentMotion | None = None,
) -> RegulationPlan:
    """Check and build everything that a regulation needs.

    Args:
        config: What to do.
        robot: What carries it out; the one that `config.robot` names, if not given.
        target: What is pressed on; what the configuration says, if not given.
        motion: Of the tip along the surface; likewise.

    Raises:
        InvalidValueError: The configuration cannot be realised; the message says what to change.
        OSError: A file of the robot cannot be read.
    """
    robot = robot or load_robot(config.robot)
    target = target or target_of(config)
    motion = motion or motion_of(config)
    profile = profile_of(config)
    duration = duration_of(config, profile)
    limits = robot.file.limits.limits()
    _check_limits(config, limits)
    ready = _built(config, robot, target)
    least = LEAST_FORCE * ready.touch_force
    if config.least < least * (1.0 - 1e-12):
        raise InvalidValueError(
            f"force = {config.force:g} N: the profile goes down to {config.least:g} N and must stay above "
            f"{least:g} N, {LEAST_FORCE:g} times what counts as a touch; press more, or swing less (--swing)"
        )
    sensing_delay = ready.finger.pipeline().delay
    period = ready.backend.period
    delay = tracking_delay(period, ready.response, sensing_delay)
    lead = tracking_delay(period, ready.lag, sensing_delay)
    assumed = config.true_stiffness if config.assumed_stiffness is None else config.assumed_stiffness
    gain = force_gain(series_stiffness(assumed, ready.stiffness), delay)
    descent = CLEARANCE + travel_of(config) + BEYOND
    model = _landing_model(gain, assumed, ready)
    landing = config.landing_speed or _landing_speed(config, model, ready)
    _check_meeting(config, model, landing, limits)
    parameters = RegulateParameters(
        gain,
        lead,
        duration,
        axis=(config.axis[0], config.axis[1], config.axis[2]) if config.axis else None,
        landing_speed=landing,
        approach_distance=descent,
        # out of reach of what comes after it
        lift_distance=LIFT + travel_of(config),
        lift_speed=LIFT_SPEED + (config.surface_speed if config.surface == "sine" else 0.0),
    )
    way = (CLEARANCE + travel_of(config)) / landing + parameters.settle_time
    return RegulationPlan(
        config,
        robot,
        target,
        profile,
        motion,
        parameters,
        surface_filter(assumed, gain, lead),
        ready.finger,
        limits,
        ready.backend,
        ready,
        way + duration + 0.5,
    )


def _built(config: RegulateConfig, robot: Robot, target: Target) -> RobotInScene:
    """The robot above the object."""
    tip = config.tip or tip_sizes(robot)
    sensor = sensor_of(robot, config)
    compression = 0.5 * config.force / config.true_stiffness
    if min(tip) <= compression:
        raise InvalidValueError(
            f"tip = {min(tip):g} m: must be larger than its compression at {config.force:g} N and "
            f"{config.true_stiffness:g} N/m, {compression:.2g} m"
        )
    noise = 0.0 if sensor.model.noise is None else max(sensor.model.noise.sd[:3])
    x, y, z = only_finger(robot).surface.center
    law = replace(
        EXPLORE.law,
        stiffness=config.true_stiffness,
        friction=config.friction,
        spin_length=config.spin_length,
    )
    task = Task(
        tip=tip,
        compression=compression,
        # a scene takes any target, though a task is declared with a surface that stands still
        target=cast(SceneObject, target),
        law=law,
        start=(-x, -y, shape_of(config).top + max(tip) + CLEARANCE - z),
        period=robot.file.period if config.period is None else config.period,
        sensor=sensor,
        touch_force=max(TOUCH_FORCE, TOUCH_DEVIATIONS * noise),
    )
    return build(robot, task)


def _landing_model(gain: ForceGain, contact: float, ready: RobotInScene) -> LandingModel:
    # what a critically damped servo of this stiffness and lag 2/w moves: K / w^2
    mass = ready.stiffness * (0.5 * ready.response) ** 2
    return LandingModel(gain.stiffness, gain.delay, contact, mass)


def _check_meeting(config: RegulateConfig, model: LandingModel, landing: float, limits: Limits) -> None:
    """Refuse to meet a surface that goes up and down with a force beyond the limit.

    The tip comes down by v P in each of the surface's periods P = 2 pi / w. So it meets the surface no more than
    that below the highest point, where a sine of amplitude A goes no faster than w sqrt(2 A v P).
    """
    if config.surface != "sine":
        return
    if config.surface_speed > FASTEST_SURFACE:
        raise InvalidValueError(
            f"surface_speed = {config.surface_speed:g} m/s: must be at most {FASTEST_SURFACE:g} m/s, the fastest "
            "that is followed"
        )
    rate = config.surface_speed / config.surface_amplitude
    below = landing * 2.0 * math.pi / rate
    upward = min(config.surface_speed, rate * math.sqrt(2.0 * config.surface_amplitude * below))
    peak = model.peak(landing + upward)
    if peak > limits.force:
        raise InvalidValueError(
            f"landing_speed = {landing:g} m/s: the surface may be met at {upward + landing:.2g} m/s, and so with "
            f"about {peak:.2g} N, beyond the robot's limit of {limits.force:g} N; come down more slowly "
            "(--landing-speed), or let the surface move more slowly or less far"
        )


def _landing_speed(config: RegulateConfig, model: LandingModel, ready: RobotInScene) -> float:
    """How fast it may land [m/s]."""
    speed = min(model.speed(config.force, min(ready.touch_force, 0.5 * config.force)), FASTEST_LANDING)
    return min(speed, LANDING_ON_MOTION) if config.surface == "sine" else speed


def _check_limits(config: RegulateConfig, limits: Limits) -> None:
    most = LANDING_SHARE * limits.force
    if config.greatest > most * (1.0 + 1e-12):
        raise InvalidValueError(
            f"force = {config.force:g} N: the profile goes up to {config.greatest:g} N and must stay below "
            f"{most:g} N, {LANDING_SHARE:.0%} of the robot's limit of {limits.force:g} N "
            "(limits.force_N in the robot file)"
        )
    for name, speed, used in (
        ("motion_speed", config.motion_speed, config.motion in ("sine", "circle")),
        ("landing_speed", config.landing_speed or 0.0, True),
    ):
        if used and speed > limits.speed:
            raise InvalidValueError(
                f"{name} = {speed:g} m/s: must be at most the robot's limit, {limits.speed:g} m/s "
                "(limits.speed_m_per_s in the robot file)"
            )
    if config.profile == "sine" and max(config.frequencies) * 4.0 * (config.period or 1e-3) > 1.0:
        highest = 0.25 / (config.period or 1e-3)
        raise InvalidValueError(
            f"frequencies = {max(config.frequencies):g} Hz: must be at most {highest:g} Hz, four periods of "
            "control to each cycle"
        )
