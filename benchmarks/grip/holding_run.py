"""One object gripped, lifted and pulled at, and what came of it by the simulation's own truth.

Slip and spin. With MuJoCo's friction, of the object over each fingertip: how far the point of the object that was
under the finger when the pull began has moved over it across the normal, and how far the object has turned; creep
and whatever else is elastic included, nothing taken off. With the friction plant, whose bristles bend by more than
what is asked for here, it is the way along which contacts really slipped: the integral of |slip_velocity|, and of
|slip_spin|, of `FrictionContact`. The larger of both fingers counts.

Grip over the least is the mean of what the fingers really press with (the mean of both) over the mean of what
`least_grip_of_two` needs of the true load with the true mu and e, from the beginning of the pull to the end.
"""

import math
from dataclasses import dataclass
from enum import Enum

import mujoco
import numpy as np

from palpate.controllers.grip.belief import SurfaceBelief
from palpate.controllers.grip.grip_plan import CommonGrip
from palpate.controllers.grip.lift import LiftController, LiftParameters
from palpate.controllers.grip.need import GripNeed, least_grip_of_two
from palpate.controllers.grip.nudge import NudgeAndLift, NudgeController, NudgedSurface, NudgeParameters
from palpate.controllers.grip.parameters import GripParameters
from palpate.controllers.grip.slip_safe import SlipSafeGrip
from palpate.errors import FloatArray
from palpate.friction.limit_surface import LimitSurface
from palpate.runtime.data import Observation
from palpate.runtime.protocols import Controller
from palpate.runtime.touch import Finger, Touch
from palpate.sensing.compensation import SensorPayload
from palpate.sim import Box, Lift, TurningStage
from palpate.sim.carriers.carrier import Carrier
from palpate.sim.fidelity import GRAVITY
from palpate.sim.friction.law import FrictionLaw
from palpate.sim.hand.backend import HandBackend
from palpate.sim.hand.contact import GraspContact
from palpate.sim.hand.hand import two_finger_hand
from palpate.sim.hand.load import ObjectLoad, RampLoad, SumOfLoads
from palpate.sim.hand.scene import GraspScene, HeldObject, build_grasp_scene
from palpate.sim.hand.truth import HandTruth
from palpate.sim.objects.table import Table
from palpate.sim.sensor.model import SeededSensor, SensorModel
from palpate.sim.sensor.presets import NET_BOX_LATENCY, NET_BOX_RATE
from palpate.sim.sensor.stages import (
    Quantisation,
    SampleClock,
    Saturation,
    WhiteNoise,
    alike,
    drawn_cross_talk,
)
from palpate.sim.sensor.temperature import ThermalDrift, WarmUp
from palpate.spatial import ZERO, norm, subtract

PERIOD = 1e-3
NUDGING_GRIP = 2.0
"""[N] 2 mu e f_n is then less than tips the box over, with mu 0.65 and e 6 mm too: 16 of 24 mNm."""

NUDGED_LATER = 2.8
"""[s] That a nudge takes before."""

MASS = 0.1
BOX = Box((0.06, 0.05, 0.06))
BRISTLE = 5e3
"""[N/m] What the plant bears with this mass and time step."""

LIFT = LiftParameters(height=0.04, speed=0.06, acceleration=0.3)
"""So high that a box that turns about its fingertips does not find the table."""

PULL_BEGINS = 2.3
"""[s] By then the object is lifted and held."""

COMES_UP = 0.3
"""[s] In which the pull comes up to its first value: what is asked for is what it grows by then."""

HELD_AFTER = 0.5
"""[s] For which the whole pull is held."""

DROPPED = 0.01
"""[m] Of slip: that is a drop, even if the table or a fingertip caught it."""

NANO17_RATED = (25.0, 25.0, 35.0, 0.25, 0.25, 0.25)
"""ATI Nano17, calibration SI-25-0.25 [N, N m]: the grip itself goes up to 12 N, the full range of SI-12-0.12."""

STEP = alike(1 / 160, 1e-3 / 32)
"""Its resolution [N, N m]."""

NOISE = alike(0.010, 1e-4)
"""[N, N m] White, of each sample: more than that resolution."""

DRIFT = alike(1e-3, 1e-5)
"""[N/s, N m/s] Each axis up or down."""

WARMING = WarmUp(rise=10.0, time_constant=100.0)
"""What drift is simulated with: it is steady for as long as a run lasts."""


class Rubs(Enum):
    """What friction is simulated with."""

    MUJOCO = "MuJoCo"
    BRISTLES = "bristles"


