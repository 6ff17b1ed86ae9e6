"""From a configuration to a regulation of force, checked and built."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Self

from palpate.controllers import ForceGain, SurfaceFilter, surface_filter
from palpate.controllers.damped_contact import DampedContact
from palpate.controllers.force_profile import ConstantForce, ForceProfile, RampForce
from palpate.controllers.force_program import StepForce, Tones
from palpate.controllers.landing import LandingModel, meeting_speed, moved_mass
from palpate.controllers.regulate import RegulateController
from palpate.controllers.regulate_parameters import RegulateParameters, live_regulation
from palpate.controllers.surface_motion import FASTEST_SURFACE
from palpate.controllers.tangent_motion import TangentMotion
from palpate.errors import InvalidValueError
from palpate.experiments.kit.checks import (
    MIN_FORCE_PER_TOUCH_FORCE,
    check_changes,
    check_force,
    check_least_force,
    check_speed,
    max_set_force,
    speed_hint,
)
from palpate.experiments.kit.one_finger import (
    CLEARANCE,
    IDENTIFIED_TEXT,
    MAX_LANDING_SPEED,
    MAX_LIFT_SPEED,
    SEARCH_DEPTH,
    Identified,
    PressingPlan,
)
from palpate.experiments.kit.scene import scene_attachments
from palpate.experiments.regulate.config import MOTION_TEXT, RegulateConfig
from palpate.experiments.regulate.motion import (
    acceleration_along,
    check_motion,
    followed_motion,
    motion_of,
    motion_text,
    speed_along,
)
from palpate.experiments.regulate.target import contact_model, depth_of, setup_of, target_of
from palpate.reporting.data import Quantity
from palpate.robots.robot import Robot
from palpate.robots.task import RobotInScene
from palpate.runtime import Limits
from palpate.sim import SceneTarget, Target

_PUSH_SHARE = 1.25
"""Largest force of a push by the model of landing, over the force limit. A dead sensor is noticed later than one
that shows the limit: with this share all dead sensors kept to 1.5 (`benchmarks/wire dead`)."""

_LANDING_SPEED_ON_MOTION = 0.0005
"""Landing speed on a surface that goes up and down [m/s]. The surface is then met less than a landing speed times
its period below its turning point, where it is slow. With 10 mm and 20 mm/s the peak is 7 N; at 4 mm/s, 15 N."""

FORCES_FILE = "forces.csv"
"""Set, felt and true force over time."""

_LIFT_DISTANCE = 0.005
"""Distance of lifting from a surface that stands still [m]."""

_STEP_IN_DELAYS = 1.5
"""Time constant of steps of the set force, in delays of force control, while the stiffness is only assumed. The
overshoot stays below 10 % for a contact three times as stiff or as soft: on stage and UR5e it is at most 7 % from
2 to 100 kN/m; with one delay it would be 15 %."""

_MIN_SETTLE_TIME, _MAX_SETTLE_TIME = 0.5, 2.0
"""Bounds on the settling time [s]."""

_SETTLED_AFTER = 4.0
"""Settling time in time constants of force control. The set force is led in over half of it: a contact three times
as stiff as assumed is pressed too hard by at most a third of the change meanwhile."""


@dataclass(frozen=True, eq=False, kw_only=True)
class RegulationPlan(PressingPlan):
    """A regulation that can be carried out: everything checked and built, nothing moved yet.

    Attributes:
        profile: Set force over time.
        motion: Motion of the tip along the surface, by something else.
        parameters: Parameters of the controller.
        contact: Model of the contact that the gain is made for; None if pressing has identified it.
        follow: Filter that follows the surface's motion.
    """

    config: RegulateConfig
    profile: ForceProfile
    motion: TangentMotion
    parameters: RegulateParameters
    contact: DampedContact | None
    follow: SurfaceFilter

    def controller(self) -> RegulateController:
        """Return a fresh controller."""
        return RegulateController(
            self.parameters, self.profile, self.period, motion=self.motion, follow=self.follow
        )

    def with_identified(self, found: Identified) -> Self:
        """Return the plan with the identified gain and the filter that follows from it."""
        gain = found.gain
        parameters = replace(
            self.parameters,
            gain=gain,
            damping_time=max(found.damping_time, 0.0),
            step_time=0.0,
            settle_time=_settle_time(gain),
        )
        follow = surface_filter(found.contact_stiffness, gain, parameters.lead)
        return replace(self, parameters=parameters, contact=None, follow=follow, identified=found)

    def attachments(self) -> dict[str, str]:
        """Return the texts of motion, identification and scene, if there are any, by file name."""
        table, target = motion_text(self.motion), self.setup.task.target
        motion = {} if table is None else {MOTION_TEXT: table}
        scene = scene_attachments(target.file) if isinstance(target, SceneTarget) else {}
        return {**motion, **super().attachments(), **scene}

    def resting_target(self) -> Target:
        """Return the object at rest."""
        return target_of(self.config, self.attachments(), at_rest=True)


def plan_regulation(config: RegulateConfig, robot: Robot, attachments: Mapping[str, str]) -> RegulationPlan:
    """Check and build everything that a regulation needs.

    Args:
        config: Configuration.
        robot: Robot that carries the fingertip.
        attachments: Texts of motion, identification and scene from a log; empty for a new run.

    Raises:
        InvalidValueError: If the regulation cannot be carried out; the message names the remedy.
    """
    target, motion = target_of(config, attachments), motion_of(config, attachments.get(MOTION_TEXT))
    profile = _profile_of(config)
    duration = profile.duration if isinstance(profile, Tones) else config.duration
    period = config.period or robot.file.period
    _check_requests(config, robot.file.limits, period)
    check_motion(config, motion, duration, period, robot.file.limits)
    setup = setup_of(config, robot, target)
    ready, along = setup.ready, speed_along(config, motion)
    push = _push_speed(config, along, setup.limits, setup.landing)
    lift_speed = min(MAX_LIFT_SPEED, setup.limits.commanded_speed)
    setup = setup.allowing("motion_speed, surface", math.hypot(along, push))
    highest = max_set_force(setup.limits)
    check_least_force(
        f"force = {config.force:g} N: the profile goes down to {config.least:g} N and",
        config.least,
        ready.touch_force,
        f"press more, up to {highest:g} N, or swing less (--swing)",
    )
    contact = contact_model(config, ready, target)
    delay = setup.landing.delay
    gain = contact.gain(delay)
    model = LandingModel(
        gain.stiffness, gain.delay, contact.stiffness, moved_mass(ready.stiffness, ready.response)
    )
    landing_speed = config.landing_speed or _landing_speed(config, model, ready)
    _check_meeting(config, model, landing_speed, setup.limits)
    sine = config.surface == "sine"
    travel = 2.0 * config.surface_amplitude if sine else 0.0  # down from where a still surface would be
    least = MIN_FORCE_PER_TOUCH_FORCE * ready.touch_force
    parameters = RegulateParameters(
        gain,
        setup.lead,
        duration,
        config.force,
        # as far as the whole profile may be moved
        (config.force - config.least + least, config.force - config.greatest + highest),
        damping_time=contact.surface_damping_time,
        step_time=_STEP_IN_DELAYS * delay,
        settle_time=_settle_time(gain),
        axis=(config.axis[0], config.axis[1], config.axis[2]) if config.axis else None,
        landing_speed=landing_speed,
        approach_distance=CLEARANCE + depth_of(target) + travel + SEARCH_DEPTH,
        # out of reach of what comes after it
        lift_distance=_LIFT_DISTANCE + travel,
        lift_speed=lift_speed + (config.surface_speed if sine else 0.0),
        fastest_push=min(push, setup.limits.commanded_speed),
    )
    check_changes(config.change, live_regulation(parameters))
    fastest = max(along, landing_speed)
    descent = parameters.approach_distance
    expected = (CLEARANCE + travel) / landing_speed + parameters.settle_time + duration + 0.5
    planned = RegulationPlan(
        setup=setup,
        config=config,
        title=f"Regulation of force on {config.described}",
        quantities=_quantities(config, parameters, expected, along),
        expected_duration=expected,
        longest_duration=2.0 * expected + 20.0,
        files=(FORCES_FILE,),
        notes=_notes(parameters, acceleration_along(motion, duration, setup.period)),
        followed=None if ready.arm is None else followed_motion(ready.arm, motion, duration, descent, fastest),
        profile=profile,
        motion=motion,
        parameters=parameters,
        contact=contact,
        follow=surface_filter(contact.surface_stiffness, gain, setup.lead),
    )
    found = attachments.get(IDENTIFIED_TEXT)
    return planned if found is None else planned.with_identified(Identified.read(found))


def _profile_of(config: RegulateConfig) -> ForceProfile:
    match config.profile:
        case "constant":
            return ConstantForce(config.force)
        case "step":
            return StepForce(config.force, config.greatest, config.hold)
        case "ramp":
            return RampForce(config.force, config.greatest, config.rate, begin=0.5)
        case "sine":
            return Tones(config.force, config.swung, config.frequencies)


def _check_requests(config: RegulateConfig, limits: Limits, period: float) -> None:
    """Refuse forces, landing speeds and frequencies beyond the limits of robot and loop."""
    check_force(config.force, config.greatest, limits)
    check_speed("landing_speed", config.landing_speed or 0.0, limits)
    highest = 0.25 / period
    if config.profile == "sine" and max(config.frequencies) > highest:
        raise InvalidValueError(
            f"frequencies = {max(config.frequencies):g} Hz: must be at most {highest:g} Hz, four periods of "
            "control to each cycle"
        )


def _quantities(
    config: RegulateConfig, parameters: RegulateParameters, expected: float, along: float
) -> tuple[Quantity, ...]:
    """Return the quantities of a dry run, the speed `along` the surface [m/s] among them."""
    return (
        Quantity("expected duration", expected, "s", "without pressing first"),
        Quantity("profile", config.profile, "", f"held for {parameters.duration:.4g} s"),
        Quantity("force", config.force, "N"),
        Quantity("greatest force asked for", config.greatest, "N"),
        Quantity("least force asked for", config.least, "N"),
        Quantity("motion", config.motion, "", "of the tip along the surface, by something else"),
        Quantity("speed", 1e3 * along, "mm/s", "largest of that motion"),
        Quantity("landing speed", 1e3 * parameters.landing_speed, "mm/s"),
        Quantity("approach distance", 1e3 * parameters.approach_distance, "mm", "where the surface is sought"),
    )


def _notes(parameters: RegulateParameters, acceleration: float) -> tuple[str, ...]:
    """Return a note for a motion with more acceleration [m/s^2] than the controller gives the tip."""
    most = parameters.tangential_acceleration
    if acceleration <= most:
        return ()
    return (
        f"The motion has accelerations of up to {acceleration:.3g} m/s^2; the tip is accelerated with at most "
        f"{most:g} m/s^2 along the surface, and falls behind there.",
    )


def _push_speed(config: RegulateConfig, along: float, limits: Limits, landing: LandingModel) -> float:
    """Return the largest speed into the surface by force errors or the surface's motion [m/s].

    On a surface that stands still, this speed keeps the force limit even if the sensor is dead.
    """
    if config.surface == "sine":
        return FASTEST_SURFACE
    harmless = landing.fastest(limits.force, _PUSH_SHARE * limits.force)
    return min(FASTEST_SURFACE, math.sqrt(max(harmless**2 - along**2, MAX_LANDING_SPEED**2)))


def _landing_speed(config: RegulateConfig, model: LandingModel, ready: RobotInScene) -> float:
    """Return the landing speed where none is given [m/s]."""
    speed = min(model.speed(config.force, min(ready.touch_force, 0.5 * config.force)), MAX_LANDING_SPEED)
    return min(speed, _LANDING_SPEED_ON_MOTION) if config.surface == "sine" else speed


def _check_meeting(config: RegulateConfig, model: LandingModel, landing_speed: float, limits: Limits) -> None:
    """Refuse to meet a surface that goes up and down with a force beyond the limit, or to follow one so fast."""
    if config.surface != "sine":
        return
    speed = config.surface_speed
    if speed > FASTEST_SURFACE:
        raise InvalidValueError(
            f"surface_speed = {speed:g} m/s: must be at most {FASTEST_SURFACE:g} m/s, the fastest that is "
            f"followed{speed_hint(speed, FASTEST_SURFACE)}"
        )
    met = meeting_speed(landing_speed, speed)
    peak = model.peak(met)
    if peak > limits.force:
        raise InvalidValueError(
            f"landing_speed = {landing_speed:g} m/s: the surface may be met at {met:.2g} m/s, and so with "
            f"about {peak:.2g} N, beyond the robot's limit of {limits.force:g} N; come down more slowly "
            "(--landing-speed), or let the surface move more slowly or less far"
        )


def _settle_time(gain: ForceGain) -> float:
    """Return the time from touching to the profile's beginning [s]: some time constants 1 / (k K) of feedback."""
    return min(max(_MIN_SETTLE_TIME, _SETTLED_AFTER / (gain.gain * gain.stiffness)), _MAX_SETTLE_TIME)
