"""How the devices of a rig are: each of them connected, watched for a while at rest, and let go of."""

from collections.abc import Iterator
from dataclasses import dataclass
from time import monotonic, sleep

import numpy as np

from palpate.errors import FloatArray
from palpate.experiments.doctor_finding import Finding, Verdict, judged
from palpate.experiments.rig_built import noise_of_finger
from palpate.hw.devices import DeviceError, SensorDevice
from palpate.hw.dynamixel.care import ServoHealth
from palpate.hw.dynamixel.hand import DynamixelHand
from palpate.hw.rig import FingerSensor
from palpate.hw.ur import UrArm
from palpate.hw.ur.problems import PLAYING, RUNNING, safety_problem
from palpate.hw.ur.version import OLDEST, cycle_rate
from palpate.runtime.robot import Robot
from palpate.runtime.robot_rig import DynamixelEntry
from palpate.sensing.ft.arrays import AXES

GLANCE = 2e-4
"""[s] between two looks at a device: as short as the fastest sensor's records are apart."""

NOISIER = 2.0
"""Times the noise that the file tells, from which on it is wrong."""

AT_REST = 1e-3
"""[m/s] of an arm that stands; as the loop has it."""

HOT, LOW = 10.0, 0.3
"""[degrees C, V] from the limit at which a servo shuts down."""

SLOW_SHARE = 0.9
"""Of the rate that it should have: less, and records are missing, not clocks apart."""

UNITS = ("N",) * 3 + ("N m",) * 3


@dataclass(frozen=True, slots=True, eq=False)
class Watched:
    """What a device said while it was watched.

    Attributes:
        time: When each new sample was taken, shape (n,) [s].
        age: Of the newest sample at each look, shape (k,) [s].
        values: Of each new sample, shape (n, m).
    """

    time: FloatArray
    age: FloatArray
    values: FloatArray

    @property
    def rate(self) -> float:
        """Of new samples [1/s]."""
        n = len(self.time)
        return (n - 1) / float(self.time[-1] - self.time[0]) if n > 1 else 0.0

    @property
    def gaps(self) -> FloatArray:
        """Between samples [s]."""
        return np.diff(self.time)


def failure(device: str, error: DeviceError) -> Finding:
    """Return what a device itself says is wrong."""
    return Finding(device, "connection", error.problem, "", "", Verdict.BAD, error.remedy)


def sensor_findings(robot: Robot, i: int, finger: FingerSensor, seconds: float) -> Iterator[Finding]:
    """Start the sensor of finger i, and tell how it is.

    Args:
        robot: For limits, and what its file says of the sensor.
        i: Number of the finger.
        finger: Its sensor.
        seconds: How long to watch it.
    """
    device = finger.device
    try:
        device.start()
        watched = _watched_sensor(device, seconds)
    except DeviceError as error:
        yield failure(device.name, error)
        return
    finally:
        device.close()
    yield from _timing(robot, device.name, watched)
    period, file = robot.file.period, robot.sensors[i]
    fix = f"its records repeat themselves: give device_rate_Hz: {watched.rate:.0f} in its sensor file"
    often = watched.rate * period >= SLOW_SHARE
    yield judged(
        device.name, "rate", watched.rate, "Hz", f"{1.0 / period:g}, the loop's", often, fix, Verdict.NOTE
    )
    if file is not None:
        right = abs(file.sample_rate * period - 1.0) < 1e-6
        fix = f"write sample_rate_Hz: {1.0 / period:g}: it is read once per period, and filtered at that rate"
        yield judged(
            device.name, "sample_rate_Hz of its file", file.sample_rate, "Hz", f"{1.0 / period:g}", right, fix
        )
    yield from _noise(robot, i, device, watched)


def _noise(robot: Robot, i: int, device: SensorDevice, watched: Watched) -> Iterator[Finding]:
    told = noise_of_finger(robot, i)
    raw = robot.sensors[i] is not None and robot.sensors[i].calibration is not None  # type: ignore[union-attr]
    sd = watched.values.std(axis=0, ddof=1)
    mean = watched.values.mean(axis=0)
    for k, axis in enumerate(AXES):
        unit = "" if raw else UNITS[k]
        fix = f"is something touched, or does it move? Else write {sd[k]:.2g} as its noise"
        yield judged(
            device.name,
            f"noise {axis}",
            float(sd[k]),
            unit,
            f"at most {NOISIER * told[k]:.2g}",
            raw or sd[k] <= NOISIER * told[k],
            fix,
        )
    for k, axis in enumerate(AXES):
        yield Finding(device.name, f"at rest {axis}", float(mean[k]), "" if raw else UNITS[k])
    if not (sd > 0.0).any():
        fix = "a reading that never changes is that of a dead sensor, unless it is an emulated one"
        yield Finding(device.name, "readings", "never change", "", "noise", Verdict.NOTE, fix)


