"""The real devices of a robot file: `backend` of kind `rig`."""

import math
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace

import msgspec

from palpate.controllers import LandingModel, series_stiffness, tracking_delay
from palpate.controllers.landing import moved_mass
from palpate.errors import InvalidValueError
from palpate.hw.devices import ArmDevice, HandDevice
from palpate.hw.rig import FingerSensor, FreshlyTared, PolledHand, Rig, RigSettings
from palpate.hw.rig.finger_sensor import NO_LOAD
from palpate.hw.rig.placed_arm import ArmAtPlace, ArmFromHere, Beginning
from palpate.kinematics.hand import HandKinematics
from palpate.open_kinds import Settings
from palpate.robots.arm_kind import ArmKind
from palpate.robots.finger_load import noise_of_finger, payload_of
from palpate.robots.hand_description import HandDescription
from palpate.robots.hand_kind import HandKind
from palpate.robots.hand_task import HandTask
from palpate.robots.impact_force import CONTACT
from palpate.robots.pace_entries import SimulatedPaceEntry
from palpate.robots.robot import Robot
from palpate.robots.robot_file import FingerEntry
from palpate.robots.robot_kind import RobotKind
from palpate.robots.sensor_kind import SensorPlace
from palpate.robots.simulated_stage import TurningStageEntry
from palpate.robots.surface_entries import SphereEntry
from palpate.robots.task import RobotInScene, Task
from palpate.runtime import Backend, Finger, FingerDescription, SensorFinger
from palpate.sensing.ft.sensor_file import PayloadEntry
from palpate.sensing.solver import Surface
from palpate.spatial import Vector, scale


def finger_sensor(robot: Robot, i: int, arm: ArmDevice | None) -> FingerSensor:
    """Return the sensor behind finger i, and what it carries; nothing is opened.

    Raises:
        InvalidValueError: There is none, or it cannot be as the file specifies.
    """
    file, payload, entry = robot.sensors[i], payload_of(robot, i), robot.file.fingers[i].sensor_device
    if entry is None:
        raise InvalidValueError(f"fingers[{i}].sensor_device: there is none")
    bias, calibrated = NO_LOAD, file is not None and file.calibration is not None
    if file is not None:
        a, b, c, d, e, f = file.bias
        bias = (a, b, c, d, e, f)
    try:
        device = entry.device(SensorPlace(noise_of_finger(robot, i), payload, calibrated, arm))
    except InvalidValueError as error:
        raise InvalidValueError(f"fingers[{i}].sensor_device.{error}") from None
    return FingerSensor(device, payload, bias, gives_wrenches=not calibrated, in_arm=entry.in_arm)


NEAR_START = 0.005
"""[m] Largest distance of the tip from the start of a run: more than a careful hand-guided placement errs, less
than the clearance to obstacles."""

MOST_TURNED = math.radians(5.0)
"""By which the middle of a tip 12 mm before its sensor is off by 1 mm."""

LONGEST_GRASP_PERIOD = 4e-3
"""[s] A controller must react to slip within some ten periods, 40 ms."""

LEAST_TOUCH, SIGMAS = 0.2, 5.0
"""[N], and standard deviations of a reading: above both it is a touch."""

TIP_MASS = 0.03
"""[kg] Of a simulated tip; nothing is simulated with it here."""


@dataclass(frozen=True, slots=True)
class RigParts:
    """The devices of a rig, not started.

    Attributes:
        arm: None: they stand.
        hand: None: there is one finger.
        sensors: One per finger.
        kinematics: Of the hand.
    """

    arm: ArmDevice | None
    hand: HandDevice | None
    sensors: tuple[FingerSensor, ...]
    kinematics: HandKinematics | None


