"""How an experiment presses first, to find stiffness and delay, about the force that it is to hold; its text."""

from collections.abc import Callable, Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, TypeVar

from palpate.controllers import Identification, IdentifyController, IdentifyParameters
from palpate.errors import InvalidValueError
from palpate.runtime import Backend, FingerDescription, Limits, Supervisor, Touch, run
from palpate.strict_decode import decode, read_mapping
from palpate.yaml_text import yaml_text

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

Found = TypeVar("Found")

IDENTIFIED_TEXT = "identified.yaml"
"""Name of the identification in a log."""

PRESSED_SHARE = 0.5
"""It presses between (1 - this) and (1 + this) of the set force, if the robot's limit has room for that."""

ROOM_BELOW_LIMIT = 0.9
"""Of the force limit: ramps turn a few periods after they have passed their upper force."""

ABOVE_TOUCH = 1.1
"""The lower force is at least so many times what counts as a touch: a tip that lifts off measures nothing."""

LIFT_SPEED = 0.02
"""At most [m/s]."""

SWING_SHARE = 0.2
"""Amplitude of the sines, of what lies between the lower and the upper force."""


def pressing(
    force: float, *, limits: Limits, touch_force: float, sensing_delay: float, approach_distance: float
) -> IdentifyParameters:
    """Return how it is pressed.

    Args:
        force: To be held later [N].
        limits: Of the robot.
        touch_force: What counts as a touch [N].
        sensing_delay: From a load to the observation that shows it [s].
        approach_distance: How far down the surface is looked for [m].
    """
    high = min((1.0 + PRESSED_SHARE) * force, ROOM_BELOW_LIMIT * limits.force)
    low = max((1.0 - PRESSED_SHARE) * force, ABOVE_TOUCH * touch_force)
    return IdentifyParameters(
        low=low,
        high=high,
        swing=SWING_SHARE * (high - low),
        sensing_delay=sensing_delay,
        approach_distance=approach_distance,
        lift_speed=min(LIFT_SPEED, limits.commanded_speed),
    )


def pressed(
    backend: Backend,
    fingers: Sequence[FingerDescription],
    limits: Limits,
    controller: IdentifyController,
    of: Callable[[Identification], Found],
    *,
    longest: float,
) -> Found:
    """Press with a robot and scene of its own, and return what was identified.

    Args:
        backend: The robot, not yet started.
        fingers: For touch; the first one presses.
        limits: For the supervisor.
        controller: That presses, a fresh one.
        of: From an identification to the parameters of force control.
        longest: After which it is stopped [s].

    Raises:
        InvalidValueError: The identification did not finish, or is not to be used.
    """
    result = run(backend, Touch(*fingers), controller, Supervisor(limits), duration=longest)
    try:
        found = controller.result()
        if not found.verdict.ok:
            raise InvalidValueError(f"not to be used: {found.verdict}")
        return of(found)
    except InvalidValueError as error:
        raise InvalidValueError(f"identify: {error} (the run: {result})") from None


def identified_text(found: "DataclassInstance") -> str:
    """Return what pressing has found as YAML; `read_identified` gives back the very same."""
    return yaml_text(asdict(found))


def read_identified(text: str, kind: type[Found]) -> Found:
    """Return what `identified_text` wrote of a `kind`.

    Raises:
        InvalidValueError: A key is misspelt, or a value of the wrong type or impossible.
    """
    try:
        return decode(read_mapping(text, "what was identified"), kind, text)
    except InvalidValueError as error:
        raise InvalidValueError(f"{IDENTIFIED_TEXT}: {error}") from None