def arm_findings(robot: Robot, arm: UrArm, seconds: float) -> Iterator[Finding]:
    """Tell how an arm is that was started.

    Raises:
        DeviceError: It is lost meanwhile.
    """
    name, limits = arm.name, robot.file.limits
    shown = ".".join(map(str, arm.version))
    oldest = OLDEST.get(arm.version[0])
    wanted = "" if oldest is None else f"{oldest[0]}.{oldest[1]} or newer"
    yield Finding(name, "PolyScope", shown, "", wanted)
    begin, first = monotonic(), arm.state()
    times, ages, values = [first.time], [], [first.tool_velocity[:3]]
    while monotonic() - begin < seconds:
        state = arm.state()
        ages.append(monotonic() - state.time)
        if state.time > times[-1]:
            times.append(state.time)
            values.append(state.tool_velocity[:3])
        sleep(GLANCE)
    watched, last = Watched(np.array(times), np.array(ages), np.array(values)), arm.state()
    yield from _timing(robot, name, watched)
    cycles = cycle_rate(arm.version)
    network = "check cable and switch: a connection of its own between this computer and the controller"
    yield judged(
        name,
        "rate",
        watched.rate,
        "Hz",
        f"{cycles:g}",
        watched.rate >= SLOW_SHARE * cycles,
        network,
    )
    yield judged(
        name,
        "control period",
        1e3 * robot.file.period,
        "ms",
        f"at least {1e3 / cycles:g}, its cycle",
        robot.file.period * cycles > 1.0 - 1e-6,
        f"write period_s: {1.0 / cycles:g}",
        Verdict.NOTE,
    )
    lost = last.lost - first.lost
    share = 100.0 * lost / max(1.0, cycles * seconds)
    yield judged(name, "states lost", share, "%", "at most 1", share <= 1.0, network, Verdict.NOTE)
    problem = safety_problem(last.robot_mode, last.safety_bits)
    yield judged(name, "safety", problem.name.lower(), "", "none", not problem, "see the pendant")
    yield judged(
        name,
        "power",
        "on, brakes released" if last.robot_mode == RUNNING else f"mode {last.robot_mode}",
        "",
        "on, brakes released",
        last.robot_mode == RUNNING,
        "power it on the pendant",
    )
    yield judged(
        name,
        "program",
        "plays" if last.runtime_state == PLAYING else f"state {last.runtime_state}",
        "",
        "plays",
        last.runtime_state == PLAYING,
        "switch the pendant to remote control",
    )
    full = last.speed_scaling > 0.99
    fix = "move the speed slider to 100 %, or backend.arm.speed_slider: 1.0: all velocities are scaled by it"
    yield judged(name, "speed scaling", 100.0 * last.speed_scaling, "%", "100", full, fix, Verdict.NOTE)
    speed = float(np.linalg.norm(watched.values, axis=1).max())
    fix = "is its payload right (backend.arm.payload)? Is it led by hand?"
    yield judged(
        name, "largest speed at rest", 1e3 * speed, "mm/s", f"below {1e3 * AT_REST:g}", speed < AT_REST, fix
    )
    pairs = zip(last.joint_position, limits.joint_lower, limits.joint_upper, strict=False)
    outside = [i + 1 for i, (q, low, high) in enumerate(pairs) if not low <= q <= high]
    if limits.joint_lower:
        words = "inside" if not outside else f"outside: joint {', '.join(map(str, outside))}"
        fix = "lead it there, or correct limits.joint_lower_rad and joint_upper_rad"
        yield judged(name, "joints within the robot's limits", words, "", "inside", not outside, fix)
    x, y, z = last.tool_pose[:3]
    yield Finding(name, "tip in its own base frame", f"{x:.4f} {y:.4f} {z:.4f}", "m")