class RigEntry(RobotKind, Settings, frozen=True, kw_only=True):
    """Real devices: see `palpate.hw.rig.Rig`. The sensors stand with the fingers (`sensor_device`).

    Attributes:
        arm: What carries the fingers; None: they stand.
        hand: With the fingers on it; None: there is one finger, at the arm's tip.
        tare_at_start: Whether sensors are tared whenever a run begins: nothing may be touched then.
    """

    REAL = True

    arm: ArmKind | None = None
    hand: HandKind | None = None
    tare_at_start: bool = True

    @property
    def files(self) -> Mapping[str, str]:
        """See `RobotKind`."""
        return {} if self.hand is None else self.hand.files

    @property
    def measures_force(self) -> bool:
        """See `RobotKind`."""
        return self.arm is not None and self.arm.MEASURES_FORCE

    def check_drivers(self) -> None:
        """See `RobotKind`."""
        if self.arm is not None:
            self.arm.check_driver()

    def check(self, robot: Robot) -> None:
        """See `RobotKind`."""
        parts = self.parts(robot)
        if self.tare_at_start:
            for i, sensor in enumerate(parts.sensors):
                if not sensor.gives_wrenches:
                    raise InvalidValueError(
                        f"fingers[{i}].sensor: it calibrates raw channels, which are not tared at the start; "
                        "write backend.tare_at_start: false, and use `palpate calibrate tare`"
                    )

    def build(self, robot: Robot, task: Task) -> RobotInScene:
        """See `RobotKind`."""
        arm = self.arm
        if arm is None:
            raise InvalidValueError("backend.arm: there is none, and this experiment moves; give it")
        if len(robot.file.fingers) != 1:
            raise InvalidValueError(
                f"fingers: there are {len(robot.file.fingers)}; this experiment is done with one"
            )
        rig = self.rig(robot, task.period, task.start)
        sensor = robot.sensors[0]
        return RobotInScene(
            self._tared(rig),
            described_finger(robot, 0, task.sensed, task.touch_force),
            arm.lag,
            arm.response,
            arm.stiffness,
            task.touch_force if sensor is None else sensor.contact.touch_force,
            angular_acceleration=arm.acceleration,
        )

    def landing_model(self, robot: Robot) -> LandingModel | None:
        """See `RobotKind`."""
        arm = self.arm
        if arm is None:
            return None
        return LandingModel(
            series_stiffness(CONTACT, arm.stiffness),
            tracking_delay(robot.file.period, arm.response),
            CONTACT,
            moved_mass(arm.stiffness, arm.response),
        )

    def has_hand(self, robot: Robot) -> bool:
        """See `RobotKind`."""
        return self.hand is not None and len(robot.file.fingers) > 1

    def described_hand(self, robot: Robot) -> HandDescription:
        """See `RobotKind`."""
        assert self.hand is not None  # it has a hand
        if self.arm is None:
            raise InvalidValueError("backend.arm: there is none, and a grasp lifts; give it")
        if robot.file.period > LONGEST_GRASP_PERIOD:
            raise InvalidValueError(
                f"period_s = {robot.file.period:g}: must be at most {LONGEST_GRASP_PERIOD:g} for a grasp"
            )
        surfaces = [finger.surface for finger in robot.file.fingers]
        if not all(isinstance(each, SphereEntry) and not any(each.center[:2]) for each in surfaces):
            raise InvalidValueError("fingers: a grasp is planned for spheres on the sensors' z axis; see surface")
        fingers = tuple(
            described_finger(
                robot, i, surface.surface(), max(LEAST_TOUCH, SIGMAS * max(noise_of_finger(robot, i)[:3]))
            )
            for i, surface in enumerate(surfaces)
        )
        return HandDescription(self.hand.geometry(robot), fingers, robot.file.period, robot.file.limits, robot)

    def hand_backend(self, hand: HandDescription, task: HandTask) -> Backend:
        """See `RobotKind`."""
        assert hand.robot is not None  # it is of this robot
        start = scale(-1.0, hand.geometry.center)
        return self._tared(self.rig(hand.robot, hand.period, start))

    @contextmanager
    def devices(self, robot: Robot) -> Iterator[Robot]:
        """See `RobotKind`: it is one."""
        yield robot

    def shown(self, robot: Robot) -> Robot:
        """See `RobotKind`: a stage that turns carries the tip; a hand is shown as itself."""
        if self.hand is not None:
            return robot
        fingers = tuple(
            FingerEntry(
                surface=finger.surface, payload=PayloadEntry(mass=TIP_MASS, center_of_mass=finger.surface.center)
            )
            for finger in robot.file.fingers
        )
        file = msgspec.structs.replace(
            robot.file,
            backend=TurningStageEntry(following_error_limit=0.1, angular_following_error=1.5),
            pace=SimulatedPaceEntry(),
            fingers=fingers,
        )
        return replace(robot, file=file, sensors=(None,) * len(fingers))

    def parts(self, robot: Robot) -> RigParts:
        """Return the devices; nothing is opened.

        Raises:
            InvalidValueError: They cannot be as the file specifies.
        """
        arm = None if self.arm is None else self.arm.device(robot.file.limits)
        hand, kinematics, fingers = None, None, len(robot.file.fingers)
        if self.hand is not None:
            self.hand.check_fingers(robot)
            hand = self.hand.device(robot)
            if fingers > 1:
                kinematics = self.hand.geometry(robot)
        elif fingers > 1:
            raise InvalidValueError(f"fingers: there are {fingers} and no backend.hand; give it, or one")
        return RigParts(arm, hand, tuple(finger_sensor(robot, i, arm) for i in range(fingers)), kinematics)

    def rig(self, robot: Robot, period: float, start: Vector | None = None) -> Rig:
        """Return the rig of a robot file.

        Args:
            robot: With this back end.
            period: Of control [s].
            start: Where the tip begins, base frame [m]; None: anywhere, in the arm's own base frame.

        Raises:
            InvalidValueError: It cannot be as the file specifies.
        """
        self.check(robot)
        parts = self.parts(robot)
        hand = None
        if parts.hand is not None and self.hand is not None:
            hand = PolledHand(parts.hand, self.hand.poll)
        arm = parts.arm
        if arm is not None and self.arm is not None and start is not None:
            robot_base, beginning = self.arm.robot_base, Beginning(start, NEAR_START, _most_turned(robot))
            arm = (
                ArmFromHere(arm, beginning) if robot_base is None else ArmAtPlace(arm, robot_base.pose, beginning)
            )
        settings = RigSettings(period, robot.file.limits.sample_age, kinematics=parts.kinematics)
        return Rig(robot.file.pace.pacer(period), settings, arm=arm, hand=hand, fingers=parts.sensors)

    def _tared(self, rig: Rig) -> Backend:
        """Return a rig that is tared whenever a run begins, if that is wanted."""
        return FreshlyTared(rig) if self.tare_at_start else rig


