"""The plan of an experiment with one fingertip over an object: setup, limits, preparation, dry run and view."""

import math
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from typing import Any, Self

from palpate.controllers import (
    Admittance,
    DirectForce,
    ForceGain,
    ForceLaw,
    Identification,
    IdentifyController,
    IdentifyParameters,
    LandingModel,
    VirtualBody,
    force_gain,
    tracking_delay,
)
from palpate.errors import InvalidValueError, check_not_negative, check_positive
from palpate.experiments.kit.checks import MIN_TOUCH_FORCE, TOUCH_DEVIATIONS, check_force
from palpate.experiments.kit.experiment import DryRun, PlanDefaults
from palpate.experiments.kit.scene import scene_view
from palpate.kinematics import FollowedPath
from palpate.kinematics.followed_path import LEAST_ROOM
from palpate.kinematics.velocity import THRESHOLD
from palpate.reporting.data import Quantity
from palpate.robots.finger_sensor import model_with_noise
from palpate.robots.fingertip import fingertip, start_above
from palpate.robots.in_scene import build
from palpate.robots.known_truth import known_scene
from palpate.robots.robot import Robot
from palpate.robots.task import RobotInScene, Task
from palpate.runtime import Backend, Controller, FingerDescription, Limits, Supervisor, Touch, run
from palpate.runtime.following import FollowingMaker
from palpate.runtime.live import Change
from palpate.runtime.supervision.guard import Guard
from palpate.sim import MovingTarget, SceneObject, SeededSensor, Target
from palpate.sim.presets import EXPLORE
from palpate.sim.scene import OBJECT_GEOM
from palpate.sim.sensor.model import SensorModel
from palpate.sim.sensor.temperature import ThermalDrift, WarmUp
from palpate.spatial import Vector
from palpate.strict_decode import decode, read_mapping
from palpate.viewing import ViewScene
from palpate.yaml_text import yaml_text

CLEARANCE = 0.003
"""Height of the tip above the object's top at the start [m]."""

SEARCH_DEPTH = 0.005
"""Depth of the search below the lowest expected place of the surface [m]."""

MAX_LANDING_SPEED = 0.005
"""Largest landing speed, however soft a contact is [m/s]."""

MAX_LIFT_SPEED = 0.02
"""Largest speed of lifting, and of travelling above the object [m/s]."""

_LONGEST_DURATION = 4.0
"""Largest duration of a run over the expected one."""

IDENTIFIED_TEXT = "identified.yaml"
"""Attachment of a log with the result of pressing."""

_PRESSED_SHARE = 0.5
"""Half of the force range of pressing, over the set force, where the force limit has room for it."""

_MAX_PRESSED_SHARE = 0.9
"""Largest force of pressing over the force limit: ramps turn a few periods after their upper force."""

_MIN_PRESSED_TOUCHES = 1.1
"""Smallest force of pressing over the touch threshold: a tip that lifts off measures nothing."""

_SWING_SHARE = 0.2
"""Amplitude of the sines of pressing over its force range."""

_MAX_PRESSING_TIME = 120.0
"""Largest duration of pressing after the landing [s]; it takes about 30 s."""

_STEADY_DRIFT_TIME = 1e5
"""Time constant of the sensor's drift [s]: constant over a run."""


