"""One object gripped, lifted and let slip to a place in the hand, and what came of it by the simulation's truth.

A box between two fingertips, its centre of mass beside or below the line of the contacts. Translation is how far
the point of the object that lay between the fingertips when the slip was begun has moved in the base frame, across
the line of the contacts: creep, overshoot and whatever else included. See `translation_of_normality`.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import mujoco
import numpy as np
from grip.holding_run import Surface, sensor_of

from palpate.controllers.grip.belief import KnownSurface, SurfaceBelief
from palpate.controllers.grip.hand_motion import HandMotion, MoveAlong, StandStill
from palpate.controllers.grip.in_turn import InTurn
from palpate.controllers.grip.lift import LiftController, LiftParameters
from palpate.controllers.grip.motion_source import HandJoint
from palpate.controllers.grip.pivot import PivotController, PivotParameters
from palpate.controllers.grip.slide import SlideController, SlideParameters
from palpate.controllers.grip.slip_safe import SlipSafeGrip
from palpate.friction.limit_surface import LimitSurface
from palpate.runtime.data import Phase
from palpate.runtime.protocols import Controller
from palpate.runtime.touch import Finger, Touch
from palpate.sensing.compensation import Payload
from palpate.sim import Box, Stage
from palpate.sim.friction.law import FrictionLaw
from palpate.sim.hand.backend import HandBackend
from palpate.sim.hand.contact import GraspContact
from palpate.sim.hand.hand import two_finger_hand
from palpate.sim.hand.passive import SLIDE, TURN, WatchedHand
from palpate.sim.hand.scene import HeldObject, build_grasp_scene
from palpate.sim.hand.truth import HandTruth
from palpate.sim.objects.table import Table

PERIOD = 1e-3
LONGEST = 30.0
"""[s] Of a run."""

LIFT = LiftParameters(first_grip=6.0, height=0.06, speed=0.06, acceleration=0.3, hold_time=0.3)
"""So high that a box that turns does not find the table, so tight that it does not turn when it leaves it."""

BRISTLE = 5e3
"""[N/m] What the plant bears with these masses and this time step. It bends: 3 degrees under the weight."""

MASS = 0.1
PIVOTED, SLID = Box((0.06, 0.05, 0.06)), Box((0.06, 0.05, 0.08))
GRIPPED_ABOVE = 0.015
"""[m] Above its centre of mass is a box gripped that is to slide: so that it hangs."""


@dataclass(frozen=True, slots=True)
class Came:
    """What came of it.

    Attributes:
        done: Whether the controller said so.
        turn: Of the object in the hand, at the end [rad].
        way: Of the object in the hand from the line of contacts, at the end [m].
        translation: Largest [m].
        fastest: Largest speed in the hand [rad/s or m/s], over 20 ms.
        turned: Largest turn in the hand in either direction, from the beginning of the slip [rad].
    """

    done: bool
    turn: float
    way: float
    translation: float
    fastest: float
    turned: float


def translation_of_normality(true: LimitSurface, offset: float, angle: float) -> float:
    """Return e^2 / offset per radian [m], from the horizontal, as asked: cos(angle) left out."""
    return true.spin_length**2 / offset * angle


def true_surface(seed: int) -> LimitSurface:
    """Return what a seed draws: mu within 3 %, e within 5 % of what was touched."""
    return Surface().drawn(np.random.default_rng((seed, 11)))


def pivot(seed: int, angle: float, offset: float = 0.01, along: bool = False, bristles: bool = False) -> Came:
    """Pivot a box by an angle [rad] whose centre of mass is `offset` [m] beside the contacts.

    Args:
        seed: Of surface and sensors.
        angle: [rad]
        offset: [m]
        along: Whether the hand moves along.
        bristles: Whether friction is the friction plant's; MuJoCo's if not.
    """

    def controller(grip: SlipSafeGrip, belief: SurfaceBelief, hand: HandMotion) -> Controller:
        moves = hand if along else StandStill()
        return PivotController(grip, belief, HandJoint(TURN), PERIOD, PivotParameters(angle), moves)

    return _run(seed, PIVOTED, (offset, 0.0), controller, bristles)


def slide(seed: int, way: float, offset: float = 0.0, bristles: bool = False) -> Came:
    """Let a box slide by a way [m]; see `pivot`."""

    def controller(grip: SlipSafeGrip, belief: SurfaceBelief, hand: HandMotion) -> Controller:
        return SlideController(grip, belief, HandJoint(SLIDE), PERIOD, SlideParameters(way))

    return _run(seed, SLID, (offset, GRIPPED_ABOVE), controller, bristles)


def _run(
    seed: int,
    box: Box,
    off: tuple[float, float],
    make: Callable[[SlipSafeGrip, SurfaceBelief, HandMotion], Controller],
    bristles: bool,
) -> Came:
    true, hand = true_surface(seed), two_finger_hand()
    law = FrictionLaw(true.friction, true.friction, spin_length=true.spin_length, stiffness=BRISTLE)
    scene = build_grasp_scene(
        hand,
        HeldObject(box, MASS),
        GraspContact(friction=true.friction, spin_length=true.spin_length),
        carrier=Stage(),
        table=Table(-box.top),
        palm=(0.0, -off[0], off[1] + hand.depth + hand.tip_along),
        friction=law if bristles else None,
    )
    backend = WatchedHand(HandBackend(scene, PERIOD, sensor=sensor_of(seed)), seed=seed)
    finger = Finger(hand.tip.surface, Payload(hand.tip.mass, hand.tip.center_of_mass))
    touch, belief = Touch(finger, finger), KnownSurface(Surface().believed)
    grip = SlipSafeGrip(2, belief, PERIOD)
    rotations = tuple(hand.pose_hand_sensor(i, 0.0).rotation for i in range(2))
    slips = make(grip, belief, MoveAlong(belief, rotations))
    controller = InTurn(LiftController(grip, PERIOD, LIFT), slips)
    now = touch.sense(backend.start())
    controller.start(now)
    place: _Place | None = None
    phase, translation, turned, path = Phase.APPROACH, 0.0, 0.0, []
    begun = 0.0
    while now.time < LONGEST and not phase.is_final:
        command = controller.step(now)
        phase = command.phase
        now = touch.sense(backend.step(command))
        if controller.at == 0:
            continue
        truth, moved = backend.backend.truth(), backend.in_hand
        if place is None:
            place, begun = _Place(truth), moved.turn
        translation = max(translation, place.moved(truth))
        turned = max(turned, abs(moved.turn - begun))
        path.append(moved.turn if isinstance(slips, PivotController) else moved.slide)
        if not all(each.touching for each in truth.fingers):
            return Came(False, moved.turn, moved.slide, math.inf, math.inf, turned)
    along = np.array(path)
    fastest = float(np.abs(along[20:] - along[:-20]).max()) / (20 * PERIOD)
    return Came(phase is Phase.DONE, moved.turn, moved.slide, translation, fastest, turned)


class _Place:
    """The point of the object between the fingertips."""

    def __init__(self, truth: HandTruth) -> None:
        self._at = np.mean([each.position for each in truth.fingers], axis=0)
        self._point = _rotation(truth).T @ (self._at - truth.position)

    def moved(self, truth: HandTruth) -> float:
        """How far it has moved across the line of the contacts [m]."""
        _, y, z = _rotation(truth) @ self._point + truth.position - self._at
        return math.hypot(y, z)


def _rotation(truth: HandTruth) -> "np.typing.NDArray[np.float64]":
    flat = np.zeros(9)
    mujoco.mju_quat2Mat(flat, truth.quat_wxyz)
    return flat.reshape(3, 3)
