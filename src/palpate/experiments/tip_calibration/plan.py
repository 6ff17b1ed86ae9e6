"""From a configuration to touches of plate, rod and ball, checked and built."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import msgspec
import numpy as np

from palpate.controllers import force_gain
from palpate.controllers.explore_parameters import ACCELERATION
from palpate.controllers.pose_motion import PoseMotionLimits
from palpate.controllers.touch_sequence import TouchParameters, TouchSequence, TouchStep
from palpate.errors import InvalidValueError
from palpate.experiments.kit.checks import (
    check_acceleration,
    check_compression,
    check_force,
    check_least_force,
)
from palpate.experiments.kit.one_finger import (
    OneFingerPlan,
    Setup,
    check_workspace,
    sensor_model,
    touch_threshold,
    workspace_around,
)
from palpate.experiments.kit.recorded_run import Recorded, carry_out
from palpate.experiments.tip_calibration.config import TOUCHES_TEXT, TipCalibrationConfig
from palpate.experiments.tip_calibration.findings import FILE_NAMES
from palpate.experiments.tip_calibration.found_tip import TipErrors, true_tip
from palpate.experiments.tip_calibration.known import KnownBefore, simulated_bench
from palpate.experiments.tip_calibration.places import Approach, first_touches
from palpate.experiments.tip_calibration.touches import FeltTouches, felt_touches, joined_touches
from palpate.experiments.tip_calibration.touches_csv import read_touches, touches_text
from palpate.reporting.data import Quantity
from palpate.robots.fingertip import fingertip
from palpate.robots.robot import Robot
from palpate.robots.task import Task
from palpate.runtime import Limits
from palpate.sensing.ft.sensor_file import SensorFile
from palpate.sensing.tip_calibration import PlannedTouch, TipFit, Touches, TouchTarget
from palpate.sim import SeededSensor
from palpate.sim.presets import EXPLORE
from palpate.spatial import as_vector

_ROOM = 0.03
"""Distance beyond the places of the touches that the supervisor allows [m]."""

_TOUCH_SHARE = 0.2
"""Touch threshold over the smallest force of a touch."""

_START_HEIGHT = 0.02
"""Height of the tip above the bench at the start [m]."""

_MAX_TRAVEL_SPEED, _MAX_TOUCH_LANDING_SPEED = 0.06, 0.004
"""Largest speeds of travelling and landing [m/s]."""

_MAX_TURNING_SPEED = 0.6
"""Largest angular speed [rad/s]; half of the supervisor's limit if that is less."""

_PLACE_SDS = 3.0
"""Search distance in standard deviations of a target's place."""

_TIP_ERROR = 2e-3
"""Largest distance of a typed tip's surface from the real one [m]."""

_LOCATED_ERROR = 6e-4
"""Largest distance of a target's surface from its estimate after the first touches [m]."""

_STIFFNESS_FACTOR = 2.0
"""Stiffness that landing and force control allow for, over the typed one: the stiffness is sought."""

_LONGEST_DURATION = 2.5
"""Largest duration of a run over the expected one."""

_ROUNDS = 3
"""Rounds in which touches of the targets alternate, so that slow changes are not taken for a target's."""

_MOTION_END = 0.8
"""Time that the end of each motion adds [s]."""


