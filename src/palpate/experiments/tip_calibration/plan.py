"""From a configuration to touches that can be carried out: everything is checked and built here."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import msgspec
import numpy as np

from palpate.controllers import ForceGain, force_gain, tracking_delay
from palpate.controllers.explore_parameters import ACCELERATION
from palpate.controllers.pose_motion import PoseMotionLimits
from palpate.controllers.touch_sequence import TouchParameters, TouchSequence, TouchStep
from palpate.errors import InvalidValueError
from palpate.experiments.kit.allowed_speed import limits_allowing
from palpate.experiments.kit.contact_checks import (
    LEAST_FORCE,
    LEAST_TOUCH_FORCE,
    TOUCH_DEVIATIONS,
    check_compression,
)
from palpate.experiments.kit.experiment import DryRun, PlanDefaults
from palpate.experiments.kit.limit_quantities import limit_quantities
from palpate.experiments.kit.recorded_run import Recorded, carry_out
from palpate.experiments.kit.run_checks import check_force
from palpate.experiments.tip_calibration.bench import simulated_bench
from palpate.experiments.tip_calibration.config import TOUCHES_TEXT, TipCalibrationConfig
from palpate.experiments.tip_calibration.findings import FILE_NAMES
from palpate.experiments.tip_calibration.found_tip import TipErrors, true_tip
from palpate.experiments.tip_calibration.known import KnownBefore
from palpate.experiments.tip_calibration.places import Approach, first_touches
from palpate.experiments.tip_calibration.touches import FeltTouches, felt_touches, joined_touches
from palpate.experiments.tip_calibration.touches_csv import read_touches, touches_text
from palpate.reporting.data import Quantity
from palpate.robots.finger_sensor import model_with_noise, noise_of
from palpate.robots.fingertip import fingertip, only_finger
from palpate.robots.in_scene import build
from palpate.robots.known_truth import known_scene
from palpate.robots.robot import Robot
from palpate.robots.task import RobotInScene, Task
from palpate.runtime import Backend, FingerDescription, Limits
from palpate.runtime.following import FollowingMaker
from palpate.sensing.ft.sensor_file import SensorFile
from palpate.sensing.tip_calibration import PlannedTouch, TipFit, Touches, TouchTarget
from palpate.sim import SeededSensor
from palpate.sim.presets import EXPLORE
from palpate.spatial import as_vector
from palpate.viewing import ViewScene

ROOM = 0.03
"""How far beyond the places of the touches the supervisor lets the tip frame go [m]."""

TOUCH_SHARE = 0.2
"""Of the least force to press with, from which on there is a touch."""

ABOVE = 0.02
"""How far above all that is touched the tip starts [m]."""


def built(config: TipCalibrationConfig, robot: Robot) -> RobotInScene:
    """Return the robot above what it touches; in a simulation with the tip that is sought.

    Raises:
        InvalidValueError: The tip is smaller than its compression, or a real one is asked to be another.
    """
    typed, real = fingertip(robot), robot.file.backend.REAL
    if real and config.tip_is_other:
        raise InvalidValueError(
            "unknown_tip, size_error, center_error, turn_error, stiffness_ratio: are for simulations; a real tip "
            "is what it is: leave them out"
        )
    errors = TipErrors.of(config)
    tip = true_tip(typed, errors) if config.tip_is_other else typed
    stiffness = config.stiffness * errors.stiffness
    check_compression(typed.half_extents, max(config.forces), stiffness)
    model = model_with_noise(only_finger(robot), config.force_noise, config.moment_noise)
    noise, _ = noise_of(model)
    x, y, _ = typed.center
    reach = float(np.linalg.norm(typed.center)) + max(typed.half_extents)
    target = simulated_bench(config)
    start = (-x, -y, target.top + reach + ABOVE)
    task = Task(
        tip=tip,
        compression=0.5 * max(config.forces) / config.stiffness,
        target=target,
        law=replace(EXPLORE.law, stiffness=stiffness, friction=config.friction, spin_length=config.spin_length),
        start=start,
        period=robot.file.period,
        sensor=SeededSensor(model, config.seed),
        touch_force=max(LEAST_TOUCH_FORCE, TOUCH_DEVIATIONS * noise),
        believed=typed,
    )
    return build(_heedless_of_drift(robot, TOUCH_SHARE * min(config.forces)), task)


def _heedless_of_drift(robot: Robot, touch_force: float) -> Robot:
    """The same robot, whose sensor takes only so much force [N] for a touch, and less for a zero that drifts.

    A calibration takes minutes, in which a zero drifts past what its file allows; each touch finds it again.
    """

    def raised(sensor: SensorFile | None) -> SensorFile | None:
        if sensor is None or sensor.contact.touch_force >= touch_force:
            return sensor
        own = sensor.contact
        release = own.release_force * touch_force / own.touch_force
        contact = msgspec.structs.replace(own, touch_force=touch_force, release_force=release)
        return msgspec.structs.replace(sensor, contact=contact)

    return replace(robot, sensors=tuple(raised(sensor) for sensor in robot.sensors))


def workspace_of(robot: Limits, limits: Limits, steps: Sequence[TouchStep]) -> Limits:
    """Return limits with as much of the robot's workspace as touches need.

    Args:
        robot: The robot's own.
        limits: For this run.
        steps: Where the tip goes.

    Raises:
        InvalidValueError: They need more.
    """
    places = np.array([(*step.standoff[:2], z) for step in steps for z in (step.standoff[2], step.height)])
    low, high = places.min(axis=0), places.max(axis=0)
    least, most = np.array(robot.workspace_lower), np.array(robot.workspace_upper)
    for axis in range(3):
        if low[axis] < least[axis] or high[axis] > most[axis]:
            raise InvalidValueError(
                f"the touches reach from {low[axis]:.3g} to {high[axis]:.3g} m along {'xyz'[axis]}: they leave "
                f"the robot's workspace, {least[axis]:g} to {most[axis]:g} m (limits.workspace_lower_m, "
                "workspace_upper_m in the robot file); put plate, rod and ball elsewhere"
            )
    lower, upper = np.maximum(low - ROOM, least), np.minimum(high + ROOM, most)
    return msgspec.structs.replace(limits, workspace_lower=as_vector(lower), workspace_upper=as_vector(upper))


TRAVEL_SPEED, FASTEST_LANDING = 0.06, 0.004
"""At most [m/s]."""

TURNING = 0.6
"""At most [rad/s]; and at most half of the supervisor's limit."""

