"""Search for the controller, sensor and plunge that exceed a limit the most: at random first, then near the worst.

A case is a plunge onto a plate, on the stage: with which velocity, wave and tilt the controller moves, and from
when on; which gain, rotation, offset and delay the sensor has, from when on, and when it freezes. Sought is the
largest ratio of a true force, a commanded or true speed, an acceleration or a position to its limit.
"""

import math
import random
import sys
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, fields, replace

import numpy as np
from rich.console import Console
from rich.progress import track
from rich.table import Table
from scipy.spatial.transform import Rotation

from faults.kind import Workshop
from faults.mountings import LIMIT, PERIOD, TIP, K
from palpate.runtime import Finger, Limits, Supervisor, Touch, run
from palpate.runtime.data import Command, Phase
from palpate.runtime.wrapped_backend import WrappedBackend
from palpate.sensing.compensation import SensorPayload
from palpate.sim import Box, ContactLaw, Fidelity, MujocoBackend, Stage, Tip, build_scene, white_noise
from palpate.spatial import norm, subtract
from palpate.surfaces import Sphere

LIMITS = Limits(force=LIMIT, workspace_lower=(-0.02, -0.02, -0.1), workspace_upper=(0.02, 0.02, 0.2))
"""The default ones, with a workspace that can be left within a plunge."""

PLATE = Box((0.2, 0.2, 0.04))
LONGEST = 1.0
"""[s] of each run."""

LOCAL = 0.6
"""Share of the tries that begin at the worst case so far."""

STEP = 0.15
"""Standard deviation of a step of such a try, as a share of each parameter's range."""


@dataclass(frozen=True, slots=True)
class Case:
    """A controller and a sensor, all in numbers from 0 to 1.

    Attributes:
        speed: Of the plunge, up to the limit.
        tilt: Of its direction against straight down, up to a right angle.
        wave: Amplitude of a wave on it.
        frequency: Of the wave, up to a quarter of the control rate.
        begins: When the plunge begins, up to half of the run; it feels its way down with 10 mm/s before.
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


NAMES = tuple(field.name for field in fields(Case))
SENSOR = frozenset(("gain", "turn", "roll", "offset", "late", "wrong_from", "freezes"))
"""Parameters of the sensor; the others are the controller's."""


class Attacker:
    """The controller of a case."""

    def __init__(self, case: Case) -> None:
        self._case, self._first, self._velocity = case, 0.0, np.zeros(3)

    def start(self, first) -> None:
        self._first = first.time

    def step(self, now) -> Command:
        case, since = self._case, now.time - self._first
        begun = since - 0.5 * LONGEST * case.begins
        wanted = np.array([0.0, 0.0, -0.01])
        if begun >= 0.0:
            tilt = 0.5 * math.pi * case.tilt
            speed = case.speed * LIMITS.speed
            swing = case.wave * speed * math.sin(0.5 * math.pi * case.frequency * begun / PERIOD)
            wanted = (speed - abs(swing) + swing) * np.array([math.sin(tilt), 0.0, -math.cos(tilt)])
        step, most = wanted - self._velocity, max(0.02, case.ramp) * LIMITS.acceleration * PERIOD
        size = float(np.linalg.norm(step))
        self._velocity = self._velocity + step * min(1.0, 0.999 * most / size if size else 1.0)
        phase = Phase.APPROACH if case.approach > 0.5 else Phase.SCAN
        return Command(tuple(self._velocity.tolist()), phase)


class AttackedSensor(WrappedBackend):
    """The sensor of a case."""

    def __init__(self, backend, case: Case) -> None:
        super().__init__(backend)
        self._case = case
        self._kept: deque = deque(maxlen=1 + round(100 * case.late))
        self._rotation = Rotation.from_euler("xy", [2 * math.pi * case.turn, 2 * math.pi * case.roll]).as_matrix()
        self._frozen = None

    def start(self):
        return self._shown(super().start())

    def step(self, command):
        return self._shown(super().step(command))

    def _shown(self, sample):
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


