"""The hand that a grasp is done with, as far as planning must know it: simulated, emulated, or of a rig."""

from dataclasses import dataclass, replace

import numpy as np

from palpate.errors import InvalidValueError
from palpate.experiments.grasp.belief import tip_radius
from palpate.experiments.grasp.config import GraspConfig
from palpate.experiments.grasp.scene import hand_of
from palpate.experiments.grasp.strength import LARGEST_GRIP
from palpate.robots.rig_built import described_finger
from palpate.robots.rig_settings import hand_geometry, noise_of_finger
from palpate.robots.with_hand import robots_with_hand
from palpate.runtime import FingerDescription, Limits
from palpate.runtime.robot import Robot
from palpate.runtime.robot_backend import EmulatedHandEntry
from palpate.runtime.robot_rig import RigEntry
from palpate.runtime.robot_surface import SphereEntry
from palpate.runtime.touch import Finger
from palpate.sensing.compensation import Payload
from palpate.sim.hand.hand import Hand

PERIOD = 1e-3
"""[s]: what the simulated hand's bus and the detectors of slip are made for."""

LONGEST_PERIOD = 4e-3
"""[s] On a robot: a contact that slips is to be answered within some ten periods, 40 ms."""

LIMITS = Limits(force=24.0, grip_force=24.0, moment=0.25)
"""As the simulated sensors', and above the largest grip that is commanded."""

LEAST_TOUCH, SIGMAS = 0.2, 5.0
"""[N], and standard deviations of a reading: above both it is a touch."""

ALIKE = 1e-6
"""[m, kg] between what a file says of an emulated fingertip and what is simulated."""


@dataclass(frozen=True, slots=True, eq=False)
class GraspHand:
    """A hand, before anything moves.

    Attributes:
        hand: Where fingers and sensors are.
        fingers: For touch, one per finger.
        period: Of control [s].
        limits: For the supervisor.
        robot: That has it; None: it is simulated, and nothing else.
    """

    hand: Hand
    fingers: tuple[FingerDescription, ...]
    period: float = PERIOD
    limits: Limits = LIMITS
    robot: Robot | None = None

    @property
    def real(self) -> bool:
        """Whether nobody knows what really happens: it is a rig's."""
        return self.robot is not None and isinstance(self.robot.file.backend, RigEntry)


def grasp_hand(config: GraspConfig, robot: Robot | None) -> GraspHand:
    """Return the hand that a grasp is done with.

    Args:
        config: What was asked for.
        robot: That `config.robot` names; None: the simulated hand.

    Raises:
        InvalidValueError: The robot has no hand, another one than was asked for, or cannot do it.
    """
    if robot is None:
        return _simulated(config)
    backend = robot.file.backend
    if not isinstance(backend, EmulatedHandEntry | RigEntry) or (
        isinstance(backend, RigEntry) and (backend.hand is None or len(robot.file.fingers) < 2)
    ):
        raise InvalidValueError(
            f"robot = {config.robot}: it has no hand of two or three fingers; leave --robot out for the simulated "
            f"hand, or take {robots_with_hand()}, or a robot file of kind rig with backend.hand"
        )
    count = len(robot.file.fingers)
    if config.fingers != count:
        raise InvalidValueError(f"fingers = {config.fingers}: {config.robot} has {count}; give --fingers {count}")
    if robot.file.limits.grip_force < LARGEST_GRIP:
        raise InvalidValueError(
            f"limits.grip_force_N = {robot.file.limits.grip_force:g} of {config.robot}: must be at least "
            f"{LARGEST_GRIP:g} N, which a grasp may ask of a finger"
        )
    return _emulated(config, robot) if isinstance(backend, EmulatedHandEntry) else _of_rig(config, robot)


