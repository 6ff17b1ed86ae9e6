"""Contacts of a held box that is lowered on a table's edge: their place, and whether there are several.

A box of 40 x 40 x 30 mm and 0.1 kg, turned by some 45 degrees about the line of the fingers, touches with its
lower edge. The table's edge lies across that: raised like a ridge, so that both edges cross in one point, or with
the table level, so that the box lies on its own edge: on all of it that is above the table, or on one end, as
it was gripped. The hand presses with 3 N and pushes to and fro by 0.9 N; what its two Nano17 feel in three seconds
is asked for the place, and for the number of contacts. Sensors, places, turns and friction are drawn anew for each
seed; MuJoCo's contacts are the truth.
"""

import argparse
import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from harness.campaign import Listing

from palpate.errors import FloatArray
from palpate.kinematics import Pose
from palpate.kinematics.pose import rotation_from_rotvec
from palpate.runtime import Command, Finger, Touch
from palpate.runtime.data import Observation
from palpate.sensing.compensation import SensorPayload
from palpate.sensing.held import ContactBounds, ContactCount, ExternalWrenches, count_contacts
from palpate.sim import Box, ContactLaw, Fidelity, SeededSensor, Stage, Tip
from palpate.sim.hand.contact import GraspContact
from palpate.sim.hand.hand_file import HANDS, HandFile
from palpate.sim.hand.held_tool import GraspedTool, Holding
from palpate.sim.hand.scene import HeldObject
from palpate.sim.hand.touched import Touched
from palpate.sim.sensor.model import SensorModel
from palpate.sim.sensor.presets import nano17
from palpate.sim.sensor.stages import drawn_cross_talk
from palpate.spatial import ZERO, Vector, subtract
from palpate.surfaces import RoundedBox, Sphere

SIZE, MASS = (0.04, 0.04, 0.03), 0.1
"""[m], [kg] Of the box."""

TABLE = (0.2, 0.2, 0.02)
"""[m]"""

ROUNDED = 5e-4
"""[m] Radius of the box's edges, as it is believed: MuJoCo's are sharp."""

GRIP, FORCE, PUSH = 9.0, 3.0, 0.9
"""[N]"""

SLOWLY, GAIN, ASIDE_GAIN = 0.002, 2e-3, 5e-4
"""[m/s], [m/s/N] Of lowering, and of what regulates forces: what sticks is as stiff as the stage, 50 kN/m."""

AIR, LOWERING, WINDOW = 300, 2500, 3000
"""Periods of 1 ms: in free air, for the noise; until it presses; and that are looked at."""

RATES = (1.0, 0.7)
"""[Hz] With which it is pushed to and fro along x and y."""

CALIBRATED = 0.001
"""Cross-talk over the full load."""

ZERO_SD = np.diag([3e-3] * 3 + [5e-5] * 3)
"""[N, N m] Of the sum's zero since the tare: drift, and what the squeeze shows on other axes."""


RARELY, MOSTLY = 0.02, 0.5
"""Shares of the time: of cases below, the box has one contact in MuJoCo, above two."""

BOUNDS = ContactBounds(friction=2.0, separation=0.015, wander=1.5e-4)
"""On an edge the force points aside from both faces, by 45 degrees and by friction, and its place goes round the
edge with it, which is believed to be rounder than it is."""


def sensor(specimen: int) -> SensorModel:
    """Return a calibrated Nano17."""
    own = nano17(specimen)
    assert own.rated is not None
    return replace(own, cross_talk=drawn_cross_talk(own.rated, (CALIBRATED,) * 6, specimen))


@dataclass(frozen=True, slots=True, eq=False)
class Lowered:
    """How a box is held over a table's edge, which lies along y through the origin.

    Attributes:
        turn: Of the box about the line of the fingers, x [rad].
        beside: Of its middle, along x [m].
        ridge: By which the table falls off from its edge [rad].
        friction: Of box and table.
        seed: Of the sensors.
    """

    turn: float
    beside: float
    ridge: float
    friction: float
    seed: int

    @property
    def surface(self) -> RoundedBox:
        """The box, in the tip frame."""
        a, b, c = (0.5 * length for length in SIZE)
        return RoundedBox((a, b, c), ROUNDED, ZERO, np.array(rotation_from_rotvec((self.turn, 0.0, 0.0))))

    def backend(self) -> tuple[GraspedTool, Touch]:
        """Return the hand around the box, and what feels."""
        pad = Tip(Sphere(0.008), 0.02)
        hand = HandFile(HANDS / "two-fingers.xml", ("left_sensor", "right_sensor")).read([pad, pad])
        lowest = 0.5 * (SIZE[2] * math.cos(self.turn) + SIZE[1] * abs(math.sin(self.turn)))
        start: Vector = (self.beside, 0.0, lowest + 1e-3)
        turned = rotation_from_rotvec((0.0, -self.ridge, 0.0))
        table = Pose(ZERO, turned) @ Pose((-0.5 * TABLE[0], 0.0, -0.5 * TABLE[2]))
        sensors = [SeededSensor(sensor(2 * self.seed + i), 2 * self.seed + i) for i in (0, 1)]
        fingers = [Finger(pad.surface, SensorPayload(pad.mass, pad.center_of_mass))] * 2
        payload = SensorPayload(MASS)
        backend = Holding(hand, fingers, GraspContact(friction=0.8, impratio=1e7), GRIP).over(
            Touched(Box(TABLE), ContactLaw(friction=self.friction), table),
            HeldObject(Box(SIZE), MASS, Pose(start, rotation_from_rotvec((self.turn, 0.0, 0.0)))),
            carrier=Stage(),
            fidelity=Fidelity(0.25e-3),
            payload=payload,
            sensor=sensors,
        )
        return backend, Touch(Finger(self.surface, payload), *fingers)


