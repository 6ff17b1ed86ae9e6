"""Real devices, or emulated ones on the wire, behind the seam.

Every device tells when it sampled, on this computer's monotonic clock; the rig's clock is that clock from its
start on. Devices are read once per period, each at once; a slower one repeats itself until its sample is too old.
"""

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from time import monotonic, sleep
from typing import Protocol, TypeVar, runtime_checkable

from palpate.errors import InvalidValueError, check_positive
from palpate.hw.devices import (
    ArmDevice,
    Device,
    DeviceError,
    HandDevice,
    SensorReading,
    WireError,
    move_fingers,
    read_stopped,
)
from palpate.hw.rig.finger_sensor import NO_LOAD, FingerSensor
from palpate.kinematics.hand import HandKinematics
from palpate.kinematics.pose import Pose, times
from palpate.runtime.closing import Closing
from palpate.runtime.data import ArmSample, Command, HandSample, Sample, WrenchSample
from palpate.runtime.pacing import Pacer
from palpate.runtime.stopping import Stopping, stopping_of
from palpate.runtime.urgency import urgent_threads
from palpate.runtime.watchdog import DeviceWatchdog, watchdogs_of
from palpate.spatial import ZERO, Matrix, Vector, Wrench, add, rotate_back

GRAVITY = 9.80665
"""Standard gravity [m/s^2]; that of the place is within 0.4 % of it, 1 mN for a fingertip of 30 g."""

UP: Vector = (0.0, 0.0, GRAVITY)
"""Specific force at rest, base frame [m/s^2]: its z axis points up."""

_STALE_RETRIES = 3
"""Times to look again, a millisecond apart, before a sample is called too old: after a stall of the whole machine
it may be this thread that runs first."""

Reading = TypeVar("Reading", ArmSample, HandSample, SensorReading)


@runtime_checkable
class Accelerated(Protocol):
    """An arm that also tells how it accelerates."""

    def acceleration_base_tip(self) -> Vector:
        """Return the acceleration of the tip frame's origin, base frame, gravity not in it [m/s^2]."""
        ...


@dataclass(frozen=True, slots=True)
class RigSettings:
    """What a rig is, beside its devices.

    Attributes:
        period: Control period [s].
        oldest: Age from which on a sample is not believed [s]; that of the supervisor is a good one.
        pose_base_tip: Where the tip frame is if there is no arm.
        kinematics: Where the sensors are in the hand frame, which is the arm's tip frame; None: the one sensor's
            frame is the tip frame.
    """

    period: float
    oldest: float
    pose_base_tip: Pose = field(default_factory=Pose)
    kinematics: HandKinematics | None = None

    def __post_init__(self) -> None:
        """Refuse what cannot be.

        Raises:
            InvalidValueError: A time that is not above 0.
        """
        check_positive(self, period="s", oldest="s")


