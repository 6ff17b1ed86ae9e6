"""Everything that is measured of the choices: errors of each, and costs of all in turns."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from palpate.errors import InvalidValueError
from simulation.choices import (
    ARM_BASE,
    STAGE_BASE,
    Group,
    HoldChoice,
    TouchChoice,
    hold_choices,
    reaches,
    sensor_choices,
    touch_choices,
)
from simulation.exploring import ELLIPSOID, SPHERE, Exploration, Explored, explore, together
from simulation.front import Rival, beaten_by
from simulation.grasping import Held, Hold, has_room, hold
from simulation.timing import Cost, Timed, measure, ratio

FORCE = 2.0  # [N]
SCAN = 800  # periods after which an exploration scans
CREEP_FLOOR = 1e-7
"""[m/s]: a tenth of the creep that is asked for; less counts as none."""

FORCE_FLOOR, POINT_FLOOR, PRESSED_FLOOR = 1e-3, 1e-7, 1e-3
"""[N, m, -]: nobody sees less."""


@dataclass(frozen=True, slots=True)
class Effort:
    """How much is measured.

    Attributes:
        speeds: Of explorations [m/s].
        objects: How many of sphere and ellipsoid.
        rounds: Of timing.
        pairs: Rounds of timing where two scenes are compared.
    """

    speeds: tuple[float, ...]
    objects: int
    rounds: int
    pairs: int


QUICK = Effort(speeds=(0.05,), objects=1, rounds=7, pairs=21)
FULL = Effort(speeds=(0.02, 0.05, 0.1), objects=2, rounds=15, pairs=60)


@dataclass(frozen=True, slots=True)
class TouchFinding:
    """A choice for a tip on an object, and what came of it; `short` says what it does not reach."""

    choice: TouchChoice
    explored: Explored
    cost: Cost | None
    short: str


@dataclass(frozen=True, slots=True)
class HoldFinding:
    """A choice for a grasp, and what came of it; `short` likewise."""

    choice: HoldChoice
    held: Held
    cost: Cost | None
    short: str


@dataclass(frozen=True, slots=True)
class Findings:
    """All of it, by kind of scene; the preset is each kind's first."""

    stage: list[TouchFinding]
    arm: list[TouchFinding]
    grasp: list[HoldFinding]
    sensors: list[TouchFinding]


def measure_all(effort: Effort, expect: Callable[[int], None], done: Callable[[], None]) -> Findings:
    """Measure everything.

    Args:
        effort: How much.
        expect: Is told how many times `done` will be called.
        done: Called after each part.
    """
    stage, arm = touch_choices(STAGE_BASE), touch_choices(ARM_BASE)
    sensors, hands = sensor_choices(), hold_choices()
    expect(len(stage) + len(arm) + len(sensors) + len(hands) + effort.rounds)
    explored = {}
    for kind, choices in (("stage", stage), ("arm", arm), ("sensor", sensors)):
        for choice in choices:
            explored[kind, choice.name] = explore_all(choice, effort)
            done()
    held = {}
    for each in hands:
        held[each.name] = hold(each.holding)
        done()
    runs: dict[tuple[str, str], Timed] = {}
    for kind, choices in (("stage", stage), ("arm", arm), ("sensor", sensors)):
        for choice in choices:
            timed = _timed_touch(choice)
            if timed is not None:
                runs[kind, choice.name] = timed
    for each in hands:
        timed = _timed_hold(each)
        if timed is not None:
            runs["grasp", each.name] = timed
    costs = measure(runs, effort.rounds, done)

    def touching(kind: str, choices: tuple[TouchChoice, ...]) -> list[TouchFinding]:
        return [
            TouchFinding(
                choice, explored[kind, choice.name], costs.get((kind, choice.name)), reaches(choice.touching)
            )
            for choice in choices
        ]

    grasp = [
        HoldFinding(
            each, held[each.name], costs.get(("grasp", each.name)), "" if has_room(each.holding) else "no room"
        )
        for each in hands
    ]
    return Findings(touching("stage", stage), touching("arm", arm), grasp, touching("sensor", sensors))


def explore_all(choice: TouchChoice, effort: Effort) -> Explored:
    """Explore all objects at all speeds."""
    runs = []
    for target in (SPHERE, ELLIPSOID)[: effort.objects]:
        for speed in effort.speeds:
            run = explore(choice.touching, target, FORCE, speed)
            if not run.done:  # nothing is learned from more of it
                return run
            runs.append(run)
    return together(runs)


def errors_of(found: TouchFinding | HoldFinding) -> tuple[float, float]:
    """Return the errors by which a choice is judged; NaN where it came to no end."""
    if isinstance(found, HoldFinding):
        return abs(found.held.creep), found.held.pressed
    if not found.explored.done:
        return float("nan"), float("nan")
    return found.explored.force_rms, found.explored.point_rms


def preset_beaten_by(found: Sequence[TouchFinding | HoldFinding]) -> list[str]:
    """Return whom the preset, the first one, is beaten by; nobody, if it lies on the front."""
    preset = found[0]
    assert preset.choice.group is Group.PRESET
    if preset.short or preset.cost is None:
        return [f"its own kind ({preset.short or 'it cannot be built'})"]
    rivals = [
        Rival(each.choice.name, ratio(each.cost.whole, preset.cost.whole), errors_of(each), not each.short)
        for each in found[1:]
        if each.choice.comparable and each.cost is not None and each.choice.group is not Group.COLLISIONS
    ]
    floors = (CREEP_FLOOR, PRESSED_FLOOR) if isinstance(preset, HoldFinding) else (FORCE_FLOOR, POINT_FLOOR)
    return beaten_by(errors_of(preset), rivals, floors)


def _timed_touch(choice: TouchChoice) -> Timed | None:
    try:
        run = Exploration(choice.touching, SPHERE, FORCE, 0.02)
        timed = Timed(run)
        timed.settle(SCAN)
    except (InvalidValueError, ArithmeticError):
        return None
    return timed


def _timed_hold(choice: HoldChoice) -> Timed | None:
    try:
        return Timed(Hold(choice.holding))
    except (InvalidValueError, ArithmeticError):
        return None