def excesses(case: Case) -> Mapping[str, float]:
    """Return the largest ratios to the limits in a run of a case."""
    start = (0.0, 0.0, PLATE.top + TIP + 0.002)
    scene = build_scene(Tip(Sphere(TIP)), PLATE, ContactLaw(stiffness=K), start, Stage(), Fidelity(0.5e-3))
    backend = MujocoBackend(scene, PERIOD, white_noise(3.1e-3, 1.6e-5, seed=1))
    force, speed, commanded, gone, jerk = [0.0], [0.0], [0.0], [0.0], [0.0]
    last = [(0.0, 0.0, 0.0)]

    def watch(sample, now, command) -> None:
        force[0] = max(force[0], norm(backend.truth().force))
        speed[0] = max(speed[0], norm(sample.arm.velocity_base_tip))
        commanded[0] = max(commanded[0], norm(command.velocity_base_tip))
        if command.phase is not Phase.STOP:  # how hard it is stopped is not limited
            jerk[0] = max(jerk[0], norm(subtract(command.velocity_base_tip, last[0])) / PERIOD)
        last[0] = command.velocity_base_tip
        over = [
            max(low - x, x - high, 0.0)
            for x, low, high in zip(
                sample.arm.position_base_tip, LIMITS.workspace_lower, LIMITS.workspace_upper, strict=True
            )
        ]
        gone[0] = max(gone[0], *over)

    finger = Finger(Sphere(TIP), SensorPayload(scene.tip.mass))
    supervisor = Supervisor(LIMITS)
    run(
        AttackedSensor(backend, case),
        Touch(finger),
        Attacker(case),
        supervisor,
        duration=LONGEST,
        observers=(watch,),
    )
    return {
        "force": force[0] / LIMITS.force,
        "speed": speed[0] / LIMITS.speed,
        "commanded speed": commanded[0] / LIMITS.speed,
        "acceleration": jerk[0] / LIMITS.acceleration,
        "position": 1.0 + gone[0] / (LIMITS.workspace_upper[0] - LIMITS.workspace_lower[0]),
    }


def drawn(chance: random.Random, free: frozenset[str], near: Case | None) -> Case:
    """Return a case that is anywhere, or near another one; what is not free is as it should be."""
    values = {}
    for name in NAMES:
        if name in free:
            value = chance.random() if near is None else getattr(near, name) + chance.gauss(0.0, STEP)
            values[name] = min(1.0, max(0.0, value))
    return Case(**values)


def worst(tries: int, seed: int, free: frozenset[str]) -> dict[str, tuple[float, Case]]:
    """Return the largest ratio of each quantity that so many tries find, and its case."""
    chance = random.Random(seed)
    found: dict[str, tuple[float, Case]] = {}
    for index in track(range(tries), description="searching", console=Console(stderr=True), transient=True):
        near = None
        if found and chance.random() < LOCAL * index / tries + 0.1:
            near = found[chance.choice(sorted(found))][1] if chance.random() < 0.3 else found["force"][1]
        case = drawn(chance, free, near)
        for name, ratio in excesses(case).items():
            if name not in found or ratio > found[name][0]:
                found[name] = (ratio, case)
    return found


def searched(tries: int, seed: int, workshop: Workshop) -> int:
    """Search with a hostile controller, with a wrong sensor, and with both; print the worst."""
    console, table = Console(width=200), Table("who is wrong", "quantity", "largest, per limit", "allowed", "with")
    exceeded = False
    everything = frozenset(NAMES)
    for who, free in (("controller", everything - SENSOR), ("sensor", SENSOR), ("both", everything)):
        for name, (ratio, case) in worst(tries, seed, free).items():
            allowed = 1.5 + (LIMITS.speed * PERIOD * K / LIMITS.force if name == "force" else -0.48)
            exceeded |= ratio > allowed
            shown = ", ".join(f"{each} {getattr(case, each):.2f}" for each in NAMES if each in free)
            table.add_row(who, name, f"{ratio:.2f}", f"{allowed:.2f}", shown)
    console.print(table)
    sys.stdout.flush()
    return int(exceeded)