@dataclass(frozen=True, slots=True)
class Surface:
    """How far the true mu and e may be from what is believed.

    Attributes:
        friction: mu that is believed, or the middle of what is possible.
        spin_length: e [m], likewise.
        friction_spread: Largest relative error of mu; even between.
        spin_spread: Of e.
    """

    friction: float = 0.5
    spin_length: float = 0.004
    friction_spread: float = 0.03
    spin_spread: float = 0.05

    def drawn(self, generator: np.random.Generator) -> LimitSurface:
        """Return a true surface."""
        a, b = generator.uniform(-1.0, 1.0, 2).tolist()
        return LimitSurface(
            self.friction * (1.0 + a * self.friction_spread), self.spin_length * (1.0 + b * self.spin_spread)
        )

    @property
    def believed(self) -> LimitSurface:
        """What is planned with, if it was touched."""
        return LimitSurface(self.friction, self.spin_length)

    @property
    def worst(self) -> LimitSurface:
        """The least that it can be."""
        return LimitSurface(
            self.friction * (1.0 - self.friction_spread), self.spin_length * (1.0 - self.spin_spread)
        )


@dataclass(frozen=True, slots=True)
class Pull:
    """A force downwards at a point of the object beside the line of contacts.

    Attributes:
        before: [N] Before it grows.
        after: [N] When it has grown.
        duration: For which it grows [s].
        offset: Of the point [m].
        begins: When it comes up to `before` [s].
    """

    before: float
    after: float
    duration: float
    offset: float
    begins: float = PULL_BEGINS

    @property
    def grows(self) -> float:
        """When it begins to grow [s]."""
        return self.begins + COMES_UP + 0.2

    @property
    def end(self) -> float:
        """When the run ends [s]."""
        return self.grows + self.duration + HELD_AFTER

    @property
    def load(self) -> ObjectLoad:
        """As the scene takes it."""
        at, before = (0.0, self.offset, 0.0), (0.0, 0.0, -self.before)
        growth = (0.0, 0.0, self.before - self.after)
        return SumOfLoads(
            (
                RampLoad(ZERO, before, self.begins, COMES_UP, at),
                RampLoad(ZERO, growth, self.grows, self.duration, at),
            )
        )


@dataclass(frozen=True, slots=True)
class Came:
    """What came of it.

    Attributes:
        dropped: Whether a finger lost the object.
        slip: [m]
        spin: [rad]
        grip: Mean over the mean of the least.
        tightest: Smallest grip over the least at any time.
        regrips: How often the grip answered a slip.
    """

    dropped: bool
    slip: float
    spin: float
    grip: float
    tightest: float
    regrips: int


def sensor_of(seed: int, cross_talk: float = 0.0) -> SeededSensor:
    """Return a sensor of the Nano17's class, with noise and drift, and with cross-talk of a share of its range."""
    signs = np.random.default_rng((seed, 7)).choice([-1.0, 1.0], 6)
    a, b, c, d, e, f = (signs * np.array(DRIFT) * WARMING.time_constant / WARMING.rise).tolist()
    model = SensorModel(
        name="Nano17 SI-25-0.25, calibrated",
        rated=NANO17_RATED,
        cross_talk=drawn_cross_talk(NANO17_RATED, alike(cross_talk, cross_talk), seed) if cross_talk else None,
        thermal_drift=ThermalDrift((a, b, c, d, e, f), WARMING),
        noise=WhiteNoise(NOISE),
        quantisation=Quantisation(STEP),
        saturation=Saturation(NANO17_RATED),
        clock=SampleClock(NET_BOX_RATE),
        latency=NET_BOX_LATENCY,
    )
    return SeededSensor(model, 2 * seed)


def scene_with(true: LimitSurface, rubs: Rubs, carrier: Carrier) -> GraspScene:
    """Return hand, box and table."""
    law = GraspContact(friction=true.friction, spin_length=true.spin_length)
    bristles = FrictionLaw(true.friction, true.friction, spin_length=true.spin_length, stiffness=BRISTLE)
    return build_grasp_scene(
        two_finger_hand(),
        HeldObject(BOX, MASS),
        law,
        carrier=carrier,
        table=Table(-0.03),
        friction=bristles if rubs is Rubs.BRISTLES else None,
    )


