"""Tip under a hostile controller with a faulty sensor: largest ratios to the limits."""

import math
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, replace

import msgspec
import numpy as np
from scipy.spatial.transform import Rotation

from faults.dead_sensor import Distorted
from faults.mountings import LIMIT, PERIOD, PLATE, TIP, over_plate
from palpate.runtime import Limits, Supervisor, run
from palpate.runtime.data import Command, Phase
from palpate.sim import ArmCarrier, Stage
from palpate.spatial import ZERO, norm, subtract

LONGEST = 1.0
"""[s] of each run."""

SEARCHING_SPEED = 0.01
"""[m/s] with which the tip feels its way down until the plunge begins."""

SENSOR = frozenset(("gain", "turn", "roll", "offset", "late", "wrong_from", "freezes"))
"""What is the sensor's of a `PlungeCase`; the rest is the controller's."""


@dataclass(frozen=True, slots=True)
class PlungeCase:
    """A controller and a sensor, all in numbers from 0 to 1.

    Attributes:
        speed: Of the plunge, up to the limit on commands.
        tilt: Of its direction against straight down, up to straight up.
        wave: Amplitude of a wave on it.
        frequency: Of the wave, up to a quarter of the control rate.
        begins: When the plunge begins, up to half of the run.
        ramp: Acceleration with which it begins, up to that of the limit.
        approach: Above a half, the plunge is called an approach.
        gain: Of the sensor: -1 to 2.
        turn: Of the sensor about x, up to 360 degrees.
        roll: Likewise about y.
        offset: Along z: -10 to 10 N.
        late: By which the sensor is late, up to 100 ms.
        wrong_from: When all that begins, up to half of the run.
        freezes: When the sensor freezes, above a half: not at all.
    """

    speed: float = 1.0
    tilt: float = 0.0
    wave: float = 0.0
    frequency: float = 0.5
    begins: float = 0.2
    ramp: float = 1.0
    approach: float = 0.0
    gain: float = 2.0 / 3.0
    turn: float = 0.0
    roll: float = 0.0
    offset: float = 0.5
    late: float = 0.0
    wrong_from: float = 0.0
    freezes: float = 1.0


class Attacker:
    """Controller of a case."""

    def __init__(self, case: PlungeCase, limits: Limits) -> None:
        self._case, self._limits, self._first, self._velocity = case, limits, 0.0, np.zeros(3)

    def start(self, first) -> None:
        self._first = first.time

    def step(self, now) -> Command:
        case, limits, since = self._case, self._limits, now.time - self._first
        begun = since - 0.5 * LONGEST * case.begins
        wanted = np.array([0.0, 0.0, -SEARCHING_SPEED])
        if begun >= 0.0:
            tilt = math.pi * case.tilt
            speed = case.speed * limits.commanded_speed
            swing = case.wave * speed * math.sin(0.5 * math.pi * case.frequency * begun / PERIOD)
            wanted = (speed - abs(swing) + swing) * np.array([math.sin(tilt), 0.0, -math.cos(tilt)])
        step, most = wanted - self._velocity, max(0.02, case.ramp) * limits.acceleration * PERIOD
        size = float(np.linalg.norm(step))
        self._velocity = self._velocity + step * min(1.0, 0.999 * most / size if size else 1.0)
        phase = Phase.APPROACH if case.approach > 0.5 else Phase.SCAN
        return Command(tuple(self._velocity.tolist()), phase)


class AttackedSensor(Distorted):
    """Sensor of a case."""

    def __init__(self, backend, case: PlungeCase) -> None:
        super().__init__(backend)
        self._case = case
        self._kept: deque = deque(maxlen=1 + round(100 * case.late))
        self._rotation = Rotation.from_euler("xy", [2 * math.pi * case.turn, 2 * math.pi * case.roll]).as_matrix()
        self._frozen = None

    def shown(self, sample):
        case, (first, *others) = self._case, sample.wrenches
        self._kept.append(first.wrench)
        if sample.time < 0.5 * LONGEST * case.wrong_from:
            return sample
        force, moment = (3.0 * case.gain - 1.0) * (np.reshape(self._kept[0], (2, 3)) @ self._rotation.T)
        force = force + np.array([0.0, 0.0, 20.0 * case.offset - 10.0])
        wrench = (*force.tolist(), *moment.tolist())
        if case.freezes < 0.5 and sample.time > LONGEST * case.freezes:
            wrench = self._frozen = self._frozen or wrench
        return replace(sample, wrenches=(replace(first, wrench=wrench), *others))


@dataclass(frozen=True, slots=True, eq=False)
class Plunge:
    """Where a tip is sent anywhere.

    Attributes:
        limits: Of the supervisor; the workspace reaches 20 mm from the start.
        carrier: What moves the tip.
        clearance: From the plate to the tip at the start [m].
        judged: What is compared with its limit.
    """

    limits: Limits
    carrier: Stage | ArmCarrier
    clearance: float
    judged: tuple[str, ...]

    def excesses(self, case: PlungeCase) -> Mapping[str, float]:
        """Return the largest ratios to the limits in a run of a case.

        Position counts beyond the workspace, as a share of its width. Acceleration is that of the controller's
        commands that reach the robot, and that of a reaction from its stop on: how hard it stops is not limited.
        """
        height = PLATE.top + TIP + self.clearance
        lower, upper = (-0.02, -0.02, height - 0.02), (0.02, 0.02, height + 0.02)
        limits = msgspec.structs.replace(self.limits, workspace_lower=lower, workspace_upper=upper)
        backend, touch = over_plate(self.carrier, self.clearance)
        most = dict.fromkeys(("force", "speed", "commanded speed", "acceleration", "beyond"), 0.0)
        supervisor, last, tripped = Supervisor(limits), ZERO, False

        def watch(sample, now, command) -> None:
            nonlocal last, tripped
            if supervisor.trip is not None and not tripped:
                last, tripped = ZERO, True
            seen = {
                "force": norm(backend.truth().force),
                "speed": norm(sample.arm.velocity_base_tip),
                "commanded speed": norm(command.velocity_base_tip),
                "beyond": max(
                    max(low - x, x - high)
                    for x, low, high in zip(sample.arm.position_base_tip, lower, upper, strict=True)
                ),
            }
            if command.phase is not Phase.STOP:
                seen["acceleration"] = norm(subtract(command.velocity_base_tip, last)) / PERIOD
            last = command.velocity_base_tip
            for name, value in seen.items():
                most[name] = max(most[name], value)

        run(
            AttackedSensor(backend, case),
            touch,
            Attacker(case, limits),
            supervisor,
            duration=LONGEST,
            observers=(watch,),
        )
        ratios = {
            "force": most["force"] / limits.force,
            "speed": most["speed"] / limits.speed,
            "commanded speed": most["commanded speed"] / limits.speed,
            "acceleration": most["acceleration"] / limits.acceleration,
            "position": 1.0 + most["beyond"] / (upper[0] - lower[0]),
        }
        return {name: ratios[name] for name in self.judged}


LIMITS = Limits(force=LIMIT)
MOTION = ("speed", "commanded speed", "acceleration", "position")
PLUNGES: Mapping[str, Plunge] = {
    "onto a plate": Plunge(LIMITS, Stage(), 0.002, ("force", *MOTION)),
    "in free space, as fast as the limit, on the stage": Plunge(
        LIMITS.allowing(LIMITS.speed), Stage(), 0.1, MOTION
    ),
    "in free space, as fast as the limit, on the UR5e": Plunge(
        LIMITS.allowing(LIMITS.speed), ArmCarrier(), 0.1, MOTION
    ),
}
"""By where."""
