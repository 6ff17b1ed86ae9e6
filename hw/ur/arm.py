"""A UR arm: states, motion and condition.

The library runs in a child process (see `client`); this module uses shared memory and a pipe only, so that reading
and moving take microseconds and never wait.
"""

import math
from collections.abc import Iterator, Mapping
from time import monotonic, sleep
from typing import Self

from palpate.hw.condition import DeviceCondition
from palpate.hw.devices import DeviceError, WireError
from palpate.hw.finding import DeviceFinding, DeviceUse, FindingVerdict, judged
from palpate.hw.ur.client import Client
from palpate.hw.ur.exchange import ClientPhase, Order, UrState, UrTask
from palpate.hw.ur.library import refuse_unsupported
from palpate.hw.ur.problems import PLAYING, RUNNING, WORDS, Problem, device_error, safety_problem
from palpate.hw.ur.rtde import OLDEST, Version, controller_version, cycle_rate, has_flange_sensor
from palpate.hw.ur.settings import UrSettings
from palpate.kinematics.pose import rotation_from_rotvec
from palpate.runtime.data import ArmSample
from palpate.runtime.standstill_check import REST_SPEED
from palpate.runtime.stopping import Stopping
from palpate.runtime.watchdog import DeviceWatchdog
from palpate.spatial import Vector

_REPLY_WITHIN = 5.0
"""[s] for a task that takes the controller some of its cycles; the library itself would wait for 300 s."""

_RECOVER_WITHIN = 90.0
"""[s]: a protective stop 8, power and brakes twice 30, the script 5."""

_STALE_RETRIES = 3
"""Further looks, a millisecond apart, before a state counts as old: after a stall of the whole machine this
process may run first."""

WATCHDOG_STAGES = 2.0
"""Watchdogs in series, each with the same time: the client process may end just before it acts."""

STOP_CHECK = "`palpate recover` reports its state and moves nothing unasked"
"""How to check that the arm was stopped."""

EXAMINED_AGE_S = 1.0
"""[s] by which a state may be older when it is examined: no control depends on it."""

ACTIONS: Mapping[Problem, str] = {
    Problem.PROTECTIVE_STOP: "unlock its protective stop and load the control program; the arm may give a little",
    Problem.NOT_POWERED: "power it and release its brakes; the arm may sag by millimetres",
}
"""Problems that `UrArm.recover` resolves, and how."""

MIN_RATE_SHARE = 0.9
"""Least share of the controller's cycles that must arrive: below, states are missing."""

MAX_LOST = 1.0
"""Largest share of states that may be lost [%]."""

REAL_LIBRARY = "palpate.hw.ur.library"