@dataclass(frozen=True, eq=False, kw_only=True)
class TipPlan(OneFingerPlan):
    """A run of touches. A `Plan`.

    Attributes:
        known: Prior knowledge of tip and targets.
        parameters: Parameters of the controller.
        planned: Touches of this run.
        steps: Poses of the tip for these touches.
        first: Earlier touches; None: these are the first.
        first_text: Text of the earlier touches, as a log keeps it.
    """

    config: TipCalibrationConfig
    known: KnownBefore
    parameters: TouchParameters
    planned: tuple[PlannedTouch, ...]
    steps: tuple[TouchStep, ...]
    first: Touches | None = None
    first_text: str = ""

    @property
    def described(self) -> Robot:
        """Robot whose fingertip is calibrated."""
        return self.robot

    def touches_of(self, recorded: Recorded) -> tuple[Touches | None, int]:
        """Return all touches after a run, the earlier ones included, and how many steps did not come to rest.

        Raises:
            InvalidValueError: If there are no touches.
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

    def controller(self) -> TouchSequence:
        """Return a fresh controller."""
        return TouchSequence(self.parameters, self.steps, self.period)

    def attachments(self) -> Mapping[str, str]:
        """Return the earlier touches."""
        return {TOUCHES_TEXT: self.first_text} if self.first_text else {}

    @property
    def preparation(self) -> str:
        """The first touches, if they have not been made."""
        if self.first is not None:
            return ""
        return f"{len(self.steps)} first touches, to find plate, rod and ball"

    def prepared(self) -> "TipPlan":
        """Make the first touches, and plan the most informative further ones.

        Raises:
            InvalidValueError: If the first touches failed; the message names the reason.
        """
        if self.first is not None:
            return self
        run = carry_out(self)
        try:
            return self.after(touches_text(self._felt(run).touches, self.known.targets))
        except InvalidValueError as error:
            raise InvalidValueError(f"the first touches: {error} (the run: {run.run})") from None

    def after(self, first_text: str) -> "TipPlan":
        """Return the plan of the most informative touches after the first ones.

        Args:
            first_text: First touches, as a log keeps them.

        Raises:
            InvalidValueError: If the touches cannot be read or leave the workspace.
        """
        first = read_touches(first_text, TOUCHES_TEXT, self.known.targets).of(self.known.targets)
        fit = self.known.fit(first)
        left = max(self.config.touch_count - len(self.steps), 1)
        planned = _in_rounds(self.known.telling(left, fit), len(self.known.targets))
        approach = Approach(fit.unknowns.tip, _located_targets(fit), _LOCATED_ERROR, self.config.forces)
        steps = approach.steps(planned)
        # with the places of the first touches, between which the robot starts again
        limits = _workspace_limits(self.robot.file.limits, self.limits, (*self.steps, *steps))
        parameters = replace(self.parameters, search_distance=approach.search_distance)
        duration = _duration(parameters, steps)
        return replace(
            self,
            setup=replace(self.setup, limits=limits),
            expected_duration=duration,
            longest_duration=_LONGEST_DURATION * duration + 10.0,
            planned=planned,
            steps=steps,
            parameters=parameters,
            first=first,
            first_text=first_text,
        )


def plan_touches(config: TipCalibrationConfig, robot: Robot, attachments: Mapping[str, str]) -> TipPlan:
    """Check and build everything that touching needs.

    Args:
        config: Configuration.
        robot: Robot that carries the fingertip.
        attachments: Texts of a log; empty for a new run.

    Raises:
        InvalidValueError: If the touches cannot be made; the message names the remedy.
    """
    own, forces = robot.file.limits, config.forces
    check_force(max(forces), max(forces), own)
    setup = _setup(config, robot)
    known = KnownBefore.of(config, robot, turns=setup.turns)
    option = f"forces: the least is {min(forces):g} N and"
    check_least_force(option, min(forces), setup.ready.touch_force, "press more")
    landing = setup.ready.landing_model(_STIFFNESS_FACTOR * config.stiffness)
    travel = min(_MAX_TRAVEL_SPEED, landing.fastest(own.force, own.largest_impact))
    setup = setup.allowing(f"travel at {travel:g} m/s", travel, landing)
    check_acceleration("the acceleration of travelling", ACCELERATION, own, "raise the limit")
    approach = Approach(known.tip, known.targets, _PLACE_SDS * config.place_sd + _TIP_ERROR, forces)
    planned = first_touches(known.tip, known.targets, max(forces), known.turn)
    steps = approach.steps(planned)
    turning = min(_MAX_TURNING_SPEED, 0.5 * own.angular_speed) if known.turn else 0.0
    parameters = TouchParameters(
        force_gain(landing.stiffness, landing.delay),
        PoseMotionLimits.stable(travel, turning, ACCELERATION, setup.lead),
        approach.search_distance,
        landing_speed=min(_MAX_TOUCH_LANDING_SPEED, landing.speed(min(forces), setup.ready.touch_force)),
    )
    duration = _duration(parameters, steps)
    still = () if known.turn else ("This robot does not turn its tip: fewer touches tell its orientation.",)
    plan = TipPlan(
        setup=replace(setup, limits=_workspace_limits(own, setup.limits, steps)),
        config=config,
        title="Calibration of a fingertip by touches",
        quantities=_quantities(config, parameters, known.turn, len(steps), duration),
        expected_duration=duration,
        longest_duration=_LONGEST_DURATION * duration + 10.0,
        files=FILE_NAMES,
        notes=still,
        known=known,
        parameters=parameters,
        planned=planned,
        steps=steps,
    )
    kept = attachments.get(TOUCHES_TEXT)
    return plan if kept is None else plan.after(kept)


def _quantities(
    config: TipCalibrationConfig, parameters: TouchParameters, turn: float, count: int, duration: float
) -> tuple[Quantity, ...]:
    """Return the quantities of a dry run, whose first `count` touches take a duration [s]."""
    forces, whole = config.forces, duration * config.touch_count / count
    margin = parameters.gain.phase_margin_deg
    return (
        Quantity("touches", config.touch_count, "", f"{count} to find plate, rod and ball, then the rest"),
        Quantity("expected duration", whole, "s", "all touches"),
        Quantity("forces", len(forces), "", ", ".join(f"{each:g} N" for each in forces)),
        Quantity("greatest force asked for", max(forces), "N"),
        Quantity("landing speed", 1e3 * parameters.landing_speed, "mm/s"),
        Quantity("travel speed", 1e3 * parameters.travel.speed, "mm/s"),
        Quantity("search distance", 1e3 * parameters.search_distance, "mm", "of the first touches"),
        Quantity("turn of the tip, largest", turn, "rad"),
        Quantity("phase margin of pressing", margin, "deg", "at the typed stiffness"),
    )


def _setup(config: TipCalibrationConfig, robot: Robot) -> Setup:
    """Return the robot above the bench; in a simulation with the true tip.

    Raises:
        InvalidValueError: If the tip is smaller than its compression, or a real tip is to be another.
    """
    typed = fingertip(robot)
    if robot.file.backend.REAL and config.tip_is_other:
        raise InvalidValueError(
            "unknown_tip, size_error, center_error, stiffness_ratio: are for simulations; a real tip "
            "is what it is: leave them out"
        )
    errors = TipErrors.of(config)
    stiffness = config.stiffness * errors.stiffness
    check_compression(typed.half_extents, max(config.forces), stiffness)
    model = sensor_model(robot, config.force_noise, config.moment_noise)
    x, y, _ = typed.center
    reach = float(np.linalg.norm(typed.center)) + max(typed.half_extents)
    target = simulated_bench(config)
    task = Task(
        tip=true_tip(typed, errors) if config.tip_is_other else typed,
        compression=0.5 * max(config.forces) / config.stiffness,
        target=target,
        law=replace(EXPLORE.law, stiffness=stiffness, friction=config.friction, spin_length=config.spin_length),
        start=(-x, -y, target.top + reach + _START_HEIGHT),
        period=robot.file.period,
        sensor=SeededSensor(model, config.seed),
        touch_force=touch_threshold(model),
        believed=typed,
    )
    return Setup.build(_insensitive_to_drift(robot, _TOUCH_SHARE * min(config.forces)), task, config.stiffness)


def _insensitive_to_drift(robot: Robot, touch_force: float) -> Robot:
    """Return the robot with a touch threshold of at least `touch_force` [N].

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


