"""A UR arm: what it says, and how it is made to move.

The library runs in a child process (see `client`); here is nothing but shared memory and a pipe, so that reading
and moving take microseconds and never wait.
"""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from time import monotonic, sleep
from typing import Self

from palpate.hw.condition import DeviceCondition
from palpate.hw.devices import DeviceError, WireError
from palpate.hw.finding import DeviceFinding, DeviceUse
from palpate.hw.ur.client import Client
from palpate.hw.ur.examined import ur_condition, ur_findings
from palpate.hw.ur.exchange import COMMAND_NUMBERS, ClientPhase, MotionCommand, Order, UrState
from palpate.hw.ur.goals import ForceTask, checked_joints, checked_pose_goal, checked_velocity
from palpate.hw.ur.hello import controller_version
from palpate.hw.ur.problems import Problem, device_error
from palpate.hw.ur.requests import UrTask
from palpate.hw.ur.settings import FlangePayload, UrSettings, checked_fraction
from palpate.hw.ur.support import refuse_unsupported
from palpate.hw.ur.version import Version, has_flange_sensor
from palpate.kinematics.pose import Pose, checked_pose, rotation_from_rotvec, rotvec_from_rotation
from palpate.runtime.data import ArmSample
from palpate.runtime.stopping import Stopping
from palpate.runtime.watchdog import DeviceWatchdog
from palpate.spatial import Vector

_REPLY_WITHIN = 5.0
"""[s] for what takes the controller some of its cycles; the library itself would wait for 300 s."""

_RECOVER_WITHIN = 90.0
"""[s]: a protective stop 8, power and brakes twice 30, the script 5."""

_STALE_RETRIES = 3
"""Times to look again, a millisecond apart, before a state is called old: after a stall of the whole machine it
may be this process that runs first."""

STAGES = 2.0
"""Watchdogs, one after the other, each with the same time: the client process may end just before it acts."""

CHECK = "`palpate recover` reports its state and moves nothing unasked"
"""How to see it."""

EXAMINED_WITHIN = 1.0
"""[s] by which a state may be older where a person looks at it, once: no control depends on it."""

_PADDING = (0.0,) * COMMAND_NUMBERS
REAL_LIBRARY = "palpate.hw.ur.library"