UNCERTAIN_SDS = 3.0
"""How many standard deviations of a place it is looked for."""

TIP_ERROR = 2e-3
"""How far a typed tip's surface may be from the real one, besides [m]."""

KNOWN_AFTER = 6e-4
"""How far a surface may be from where it is thought to be once the first touches are made [m]."""

LONGEST = 2.5
"""Times the expected duration, after which a run is stopped."""

BLOCKS_OF = 3
"""Touches of one target are made in so many turns, so that what changes with time is not taken for a target's."""

MILLI = 1e3


@dataclass(frozen=True, slots=True, eq=False)
class TipPlan(PlanDefaults):
    """A run of touches. A `Plan`.

    Attributes:
        config: What was asked for.
        robot: What carries it out.
        known: Before anything is touched.
        ready: The robot, over what it touches.
        parameters: For the controller.
        limits: For the supervisor.
        planned: Touches of this run.
        steps: Where the tip goes for them.
        first: Touches that were made before; None: these are the first.
        first_text: The same, as a log keeps them.
    """

    config: TipCalibrationConfig
    robot: Robot
    known: KnownBefore
    ready: RobotInScene
    parameters: TouchParameters
    limits: Limits
    planned: tuple[PlannedTouch, ...]
    steps: tuple[TouchStep, ...]
    first: Touches | None = None
    first_text: str = ""

    @property
    def fingers(self) -> tuple[FingerDescription, ...]:
        """See `Plan`."""
        return (self.ready.finger,)

    @property
    def following(self) -> FollowingMaker:
        """See `Plan`."""
        return self.ready.servo.following(self.limits.force)

    @property
    def expected_duration(self) -> float:
        """See `Plan`; without the touches that come first."""
        return _duration(self.parameters, self.steps)

    @property
    def longest_duration(self) -> float:
        """See `Plan`."""
        return LONGEST * self.expected_duration + 10.0

    @property
    def described(self) -> Robot:
        """The robot whose fingertip it is."""
        return self.robot

    def touches_of(self, recorded: Recorded) -> tuple[Touches | None, int]:
        """Return all touches after a run, those that came first included, and how many steps did not rest.

        Raises:
            InvalidValueError: There are none.
        """
        try:
            felt = self._felt(recorded)
        except InvalidValueError:
            if self.first is None:
                raise
            return self.first, 0
        return felt.touches if self.first is None else joined_touches(self.first, felt.touches), len(felt.unrested)

    def _felt(self, recorded: Recorded) -> FeltTouches:
        records = (piece.record() for piece in recorded.periods.pieces())
        return felt_touches(records, recorded.controller.spans, [each.target for each in self.planned])

    def backend(self) -> Backend:
        """See `Plan`."""
        return built(self.config, self.robot).backend

    def controller(self) -> TouchSequence:
        """See `Plan`."""
        return TouchSequence(self.parameters, self.steps, self.ready.backend.period)

    def texts(self) -> Mapping[str, str]:
        """See `Plan`: the touches that came first."""
        return {TOUCHES_TEXT: self.first_text} if self.first_text else {}

    @property
    def preparation(self) -> str:
        """See `Plan`."""
        if self.first is not None:
            return ""
        return f"{len(self.steps)} first touches, to find plate, rod and ball"

    def prepared(self) -> "TipPlan":
        """See `Plan`: make the first touches, and plan those that tell most."""
        if self.first is not None:
            return self
        run = carry_out(self)
        try:
            return self.after(touches_text(self._felt(run).touches, self.known.targets))
        except InvalidValueError as error:
            raise InvalidValueError(f"the first touches: {error} (the run: {run.run})") from None

    def after(self, first_text: str) -> "TipPlan":
        """Return the plan of the touches that tell most after the first ones, which are given as a log keeps them.

        Raises:
            InvalidValueError: Those cannot be.
        """
        first = read_touches(first_text, TOUCHES_TEXT, self.known.targets).of(self.known.targets)
        fit = self.known.fit(first)
        left = max(self.config.touch_count - len(self.steps), 1)
        planned = _in_turns(self.known.telling(left, fit), len(self.known.targets))
        approach = Approach(fit.unknowns.tip, found_targets(fit), KNOWN_AFTER, self.config.forces)
        steps = approach.steps(planned)
        # with the places of the first touches, between which the robot starts again
        limits = workspace_of(self.robot.file.limits, self.limits, (*self.steps, *steps))
        parameters = replace(self.parameters, search_distance=approach.search_distance)
        return replace(
            self,
            planned=planned,
            steps=steps,
            limits=limits,
            parameters=parameters,
            first=first,
            first_text=first_text,
        )

    def dry_run(self) -> DryRun:
        """See `Plan`."""
        config, count = self.config, len(self.steps)
        return DryRun(
            "Calibration of a fingertip by touches",
            (
                Quantity("touches", config.touch_count, "", f"{count} to find plate, rod and ball, then the rest"),
                Quantity("expected duration", self._all_of_it, "s", "all touches"),
                Quantity("forces", len(config.forces), "", ", ".join(f"{each:g} N" for each in config.forces)),
                Quantity("greatest force asked for", max(config.forces), "N"),
                Quantity("landing speed", MILLI * self.parameters.landing_speed, "mm/s"),
                Quantity("travel speed", MILLI * self.parameters.travel.speed, "mm/s"),
                Quantity("search distance", MILLI * self.parameters.search_distance, "mm", "of the first touches"),
                Quantity("turn of the tip, largest", self.known.turn, "rad"),
                Quantity(
                    "phase margin of pressing",
                    self.parameters.gain.phase_margin_deg,
                    "deg",
                    "at the typed stiffness",
                ),
                *limit_quantities(self.limits, self.ready.landing_model(config.stiffness)),
            ),
            FILE_NAMES,
            () if self.known.turn else ("This robot does not turn its tip: fewer touches tell its orientation.",),
        )

    @property
    def _all_of_it(self) -> float:
        return self.expected_duration * self.config.touch_count / len(self.steps)

    def view(self) -> ViewScene:
        """See `Plan`."""
        from palpate.experiments.kit.scene_view import scene_view  # with MuJoCo's meshes

        title = f"Calibration of a fingertip, {self.config.robot}"
        return scene_view(title, known_scene(self.ready.backend).model)