class UrArm:
    """Arm at a controller of Universal Robots (an `ArmDevice`). Also a context manager: starts, and closes."""

    def __init__(self, address: str, settings: UrSettings | None = None, *, library: str = REAL_LIBRARY) -> None:
        """Keep the settings; `start` connects.

        Args:
            address: Host name or IP address of the controller.
            settings: Limits, tool and times; None: the defaults.
            library: Name of the module that makes connections; tests have their own.
        """
        self.settings = settings or UrSettings()
        self._address, self._library = address, library
        self._client: Client | None = None
        self._version: Version | None = None
        self._number = 0

    @property
    def name(self) -> str:
        """Name for messages."""
        return f"UR arm at {self._address}"

    @property
    def version(self) -> Version:
        """Version of the controller's software.

        Raises:
            DeviceError: If it is not started.
        """
        if self._version is None:
            raise self._not_started()
        return self._version

    @property
    def process_id(self) -> int:
        """Id of the client process.

        Raises:
            DeviceError: If it is not started.
        """
        return self._running().pid

    def __enter__(self) -> Self:
        self.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def watchdogs(self) -> tuple[DeviceWatchdog, ...]:
        """See `WatchdogSource`: the client process watches the commands, the controller the client process."""
        settings = self.settings
        within = WATCHDOG_STAGES * settings.watchdog + settings.speed / settings.deceleration
        return (DeviceWatchdog(self.name, "is stopped by its controller", within, STOP_CHECK),)

    def stopping(self) -> Stopping:
        """See `StoppingSource`: it follows a velocity of zero like any other."""
        return Stopping(deceleration=self.settings.acceleration)

    # Start and end

    def start(self) -> None:
        """Connect, load the script, set watchdog, tool and payload; the arm stands still.

        Raises:
            DeviceError: If it cannot be reached, is too old, in local control, stopped, or not powered.
            MissingLibraryError: If there is no ur_rtde for this computer.
        """
        if self._library == REAL_LIBRARY:
            refuse_unsupported()
        if self._client is None:
            self._begin(UrTask.BRING_UP, self.settings.start_within)

    def examine(self) -> UrState:
        """Connect if need be, and return the controller's state, whatever it is: nothing is loaded, nothing moves.

        Raises:
            DeviceError: If it cannot be reached, is too old, or sends no states.
            MissingLibraryError: If there is no ur_rtde for this computer.
        """
        if self._library == REAL_LIBRARY:
            refuse_unsupported()
        client = self._client or self._connected(monotonic() + self.settings.start_within)
        state = client.exchange.state()
        if state is None or monotonic() - state.time > self.settings.stale_after + EXAMINED_AGE_S:
            raise device_error(self.name, Problem.SILENT)
        return state

    def condition(self) -> DeviceCondition:
        """See `Recoverable`."""
        return _condition(self.name, self.examine())

    def findings(self, use: DeviceUse) -> Iterator[DeviceFinding]:
        """See `SelfExamining`."""
        return _findings(self.name, self.version, self.state(), use)

    def recover(self) -> None:
        """Make it fit to run after any failure: the cause must be gone, and the path clear.

        Unlocks a protective stop, powers the arm and releases its brakes if need be, starts a new client process
        if the old one has ended, and loads the script again. Sensors are not tared.

        Raises:
            DeviceError: If it is not fit: an emergency stop is pressed, for example.
        """
        client = self._client
        if client is not None and client.responsive:
            try:
                self._rest_first(client, UrTask.RECOVER, _RECOVER_WITHIN)
            except DeviceError:
                if client.responsive:
                    raise
            else:
                return
        self.close()
        self._begin(UrTask.RECOVER, _RECOVER_WITHIN)

    def close(self) -> None:
        """Stop arm and script, end the client process; may be called more than once, at any time."""
        client, self._client = self._client, None
        if client is not None:
            client.close()

    # States

    def state(self) -> UrState:
        """Return the controller's latest state.

        Raises:
            DeviceError: If the arm is lost, stopped, or silent for longer than `UrSettings.stale_after`.
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
        """Return the newest state of the tip frame, in a stop too; the caller checks its age.

        Raises:
            DeviceError: If it is not started, or has sent no state.
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

    # Motion

    def move(self, velocity_base_tip: Vector, angular_velocity_base_tip: Vector) -> None:
        """Move with these velocities [m/s, rad/s] until the next command, or until the watchdog expires.

        Raises:
            DeviceError: See `state`.
            InvalidValueError: If faster than the limits, not finite, or not three numbers each.
        """
        twist = self.settings.checked_twist(velocity_base_tip, angular_velocity_base_tip)
        self._write(self._fresh(), Order(self._number + 1, monotonic(), True, twist))

    def stop(self) -> None:
        """Bring it to rest, and wait for that; a motion may follow at once.

        Raises:
            DeviceError: If it refused, or see `state`.
        """
        self._ask(UrTask.REST)

    def tare(self) -> None:
        """Take the present load on the tool for zero, at rest: just before use, with nothing in contact.

        Raises:
            DeviceError: If it refused, or see `state`.
        """
        self._ask(UrTask.TARE)

    def _begin(self, task: UrTask, within: float) -> None:
        """Start a client process and have it bring the arm up within `within` [s]; leave nothing if that fails."""
        begun = monotonic()
        client = self._connected(begun + min(within, self.settings.start_within))
        try:
            self._rest_first(client, task, begun + within - monotonic())
        except BaseException:
            self.close()
            raise

    def _connected(self, deadline: float) -> Client:
        """Start a client process and wait for its first state until `deadline` [s]; leave nothing on failure."""
        try:
            self._version = controller_version(self.name, self._address)
            client = self._client = Client(self.name, self._address, self.settings, self._version, self._library)
            client.wait_for(ClientPhase.LISTENING, deadline)
            self._first_state(client, deadline)
        except BaseException:
            self.close()
            raise
        return client

    def _first_state(self, client: Client, deadline: float) -> None:
        while client.exchange.state() is None:
            client.status()
            if monotonic() > deadline:
                raise device_error(self.name, Problem.SILENT)
            sleep(1e-3)

    def _rest_first(self, client: Client, task: UrTask, within: float) -> None:
        """Request a task after a command to rest: a motion that was not followed yet must not follow the task."""
        self._write(client, Order(self._number + 1, monotonic(), False))
        client.ask(task, within)

    def _ask(self, task: UrTask) -> None:
        client = self._running()
        client.status()
        self._rest_first(client, task, _REPLY_WITHIN)

    def _write(self, client: Client, order: Order) -> None:
        self._number = order.number
        client.exchange.write_command(order)

    def _running(self) -> Client:
        if self._client is None:
            raise self._not_started()
        return self._client

    def _not_started(self) -> DeviceError:
        return DeviceError(self.name, "it is not started", "call start() first")

    def _fresh(self) -> Client:
        """Return the client, if it reports no problem and its newest state is young enough."""
        client, oldest = self._running(), self.settings.stale_after
        status = client.status()
        for _ in range(_STALE_RETRIES):
            if monotonic() - status.sampled <= oldest:
                return client
            sleep(1e-3)
            status = client.status()
        # it runs several rounds per state: if it missed half of that time, it is the cause
        if monotonic() - status.beat > 0.5 * oldest:
            raise WireError(
                self.name,
                # ur_rtde holds Python's lock for a while after a connection is lost
                "the process that talks to it is held up by a lost connection, hangs, or is starved",
                "see that controller and network are up, and what else runs here, then `palpate recover`",
            )
        now, state = monotonic(), client.exchange.state()
        if state is not None and now - state.time <= oldest:  # it has arrived meanwhile
            return client
        if state is None or now - state.seen > state.seen - state.time:
            raise device_error(self.name, Problem.SILENT)
        raise WireError(
            self.name,
            f"its newest state is {1e3 * (now - state.time):.0f} ms old, as round trips prove; the limit is "
            f"{1e3 * oldest:g} ms",
            "see what else uses network and computer, or allow more (limits.sample_age_s), then `palpate recover`",
        )