def hand_findings(robot: Robot, entry: DynamixelEntry, hand: DynamixelHand, seconds: float) -> Iterator[Finding]:
    """Tell how a hand is that was started.

    Raises:
        DeviceError: It is lost meanwhile.
    """
    models = {servo.servo_id: servo.model for servo in entry.servos}
    for servo in hand.health():
        yield from _servo(hand.name, servo, models[servo.servo_id])
    missed, took, begin = hand.missed, list[float](), monotonic()
    while monotonic() - begin < seconds:
        asked = monotonic()
        hand.read()
        took.append(monotonic() - asked)
    half, most = (1e3 * float(x) for x in np.percentile(took, [50.0, 99.0]))
    oldest = 1e3 * robot.file.limits.sample_age
    cable = "check cables, baud rate and the adapter's latency"
    yield judged(
        hand.name, "exchange, median", half, "ms", f"at most backend.hand.poll_s, {1e3 * entry.poll:g}",
        half <= 1e3 * entry.poll, f"write poll_s: {1e-3 * half * 1.3:.3f}, or raise the baud rate", Verdict.NOTE,
    )  # fmt: skip
    yield judged(
        hand.name, "exchange, 99 %", most, "ms", f"well below limits.sample_age_s, {oldest:g} ms",
        most + 1e3 * entry.poll < oldest, cable,
    )  # fmt: skip
    share = 100.0 * (hand.missed - missed) / max(1, len(took))
    yield judged(hand.name, "exchanges missed", share, "%", "at most 1", share <= 1.0, cable)


def _servo(hand: str, servo: ServoHealth, model: str | None) -> Iterator[Finding]:
    name = f"{hand}, servo {servo.servo_id}"
    if model is not None:
        fix = f"write model: {servo.model}, or see which servo has which id"
        yield judged(name, "model", servo.model, "", model, model in servo.model, fix)
    yield Finding(name, "firmware", float(servo.firmware))
    limit = servo.temperature_limit
    fix = f"let it cool down: at {limit:g} it shuts down, and lets go"
    yield judged(
        name,
        "temperature",
        servo.temperature,
        "deg C",
        f"below {limit - HOT:g}",
        servo.temperature < limit - HOT,
        fix,
    )
    low, high = servo.voltage_range
    fix = "check its supply: outside of its range it shuts down, and lets go"
    good = low + LOW <= servo.voltage <= high - LOW
    yield judged(name, "supply", servo.voltage, "V", f"{low + LOW:.1f} to {high - LOW:.1f}", good, fix)
    words = servo.error.words if servo.error else "none"
    yield judged(name, "hardware error", words, "", "none", not servo.error, "remove the cause, then reboot it")


def _timing(robot: Robot, name: str, watched: Watched) -> Iterator[Finding]:
    """How old samples are, and how regular."""
    half, most = (1e3 * float(x) for x in np.percentile(watched.age, [50.0, 99.0]))
    oldest = 1e3 * robot.file.limits.sample_age
    fix = "check the network and what else runs here, or allow more (limits.sample_age_s)"
    yield Finding(name, "age, median", half, "ms")
    yield judged(name, "age, 99 %", most, "ms", f"at most {oldest:g}", most <= oldest, fix)
    if len(watched.time) > 2:
        yield Finding(name, "jitter of samples", 1e3 * float(watched.gaps.std()), "ms")
        yield Finding(name, "largest gap between samples", 1e3 * float(watched.gaps.max()), "ms")


def _watched_sensor(device: SensorDevice, seconds: float) -> Watched:
    """Watch it.

    Raises:
        DeviceError: It is lost meanwhile.
    """
    first = device.read()
    times, ages, values, begin = [first.time], [], [first.wrench], monotonic()
    while monotonic() - begin < seconds:
        reading = device.read()
        ages.append(monotonic() - reading.time)
        if not reading.healthy:
            why = getattr(device, "problem", "") or "its status says that the reading is no good"
            raise DeviceError(device.name, why, "take loads off, see its manual")
        if reading.time > times[-1]:
            times.append(reading.time)
            values.append(reading.wrench)
        sleep(GLANCE)
    if len(times) < 3:
        raise DeviceError(device.name, f"{len(times)} records in {seconds:g} s", "check its settings")
    return Watched(np.array(times), np.array(ages), np.array(values))
