"""A simulated hand that is commanded any grip within its limit, and shaken: how hard it truly grips."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

from faults.mountings import PERIOD
from palpate.runtime import Finger, Limits, Supervisor, Touch, run
from palpate.runtime.data import Command, Phase
from palpate.sensing.compensation import SensorPayload
from palpate.sim import Box, Lift, white_noise
from palpate.sim.hand.backend import HandBackend
from palpate.sim.hand.hand import three_finger_hand, two_finger_hand
from palpate.sim.hand.scene import HeldObject, build_grasp_scene
from palpate.sim.objects.table import Table
from palpate.spatial import dot

LIMITS = Limits(force=40.0, grip_force=20.0)
"""The default grip: fingers may feel more than they grip with, as what they hold pulls at them."""

LONGEST = 3.0
"""[s] of each run: fingers take 1 s to close."""

TABLE = Table(-0.03)
SCENES = tuple(
    build_grasp_scene(hand, HeldObject(Box((0.06, 0.05, 0.06))), carrier=Lift(), table=TABLE)
    for hand in (two_finger_hand(), three_finger_hand())
)


@dataclass(frozen=True, slots=True)
class SqueezeCase:
    """What a controller does to a hand, in numbers from 0 to 1.

    Attributes:
        level: Of the grip, up to its limit.
        first: Grip with which the hand closes, likewise.
        jumps: When it goes over from one to the other, a share of the run.
        wave: Share of the grip by which it swings.
        frequency: Of that, up to a quarter of the control rate, logarithmic.
        lift: Speed up and down, up to the limit on commands.
        turns: How often it goes up and down, up to 20 a second.
        uneven: Share of the grip that the first finger lacks.
        fingers: Above a half three, else two.
    """

    level: float = 1.0
    first: float = 1.0
    jumps: float = 0.5
    wave: float = 0.0
    frequency: float = 0.5
    lift: float = 0.0
    turns: float = 0.1
    uneven: float = 0.0
    fingers: float = 0.0


class Squeezer:
    """The controller of a case."""

    def __init__(self, case: SqueezeCase, fingers: int) -> None:
        self._case, self._fingers, self._first, self._speed = case, fingers, 0.0, 0.0

    def start(self, first) -> None:
        self._first = first.time

    def step(self, now) -> Command:
        case, since = self._case, now.time - self._first
        jumped = since > LONGEST * case.jumps
        rate = 0.25 / PERIOD * 10.0 ** (-3.0 * (1.0 - case.frequency))
        swing = 1.0 - case.wave * (0.5 - 0.5 * math.cos(2.0 * math.pi * rate * since))
        grip = LIMITS.grip_force * (case.level if jumped else case.first) * swing
        wanted = case.lift * LIMITS.commanded_speed * math.sin(2.0 * math.pi * 20.0 * case.turns * since)
        most = 0.999 * LIMITS.acceleration * PERIOD
        self._speed += max(-most, min(most, (wanted if jumped else 0.0) - self._speed))
        return Command(
            (0.0, 0.0, self._speed), Phase.HOLD, (grip * (1.0 - case.uneven), *(grip,) * (self._fingers - 1))
        )


class Squeeze:
    """Where a hand grips a box on a table."""

    def excesses(self, case: SqueezeCase) -> Mapping[str, float]:
        """Return the largest ratios of commanded and true grip to the limit in a run of a case."""
        scene = SCENES[case.fingers > 0.5]
        fingers, tip = scene.hand.fingers, scene.hand.tip
        backend = HandBackend(scene, PERIOD, white_noise(3.1e-3, 1.6e-5, seed=1))
        most = {"grip": 0.0, "commanded grip": 0.0}
        turns = [scene.hand.pose_hand_sensor(i, 0.0).rotation for i in range(fingers)]
        closing = [(a[0], b[0], c[0]) for a, b, c in turns]  # each sensor's x; the hand never turns

        def watch(sample, now, command) -> None:
            truth = zip(backend.truth().fingers, closing, strict=True)
            most["grip"] = max(most["grip"], *(-dot(finger.force, along) for finger, along in truth))
            most["commanded grip"] = max(most["commanded grip"], *command.grip_force or (0.0,))

        touch = Touch(*[Finger(tip.surface, SensorPayload(tip.mass, tip.center_of_mass))] * fingers)
        supervisor = Supervisor(LIMITS)
        run(backend, touch, Squeezer(case, fingers), supervisor, duration=LONGEST, observers=(watch,))
        return {name: value / LIMITS.grip_force for name, value in most.items()}