def _condition(name: str, state: UrState) -> DeviceCondition:
    """Return whether an arm in this state is fit to run."""
    speed = math.hypot(*state.tool_velocity[:3])
    stands = f"it moves at {1e3 * speed:.3g} mm/s" if speed >= REST_SPEED else "it stands still"
    power = "powered, brakes released" if state.robot_mode == RUNNING else f"robot mode {state.robot_mode}"
    problem = safety_problem(state.robot_mode, state.safety_bits)
    if problem is Problem.NONE:
        fit = speed < REST_SPEED
        remedy = "" if fit else "another program or somebody's hand moves it: end that first"
        return DeviceCondition(name, f"{stands}, {power}, no safety stop", fit, remedy=remedy)
    words, remedy = WORDS[problem]
    action = ACTIONS.get(problem, "")
    return DeviceCondition(name, f"{stands}, {power}; {words}", False, action, "" if action else remedy)


def _findings(name: str, version: Version, last: UrState, use: DeviceUse) -> Iterator[DeviceFinding]:
    """Yield the findings on a controller that has been watched."""
    oldest, cycles = OLDEST.get(version[0]), cycle_rate(version)
    wanted = "" if oldest is None else f"{oldest[0]}.{oldest[1]} or newer"
    yield DeviceFinding(name, "PolyScope", ".".join(map(str, version)), "", wanted)
    network = "check cable and switch: a connection of its own between this computer and the controller"
    yield judged(name, "rate", use.rate, "Hz", f"{cycles:g}", use.rate >= MIN_RATE_SHARE * cycles, network)
    share, note = 100.0 * last.lost / max(1, last.lost + use.exchanges), FindingVerdict.NOTE
    yield judged(name, "states lost", share, "%", f"at most {MAX_LOST:g}", share <= MAX_LOST, network, note)
    slow = use.period * cycles > 1.0 - 1e-6
    wanted, fix = f"at least {1e3 / cycles:g}, its cycle", f"write period_s: {1.0 / cycles:g}"
    yield judged(name, "control period", 1e3 * use.period, "ms", wanted, slow, fix, note)
    problem = safety_problem(last.robot_mode, last.safety_bits)
    yield judged(name, "safety", problem.name.lower(), "", "none", not problem, "see the pendant")
    powered, wanted = last.robot_mode == RUNNING, "on, brakes released"
    power = wanted if powered else f"mode {last.robot_mode}"
    yield judged(name, "power", power, "", wanted, powered, "power it on the pendant")
    plays = last.runtime_state == PLAYING
    program, fix = "plays" if plays else f"state {last.runtime_state}", "switch the pendant to remote control"
    yield judged(name, "program", program, "", "plays", plays, fix)
    full = last.speed_scaling > 0.99
    fix = "move the speed slider to 100 %, or backend.arm.speed_slider: 1.0: all velocities are scaled by it"
    yield judged(name, "speed scaling", 100.0 * last.speed_scaling, "%", "100", full, fix, note)
