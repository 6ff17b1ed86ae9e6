"""An experiment with one fingertip over something to touch: the plan of simple experiments."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, Self

from palpate.controllers import ForceGain, LandingModel, force_gain
from palpate.experiments.kit.allowed_speed import limits_allowing
from palpate.experiments.kit.contact_checks import LEAST_TOUCH_FORCE
from palpate.experiments.kit.experiment import DryRun, PlanDefaults
from palpate.experiments.kit.limit_quantities import limit_quantities
from palpate.experiments.kit.run_checks import CLEARANCE, check_force
from palpate.reporting.data import Quantity
from palpate.robots.finger_sensor import model_of_finger
from palpate.robots.fingertip import fingertip, only_finger, start_above
from palpate.robots.in_scene import build
from palpate.robots.known_truth import known_scene
from palpate.robots.robot import Robot
from palpate.robots.task import RobotInScene, Task
from palpate.runtime import Backend, Controller, FingerDescription, Limits
from palpate.runtime.following import FollowingMaker
from palpate.runtime.supervision.guard import Guard
from palpate.sim import SceneObject, SeededSensor
from palpate.sim.presets import EXPLORE
from palpate.viewing import ViewScene

LONGEST = 4.0
"""Times the expected duration, after which a run is stopped."""


class ReadyPlan(PlanDefaults):
    """Base of plans whose robot stands ready over the object: fingers, guards and following are the robot's.

    Attributes:
        ready: Robot as built over the object.
        limits: Limits for the supervisor.
    """

    __slots__ = ()

    ready: RobotInScene
    limits: Limits

    @property
    def fingers(self) -> tuple[FingerDescription, ...]:
        """Fingers for touch: the one that touches first, then those that hold."""
        return self.ready.fingers

    @property
    def following(self) -> FollowingMaker:
        """See `Plan`."""
        return self.ready.servo.following(self.limits.force)

    def guards(self) -> tuple[Guard, ...]:
        """See `Plan`."""
        return self.ready.guards()


@dataclass(frozen=True, slots=True, eq=False)
class OneFingerPlan(ReadyPlan):
    """A run with one fingertip. A `Plan`.

    Attributes:
        config: What was asked for; its `seed` is that of the sensor's noise.
        robot: What carries it out.
        ready: The same, over the object.
        landing: How hard it presses on this contact.
        gain: Of force control on this contact, with its stability margins.
        control: From this plan to a fresh controller.
        limits: Of the robot, with room for the speed that is asked for.
        title: What is done, for people.
        expected_duration: About how long it takes [s].
        metrics: Of a dry run, besides durations and limits.
        files: Names of the files that it writes.
    """

    config: Any
    robot: Robot
    ready: RobotInScene
    landing: LandingModel
    gain: ForceGain
    control: Callable[[Any], Controller]
    limits: Limits
    title: str
    expected_duration: float
    metrics: tuple[Quantity, ...] = ()
    files: tuple[str, ...] = ()

    @classmethod
    def over(
        cls,
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
        metrics: tuple[Quantity, ...] = (),
        files: tuple[str, ...] = (),
    ) -> Self:
        """Return the plan of a fingertip that starts over an object.

        Args:
            target: What is touched.
            config: What was asked for.
            robot: What carries it out.
            control: From the plan to a fresh controller.
            force: Largest normal force that is asked for [N].
            speed: With which the tip is moved along the object [m/s]; for force control the limits leave room
                besides, up to an error as large as `force`.
            stiffness: Of the contact [N/m].
            duration: About how long it takes [s].
            title: What is done.
            beside: Where the tip's middle starts, x and y [m].
            metrics: More for a dry run.
            files: Names of the files that it writes.

        Raises:
            InvalidValueError: The robot cannot press so hard, or cannot be simulated so.
        """
        check_force(force, force, robot.file.limits)
        finger, tip = only_finger(robot), fingertip(robot)
        task = Task(
            tip=tip,
            compression=0.5 * force / stiffness,
            target=target,
            law=replace(EXPLORE.law, stiffness=stiffness),
            start=start_above(tip, target.top, CLEARANCE, beside),
            period=robot.file.period,
            sensor=SeededSensor(model_of_finger(finger), config.seed),
            touch_force=LEAST_TOUCH_FORCE,
        )
        ready = build(robot, task)
        landing = ready.landing_model(stiffness)
        gain = force_gain(landing.stiffness, landing.delay)
        limits = limits_allowing(robot.file.limits, f"speed = {speed:g} m/s", speed + gain.gain * force, landing)
        return cls(config, robot, ready, landing, gain, control, limits, title, duration, metrics, files)

    @property
    def longest_duration(self) -> float:
        """See `Plan`."""
        return LONGEST * self.expected_duration

    def backend(self) -> Backend:
        """See `Plan`."""
        return self.ready.backend

    def controller(self) -> Controller:
        """See `Plan`."""
        return self.control(self)

    def dry_run(self) -> DryRun:
        """See `Plan`."""
        expected = Quantity("expected duration", self.expected_duration, "s")
        return DryRun(
            self.title, (expected, *self.metrics, *limit_quantities(self.limits, self.landing)), self.files
        )

    def view(self) -> ViewScene:
        """See `Plan`."""
        from palpate.experiments.kit.scene_view import scene_view  # with MuJoCo's meshes

        return scene_view(self.title, known_scene(self.ready.backend).model)