def config_on(config: GraspConfig, hand: GraspHand) -> GraspConfig:
    """Return what a grasp is to be like on a hand: what was typed, but for what nobody can ask of a real one.

    Raises:
        InvalidValueError: Something was typed that no real hand can be asked for.
    """
    if not hand.real:
        return config
    told = {
        "friction": config.friction,
        "spin_length": config.spin_length,
        "norm_exponent": config.norm_exponent,
        "load_exponent": config.load_exponent,
    }
    for name, value in told.items():
        if value is not None:
            raise InvalidValueError(
                f"{name} = {value:g}: is the truth of a simulated object, and {config.robot} is a robot; give "
                "what is believed (--friction-file, or --believed-friction and --believed-spin-length)"
            )
    if config.friction_file is None and not (config.believed_friction and config.believed_spin_length):
        raise InvalidValueError(
            f"robot = {config.robot}: nobody knows how a real object rubs; give --friction-file (palpate friction "
            "writes it), or --believed-friction and --believed-spin-length"
        )
    if config.load not in ("ramp", "none"):
        raise InvalidValueError(
            f"load = {config.load}: nothing pulls at a real object but who stands there; leave --load out, and "
            "give --rise for how long it is held"
        )
    if config.plant or config.against_ignoring_spin or config.ignore_spin:
        raise InvalidValueError(
            "plant, ignore_spin, against_ignoring_spin: are for simulation; leave them out on a robot"
        )
    assert hand.robot is not None  # it is real
    noises = [noise_of_finger(hand.robot, i) for i in range(config.fingers)]
    return replace(
        config,
        load="none",
        pull=None,
        pull_before=0.0,
        # by what is believed it is planned; what is true nobody knows
        friction=config.believed_friction,
        spin_length=config.believed_spin_length,
        force_noise=max(max(noise[:3]) for noise in noises),
        moment_noise=max(max(noise[3:]) for noise in noises),
        drift=0.0,
    )


def _simulated(config: GraspConfig) -> GraspHand:
    hand = hand_of(config)
    return GraspHand(hand, _alike_fingers(hand, config.fingers))


def _alike_fingers(hand: Hand, count: int) -> tuple[Finger, ...]:
    return (Finger(hand.tip.surface, Payload(hand.tip.mass, hand.tip.center_of_mass)),) * count


def _emulated(config: GraspConfig, robot: Robot) -> GraspHand:
    hand = hand_of(config)
    if robot.file.period != PERIOD:
        raise InvalidValueError(f"period_s = {robot.file.period:g}: must be {PERIOD:g} for an emulated hand")
    radius, mass, center = tip_radius(hand.tip), hand.tip.mass, hand.tip.center_of_mass
    for i, finger in enumerate(robot.file.fingers):
        surface, payload = finger.surface, finger.payload
        alike = (
            isinstance(surface, SphereEntry)
            and payload is not None
            and np.allclose(surface.center, center, atol=ALIKE)
            and abs(surface.radius - radius) < ALIKE
            and abs(payload.mass - mass) < ALIKE
            and np.allclose(payload.center_of_mass, center, atol=ALIKE)
        )
        if not alike:
            raise InvalidValueError(
                f"fingers[{i}]: an emulated hand has spheres of {radius:g} m around {list(center)} m, of {mass:g} "
                "kg with their centre of mass there, and no sensor file; write surface and payload so"
            )
    limits = robot.file.limits.limits()
    return GraspHand(hand, _alike_fingers(hand, config.fingers), PERIOD, limits, robot)


def _of_rig(config: GraspConfig, robot: Robot) -> GraspHand:
    entry = robot.file.backend
    assert isinstance(entry, RigEntry)  # it was chosen for that
    assert entry.hand is not None
    if entry.arm is None:
        raise InvalidValueError("backend.arm: there is none, and a grasp lifts; give it")
    if robot.file.period > LONGEST_PERIOD:
        raise InvalidValueError(
            f"period_s = {robot.file.period:g}: must be at most {LONGEST_PERIOD:g} for a grasp"
        )
    surfaces = [finger.surface for finger in robot.file.fingers]
    if not all(isinstance(each, SphereEntry) and not any(each.center[:2]) for each in surfaces):
        raise InvalidValueError("fingers: a grasp is planned for spheres on the sensors' z axis; see surface")
    fingers = tuple(
        described_finger(
            robot, i, surface.surface(), max(LEAST_TOUCH, SIGMAS * max(noise_of_finger(robot, i)[:3]))
        )
        for i, surface in enumerate(surfaces)
    )
    return GraspHand(
        hand_geometry(robot, entry.hand), fingers, robot.file.period, robot.file.limits.limits(), robot
    )
