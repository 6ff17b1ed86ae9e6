"""From a configuration to a regulation that can be carried out: everything is checked and built here."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

from palpate.controllers import ForceGain, SurfaceFilter, surface_filter, tracking_delay
from palpate.controllers.damped_contact import DampedContact
from palpate.controllers.force_profile import ForceProfile
from palpate.controllers.identify import IdentifyController
from palpate.controllers.regulate import RegulateController
from palpate.controllers.regulate_parameters import RegulateParameters, live_regulation
from palpate.controllers.tangent_motion import TangentMotion
from palpate.errors import InvalidValueError
from palpate.experiments.explore.config import LEAST_FORCE
from palpate.experiments.kit.pressing import pressing
from palpate.experiments.kit.run_checks import CLEARANCE
from palpate.experiments.regulate.built import built
from palpate.experiments.regulate.checks import check_limits, most_force
from palpate.experiments.regulate.config import FROM_FILES, RegulateConfig
from palpate.experiments.regulate.file import (
    IDENTIFIED_TEXT,
    MOTION_TEXT,
    REGULATION_TEXT,
    Identified,
    identified_text,
    read_identified,
    read_regulation,
    regulation_text,
)
from palpate.experiments.regulate.landing import check_meeting, landing_model, landing_speed
from palpate.experiments.regulate.motion import motion_text
from palpate.experiments.regulate.parts import (
    contact_model,
    duration_of,
    motion_in,
    motion_of,
    profile_of,
    target_of,
    travel_of,
)
from palpate.robots.simulated_stage import RobotInScene
from palpate.robots.values import load_named_robot
from palpate.runtime import Backend, FingerDescription, Limits
from palpate.runtime.live import Change
from palpate.runtime.robot import Robot, read_robot
from palpate.sim import Target

LIFT, LIFT_SPEED = 0.005, 0.02
"""How far [m] and how fast [m/s] it is lifted from what stands still."""

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
taken for is pressed too hard by a third of the change on the way, at most."""


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
        contact: What the gain is made for; None if pressing has found it.
        follow: How the surface's motion is followed.
        finger: For touch.
        limits: For the supervisor.
        backend: The robot.
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
    contact: DampedContact | None
    follow: SurfaceFilter
    finger: FingerDescription
    limits: Limits
    backend: Backend
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

    def changes(self) -> tuple[Change, ...]:
        """Return the changes of live parameters that were asked for beforehand."""
        return tuple(Change(*change) for change in self.config.change)

    def identifier(self) -> IdentifyController:
        """Return a fresh controller that finds out stiffness and delay."""
        wanted = pressing(
            self.config.force,
            limit=self.limits.force,
            touch_force=self.ready.touch_force,
            sensing_delay=self.finger.pipeline().delay,
            approach_distance=self.parameters.approach_distance,
        )
        return IdentifyController(wanted, self.period)

    def resting(self) -> Backend:
        """Return the same robot above the same object, which stands still: to identify it."""
        return built(self.config, self.robot, target_of(self.config, at_rest=True)).backend

    def with_identified(self, found: Identified) -> "RegulationPlan":
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

    def texts(self) -> dict[str, str]:
        """Return everything that `plan_from_texts` needs to plan the very same again, by file name."""
        texts = {REGULATION_TEXT: regulation_text(self.config), **self.robot.texts}
        table = motion_text(self.motion)
        if table is not None:
            texts[MOTION_TEXT] = table
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
    return plan_with(read_regulation(texts[REGULATION_TEXT]), read_robot(texts), texts)


def plan_with(config: RegulateConfig, robot: Robot, texts: Mapping[str, str]) -> RegulationPlan:
    """Return the plan of a configuration, with motion and identification as a log keeps them, if it does.

    Raises:
        InvalidValueError: Something in a text is wrong, or the configuration cannot be realised.
    """
    file = texts.get(MOTION_TEXT) if config.motion in FROM_FILES else None
    motion = None if file is None else motion_in(config, file, MOTION_TEXT)
    planned = plan(config, robot, motion=motion)
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
    """
    robot = robot or load_named_robot(config.robot)
    target = target or target_of(config)
    motion = motion or motion_of(config)
    profile = profile_of(config)
    duration = duration_of(config, profile)
    limits = robot.file.limits.limits()
    check_limits(config, motion, limits)
    ready = built(config, robot, target)
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
    descent = CLEARANCE + travel_of(config) + BEYOND
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
        lift_speed=LIFT_SPEED + (config.surface_speed if config.surface == "sine" else 0.0),
    )
    live = live_regulation(parameters)
    for time, name, value in config.change:
        try:
            live.check(name, value)
        except InvalidValueError as error:
            raise InvalidValueError(f"change after {time:g} s: {error}") from None
    way = (CLEARANCE + travel_of(config)) / landing + parameters.settle_time
    return RegulationPlan(
        config,
        robot,
        target,
        profile,
        motion,
        parameters,
        contact,
        surface_filter(contact.surface_stiffness, gain, lead),
        ready.finger,
        limits,
        ready.backend,
        ready,
        way + duration + 0.5,
    )


def _settle_time(gain: ForceGain) -> float:
    """From touching to the profile's beginning [s]: feedback alone needs some of its time constants, 1 / (k K)."""
    return min(max(SHORTEST_SETTLING, SETTLED_AFTER / (gain.gain * gain.stiffness)), LONGEST_SETTLING)