@dataclass(frozen=True, slots=True, eq=False)
class Setup:
    """A robot whose fingertip stands over an object.

    Attributes:
        robot: Robot as its files describe it.
        task: Object, fingertip, contact and sensor.
        ready: Robot as built for the task.
        limits: Limits for the supervisor.
        stiffness: Expected stiffness of the contact [N/m].
    """

    robot: Robot
    task: Task
    ready: RobotInScene
    limits: Limits
    stiffness: float

    @classmethod
    def build(cls, robot: Robot, task: Task, stiffness: float, limits: Limits | None = None) -> Self:
        """Build a robot over an object; `limits` default to those of the robot.

        Raises:
            InvalidValueError: If the robot or its simulation cannot be built, or cannot do the task.
        """
        return cls(robot, task, build(robot, task), limits or robot.file.limits, stiffness)

    @property
    def period(self) -> float:
        """Control period [s]."""
        return self.ready.backend.period

    @property
    def sensing_delay(self) -> float:
        """Delay from a load to the observation that shows it [s]."""
        return self.ready.finger.pipeline().delay

    @property
    def lead(self) -> float:
        """Delay of observations of the tip behind commanded ramps [s]."""
        return tracking_delay(self.period, self.ready.lag, self.sensing_delay)

    @property
    def landing(self) -> LandingModel:
        """Model of landing on the expected contact."""
        return self.ready.landing_model(self.stiffness)

    @property
    def gain(self) -> ForceGain:
        """Gain of force control on the expected contact, with its stability margins."""
        landing = self.landing
        return force_gain(landing.stiffness, landing.delay)

    @property
    def turns(self) -> bool:
        """Whether the robot can turn its tip."""
        return self.robot.file.backend.TURNS and (self.ready.arm is None or self.ready.arm.turns)

    def allowing(self, option: str, speed: float, landing: LandingModel | None = None) -> Self:
        """Return the setup with limits that allow a commanded speed.

        Args:
            option: Option that requests the speed, for the message.
            speed: Largest commanded speed where something may be hit [m/s].
            landing: Model of landing; that of the expected contact if None.

        Raises:
            InvalidValueError: If something unexpected would be hit too hard.
        """
        limits, landing = self.limits, landing or self.landing
        force = landing.largest_force(speed, limits.force)
        if force > limits.largest_impact * (1.0 + 1e-9):
            fastest = landing.fastest(limits.force, limits.largest_impact)
            raise InvalidValueError(
                f"{option}: the tip is commanded at up to {speed:.3g} m/s, with which something unexpected of "
                f"{landing.contact_stiffness:g} N/m may be hit with {force:.3g} N; the limit is "
                f"{limits.largest_impact:g} N, up to {fastest:.2g} m/s; go slower, or write "
                f"limits.impact_force_N: {math.ceil(force)} in the robot file if sensor, tip and object bear that"
            )
        return replace(self, limits=limits.allowing(speed))


def touch_threshold(model: SensorModel) -> float:
    """Return the force that counts as a touch on a simulated sensor [N]."""
    noise = 0.0 if model.noise is None else max(model.noise.sd[:3])
    return max(MIN_TOUCH_FORCE, TOUCH_DEVIATIONS * noise)


def sensor_model(
    robot: Robot, force_noise: float | None, moment_noise: float | None, drift: float = 0.0, lever: float = 0.0
) -> SensorModel:
    """Return the simulated sensor of a robot file, with other noise and drift where given.

    Args:
        robot: Robot with the sensor.
        force_noise: Standard deviation of each force component [N]; None: the robot file's.
        moment_noise: Standard deviation of each moment component [N m]; None: the robot file's.
        drift: Drift of the zero of the force along z [N/min].
        lever: Drift of the zero of the moment about x, over that of the force [m].

    Raises:
        InvalidValueError: If the sensor model is impossible.
    """
    model = model_with_noise(robot.file.fingers[0], force_noise, moment_noise)
    if not drift:
        return model
    rate = drift / 60.0
    warm_up = WarmUp(_STEADY_DRIFT_TIME, _STEADY_DRIFT_TIME)
    return replace(model, thermal_drift=ThermalDrift((0.0, 0.0, rate, lever * rate, 0.0, 0.0), warm_up))


def check_workspace(
    robot: Limits, low: Vector, high: Vector, remedy: str, *, down_to_object: bool = False
) -> None:
    """Refuse a path that leaves the workspace of a robot.

    Args:
        robot: Limits of the robot.
        low: Smallest position of the tip frame, base frame [m].
        high: Largest position of the tip frame [m].
        remedy: End of the message.
        down_to_object: Whether the object ends the descent, so that `low` is no bound along z.

    Raises:
        InvalidValueError: If the path leaves the workspace.
    """
    for axis, start, end, least, most in zip(
        "xyz", low, high, robot.workspace_lower, robot.workspace_upper, strict=True
    ):
        if end > most or (start < least and not (down_to_object and axis == "z")):
            raise InvalidValueError(
                f"the path reaches from {start:.4g} to {end:.4g} m along {axis}: it leaves the robot's workspace, "
                f"{least:g} to {most:g} m (limits.workspace_lower_m, workspace_upper_m in the robot file); "
                f"{remedy}"
            )