class Rig(Closing):
    """A `Backend` of devices. Leaving its `with` block, like any exception in it, leaves the robot stopped.

    Whatever fails, the arm is commanded to stand still, and the hand to go on as it was: no fault opens it.
    """

    def __init__(
        self,
        pacer: Pacer,
        settings: RigSettings,
        *,
        arm: ArmDevice | None = None,
        hand: HandDevice | None = None,
        fingers: Sequence[FingerSensor] = (),
    ) -> None:
        """Take what there is; nothing is opened yet.

        Args:
            pacer: That waits for the end of a period.
            settings: See there.
            arm: What carries the tip; None: it stands.
            hand: With its own fingers; None: none.
            fingers: Sensors, one per finger.

        Raises:
            InvalidValueError: Several sensors, and nobody says where they are.
        """
        if len(fingers) > 1 and settings.kinematics is None:
            raise InvalidValueError(
                f"{len(fingers)} sensors and no kinematics: give RigSettings.kinematics, which says how each is "
                "turned"
            )
        if settings.kinematics is not None and hand is None:
            raise InvalidValueError("kinematics without a hand: give the hand, or leave its kinematics out")
        self._pacer, self.settings = pacer, settings
        self.arm, self.hand, self.fingers = arm, hand, tuple(fingers)
        self._accelerated = arm if isinstance(arm, Accelerated) else None
        self._up = False
        self._origin = 0.0
        self._grip: tuple[float, ...] | None = None
        self._offsets: list[Wrench] = [NO_LOAD] * len(self.fingers)

    @property
    def period(self) -> float:
        """Control period [s]."""
        return self.settings.period

    @property
    def pacer(self) -> Pacer:
        """See `Backend`."""
        return self._pacer

    @property
    def devices(self) -> tuple[Device, ...]:
        """In the order in which they start: what only tells, then what holds, last what moves."""
        outside = [finger.device for finger in self.fingers if not finger.in_arm]
        inside = [finger.device for finger in self.fingers if finger.in_arm]
        return tuple(device for device in (*outside, self.hand, self.arm, *inside) if device is not None)

    def start(self) -> Sample:
        """Connect and check all devices; return the first sample, at time 0. A rig that is up only begins anew.

        Raises:
            DeviceError: One is not fit; those that had started are closed again.
        """
        if not self._up:
            self._bring_up()
        self._origin = monotonic()
        try:
            return self._sample(first=True)
        except BaseException:
            self.close()
            raise

    def watchdogs(self) -> tuple[DeviceWatchdog, ...]:
        """Return what stops arm and hand; none if one of them states nothing."""
        each = [watchdogs_of(device) for device in (self.arm, self.hand) if device is not None]
        return tuple(watchdog for found in each for watchdog in found) if all(each) else ()

    def stopping(self) -> Stopping:
        """See `StoppingSource`."""
        return stopping_of(self.arm)

    def arm_alone(self) -> Sample:
        """See `ArmSource`.

        Raises:
            DeviceError: The arm is lost, or its newest state too old.
        """
        device = self.arm
        arm = self._standing() if device is None else self._fresh(device, lambda: read_stopped(device))
        now = monotonic()
        return Sample(now - self._origin, replace(arm, time=min(arm.time, now) - self._origin), ())

    def tare(self) -> None:
        """Take what the sensors show for what they show of bias and payload alone: at rest, nothing touched.

        Raises:
            DeviceError: Not started, readings that move, or a sensor that gives raw channels.
        """
        self._require_up()
        for finger in self.fingers:
            if not finger.gives_wrenches:
                raise DeviceError(
                    finger.device.name, "raw channels cannot be tared here", "use `palpate calibrate tare`"
                )
        self._halt()
        for finger in self.fingers:
            finger.device.tare()
        self._offsets = [NO_LOAD] * len(self.fingers)
        rest = self._sample(first=False)
        for i, (finger, sample) in enumerate(zip(self.fingers, rest.wrenches, strict=True)):
            self._offsets[i] = finger.resting_load(sample.acceleration)

    def step(self, command: Command) -> Sample:
        """Tell the devices, wait for the end of the period, and return what they say then.

        Raises:
            DeviceError: One is lost, unwell, or its newest sample is too old.
            InvalidValueError: A command that these devices cannot follow.
            OverrunError: See `Backend`.
        """
        self._require_up()
        try:
            problem = self._send(command)
            self._pacer.wait()
            if problem is not None:
                raise problem
            return self._sample(first=False)
        except BaseException:
            self._halt()
            raise

    def close(self) -> None:
        """Stop the arm, leave the hand as its settings say, let go of the sensors: all of them, whatever fails.

        Raises:
            Exception: What the first device raised that could not be closed.
        """
        self._up = False
        problems: list[Exception] = []
        for device in self._closing_order():
            try:
                device.close()
            except Exception as error:
                problems.append(error)
        if problems:
            raise problems[0]

    # Inside

    def _closing_order(self) -> tuple[Device, ...]:
        """What moves first, then what holds, then what only tells."""
        moving = [device for device in (self.arm, self.hand) if device is not None]
        return (*moving, *(finger.device for finger in self.fingers))

    def _bring_up(self) -> None:
        self._grip = None
        self._offsets = [NO_LOAD] * len(self.fingers)
        try:
            with urgent_threads():  # that read what devices send
                for device in self.devices:
                    device.start()
        except BaseException:
            with suppress(Exception):  # why it did not start is what matters
                self.close()
            raise
        self._up = True

    def _require_up(self) -> None:
        if not self._up:
            raise DeviceError("the rig", "it is not started", "call start() first")

    def _send(self, command: Command) -> Exception | None:
        """Command arm and hand, each even if the other fails. Return the first error."""
        problem: Exception | None = None
        try:
            self._check(command)
        except InvalidValueError as error:
            problem = error
        else:
            if command.grip_force is not None:
                self._grip = command.grip_force
            if self.arm is not None:
                try:
                    self.arm.move(command.velocity_base_tip, command.angular_velocity_base_tip)
                except Exception as error:
                    problem = error
        try:
            if self.hand is not None and self._grip is not None:
                self.hand.press(self._grip)
            move_fingers(self.hand, None if problem else command.finger_velocity)
        except Exception as error:
            problem = problem or error
        if problem is not None:
            self._halt()
        return problem

    def _check(self, command: Command) -> None:
        if self.arm is None and (command.velocity_base_tip != ZERO or command.angular_velocity_base_tip != ZERO):
            raise InvalidValueError(
                f"velocity = {command.velocity_base_tip} m/s: this rig has no arm; only zero can be followed"
            )
        if command.grip_force is not None and self.hand is None:
            raise InvalidValueError(f"grip_force = {command.grip_force} N: this rig has no hand; give None")

    def _halt(self) -> None:
        """Tell the arm to stand still, whatever comes of it; it has its watchdog besides."""
        if self._up and self.arm is not None:
            with suppress(Exception):
                self.arm.move(ZERO, ZERO)

    def _sample(self, *, first: bool) -> Sample:
        arm = self._standing() if self.arm is None else self._fresh(self.arm, self.arm.read)
        hand = None if self.hand is None else self._fresh(self.hand, self.hand.read)
        readings = [self._fresh(finger.device, finger.device.read) for finger in self.fingers]
        for finger, reading in zip(self.fingers, readings, strict=True):
            if not reading.healthy:
                why = getattr(finger.device, "problem", "") or "its status says that the reading is no good"
                raise DeviceError(finger.device.name, why, "take loads off, see its manual, then start again")
        now = self._origin if first else monotonic()
        begin = self._origin
        rotations = self._rotations(arm, hand)
        felt = UP if self._accelerated is None else add(UP, self._accelerated.acceleration_base_tip())
        wrenches = tuple(
            WrenchSample(min(reading.time, now) - begin, _sum(reading.wrench, offset), rotate_back(rotation, felt))
            for reading, offset, rotation in zip(readings, self._offsets, rotations, strict=True)
        )
        return Sample(
            now - begin,
            replace(arm, time=min(arm.time, now) - begin, tip_force_base=self._second_channel(arm)),
            wrenches,
            None if hand is None else replace(hand, time=min(hand.time, now) - begin),
        )

    def _second_channel(self, arm: ArmSample) -> Vector | None:
        """The arm's own force, where it is not the fingertip's sensor by another name."""
        return None if any(finger.in_arm for finger in self.fingers) else arm.tip_force_base

    def _standing(self) -> ArmSample:
        pose = self.settings.pose_base_tip
        return ArmSample(monotonic(), pose.position, pose.rotation, ZERO)

    def _rotations(self, arm: ArmSample, hand: HandSample | None) -> list[Matrix]:
        """Return how each sensor is turned in the base frame."""
        kinematics, rotation = self.settings.kinematics, arm.rotation_base_tip
        if kinematics is None or hand is None:
            return [rotation] * len(self.fingers)
        poses = kinematics.sensor_poses(hand.joint_position)
        return [times(rotation, pose.rotation) for pose in poses[: len(self.fingers)]]

    def _fresh(self, device: Device, read: Callable[[], Reading]) -> Reading:
        """Return the newest sample of a device, if it is young enough.

        Raises:
            DeviceError: It is not, or see the device.
        """
        sample, oldest = read(), self.settings.oldest
        for _ in range(_STALE_RETRIES):
            if monotonic() - sample.time <= oldest:
                return sample
            sleep(1e-3)
            sample = read()
        age = monotonic() - sample.time
        if age <= oldest:
            return sample
        raise WireError(
            device.name,
            f"its newest sample is {1e3 * age:.0f} ms old, the limit is {1e3 * oldest:.0f} ms",
            "check cable, network and what else runs on this computer, or allow more (limits.sample_age_s)",
        )


def _sum(wrench: tuple[float, ...], offset: Wrench) -> tuple[float, ...]:
    return wrench if offset is NO_LOAD else tuple(w + o for w, o in zip(wrench, offset, strict=True))