@dataclass(frozen=True, slots=True)
class Answer:
    """What was felt.

    Attributes:
        count: Of contacts.
        several: Share of the time in which MuJoCo has contacts farther apart than `BOUNDS.separation`.
        off: Of the place from MuJoCo's mean one [m].
        sd: As it is stated [m].
        words: Of the verdict.
    """

    count: ContactCount
    several: float
    off: float
    sd: float
    words: str


def asked(case: Lowered) -> Answer:
    """Lower the box, push it to and fro, and ask."""
    backend, touch = case.backend()
    touch.start()
    now = touch.sense(backend.start())
    air, wrenches, places, points = [], [], [], []
    for i in range(AIR + LOWERING + WINDOW):
        t = 1e-3 * (i - AIR - LOWERING)
        aside = [PUSH * math.sin(2.0 * math.pi * rate * t) if t >= 0.0 else 0.0 for rate in RATES]
        velocity = ZERO if i < AIR else _velocity(now, aside)
        now = touch.sense(backend.step(Command(velocity)))
        wrench = now.fingers[0].wrench
        if i < AIR:
            air.append(wrench)
        elif t >= 0.0:
            wrenches.append(wrench)
            places.append(subtract(backend.truth().position, now.arm.position_base_tip))
            points.append(backend.touched_points())
    n = len(wrenches)
    noise, common = (np.broadcast_to(each, (n, 6, 6)) for each in (np.cov(np.array(air).T), ZERO_SD))
    found = count_contacts(case.surface, ExternalWrenches(np.array(wrenches), noise, common), BOUNDS)
    apart = np.array([np.linalg.norm(np.ptp(each, axis=0)) for each in points if len(each)])
    several = float(np.mean(apart > BOUNDS.separation))
    off = float(np.linalg.norm(found.place - np.mean(places, axis=0)))
    return Answer(found.count, several, off, float(np.sqrt(np.trace(found.covariance))), str(found.verdict))


def _velocity(now: Observation, aside: list[float]) -> Vector:
    """Towards a force of `FORCE` upwards and these ones aside, from what is felt."""
    x, y, z = now.fingers[0].force
    down = -min(SLOWLY, GAIN * (FORCE - z))
    return (
        (ASIDE_GAIN * (x - aside[0]), ASIDE_GAIN * (y - aside[1]), down) if z > 0.5 * FORCE else (0.0, 0.0, down)
    )


def drawn(kind: str, seed: int) -> Lowered:
    """Return a case of a kind: "crossing" edges, or "lying" on one of them."""
    rng = np.random.default_rng(seed)
    turn = math.radians(float(rng.uniform(38.0, 52.0) * rng.choice([-1.0, 1.0])))
    # lying, 28 to 38 mm of its edge are above the table, its middle among them: else it rests on the table's edge
    beside = float(rng.uniform(-0.012, 0.012) if kind == "crossing" else rng.uniform(-0.018, -0.008))
    ridge = float(rng.uniform(0.05, 0.2)) if kind == "crossing" else 0.0
    return Lowered(turn, beside, ridge, float(rng.uniform(0.45, 0.7)), seed)


def box(options: argparse.Namespace) -> Iterator[Listing]:
    """Compare the verdict with MuJoCo's contacts."""
    answered = [asked(drawn(kind, seed)) for kind in ("crossing", "lying") for seed in range(options.seeds or 40)]
    rows = []
    for name, low, high in (("one", 0.0, RARELY), ("now one, now two", RARELY, MOSTLY), ("two", MOSTLY, 1.1)):
        answers = [each for each in answered if low <= each.several < high]
        if answers:
            counts = ", ".join(f"{sum(each.count is count for each in answers)} {count}" for count in ContactCount)
            off, sd = (1e3 * np.array([getattr(each, which) for each in answers]) for which in ("off", "sd"))
            rows.append((name, counts, f"{_rms(off):.2g} / {np.nanmax(off):.2g}", f"{_rms(sd):.2g}"))
    heads = ("MuJoCo's contacts", "verdicts", "error of place: RMS / largest [mm]", "stated, RMS [mm]")
    yield Listing("a held box on an edge", heads, rows)


def _rms(values: FloatArray) -> float:
    return float(np.sqrt(np.nanmean(np.square(values))))


PARTS = {"box": box}