def workspace_around(
    robot: Limits, low: Vector, high: Vector, room: float, inset: float = 0.0
) -> tuple[Vector, Vector]:
    """Return the bounds of a workspace around a path.

    Args:
        robot: Limits of the robot.
        low: Smallest position of the tip frame, base frame [m].
        high: Largest position of the tip frame [m].
        room: Distance of the bounds from the path [m].
        inset: Smallest distance of the bounds from those of the robot's workspace [m].
    """
    lower = (max(a - room, least + inset) for a, least in zip(low, robot.workspace_lower, strict=True))
    upper = (min(a + room, most - inset) for a, most in zip(high, robot.workspace_upper, strict=True))
    return (next(lower), next(lower), next(lower)), (next(upper), next(upper), next(upper))


@dataclass(frozen=True, eq=False, kw_only=True)
class OneFingerPlan(PlanDefaults, ABC):
    """A run with one fingertip over an object, checked and built; nothing has moved. A `Plan`.

    Attributes:
        setup: Robot over the object.
        config: Configuration; its `seed` is that of the sensor's noise.
        title: Title of dry run and view.
        quantities: Quantities of a dry run, without those of joints and limits.
        expected_duration: Expected duration of the run [s].
        longest_duration: Time after which the run is stopped [s].
        files: Names of the files that the experiment writes.
        notes: Notes of a dry run.
        followed: Joint motion along the planned path; None if palpate does not move the joints.
    """

    setup: Setup
    config: Any
    title: str
    quantities: tuple[Quantity, ...]
    expected_duration: float
    longest_duration: float
    files: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    followed: FollowedPath | None = None

    @staticmethod
    def over(
        target: SceneObject,
        config: Any,
        robot: Robot,
        control: Callable[[Any], Controller],
        *,
        force: float,
        speed: float,
        stiffness: float,
        duration: float,
        title: str,
        beside: tuple[float, float] = (0.0, 0.0),
        quantities: tuple[Quantity, ...] = (),
        files: tuple[str, ...] = (),
    ) -> "OneFingerPlan":
        """Return the plan of a fingertip that starts over an object.

        Args:
            target: Object that is touched.
            config: Configuration.
            robot: Robot that carries the fingertip.
            control: Function from the plan to a fresh controller.
            force: Largest normal force [N].
            speed: Speed of the tip along the object [m/s]; the limits also leave room for force control, up to an
                error as large as `force`.
            stiffness: Stiffness of the contact [N/m].
            duration: Expected duration [s].
            title: Title of the run.
            beside: Start of the tip's centre, x and y [m].
            quantities: Further quantities of a dry run.
            files: Names of the files that the experiment writes.

        Raises:
            InvalidValueError: If the robot cannot press so hard, or cannot be built or simulated.
        """
        check_force(force, force, robot.file.limits)
        tip, model = fingertip(robot), sensor_model(robot, None, None)
        task = Task(
            tip=tip,
            compression=0.5 * force / stiffness,
            target=target,
            law=replace(EXPLORE.law, stiffness=stiffness),
            start=start_above(tip, target.top, CLEARANCE, beside),
            period=robot.file.period,
            sensor=SeededSensor(model, config.seed),
            touch_force=touch_threshold(model),
        )
        setup = Setup.build(robot, task, stiffness)
        return ControlledPlan(
            setup=setup.allowing(f"speed = {speed:g} m/s", speed + setup.gain.gain * force),
            config=config,
            title=title,
            quantities=(Quantity("expected duration", duration, "s"), *quantities),
            expected_duration=duration,
            longest_duration=_LONGEST_DURATION * duration,
            files=files,
            control=control,
        )

    @property
    def robot(self) -> Robot:
        """Robot that carries the fingertip."""
        return self.setup.robot

    @property
    def ready(self) -> RobotInScene:
        """Robot as built over the object."""
        return self.setup.ready

    @property
    def limits(self) -> Limits:
        """Limits for the supervisor."""
        return self.setup.limits

    @property
    def fingers(self) -> tuple[FingerDescription, ...]:
        """Fingers for touch: the one that touches first, then those that hold."""
        return self.ready.fingers

    @property
    def following(self) -> FollowingMaker:
        """Comparison of the robot's motion with its commands."""
        return self.ready.servo.following(self.limits.force)

    @property
    def period(self) -> float:
        """Control period [s]."""
        return self.setup.period

    def guards(self) -> tuple[Guard, ...]:
        """Return fresh guards of the robot."""
        return self.ready.guards()

    def backend(self) -> Backend:
        """Return the robot over the object, ready to be started once."""
        return build(self.robot, self.setup.task).backend

    @abstractmethod
    def controller(self) -> Any:
        """Return a fresh controller."""

    def dry_run(self) -> DryRun:
        """Return the quantities of the run, the joints' and limits' among them."""
        slow = self.followed is not None and self.followed.speed.value > 1.0
        return DryRun(
            self.title,
            (*self.quantities, *self._joint_quantities(), *self._limit_quantities()),
            self.files,
            (*(self._slow_joint_note() if slow else ()), *self.notes),
        )

    def _joint_quantities(self) -> tuple[Quantity, ...]:
        followed = self.followed
        if followed is None:
            return ()
        room, speed, singular = followed.room, followed.speed, followed.singular_value
        damped = f"{singular}; below {THRESHOLD:g} it is damped"
        return (
            Quantity("room of joints", room.value, "", f"rad or m, {room}; {LEAST_ROOM:g} is the least", digits=3),
            Quantity("fastest joint", 100.0 * speed.value, "%", f"of its limit, {speed}", digits=3),
            Quantity("least singular value", singular.value, "", damped, digits=3),
        )

    def _slow_joint_note(self) -> tuple[str, ...]:
        assert self.followed is not None
        speed = self.followed.speed
        return (
            f"The path would ask for {speed.value:.3g} times the largest speed {speed}; it takes longer there.",
        )

    def _limit_quantities(self) -> tuple[Quantity, ...]:
        limits, landing = self.limits, self.setup.landing
        speed, stiffness = limits.commanded_speed, landing.contact_stiffness
        largest = landing.largest_force(speed, limits.force)
        hit = (
            f"{largest / limits.force:.2g} times the limit: with which something unexpected of {stiffness:g} N/m "
            "may be hit at the speed limit"
        )
        return (
            Quantity("force limit", limits.force, "N", "of the supervisor, which then draws back"),
            Quantity(
                "speed limit", 1e3 * speed, "mm/s", "of the supervisor, for what is commanded near a contact"
            ),
            Quantity("largest force", largest, "N", hit, digits=3),
        )

    def view(self) -> ViewScene:
        """Return the simulated scene; an object that moves does so in the view.

        Raises:
            InvalidValueError: If nothing is simulated.
        """
        target, motions = self.setup.task.target, {}
        if isinstance(target, MovingTarget):
            motions = {f"{OBJECT_GEOM}_{i}": joint.motion for i, joint in enumerate(target.joints)}
        model = known_scene(self.ready.backend).model
        return scene_view(f"{self.title}, {self.config.robot}", model, motions=motions)