def rig_entry(robot: Robot) -> RigEntry:
    """Return the back end of a robot with real devices.

    Raises:
        TypeError: It is of another kind: whoever chose this is wrong.
    """
    backend = robot.file.backend
    if not isinstance(backend, RigEntry):
        raise TypeError(f"a {type(backend).__name__} is no RigEntry")
    return backend


def parts_of(robot: Robot) -> RigParts:
    """Return the devices that a robot file of kind `rig` names; see `RigEntry.parts`."""
    return rig_entry(robot).parts(robot)


def assembled(robot: Robot, period: float, start: Vector | None = None) -> Rig:
    """Return the rig of a robot file of kind `rig`; see `RigEntry.rig`."""
    return rig_entry(robot).rig(robot, period, start)


def _most_turned(robot: Robot) -> float:
    """How far the tip may be turned [rad]: experiments take its axes for those of the base, but for a sphere."""
    surface = robot.file.fingers[0].surface
    return math.pi if isinstance(surface, SphereEntry) and not any(surface.center) else MOST_TURNED


def described_finger(robot: Robot, i: int, surface: Surface, touch_force: float) -> FingerDescription:
    """Return the description of finger i for touch.

    Args:
        robot: With real sensors.
        i: Number of the finger.
        surface: Of its tip, sensor frame.
        touch_force: That counts as a touch on a sensor without a file [N].
    """
    sensor = robot.sensors[i]
    if sensor is None:
        return Finger(surface, payload_of(robot, i), touch_force, touch_force / 2.0, noise_of_finger(robot, i))
    return SensorFinger(surface, sensor)