class UrArm:
    """An arm at a controller of Universal Robots (an `ArmDevice`). Also a context manager: starts, and closes."""

    def __init__(self, address: str, settings: UrSettings | None = None, *, library: str = REAL_LIBRARY) -> None:
        """Remember; `start` connects.

        Args:
            address: Of the controller: a host name or IP address.
            settings: Limits, tool and times; None: the defaults.
            library: Name of the module that makes connections; a test has its own.
        """
        self.settings = settings or UrSettings()
        self._address, self._library = address, library
        self._client: Client | None = None
        self._version: Version | None = None
        self._number = 0
        self._free = False

    @property
    def name(self) -> str:
        """For messages."""
        return f"UR arm at {self._address}"

    @property
    def version(self) -> Version:
        """Of the controller's software.

        Raises:
            DeviceError: Not started.
        """
        if self._version is None:
            raise self._not_started()
        return self._version

    @property
    def process_id(self) -> int:
        """Of the client process.

        Raises:
            DeviceError: Not started.
        """
        return self._running().pid

    def __enter__(self) -> Self:
        self.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def watchdogs(self) -> tuple[DeviceWatchdog, ...]:
        """See `WatchdogSource`: without commands the client process stops it, without that the controller."""
        settings = self.settings
        within = STAGES * settings.watchdog + settings.speed / settings.deceleration
        return (DeviceWatchdog(self.name, "is stopped by its controller", within, CHECK),)

    def stopping(self) -> Stopping:
        """See `StoppingSource`: it follows a velocity of zero as any other."""
        return Stopping(deceleration=self.settings.acceleration)

    # To begin and to end

    def start(self) -> None:
        """Connect, load the script, set watchdog, tool and payload; the arm stands still.

        Raises:
            DeviceError: It cannot be reached, is too old, in local control, stopped, or not powered.
            MissingLibraryError: There is no ur_rtde for this computer.
        """
        if self._library == REAL_LIBRARY:
            refuse_unsupported()
        if self._client is None:
            self._begin(UrTask.BRING_UP, self.settings.start_within)

    def examine(self) -> UrState:
        """Connect if need be, and return the controller's state whatever it is: nothing is loaded, nothing moves.

        Raises:
            DeviceError: It cannot be reached, is too old, or sends no states.
            MissingLibraryError: There is no ur_rtde for this computer.
        """
        if self._library == REAL_LIBRARY:
            refuse_unsupported()
        client = self._client or self._connected(monotonic() + self.settings.start_within)
        state = client.exchange.state()
        if state is None or monotonic() - state.time > self.settings.stale_after + EXAMINED_WITHIN:
            raise device_error(self.name, Problem.SILENT)
        return state

    def condition(self) -> DeviceCondition:
        """See `Recoverable`."""
        return ur_condition(self.name, self.examine())

    def findings(self, use: DeviceUse) -> Iterator[DeviceFinding]:
        """See `SelfExamining`."""
        return ur_findings(self.name, self.version, self.state(), use)

    def recover(self) -> None:
        """Make it fit to go on after whatever has happened: the cause must be gone, and the path clear.

        Unlocks a protective stop, powers it and releases the brakes if need be, starts a new client process if the
        old one has ended, loads the script anew. Sensors are not tared.

        Raises:
            DeviceError: It is not fit: an emergency stop is pressed, for example.
        """
        client = self._client
        if client is not None and client.responsive:
            try:
                self._ask_up(client, UrTask.RECOVER, _RECOVER_WITHIN)
            except DeviceError:
                if client.responsive:
                    raise
            else:
                return
        self.close()
        self._begin(UrTask.RECOVER, _RECOVER_WITHIN)

    def close(self) -> None:
        """Stop arm and script, end the client process; may be called more than once, at any time."""
        client, self._client, self._free = self._client, None, False
        if client is not None:
            client.close()

    # What it says

    def state(self) -> UrState:
        """Return the controller's latest state.

        Raises:
            DeviceError: The arm is lost, stopped, or silent for longer than `UrSettings.stale_after`.
        """
        state = self._fresh().exchange.state()
        if state is None:
            raise device_error(self.name, Problem.SILENT)
        return state

    def read(self) -> ArmSample:
        """Return the newest state of the tip frame.

        Raises:
            DeviceError: See `state`.
        """
        return self._sample_of(self.state())

    def read_stopped(self) -> ArmSample:
        """Return the newest state of the tip frame, in a stop too; who asks looks at its age.

        Raises:
            DeviceError: Not started, or there is none.
        """
        state = self._running().exchange.state()
        if state is None:
            raise device_error(self.name, Problem.SILENT)
        return self._sample_of(state)

    def _sample_of(self, s: UrState) -> ArmSample:
        x, y, z, rx, ry, rz = s.tool_pose
        vx, vy, vz, wx, wy, wz = s.tool_velocity
        fx, fy, fz = s.tool_wrench[:3]
        return ArmSample(
            time=s.time,
            position_base_tip=(x, y, z),
            rotation_base_tip=rotation_from_rotvec((rx, ry, rz)),
            velocity_base_tip=(vx, vy, vz),
            joint_position=s.joint_position,
            angular_velocity_base_tip=(wx, wy, wz),
            tip_force_base=(fx, fy, fz) if has_flange_sensor(self.version) else None,
        )

    # How it moves: one of these, once per period

    def move(self, velocity_base_tip: Vector, angular_velocity_base_tip: Vector) -> None:
        """Move with these velocities [m/s, rad/s] until commanded otherwise, or until the watchdog's time is over.

        Raises:
            DeviceError: As `state`.
            InvalidValueError: Faster than the limits, not finite, or not three numbers each.
        """
        values = checked_velocity(self.settings, velocity_base_tip, angular_velocity_base_tip)
        self._command(MotionCommand.VELOCITY, values)

    def servo_joints(self, joint_position: Sequence[float]) -> None:
        """Follow a joint goal [rad], one of a dense stream (servoj).

        Raises:
            DeviceError: As `state`.
            InvalidValueError: Farther from where the joints are than they may go meanwhile, or not six numbers.
        """
        self._command(MotionCommand.JOINTS, checked_joints(self.settings, joint_position, self.state()))

    def servo_pose(self, pose_base_tip: Pose) -> None:
        """Follow a pose of the tip frame, one of a dense stream (servoj with the controller's own kinematics).

        Raises:
            DeviceError: As `state`.
            InvalidValueError: Farther from where the tip is than it may go meanwhile, or no pose.
        """
        self._command(MotionCommand.POSE, checked_pose_goal(self.settings, pose_base_tip, self.state()))

    def push(self, task: ForceTask) -> None:
        """Let the controller hold a force (force mode): its own loop, instead of one of ours.

        Raises:
            DeviceError: As `state`.
            InvalidValueError: Beyond the limits.
        """
        self._command(MotionCommand.FORCE, task.checked(self.settings))

    def stop(self) -> None:
        """Come to rest and wait for it; a motion may follow at once.

        Raises:
            DeviceError: As `state`, or it refused.
        """
        self._ask(UrTask.REST)

    # What is done at rest: each of these brings it to rest first, and waits

    def tare(self) -> None:
        """Take the present load on the tool for zero: just before use, nothing touched.

        Raises:
            DeviceError: It refused, or see `state`.
        """
        self._ask(UrTask.TARE)

    def set_payload(self, payload: FlangePayload) -> None:
        """Say what the flange carries from now on, as after it has taken something up."""
        self._ask(UrTask.PAYLOAD, (payload.mass, *payload.center))

    def set_tool(self, pose_flange_tip: Pose) -> None:
        """Say where the tip frame is from now on."""
        pose = checked_pose("pose_flange_tip", pose_flange_tip)
        self._ask(UrTask.TOOL, (*pose.position, *rotvec_from_rotation(pose.rotation)))

    def set_speed_slider(self, fraction: float) -> None:
        """Set the pendant's slider: all motions are slowed down to this fraction, (0, 1]; the arm may move."""
        self._ask(UrTask.SLIDER, (checked_fraction("fraction", fraction),))

    @contextmanager
    def freedrive(self) -> Iterator[None]:
        """Let it be led by hand, to teach; `read` tells where it is. Leaving the block holds it where it is."""
        self._ask(UrTask.FREE)
        self._free = True
        try:
            yield
        finally:
            self._free = False
            self._ask(UrTask.END_FREE)

    # Inside

    def _begin(self, task: UrTask, within: float) -> None:
        """Start a client process and have it bring the arm up, all in so many seconds; nothing is left if not."""
        begun = monotonic()
        client = self._connected(begun + min(within, self.settings.start_within))
        try:
            self._ask_up(client, task, begun + within - monotonic())
        except BaseException:
            self.close()
            raise

    def _connected(self, deadline: float) -> Client:
        """Start a client process, and wait for its first state; nothing is left if there is none by a time [s]."""
        try:
            self._version = controller_version(self.name, self._address)
            client = self._client = Client(self.name, self._address, self.settings, self._version, self._library)
            client.wait_for(ClientPhase.LISTENING, deadline)
            self._first_state(client, deadline)
        except BaseException:
            self.close()
            raise
        return client

    def _ask_up(self, client: Client, task: UrTask, within: float) -> None:
        self._write(client, MotionCommand.NONE, ())  # nothing of before goes on
        client.ask(task, (), within)

    def _first_state(self, client: Client, deadline: float) -> None:
        while client.exchange.state() is None:
            client.status()
            if monotonic() > deadline:
                raise device_error(self.name, Problem.SILENT)
            sleep(1e-3)

    def _command(self, motion: MotionCommand, values: tuple[float, ...]) -> None:
        client = self._fresh()
        if self._free:
            raise DeviceError(self.name, "it is led by hand", "leave the freedrive() block before it moves")
        self._write(client, motion, values)

    def _ask(self, task: UrTask, values: tuple[float, ...] = ()) -> None:
        client = self._running()
        client.status()
        if task is not UrTask.SLIDER:
            self._write(
                client, MotionCommand.NONE, ()
            )  # a motion that was not followed yet must not be after this
        client.ask(task, values, _REPLY_WITHIN)

    def _write(self, client: Client, motion: MotionCommand, values: tuple[float, ...]) -> None:
        self._number += 1
        padded = values + _PADDING[len(values) :]
        client.exchange.write_command(Order(self._number, monotonic(), motion, padded))

    def _running(self) -> Client:
        if self._client is None:
            raise self._not_started()
        return self._client

    def _not_started(self) -> DeviceError:
        return DeviceError(self.name, "it is not started", "call start() first")

    def _fresh(self) -> Client:
        """Return the client, if all is well and its newest state young enough."""
        client, oldest = self._running(), self.settings.stale_after
        status = client.status()
        for _ in range(_STALE_RETRIES):
            if monotonic() - status.sampled <= oldest:
                return client
            sleep(1e-3)
            status = client.status()
        # it goes round several times per state: one that missed as many as half of that time has is the reason
        if monotonic() - status.beat > 0.5 * oldest:
            raise WireError(
                self.name,
                # ur_rtde keeps Python to itself for a while after a connection is lost
                "the process that talks to it is held up by a lost connection, hangs, or is starved",
                "see that controller and network are up, and what else runs here, then `palpate recover`",
            )
        now, state = monotonic(), client.exchange.state()
        if state is not None and now - state.time <= oldest:  # it has come meanwhile
            return client
        if state is None or now - state.seen > state.seen - state.time:
            raise device_error(self.name, Problem.SILENT)
        raise WireError(
            self.name,
            f"its newest state is {1e3 * (now - state.time):.0f} ms old, as round trips prove; the limit is "
            f"{1e3 * oldest:g} ms",
            "see what else uses network and computer, or allow more (limits.sample_age_s), then `palpate recover`",
        )
