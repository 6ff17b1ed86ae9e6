"""A box held by two fingers: how it creeps, and what happens when it slips, against the simulation's truth."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import mujoco
import numpy as np

from palpate.errors import InvalidValueError
from palpate.runtime import Finger, Touch
from palpate.runtime.data import Command
from palpate.sensing.compensation import SensorPayload
from palpate.sim import Box, Fidelity, SeededSensor
from palpate.sim.contact_law import solimp, solref
from palpate.sim.hand.backend import HandBackend
from palpate.sim.hand.contact import IMPEDANCE, IMPRATIO, GraspContact
from palpate.sim.hand.hand import two_finger_hand
from palpate.sim.hand.scene import GraspScene, HeldObject, build_grasp_scene
from palpate.sim.objects.table import Table
from palpate.sim.presets import GRASP
from simulation.exploring import let_everything_collide

PERIOD = 1e-3  # [s]
HAND = two_finger_hand()
BOX = Box((0.06, 0.05, 0.06))
MASS, GRIP = 0.2, 4.0  # [kg], [N]: about twice what carries it
RISE, SETTLE = 400, 1500  # periods: ramp of the grip, until all is still
WATCH = 500  # periods over which it creeps
SLIP_SPEED = 0.02  # |(v, e w)| [m/s]
SLIP_ANGLES = tuple(np.linspace(0.0, 90.0, 7).tolist())
SLIP, SLIPPED = 30, 20  # periods of a slip, and of those that are let pass
LIGHT = 0.1  # [kg]: the lightest object that 20 kN/m shall do for
STILL = 1e-4  # [m]: an object that moves by more on its table has jumped
HEAVY = 100.0  # [kg]: an object that no contact slows, and is led


@dataclass(frozen=True, slots=True)
class Holding:
    """One way to simulate a hand that holds an object.

    Attributes:
        fidelity: How the scene is computed.
        law: Contact of fingertips and object.
        impedance: MuJoCo's, of the contact.
        impratio: Of friction to normal impedance.
        mass: Of the object [kg].
        stiffer: How many times stiffer than the law the contact is made, unchecked.
        sensor: Behind each fingertip.
        every_collision: Whether every shape may hit every other, besides the explicit pairs.
    """

    fidelity: Fidelity = GRASP.fidelity
    law: GraspContact = GRASP.law
    impedance: float = IMPEDANCE
    impratio: float = IMPRATIO
    mass: float = MASS
    stiffer: float = 1.0
    sensor: SeededSensor = field(default_factory=SeededSensor)
    every_collision: bool = False

    def scene(self, table: Table | None = None) -> GraspScene:
        """Build it; without a table, the object falls."""
        target = HeldObject(BOX, self.mass)
        scene = build_grasp_scene(HAND, target, self.law, table=table, fidelity=self.fidelity)
        model, pair, law = scene.model, scene.pair, self.law
        if (self.impedance, self.impratio, self.stiffer) != (IMPEDANCE, IMPRATIO, 1.0):
            # the same friction damping and damping ratio from other numbers, for each pair's own masses
            model.opt.impratio = self.impratio
            for k in range(model.npair):
                A = -float(model.pair_solref[k, 0]) / ((1.0 - pair.solimp[0]) * law.stiffness)
                stiffness = self.stiffer * law.stiffness
                model.pair_solref[k] = solref(stiffness, law.damping_ratio, self.impedance, A)
                model.pair_solimp[k] = solimp(self.impedance)
                # MuJoCo divides a direct-format damping by the impedance
                model.pair_solreffriction[k, 1] = -self.impedance * pair.friction_damping
        if self.every_collision:
            let_everything_collide(model)
        return scene


class Hold:
    """A box in the air between two fingertips."""

    def __init__(self, choice: Holding) -> None:
        self.choice, self.backend = choice, HandBackend(choice.scene(), PERIOD, choice.sensor)
        payload = SensorPayload(HAND.tip.mass, HAND.tip.center_of_mass)
        self.touch = Touch(*(Finger(HAND.tip.surface, payload),) * HAND.fingers)
        model = self.backend.scene.model
        weight = model.opt.gravity.copy()
        model.opt.gravity[:] = 0.0  # it floats until it is held
        self.backend.start()
        for i in range(RISE):
            self.backend.step(Command(grip_force=(GRIP * (i + 1) / RISE,) * HAND.fingers))
        self.wait(SETTLE // 2)
        model.opt.gravity[:] = weight
        self.wait(SETTLE - SETTLE // 2)

    def wait(self, periods: int) -> None:
        """Go on holding."""
        command = Command(grip_force=(GRIP,) * HAND.fingers)
        for _ in range(periods):
            self.backend.step(command)

    def creep(self) -> float:
        """Return how fast it sinks [m/s]."""
        first = self.backend.truth()
        self.wait(WATCH)
        last = self.backend.truth()
        return (first.position[2] - last.position[2]) / (last.time - first.time)

    def slip(self, angle: float, speed: float = SLIP_SPEED) -> list[tuple[float, float, float]]:
        """Lead the object through the fingers, between sliding (0) and spinning (90 deg).

        Returns:
            For each finger and period: tangential force over mu f_n, spin torque over mu e f_n, and normal force
            over that before the slip.
        """
        law, before = self.choice.law, self.backend.truth().fingers
        backend, model = self.backend, self.backend.scene.model
        _lead_object(model)
        data, at = _data_of(backend), int(model.joint("object").dofadr[0])
        v, w = speed * math.cos(math.radians(angle)), speed * math.sin(math.radians(angle)) / law.spin_length
        rows = []
        for i in range(SLIP):
            data.qvel[at : at + 6] = (0.0, v, 0.0, w, 0.0, 0.0)
            backend.step(Command())
            if i < SLIPPED:
                continue
            for now, then in zip(backend.truth().fingers, before, strict=True):
                f_n = abs(now.force[0])
                most = law.friction * f_n
                if not most:
                    rows.append((math.nan, math.nan, 0.0))
                    continue
                tangential = math.hypot(now.force[1], now.force[2])
                turning = abs(now.torque[0]) / law.spin_length
                rows.append((tangential / most, turning / most, f_n / abs(then.force[0])))
        return rows


@dataclass(frozen=True, slots=True)
class Held:
    """What came of holding.

    Attributes:
        creep: Of the held object [m/s].
        limit: Largest error of the limit surface in full slip, over all angles.
        turned: Largest angle between load and slip [deg].
        pressed: Largest change of the normal force by slipping at 20 mm/s, over itself.
    """

    creep: float
    limit: float
    turned: float
    pressed: float


NOT_HELD = Held(math.nan, math.nan, math.nan, math.nan)
"""What comes of a scene that cannot be built, or of an object that was dropped."""


def hold(choice: Holding, angles: Sequence[float] = SLIP_ANGLES) -> Held:
    """Hold the box, see it creep, and lead it through full slip at several angles."""
    try:
        held = Hold(choice)
        creep = held.creep()
        rows, turned = [], 0.0
        for angle in angles:
            found = np.array(Hold(choice).slip(angle))
            rows.append(found)
            of_load = np.degrees(np.arctan2(found[:, 1], found[:, 0]))
            turned = max(turned, float(np.abs(of_load - angle).max()))
    except (InvalidValueError, ArithmeticError):
        return NOT_HELD
    table = np.vstack(rows)
    return Held(
        creep,
        float(np.abs(np.hypot(table[:, 0], table[:, 1]) - 1.0).max()),
        turned,
        float(np.abs(table[:, 2] - 1.0).max()),
    )


def has_room(choice: Holding) -> bool:
    """Whether the lightest object stands still on a table and in the grip, with even twice sqrt(K A) dt.

    On the table four corners bear it at once. What is sound only just is of no use.
    """
    try:
        scene = replace(choice, mass=LIGHT, stiffer=4.0).scene(Table(-BOX.top))
        backend = HandBackend(scene, PERIOD)
        backend.start()
        heights = []
        for i in range(RISE + SETTLE):
            backend.step(Command(grip_force=(GRIP * min(1.0, (i + 1) / RISE),) * HAND.fingers))
            heights.append(backend.truth().position[2])
    except (InvalidValueError, ArithmeticError):
        return False
    return max(map(abs, heights)) < STILL


def _lead_object(model: mujoco.MjModel) -> None:
    """Make the object so heavy that no contact changes its velocity, and weightless; the contact law stays."""
    body = model.body("object").id
    kept = model.body_invweight0.copy(), model.dof_invweight0.copy()
    model.body_mass[body], model.body_inertia[body], model.opt.gravity[:] = HEAVY, [1.0] * 3, 0.0
    mujoco.mj_setConst(model, mujoco.MjData(model))
    model.body_invweight0[:], model.dof_invweight0[:] = kept


def _data_of(backend: HandBackend) -> mujoco.MjData:
    """The simulation's own state: a benchmark may lead what no command can."""
    return backend._data