def plan_touches(config: TipCalibrationConfig, robot: Robot, texts: Mapping[str, str]) -> TipPlan:
    """Check and build everything that touching needs.

    Args:
        config: What to do.
        robot: What carries it out.
        texts: As a log keeps them; empty for a new run.

    Raises:
        InvalidValueError: It cannot be carried out; the message names the remedy.
    """
    limits = robot.file.limits
    check_force(max(config.forces), max(config.forces), limits)
    ready = built(config, robot)
    turns = robot.file.backend.TURNS and (ready.arm is None or ready.arm.turns)
    known = KnownBefore.of(config, robot, turns=turns)
    least = LEAST_FORCE * ready.touch_force
    if min(config.forces) < least * (1.0 - 1e-12):
        raise InvalidValueError(
            f"forces: the least is {min(config.forces):g} N and must be at least {least:.3g} N, {LEAST_FORCE:g} "
            "times what counts as a touch; press more"
        )
    landing = ready.landing_model(STIFFEST * config.stiffness)
    travel = min(TRAVEL_SPEED, landing.fastest(limits.force, limits.largest_impact))
    limits = limits_allowing(limits, f"travel at {travel:g} m/s", travel, landing)
    approach = Approach(known.tip, known.targets, UNCERTAIN_SDS * config.place_sd + TIP_ERROR, config.forces)
    planned = first_touches(known.tip, known.targets, max(config.forces), known.turn)
    steps = approach.steps(planned)
    gain: ForceGain = force_gain(landing.stiffness, landing.delay)
    delay = tracking_delay(ready.backend.period, ready.lag, ready.finger.pipeline().delay)
    turning = min(TURNING, 0.5 * robot.file.limits.angular_speed) if known.turn else 0.0
    parameters = TouchParameters(
        gain,
        PoseMotionLimits.stable(travel, turning, ACCELERATION, delay),
        approach.search_distance,
        landing_speed=min(FASTEST_LANDING, landing.speed(min(config.forces), ready.touch_force)),
    )
    plan = TipPlan(
        config, robot, known, ready, parameters, workspace_of(robot.file.limits, limits, steps), planned, steps
    )
    kept = texts.get(TOUCHES_TEXT)
    return plan if kept is None else plan.after(kept)