@dataclass(frozen=True, eq=False, kw_only=True)
class ControlledPlan(OneFingerPlan):
    """A plan with a function that makes its controllers, from `OneFingerPlan.over`.

    Attributes:
        control: Function from the plan to a fresh controller.
    """

    control: Callable[[Any], Controller]

    def controller(self) -> Controller:
        """Return a fresh controller."""
        return self.control(self)


@dataclass(frozen=True, slots=True)
class Identified:
    """Law of force control identified by pressing, with its measured margins.

    Attributes:
        contact_stiffness: Stiffness K of the contact alone [N/m].
        contact_stiffness_sd: Standard deviation of `contact_stiffness` [N/m].
        damping_time: Damping c of the contact over K [s].
        series_stiffness: Stiffness of contact and servo in series [N/m].
        delay: Delay T of the loop [s].
        force_gain: Velocity k per steady force error [m/s/N].
        mass: Mass of the virtual body [kg]; 0 for the direct law.
        gain_margin: Factor by which the response may grow before the loop oscillates.
        phase_margin_deg: Phase margin [degrees].
    """

    contact_stiffness: float
    contact_stiffness_sd: float
    damping_time: float
    series_stiffness: float
    delay: float
    force_gain: float
    mass: float
    gain_margin: float
    phase_margin_deg: float

    def __post_init__(self) -> None:
        check_positive(
            self,
            contact_stiffness="N/m",
            series_stiffness="N/m",
            delay="s",
            force_gain="m/s/N",
            gain_margin="",
            phase_margin_deg="degrees",
        )
        check_not_negative(self, contact_stiffness_sd="N/m", mass="kg")

    @classmethod
    def of(cls, found: Identification, *, virtual_mass: bool) -> Self:
        """Return the direct law of an identification, or the better law with a virtual mass if there is one."""
        contact, gain, better = found.stiffness, found.gain, found.admittance
        law = (gain.stiffness, gain.delay, gain.gain, 0.0, gain.gain_margin, found.phase_margin_deg)
        if virtual_mass and better is not None:
            body = better.body
            margins = (better.gain_margin, better.phase_margin_deg)
            law = (body.stiffness, body.delay, 1.0 / body.damping, body.mass, *margins)
        return cls(contact.value, contact.sd, found.damping_time, *law)

    @property
    def damping(self) -> float:
        """Steady force error per velocity, 1 / k [N s/m]."""
        return 1.0 / self.force_gain

    @property
    def gain(self) -> ForceGain:
        """Gain of force control, with its margins."""
        return ForceGain(self.force_gain, self.series_stiffness, self.delay)

    def law(self, period: float) -> ForceLaw:
        """Return a fresh law for a control period [s]."""
        if self.mass == 0.0:
            return DirectForce(self.gain)
        return Admittance(VirtualBody(self.mass, self.damping, self.series_stiffness, self.delay), period)

    @property
    def text(self) -> str:
        """YAML from which `read` returns the same bits."""
        return yaml_text(asdict(self))

    @classmethod
    def read(cls, text: str) -> Self:
        """Read the YAML of a log.

        Raises:
            InvalidValueError: If a key is misspelt, or a value has the wrong type or is out of bounds.
        """
        try:
            return decode(read_mapping(text, "the result of pressing"), cls, text)
        except InvalidValueError as error:
            raise InvalidValueError(f"{IDENTIFIED_TEXT}: {error}") from None


