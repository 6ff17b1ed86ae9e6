"""The hand that a grasp is done with: whether it can, and what can be asked of it."""

from dataclasses import replace

from palpate.errors import InvalidValueError
from palpate.experiments.grasp.config import GraspConfig
from palpate.experiments.grasp.strength import LARGEST_GRIP
from palpate.robots.finger_load import noise_of_finger
from palpate.robots.hand_description import (
    HandDescription,
    robots_with_hand,
    simulated_hand,
)
from palpate.robots.robot import Robot


def grasp_hand(config: GraspConfig, robot: Robot | None) -> HandDescription:
    """Return the hand that a grasp is done with.

    Args:
        config: What was asked for.
        robot: That `config.robot` names; None: the simulated hand.

    Raises:
        InvalidValueError: The robot has no hand, another one than was asked for, or cannot do it.
    """
    if robot is None:
        return simulated_hand(config.fingers)
    if not robot.file.backend.has_hand(robot):
        raise InvalidValueError(
            f"robot = {config.robot}: it has no hand of two or three fingers; leave --robot out for the simulated "
            f"hand, or take {robots_with_hand()}, or a robot file with backend.hand"
        )
    count = len(robot.file.fingers)
    if config.fingers != count:
        raise InvalidValueError(f"fingers = {config.fingers}: {config.robot} has {count}; give --fingers {count}")
    if robot.file.limits.grip_force < LARGEST_GRIP:
        raise InvalidValueError(
            f"limits.grip_force_N = {robot.file.limits.grip_force:g} of {config.robot}: must be at least "
            f"{LARGEST_GRIP:g} N, which a grasp may ask of a finger"
        )
    return robot.file.backend.described_hand(robot)


def config_on(config: GraspConfig, hand: HandDescription) -> GraspConfig:
    """Return what a grasp is to be like on a hand: without what only a simulated hand can do.

    Raises:
        InvalidValueError: An option was given that only a simulated hand takes.
    """
    if not hand.real:
        return config
    simulated = {
        "friction": config.friction,
        "spin_length": config.spin_length,
        "norm_exponent": config.norm_exponent,
        "load_exponent": config.load_exponent,
    }
    for name, value in simulated.items():
        if value is not None:
            raise InvalidValueError(
                f"{name} = {value:g}: is the truth of a simulated object, and {config.robot} is a robot; give "
                "what is believed (--friction-file, or --believed-friction and --believed-spin-length)"
            )
    if config.friction_file is None and not (config.believed_friction and config.believed_spin_length):
        raise InvalidValueError(
            f"robot = {config.robot}: the friction of a real object is unknown; give --friction-file (palpate "
            "friction writes it), or --believed-friction and --believed-spin-length"
        )
    if config.load not in ("ramp", "none"):
        raise InvalidValueError(
            f"load = {config.load}: nothing is simulated that pulls at a real object; leave --load out, and "
            "give --rise for how long it is held"
        )
    if config.plant or config.against_ignoring_spin or config.ignores_spin:
        raise InvalidValueError(
            "plant, controller = coulomb, against_ignoring_spin: are for simulation; leave them out on a robot"
        )
    assert hand.robot is not None  # it is real
    noises = [noise_of_finger(hand.robot, i) for i in range(config.fingers)]
    return replace(
        config,
        load="none",
        pull=None,
        pull_before=0.0,
        force_noise=max(max(noise[:3]) for noise in noises),
        moment_noise=max(max(noise[3:]) for noise in noises),
        drift=0.0,
    )