STIFFEST = 2.0
"""Times the stiffness that is typed, which landing and force control still bear: it is what is sought."""


def found_targets(fit: TipFit) -> tuple[TouchTarget, ...]:
    """Return the targets where touches have found them."""
    places = fit.unknowns.places(fit.values)
    return tuple(
        replace(target, place=tuple(place.tolist()), direction=tuple(direction.tolist()))
        for target, place, direction in zip(fit.unknowns.targets, places.place, places.direction, strict=True)
    )


def _in_turns(touches: Sequence[PlannedTouch], targets: int) -> tuple[PlannedTouch, ...]:
    """The same touches, target by target, in a few turns."""
    of = [[each for each in touches if each.target == i] for i in range(targets)]
    found: list[PlannedTouch] = []
    for turn in range(BLOCKS_OF):
        for each in of:
            size = -(-len(each) // BLOCKS_OF)
            found += each[turn * size : (turn + 1) * size]
    return tuple(found)


def _duration(parameters: TouchParameters, steps: Sequence[TouchStep]) -> float:
    """About how long touches take [s]."""
    travel, total = parameters.travel, 0.0
    for before, step in zip(steps, (*steps[1:], steps[-1]), strict=True):
        high = max(before.height, step.height)
        across = float(np.linalg.norm(np.subtract(before.standoff[:2], step.standoff[:2])))
        length = 2.0 * high - before.standoff[2] - step.standoff[2] + across
        total += length / travel.speed + 3.0 * ENDING
    at_forces = parameters.air_time + parameters.settle_time + parameters.rest_time + parameters.hold_time
    each = (
        0.5 * parameters.search_distance * (1.0 / parameters.landing_speed + 1.0 / travel.speed)
        + parameters.rest_time
        + parameters.settle_time
    )
    return total + sum(each + at_forces * len(step.forces) for step in steps)


ENDING = 0.8
"""[s] That the end of each motion takes besides."""
