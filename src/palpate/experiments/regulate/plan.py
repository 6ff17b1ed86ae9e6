"""From a configuration to a regulation that can be carried out: everything is checked and built here."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Self

from palpate.controllers import ForceGain, IdentifyParameters, SurfaceFilter, surface_filter, tracking_delay
from palpate.controllers.damped_contact import DampedContact
from palpate.controllers.force_profile import ForceProfile
from palpate.controllers.identify import IdentifyController
from palpate.controllers.landing import LandingModel
from palpate.controllers.regulate import RegulateController
from palpate.controllers.regulate_parameters import RegulateParameters, live_regulation
from palpate.controllers.surface_motion import FASTEST_SURFACE
from palpate.controllers.tangent_motion import PathTable, TangentMotion, VelocityTable
from palpate.errors import InvalidValueError
from palpate.experiments.kit.allowed_speed import limits_allowing
from palpate.experiments.kit.change_names import check_changes
from palpate.experiments.kit.contact_checks import (
    LEAST_FORCE,
    LEAST_TOUCH_FORCE,
    MOST_FORCE,
    TOUCH_DEVIATIONS,
    check_compression,
)
from palpate.experiments.kit.experiment import DryRun
from palpate.experiments.kit.joint_quantities import joint_notes, joint_quantities
from palpate.experiments.kit.limit_quantities import limit_quantities
from palpate.experiments.kit.one_finger import ReadyPlan
from palpate.experiments.kit.pressing import IDENTIFIED_TEXT, identified_text, pressed, pressing, read_identified
from palpate.experiments.kit.run_checks import CLEARANCE, LANDING_SHARE, check_force, check_speed
from palpate.experiments.kit.scene_texts import scene_texts
from palpate.experiments.regulate.config import LARGEST_MOTION, MOTION_TEXT, RegulateConfig
from palpate.experiments.regulate.identified import Identified
from palpate.experiments.regulate.landing import (
    FASTEST_LANDING,
    LIFT_SPEED,
    check_meeting,
    landing_model,
    landing_speed,
)
from palpate.experiments.regulate.motion import motion_text
from palpate.experiments.regulate.parts import (
    contact_model,
    depth_of,
    duration_of,
    motion_of,
    profile_of,
    sensor_of,
    target_of,
    travel_of,
)
from palpate.kinematics import FollowedPath, StandingArm, follow_path
from palpate.reporting.data import Quantity
from palpate.robots.fingertip import fingertip, start_above
from palpate.robots.in_scene import build
from palpate.robots.known_truth import known_scene
from palpate.robots.robot import Robot
from palpate.robots.task import RobotInScene, Task
from palpate.runtime import Backend, Limits
from palpate.runtime.live import Change
from palpate.sim import MovingTarget, SceneTarget, Target
from palpate.sim.presets import EXPLORE
from palpate.sim.scene import OBJECT_GEOM
from palpate.spatial import add_scaled

if TYPE_CHECKING:
    from palpate.viewing import ViewScene


FARTHEST_MOTION = 1.8 * LARGEST_MOTION
"""How far from its beginning a motion from a file may lead along x or y [m]: the plate ends after 0.1 m."""

PUSH_SHARE = 1.25
"""Of the force limit, that a push may reach by the model of a landing. A sensor that is dead is noticed later than
one that shows the limit: with it all dead sensors kept to 1.5 (`benchmarks/wire dead`)."""


def check_limits(config: RegulateConfig, motion: TangentMotion, limits: Limits) -> None:
    """Refuse forces, speeds, distances and frequencies beyond what robot and loop can do.

    Raises:
        InvalidValueError: One is.
    """
    check_force(config.force, config.greatest, limits)
    check_speed("landing_speed", config.landing_speed or 0.0, limits)
    if isinstance(motion, PathTable | VelocityTable):
        check_speed(f"motion_file = {config.motion_file}: its fastest", motion.fastest, limits)
        if motion.farthest > FARTHEST_MOTION:
            raise InvalidValueError(
                f"motion_file = {config.motion_file}: it goes {motion.farthest:.3g} m away from where it begins: "
                f"must be at most {FARTHEST_MOTION:g} m, or the tip would leave the plate; metres are meant"
            )
    elif config.motion != "still":
        check_speed("motion_speed", config.motion_speed, limits)
    if config.profile == "sine" and max(config.frequencies) * 4.0 * (config.period or 1e-3) > 1.0:
        highest = 0.25 / (config.period or 1e-3)
        raise InvalidValueError(
            f"frequencies = {max(config.frequencies):g} Hz: must be at most {highest:g} Hz, four periods of "
            "control to each cycle"
        )


def fastest_along(config: RegulateConfig, motion: TangentMotion) -> float:
    """Return the largest speed of the motion along the surface [m/s]."""
    if isinstance(motion, PathTable | VelocityTable):
        return motion.fastest
    return 0.0 if config.motion == "still" else config.motion_speed


def fastest_push(config: RegulateConfig, along: float, limits: Limits, landing: LandingModel) -> float:
    """Return with which speed a force error or a surface that moves may have the tip pushed at most [m/s].

    Onto what stands still no faster than the force limit is kept with, were the sensor dead.
    """
    if config.surface == "sine":
        return FASTEST_SURFACE
    harmless = landing.fastest(limits.force, PUSH_SHARE * limits.force)
    return min(FASTEST_SURFACE, math.sqrt(max(harmless**2 - along**2, FASTEST_LANDING**2)))


def most_force(limits: Limits) -> float:
    """Return the largest force that may be asked for [N]."""
    return min(MOST_FORCE, LANDING_SHARE * limits.force)


def built(config: RegulateConfig, robot: Robot, target: Target) -> RobotInScene:
    """Return the robot above the object.

    Raises:
        InvalidValueError: The fingertip is smaller than its compression, or a real surface is to move.
    """
    if robot.file.backend.REAL and config.surface != "still":
        raise InvalidValueError(
            f"surface = {config.surface}: is for simulated objects; a real one does as it likes: leave it still"
        )
    tip = fingertip(robot, config.tip)
    sensor = sensor_of(robot, config)
    compression = 0.5 * config.force / config.true_stiffness
    check_compression(tip.half_extents, config.force, config.true_stiffness)
    noise = 0.0 if sensor.model.noise is None else max(sensor.model.noise.sd[:3])
    law = replace(
        EXPLORE.law,
        stiffness=config.true_stiffness,
        friction=config.friction,
        spin_length=config.spin_length,
    )
    task = Task(
        tip=tip,
        compression=compression,
        target=target,
        law=law,
        start=start_above(tip, target.shape.top, CLEARANCE),
        period=config.period or robot.file.period,
        sensor=sensor,
        touch_force=max(LEAST_TOUCH_FORCE, TOUCH_DEVIATIONS * noise),
    )
    return build(robot, task)


FORCES_FILE = "forces.csv"
"""Set, felt and true force over time."""

LIFT = 0.005
"""How far it is lifted from what stands still [m]."""

BEYOND = 0.005
"""How far below where the surface may be it is looked for [m]."""

STEP_IN_DELAYS = 1.5
"""Time constant in which a set force that jumps is gone over to, in delays of force control, while the stiffness
is only assumed: it overshoots by no more than 10 % then, be the contact three times as stiff or as soft. Measured
on stage and UR5e from 2 to 100 kN/m: 7 % at most; in one delay it would be 15 %."""

SHORTEST_SETTLING, LONGEST_SETTLING = 0.5, 2.0
"""[s]"""

SETTLED_AFTER = 4.0
"""Time constants of force control, half of which the set force is led in: what is three times as stiff as it was
taken for is pressed too hard by a third of the change meanwhile, at most."""


MOTION_STEP, MOST_STEPS = 0.01, 20_000
"""[s] At which the motion is looked up to see whether joints can follow; and how often at most."""

LONGEST_PRESSING = 120.0
"""Bounds how long it presses first [s]: it takes about 30."""


@dataclass(frozen=True, slots=True, eq=False)
class RegulationPlan(ReadyPlan):
    """A regulation that can be carried out: everything checked and built, nothing moved yet.

    Attributes:
        config: What was asked for.
        robot: What carries it out.
        target: What is pressed on.
        profile: Of the force.
        motion: Of the tip along the surface, by something else.
        parameters: For the controller.
        contact: What the gain is made for; None if pressing has found it.
        follow: How the surface's motion is followed.
        limits: For the supervisor.
        ready: The robot as built, for what is known of it.
        followed: What the motion asks of the arm's joints; None: palpate does not move them.
        expected_duration: About how long it takes [s].
        identified: What pressing has found; None if nothing was pressed.
    """

    config: RegulateConfig
    robot: Robot
    target: Target
    profile: ForceProfile
    motion: TangentMotion
    parameters: RegulateParameters
    contact: DampedContact | None
    follow: SurfaceFilter
    limits: Limits
    ready: RobotInScene
    followed: FollowedPath | None
    expected_duration: float
    identified: Identified | None = None

    @property
    def longest_duration(self) -> float:
        """After which it is stopped [s]."""
        return 2.0 * self.expected_duration + 20.0

    @property
    def period(self) -> float:
        """Of control [s]."""
        return self.ready.backend.period

    def backend(self) -> Backend:
        """Return the robot above the object."""
        return built(self.config, self.robot, self.target).backend

    def controller(self) -> RegulateController:
        """Return a fresh controller for it."""
        return RegulateController(
            self.parameters, self.profile, self.period, motion=self.motion, follow=self.follow
        )

    def changes(self) -> tuple[Change, ...]:
        """Return the changes of live parameters that were asked for beforehand."""
        return tuple(Change(*change) for change in self.config.change)

    @property
    def preparation(self) -> str:
        """Pressing, if that was asked for and has not been done."""
        wanted = self.config.identify and self.identified is None
        return "pressing, to find stiffness and delay" if wanted else ""

    def prepared(self) -> Self:
        """Press first, if that was asked for, and return the plan with gain and filter that follow.

        Raises:
            InvalidValueError: Pressing has found nothing; the message names the reason.
        """
        return self.with_identified(self._pressed()) if self.preparation else self

    def with_identified(self, found: Identified) -> Self:
        """Return the plan with gain and filter as pressing has found them."""
        gain = found.gain
        return replace(
            self,
            parameters=replace(
                self.parameters,
                gain=gain,
                damping_time=max(found.damping_time, 0.0),
                step_time=0.0,
                settle_time=_settle_time(gain),
            ),
            contact=None,
            follow=surface_filter(found.contact_stiffness, gain, self.parameters.lead),
            identified=found,
        )

    def texts(self) -> Mapping[str, str]:
        """Return motion, identification and scene, if there are any, by file name."""
        table = motion_text(self.motion)
        found = {} if self.identified is None else {IDENTIFIED_TEXT: identified_text(self.identified)}
        scene = scene_texts(self.target.file) if isinstance(self.target, SceneTarget) else {}
        return {**({} if table is None else {MOTION_TEXT: table}), **found, **scene}

    def dry_run(self) -> DryRun:
        """Return what it would do."""
        config, parameters = self.config, self.parameters
        speed = 0.0 if config.motion == "still" else 1e3 * config.motion_speed
        return DryRun(
            f"Regulation of force on {config.described}",
            (
                Quantity("expected duration", self.expected_duration, "s", "without pressing first"),
                Quantity("profile", config.profile, "", f"held for {parameters.duration:.4g} s"),
                Quantity("force", config.force, "N"),
                Quantity("greatest force asked for", config.greatest, "N"),
                Quantity("least force asked for", config.least, "N"),
                Quantity("motion", config.motion, "", "of the tip along the surface, by something else"),
                Quantity("speed", speed, "mm/s", "largest of that motion"),
                Quantity("landing speed", 1e3 * parameters.landing_speed, "mm/s"),
                Quantity(
                    "approach distance", 1e3 * parameters.approach_distance, "mm", "where the surface is sought"
                ),
                *joint_quantities(self.followed),
                *limit_quantities(self.limits, self.ready.landing_model(self.config.true_stiffness)),
            ),
            (FORCES_FILE,),
            joint_notes(self.followed),
        )

    def view(self) -> "ViewScene":
        """See `Plan`: the object moves as it did."""
        from palpate.experiments.kit.scene_view import scene_view  # with MuJoCo's meshes

        motions = {}
        if isinstance(self.target, MovingTarget):
            motions = {f"{OBJECT_GEOM}_{i}": joint.motion for i, joint in enumerate(self.target.joints)}
        title = f"Force on {self.config.thing}, {self.config.surface}, {self.config.robot}"
        return scene_view(title, known_scene(self.ready.backend).model, motions=motions)

    def pressing(self) -> IdentifyParameters:
        """Return how it presses first."""
        return pressing(
            self.config.force,
            limits=self.limits,
            touch_force=self.ready.touch_force,
            sensing_delay=self.ready.finger.pipeline().delay,
            approach_distance=self.parameters.approach_distance,
        )

    def _pressed(self) -> Identified:
        """Press on the object at rest, on a robot and scene of its own; return what was identified."""
        resting = built(self.config, self.robot, target_of(self.config, self.texts(), at_rest=True)).backend
        controller = IdentifyController(self.pressing(), self.period)
        return pressed(resting, self.fingers, self.limits, controller, Identified.of, longest=LONGEST_PRESSING)


def plan_regulation(config: RegulateConfig, robot: Robot, texts: Mapping[str, str]) -> RegulationPlan:
    """Check and build everything that a regulation needs.

    Args:
        config: What to do.
        robot: What carries it out.
        texts: Motion, identification and scene as a log keeps them.

    Raises:
        InvalidValueError: The configuration cannot be carried out; the message names the remedy.
    """
    target = target_of(config, texts)
    motion = motion_of(config, texts.get(MOTION_TEXT))
    profile = profile_of(config)
    duration = duration_of(config, profile)
    limits = robot.file.limits
    check_limits(config, motion, limits)
    ready = built(config, robot, target)
    met = ready.landing_model(config.true_stiffness)
    along = fastest_along(config, motion)
    push, lift = fastest_push(config, along, limits, met), min(LIFT_SPEED, limits.commanded_speed)
    limits = limits_allowing(limits, "motion_speed, surface", math.hypot(along, push), met)
    lift += config.surface_speed if config.surface == "sine" else 0.0
    least = LEAST_FORCE * ready.touch_force
    if config.least < least * (1.0 - 1e-12):
        raise InvalidValueError(
            f"force = {config.force:g} N: the profile goes down to {config.least:g} N and must stay above "
            f"{least:g} N, {LEAST_FORCE:g} times what counts as a touch, and below {most_force(limits):g} N; "
            "press more, or swing less (--swing)"
        )
    sensing_delay = ready.finger.pipeline().delay
    period = ready.backend.period
    delay = tracking_delay(period, ready.response, sensing_delay)
    lead = tracking_delay(period, ready.lag, sensing_delay)
    contact = contact_model(config, ready)
    gain = contact.gain(delay)
    descent = CLEARANCE + depth_of(target) + travel_of(config) + BEYOND
    model = landing_model(gain, contact.stiffness, ready)
    landing = config.landing_speed or landing_speed(config, model, ready)
    check_meeting(config, model, landing, limits)
    parameters = RegulateParameters(
        gain,
        lead,
        duration,
        config.force,
        # as far as the whole profile may be moved
        (config.force - config.least + least, config.force - config.greatest + most_force(limits)),
        damping_time=contact.surface_damping_time,
        step_time=STEP_IN_DELAYS * delay,
        settle_time=_settle_time(gain),
        axis=(config.axis[0], config.axis[1], config.axis[2]) if config.axis else None,
        landing_speed=landing,
        approach_distance=descent,
        # out of reach of what comes after it
        lift_distance=LIFT + travel_of(config),
        lift_speed=lift,
        fastest_push=min(push, limits.commanded_speed),
    )
    check_changes(config.change, live_regulation(parameters))
    before = (CLEARANCE + travel_of(config)) / landing + parameters.settle_time
    planned = RegulationPlan(
        config,
        robot,
        target,
        profile,
        motion,
        parameters,
        contact,
        surface_filter(contact.surface_stiffness, gain, lead),
        limits,
        ready,
        None if ready.arm is None else _followed(ready.arm, parameters, motion, along),
        before + duration + 0.5,
    )
    if IDENTIFIED_TEXT in texts:
        return planned.with_identified(read_identified(texts[IDENTIFIED_TEXT], Identified))
    return planned


def _followed(
    arm: StandingArm, parameters: RegulateParameters, motion: TangentMotion, fastest: float
) -> FollowedPath:
    """What it asks of the joints to come down, to be moved along, and to come up again.

    Raises:
        InvalidValueError: They cannot.
    """
    lowest = add_scaled(arm.position, -parameters.approach_distance, (0.0, 0.0, 1.0))
    step, position = max(MOTION_STEP, parameters.duration / MOST_STEPS), arm.position
    points = [lowest, position]
    for i in range(int(parameters.duration / step)):
        position = add_scaled(position, step, motion.velocity((i + 0.5) * step))
        points.append(position)
    return follow_path(arm, points, max(fastest, parameters.landing_speed))


def _settle_time(gain: ForceGain) -> float:
    """From touching to the profile's beginning [s]: feedback alone needs some of its time constants, 1 / (k K)."""
    return min(max(SHORTEST_SETTLING, SETTLED_AFTER / (gain.gain * gain.stiffness)), LONGEST_SETTLING)