@dataclass(frozen=True, eq=False, kw_only=True)
class PressingPlan(OneFingerPlan):
    """A plan that may press first, to identify stiffness and delay about the set force.

    Attributes:
        parameters: Parameters of the controller; those of pressing follow from `approach_distance`.
        identified: Result of pressing; None if the gain is made for an assumed stiffness.
    """

    parameters: Any
    identified: Identified | None = None

    @abstractmethod
    def with_identified(self, found: Identified) -> Self:
        """Return the plan with the law of force control that was identified."""

    @property
    def virtual_mass(self) -> bool:
        """Whether the identified law may have a virtual mass."""
        return False

    def resting_target(self) -> SceneObject | Target:
        """Return the object at rest."""
        return self.setup.task.target

    def changes(self) -> tuple[Change, ...]:
        """Return the requested changes of live parameters."""
        return tuple(Change(*change) for change in self.config.change)

    def attachments(self) -> dict[str, str]:
        """Return the result of pressing, if there is one."""
        return {} if self.identified is None else {IDENTIFIED_TEXT: self.identified.text}

    @property
    def preparation(self) -> str:
        """Pressing, if it was requested and has not been done."""
        wanted = self.config.identify and self.identified is None
        return "pressing, to find stiffness and delay" if wanted else ""

    def pressing(self) -> IdentifyParameters:
        """Return the parameters of pressing."""
        force, limits = self.config.force, self.limits
        high = min((1.0 + _PRESSED_SHARE) * force, _MAX_PRESSED_SHARE * limits.force)
        low = max((1.0 - _PRESSED_SHARE) * force, _MIN_PRESSED_TOUCHES * self.ready.touch_force)
        return IdentifyParameters(
            low=low,
            high=high,
            swing=_SWING_SHARE * (high - low),
            sensing_delay=self.setup.sensing_delay,
            approach_distance=self.parameters.approach_distance,
            lift_speed=min(MAX_LIFT_SPEED, limits.commanded_speed),
        )

    def prepared(self) -> Self:
        """Press on the object at rest, if that was requested, and return the plan with the identified law.

        Raises:
            InvalidValueError: If pressing did not finish, or its result breaks an assumption.
        """
        if not self.preparation:
            return self
        how = self.pressing()
        controller = IdentifyController(how, self.period)
        backend = build(self.robot, replace(self.setup.task, target=self.resting_target())).backend
        longest = how.approach_distance / how.landing_speed + _MAX_PRESSING_TIME
        result = run(backend, Touch(*self.fingers), controller, Supervisor(self.limits), duration=longest)
        try:
            found = controller.result()
            if not found.verdict.ok:
                raise InvalidValueError(f"not to be used: {found.verdict}")
            identified = Identified.of(found, virtual_mass=self.virtual_mass)
        except InvalidValueError as error:
            raise InvalidValueError(f"identify: {error} (the run: {result})") from None
        return self.with_identified(identified)