def _workspace_limits(robot: Limits, limits: Limits, steps: Sequence[TouchStep]) -> Limits:
    """Return limits with as much of the robot's workspace as touches need.

    Args:
        robot: Limits of the robot.
        limits: Limits of this run.
        steps: Poses of the tip.

    Raises:
        InvalidValueError: If the touches leave the robot's workspace.
    """
    places = np.array([(*step.standoff[:2], z) for step in steps for z in (step.standoff[2], step.height)])
    low, high = places.min(axis=0), places.max(axis=0)
    check_workspace(robot, as_vector(low), as_vector(high), "put plate, rod and ball elsewhere")
    lower, upper = workspace_around(robot, as_vector(low), as_vector(high), _ROOM)
    return msgspec.structs.replace(limits, workspace_lower=lower, workspace_upper=upper)


def _located_targets(fit: TipFit) -> tuple[TouchTarget, ...]:
    """Return the targets at their estimated places."""
    places = fit.unknowns.places(fit.values)
    return tuple(
        replace(target, place=tuple(place.tolist()), direction=tuple(direction.tolist()))
        for target, place, direction in zip(fit.unknowns.targets, places.place, places.direction, strict=True)
    )


def _in_rounds(touches: Sequence[PlannedTouch], targets: int) -> tuple[PlannedTouch, ...]:
    """Return touches target by target, in several rounds."""
    by_target = [[each for each in touches if each.target == i] for i in range(targets)]
    found: list[PlannedTouch] = []
    for turn in range(_ROUNDS):
        for each in by_target:
            size = -(-len(each) // _ROUNDS)
            found += each[turn * size : (turn + 1) * size]
    return tuple(found)


def _duration(parameters: TouchParameters, steps: Sequence[TouchStep]) -> float:
    """Return the expected duration of touches [s]."""
    travel, total = parameters.travel, 0.0
    for before, step in zip(steps, (*steps[1:], steps[-1]), strict=True):
        high = max(before.height, step.height)
        across = float(np.linalg.norm(np.subtract(before.standoff[:2], step.standoff[:2])))
        length = 2.0 * high - before.standoff[2] - step.standoff[2] + across
        total += length / travel.speed + 3.0 * _MOTION_END
    at_forces = parameters.air_time + parameters.settle_time + parameters.rest_time + parameters.hold_time
    each = (
        0.5 * parameters.search_distance * (1.0 / parameters.landing_speed + 1.0 / travel.speed)
        + parameters.rest_time
        + parameters.settle_time
    )
    return total + sum(each + at_forces * len(step.forces) for step in steps)
