"""A fingertip on a turning stage rolled over a fixed plate, and what came of it by the simulation's own truth.

Slip is the way of the tip's material at the true place of contact over the plate: v + w x c, added up from the
beginning of the roll to the end of the run; its largest length. With the friction plant what bends elastically is
in it.
"""

import math
from dataclasses import dataclass

import numpy as np
from grip.holding_run import sensor_of

from palpate.controllers.grip.roll import RollController, RollParameters
from palpate.runtime.data import Phase
from palpate.runtime.touch import Finger, Touch
from palpate.sensing.compensation import Payload
from palpate.sim import Box, ContactLaw, MujocoBackend, Tip, TurningStage, build_scene
from palpate.sim.friction.law import FrictionLaw
from palpate.spatial import ZERO, Vector, add, add_scaled, cross, norm, subtract
from palpate.surfaces import Sphere

PERIOD = 1e-3
LONGEST = 10.0
"""[s] Of a run."""

PLATE = Box((0.2, 0.2, 0.02))

BEFORE_SENSOR = 0.012
"""[m] By which the tip's middle lies in front of the sensor, about which the stage turns: with the friction plant.
With MuJoCo's friction it is 0, for that leaves out how a contact's Jacobian changes (dJ/dt q') and lets the
material slip at that rate over b_f: 0.3 mm/s with 12 mm, whoever controls."""


@dataclass(frozen=True, slots=True)
class Rolled:
    """What came of a roll.

    Attributes:
        done: Whether it came to its end.
        way: Of the tip's middle [m].
        slip: Largest [m].
        told: What the controller made of it by arm and touch, at the end [m].
        sideways: Largest tangential force over normal force.
    """

    done: bool
    way: float
    slip: float
    told: float
    sideways: float


def roll(
    seed: int,
    way: float = 0.01,
    radius: float = 0.008,
    heading: float = 0.0,
    bristles: bool = False,
    tangential_gain: float = 1e-3,
    friction: float = 0.5,
) -> Rolled:
    """Land and roll.

    Args:
        seed: Of the sensor.
        way: Of the contact [m].
        radius: Of the tip [m].
        heading: Of the way over the plate [rad].
        bristles: Whether friction is the friction plant's; MuJoCo's if not.
        tangential_gain: See `RollParameters`.
        friction: mu.
    """
    before = BEFORE_SENSOR if bristles else 0.0
    tip = Tip(Sphere(radius, center=np.array([0.0, 0.0, -before])), mass=0.015)
    scene = build_scene(
        tip,
        PLATE,
        ContactLaw(friction=friction),
        (0.0, 0.0, PLATE.top + radius + before + 5e-4),
        TurningStage(),
        friction=FrictionLaw(friction, friction) if bristles else None,
    )
    backend = MujocoBackend(scene, PERIOD, sensor_of(seed))
    touch = Touch(Finger(tip.surface, Payload(tip.mass, tip.center_of_mass)))
    direction: Vector = (math.cos(heading), math.sin(heading), 0.0)
    parameters = RollParameters(way, direction, radius, tangential_gain=tangential_gain)
    controller = RollController(PERIOD, parameters)
    now = touch.sense(backend.start())
    controller.start(now)
    over, slip, sideways, begun = ZERO, 0.0, 0.0, ZERO
    while now.time < LONGEST and not controller.phase.is_final:
        now = touch.sense(backend.step(controller.step(now)))
        arm, truth = now.arm, backend.truth()
        middle = add_scaled(arm.position_base_tip, -before, tuple(row[2] for row in arm.rotation_base_tip))
        if controller.phase in (Phase.APPROACH, Phase.SETTLE):
            begun = middle
            continue
        lever = subtract(truth.position, arm.position_base_tip)
        x, y, _ = add(arm.velocity_base_tip, cross(arm.angular_velocity_base_tip, lever))
        over = add_scaled(over, PERIOD, (x, y, 0.0))
        slip = max(slip, norm(over))
        sideways = max(sideways, math.hypot(*truth.force[:2]) / max(truth.force[2], 1e-9))
    gone = norm(subtract(middle, begun))
    return Rolled(controller.phase is Phase.DONE, gone, slip, norm(controller.slip), sideways)