def hold(
    true: LimitSurface,
    belief: SurfaceBelief,
    pull: Pull,
    seed: int,
    need: GripNeed | None = None,
    rubs: Rubs = Rubs.MUJOCO,
    cross_talk: float = 0.0,
    parameters: GripParameters | None = None,
) -> Came:
    """Grip, lift and hold.

    Args:
        true: What the contacts bear.
        belief: What they are taken to bear; a `NudgedSurface` is taught by a nudge first, on a hand that can turn.
        pull: What pulls.
        seed: Of the sensors.
        need: From load to grip; with spin if not given.
        rubs: What friction is simulated with.
        cross_talk: Of the sensors, a share of their range.
        parameters: Of the grip; the defaults if not given.
    """
    nudged = isinstance(belief, NudgedSurface)
    scene = scene_with(true, rubs, TurningStage() if nudged else Lift())
    backend = HandBackend(scene, PERIOD, sensor=sensor_of(seed, cross_talk), load=pull.load)
    tip = scene.hand.tip
    finger = Finger(tip.surface, SensorPayload(tip.mass, tip.center_of_mass))
    touch = Touch(finger, finger)
    grip = SlipSafeGrip(2, belief, PERIOD, parameters, plan=CommonGrip(2, belief, PERIOD, parameters, need))
    controller: Controller = LiftController(grip, PERIOD, LIFT)
    if isinstance(belief, NudgedSurface):
        center = (0.0, 0.0, -(scene.hand.depth + scene.hand.tip_along))
        nudge = NudgeController(2, PERIOD, NudgeParameters(NUDGING_GRIP, center))
        controller = NudgeAndLift(nudge, belief, LiftController(grip, PERIOD, LIFT))
    now = touch.sense(backend.start())
    controller.start(now)
    watched: _Watched | None = None
    felt, least = [], []
    while now.time < pull.end:
        now = touch.sense(backend.step(controller.step(now)))
        if now.time < pull.begins:
            continue
        truth = backend.truth()
        watched = watched or _Watched(truth, now)
        if not all(each.touching for each in truth.fingers):
            return Came(True, math.inf, math.inf, math.nan, math.nan, grip.regrips)
        watched.see(truth, now, backend)
        felt.append(0.5 * sum(abs(each.force[0]) for each in truth.fingers))
        least.append(_least(true, truth, backend))
    assert watched is not None
    ratios = np.array(felt) / np.array(least)
    slip, spin = (watched.slip, watched.spin) if rubs is Rubs.MUJOCO else (watched.slip_way, watched.spin_way)
    return Came(slip > DROPPED, slip, spin, sum(felt) / sum(least), float(ratios.min()), grip.regrips)


def _least(true: LimitSurface, truth: HandTruth, backend: HandBackend) -> float:
    a, b, c, d, e, f = backend.pull
    first, second = (subtract(each.position, truth.position) for each in truth.fingers)
    return least_grip_of_two(true, (a, b, c - MASS * GRAVITY, d, e, f), first, second)


class _Watched:
    """How far the object has moved over the fingertips."""

    def __init__(self, truth: HandTruth, now: Observation) -> None:
        self._rotation = _rotation_of(truth)
        self._hand = np.array(now.arm.position_base_tip)
        self._under = [np.array(each.position) for each in truth.fingers]
        self._points = [self._rotation.T @ (each - truth.position) for each in self._under]
        self.slip = self.spin = self.slip_way = self.spin_way = 0.0
        self._ways = [[0.0, 0.0] for _ in truth.fingers]

    def see(self, truth: HandTruth, now: Observation, backend: HandBackend) -> None:
        """Take a period."""
        rotation, hand = _rotation_of(truth), np.array(now.arm.position_base_tip) - self._hand
        for under, point in zip(self._under, self._points, strict=True):
            over = rotation @ point + truth.position - under - hand
            self.slip = max(self.slip, math.hypot(over[1], over[2]))  # fingers close along x
        turned = rotation @ self._rotation.T
        self.spin = max(self.spin, abs(math.atan2(turned[2, 1] - turned[1, 2], turned[1, 1] + turned[2, 2])))
        for contact, way in zip(backend.rubbing, self._ways, strict=False):
            way[0] += norm(contact.slip_velocity) * PERIOD
            way[1] += abs(contact.slip_spin) * PERIOD
        self.slip_way, self.spin_way = (max(way[k] for way in self._ways) for k in (0, 1))


def _rotation_of(truth: HandTruth) -> FloatArray:
    flat = np.zeros(9)
    mujoco.mju_quat2Mat(flat, truth.quat_wxyz)
    return flat.reshape(3, 3)
