"""Every simulated back end that is shipped, in a scene that uses all of it: importable by worker processes."""

import hashlib
import math
from collections.abc import Callable
from dataclasses import dataclass, replace

from palpate.runtime.data import Command, Sample
from palpate.sim import (
    ArmCarrier,
    Box,
    ContactLaw,
    Lift,
    MujocoBackend,
    PresetSensor,
    SphereObject,
    Tip,
    Torus,
    build_scene,
    sensor_preset,
    white_noise,
)
from palpate.sim.friction.law import FrictionLaw
from palpate.sim.friction.texture import Grating
from palpate.sim.hand.backend import HandBackend
from palpate.sim.hand.hand import three_finger_hand, two_finger_hand
from palpate.sim.hand.scene import HeldObject, build_grasp_scene
from palpate.sim.objects.table import Table
from palpate.sim.sensor.model import SeededSensor
from palpate.surfaces import Ellipsoid, Sphere

RADIUS, SINK, STROKE, CLOSED = 0.008, 200, 0.02, 900
"""[m]; periods until the tip presses; tangential speed [m/s]; periods until the hand holds."""
NOISY = white_noise(0.01, 1e-4)
PERFECT = SeededSensor()
NANO = SeededSensor(sensor_preset(PresetSensor.NANO17))
RUBBER = FrictionLaw(static_friction=0.5, kinetic_friction=0.3, load_exponent=0.3, norm_exponent=1.3)
SOFT = replace(RUBBER, stiffness=2e3)  # for an object of 0.1 kg
BEAD, BALL = Tip(Sphere(RADIUS)), SphereObject(0.04)


@dataclass(frozen=True, slots=True)
class Run:
    """One run of one back end.

    Attributes:
        kind: One of `BACKENDS`.
        seed: Of its sensors' noise.
        periods: How long.
    """

    kind: str
    seed: int
    periods: int


def stroke(k: int) -> Command:
    """Come down by half a millimetre, then rub to and fro."""
    if k < SINK:
        return Command((0.0, 0.0, -2.5e-3))
    return Command((STROKE * math.sin(0.02 * k), STROKE * math.cos(0.013 * k), -5e-4 * math.sin(0.05 * k)))


def grip(fingers: int) -> Callable[[int], Command]:
    """Close, then press more and less, and lift."""

    def command(k: int) -> Command:
        force = 2.5 + 0.5 * math.sin(0.02 * k)
        return Command((0.0, 0.0, 0.01 if k > CLOSED else 0.0), grip_force=(force,) * fingers)

    return command


def on_stage(sensor, target=BALL, tip=BEAD, above=RADIUS, carrier=None, x=0.0, **rubbing):
    start = (x, 0.0, target.top + above + 2e-4)
    return MujocoBackend(build_scene(tip, target, ContactLaw(), start, carrier, **rubbing), sensor=sensor), stroke


def in_hand(sensor, hand, shape, **rubbing):
    scene = build_grasp_scene(hand, HeldObject(shape), carrier=Lift(), table=Table(-0.03), **rubbing)
    return HandBackend(scene, sensor=sensor), grip(hand.fingers)


BACKENDS = {
    "stage": lambda seed: on_stage(PERFECT),
    "stage, noise": lambda seed: on_stage(replace(NOISY, seed=seed)),
    "stage, Nano17, ellipsoid on a box": lambda seed: on_stage(
        replace(NANO, seed=seed), Box((0.1, 0.1, 0.04)), Tip(Ellipsoid((0.008, 0.009, 0.012))), above=0.012
    ),
    "stage, friction plant, noise": lambda seed: on_stage(
        replace(NOISY, seed=seed), Box((0.1, 0.1, 0.04)), friction=RUBBER, texture=Grating(2e-3, 0.2)
    ),
    "stage, friction plant, torus, noise": lambda seed: on_stage(
        replace(NOISY, seed=seed), Torus(0.03, 0.012), x=0.03, friction=RUBBER
    ),
    "UR5e, noise": lambda seed: on_stage(replace(NOISY, seed=seed), carrier=ArmCarrier()),
    "UR5e, friction plant, Nano17": lambda seed: on_stage(
        replace(NANO, seed=seed), carrier=ArmCarrier(), friction=RUBBER
    ),
    "hand, noise": lambda seed: in_hand(replace(NOISY, seed=seed), two_finger_hand(), Box((0.06, 0.05, 0.06))),
    "hand, friction plant, noise": lambda seed: in_hand(
        replace(NOISY, seed=seed),
        two_finger_hand(),
        Box((0.06, 0.05, 0.06)),
        friction=replace(RUBBER, stiffness=2e3),
    ),
    "hand of three, Nano17": lambda seed: in_hand(
        replace(NANO, seed=seed), three_finger_hand(), SphereObject(0.03)
    ),
}
NOISELESS = "stage"


def steps(run: Run):
    """Yield everything that a run says, sample and truth of each period."""
    backend, command = BACKENDS[run.kind](run.seed)
    yield backend.start(), None
    for k in range(run.periods):
        yield backend.step(command(k)), backend.truth()
    backend.close()


def touched(history: list[tuple[Sample, object]]) -> bool:
    """Whether anything was felt, so that a comparison is worth something."""
    loads = [max(map(abs, wrench.wrench[:3])) for sample, _ in history for wrench in sample.wrenches]
    return max(loads) > 1.0


def digest(run: Run) -> tuple[str, bool]:
    """Everything that a run says, in short, and whether it felt anything."""
    history = list(steps(run))
    return hashlib.sha256("\n".join(map(repr, history)).encode()).hexdigest(), touched(history)
