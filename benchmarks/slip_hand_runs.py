"""One object held by the simulated hand at a grip that does not change, pulled at until it slips, or not quite."""

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from grip.holding_run import MASS, PERIOD, Rubs, Surface, scene_with, sensor_of
from slip_cases import Shape, load_over_time
from slip_model import TIME_STEP

from palpate.errors import FloatArray
from palpate.friction.contact_load import ContactLoad
from palpate.friction.limit_surface import LimitSurface
from palpate.friction.slip.grip_dither import GripDither
from palpate.friction.slip.kinds import SlipKind
from palpate.runtime.data import Command
from palpate.runtime.touch import Finger, Touch
from palpate.sensing.compensation import SensorPayload
from palpate.sim import Lift
from palpate.sim.fidelity import GRAVITY
from palpate.sim.hand.backend import HandBackend
from palpate.sim.hand.load import ObjectLoad, RampLoad
from palpate.spatial import ZERO, Matrix, Vector, Wrench, cross, norm, rotate

GRIP = 4.0
CLOSED, LIFTED, PULLED = 1.6, 2.0, 2.2
"""[s] When the grip stands, the box is up, and the pull begins."""
RISING = 0.02
"""[m/s] Of the lift."""
ANY_PHASE = 0.02
"""[s] By which the pull begins later, at random: at any phase of a ripple."""
ONSET = 1e-6
"""[m] Of slip."""
AFTER = 0.15
"""[s] For which a run goes on once it slips, or the whole pull is there."""
MOST_SAFE = 0.8
"""Of what a contact bears at the mean grip, that a run without slip reaches."""
FAR_BEYOND = 10.0
"""A friction at which nothing slips."""


class Detector(Protocol):
    def step(self, load: ContactLoad) -> SlipKind | None: ...


@dataclass(frozen=True, slots=True)
class Drawn:
    """What is held, and where it is pulled at.

    Attributes:
        surface: True limit surface.
        offset: Of the pull from the line of the contacts [m].
        began: When the pull begins [s].
    """

    surface: LimitSurface
    offset: float
    began: float

    @classmethod
    def of(cls, generator: np.random.Generator, surface: Surface) -> "Drawn":
        return cls(
            surface.drawn(generator),
            float(generator.uniform(0.0, 0.008)),
            PULLED + float(generator.uniform(0.0, ANY_PHASE)),
        )

    @property
    def bears(self) -> float:
        """The pull that brings both contacts onto the limit surface, weight included [N]."""
        return 2.0 * self.surface.friction * GRIP / math.hypot(1.0, self.offset / self.surface.spin_length)

    def ramp(self, share: float, rise: float) -> RampLoad:
        """From the weight alone to a share of what the grip bears within so long [s]."""
        after = (0.0, 0.0, MASS * GRAVITY - share * self.bears)
        return RampLoad(ZERO, after, self.began, rise, (0.0, self.offset, 0.0))


@dataclass(frozen=True, slots=True, eq=False)
class Course:
    """A pull downwards that goes any course. A `ObjectLoad`.

    Attributes:
        pull: Every TIME_STEP from the beginning on [N].
        begin: [s]
        point: Where it acts, in the object's frame [m].
    """

    pull: FloatArray
    begin: float
    point: Vector

    def wrench(self, time: float, rotation_base_object: Matrix) -> Wrench:
        at = round((time - self.begin) / TIME_STEP)
        if at < 0:
            return (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
        force = (0.0, 0.0, -float(self.pull[min(at, len(self.pull) - 1)]))
        return (*force, *cross(rotate(rotation_base_object, self.point), force))


@dataclass(frozen=True, slots=True)
class Run:
    """What came of it.

    Attributes:
        latency: From slip to the first alarm [s]; inf: not told, NaN: it did not slip.
        kind: The first that was told.
        turning: e omega over v of the slip.
        alarms: How often either finger began to tell.
        highest: Largest load ratio of either contact, at the mean grip.
    """

    latency: float
    kind: SlipKind | None
    turning: float
    alarms: int
    highest: float

    @property
    def slipped(self) -> bool:
        return not math.isnan(self.latency)


def command_at(time: float, dither: GripDither | None, lifts: bool = True) -> Command:
    grip = min(GRIP, 8.0 * time)
    if dither is not None and time >= CLOSED:
        grip += dither.force_at(time, GRIP)
    return Command((0.0, 0.0, RISING if lifts and CLOSED <= time < LIFTED else 0.0), grip_force=(grip, grip))


def held_up(
    true: LimitSurface,
    load: ObjectLoad,
    until: float,
    seed: int,
    dither: GripDither | None,
    detectors: tuple[Detector, ...] = (),
) -> Run:
    """Grip, lift and pull.

    Args:
        true: What the contacts bear.
        load: What pulls.
        until: When it has all come [s].
        seed: Of the sensors.
        dither: On the grip, or None.
        detectors: One per finger; without any, nothing is sensed.
    """
    scene = scene_with(true, Rubs.BRISTLES, Lift())
    backend = HandBackend(scene, PERIOD, sensor=sensor_of(seed), load=load)
    tip = scene.hand.tip
    finger = Finger(tip.surface, SensorPayload(tip.mass, tip.center_of_mass))
    touch = Touch(finger, finger)
    sample = backend.start()
    onset = told = math.inf
    kind: SlipKind | None = None
    ways = np.zeros((2, 2))
    alarms, before, highest = 0, [False] * len(detectors), 0.0
    while sample.time < min(onset, until) + AFTER:
        sample = backend.step(command_at(sample.time, dither))
        # touch takes every sample, that of a closing hand too
        now = touch.sense(sample) if detectors else None
        if sample.time < LIFTED + 0.1:
            continue
        for way, contact in zip(ways, backend.rubbing, strict=True):
            way += PERIOD * norm(contact.slip_velocity), PERIOD * true.spin_length * abs(contact.slip_spin)
            ratio = true.load_ratio(GRIP, norm(contact.tangential_force), contact.spin_torque)
            highest = max(highest, ratio)
        if math.isinf(onset) and np.hypot(*ways.T).max() > ONSET:
            onset = sample.time
        for i, detector in enumerate(detectors):
            assert now is not None
            its = detector.step(ContactLoad.of(now.fingers[i].contact))
            if its is not None and math.isinf(told):
                told, kind = sample.time, its
            alarms += its is not None and not before[i]
            before[i] = its is not None
    worst = ways[np.hypot(*ways.T).argmax()]
    latency = math.nan if math.isinf(onset) else told - onset
    return Run(latency, kind, float(worst[1] / max(worst[0], 1e-12)), alarms, highest)


def safe_course(generator: np.random.Generator, drawn: Drawn, shape: Shape, seconds: float, seed: int) -> Course:
    """A pull of a shape that loads no contact beyond `MOST_SAFE`, ringing and weight included."""
    point = (0.0, drawn.offset, 0.0)
    share = load_over_time(generator, shape, False, seconds)
    sticky = LimitSurface(FAR_BEYOND, drawn.surface.spin_length)
    scale = drawn.bears * MOST_SAFE / float(np.abs(share).max())
    # as nothing slips, what the contacts bear is linear in the pull, but for the weight
    for _ in range(4):
        course = Course(share * scale, drawn.began, point)
        run = held_up(sticky, course, drawn.began + seconds, seed, None)
        highest = run.highest * sticky.friction / drawn.surface.friction
        if highest <= MOST_SAFE:
            break
        scale *= 0.98 * MOST_SAFE / highest
    return course
