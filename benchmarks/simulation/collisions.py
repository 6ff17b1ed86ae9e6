"""A scene in which every shape may hit every other, against the preset: is it ever faster, or more accurate?"""

import time
from collections.abc import Callable
from dataclasses import dataclass, replace

import mujoco

from simulation.choices import ARM_BASE, GRASP_BASE, STAGE_BASE
from simulation.exploring import SPHERE, Exploration, Touching, explore
from simulation.grasping import Hold, Holding, hold
from simulation.timing import Ratio, ratio

SAME = 1e-9
"""Relative: errors nearer than this are those of the same path."""

STEPS = 300  # in each measurement: about a millisecond
SCAN = 800  # periods after which an exploration scans


@dataclass(frozen=True, slots=True)
class Comparison:
    """Every collision on, against the preset.

    Attributes:
        kind: Of scene.
        time: Of MuJoCo's time step, paired.
        preset: Its errors.
        everything: Those with every collision on.
        names: Of the errors.
    """

    kind: str
    time: Ratio
    preset: tuple[float, ...]
    everything: tuple[float, ...]
    names: tuple[str, ...]

    @property
    def faster(self) -> bool:
        """Whether it is, with 95 % confidence."""
        return self.time.high < 1.0

    @property
    def slower(self) -> bool:
        """Likewise."""
        return self.time.low > 1.0

    @property
    def more_accurate(self) -> bool:
        """Whether any of its errors is smaller."""
        pairs = zip(self.everything, self.preset, strict=True)
        return any(a < b * (1.0 - SAME) for a, b in pairs)

    @property
    def kept(self) -> bool:
        """Neither faster nor more accurate."""
        return not (self.faster or self.more_accurate)


def compare_collisions(rounds: int, done: Callable[[], None] = lambda: None) -> list[Comparison]:
    """Measure stage, arm and hand."""
    found = []
    for kind, base in (("stage", STAGE_BASE), ("arm", ARM_BASE)):
        both = (base, replace(base, every_collision=True))
        errors = [_touching_errors(each) for each in both]
        paired = _paired((_scanning(both[0]), _scanning(both[1])), rounds)
        found.append(Comparison(kind, paired, errors[0], errors[1], ("force RMS N", "points RMS m")))
        done()
    hands = (GRASP_BASE, replace(GRASP_BASE, every_collision=True))
    held = [_holding_errors(each) for each in hands]
    paired = _paired((Hold(hands[0]), Hold(hands[1])), rounds)
    found.append(Comparison("hand", paired, held[0], held[1], ("creep m/s", "pressed by slip")))
    done()
    return found


def _touching_errors(choice: Touching) -> tuple[float, float]:
    run = explore(choice, SPHERE, 2.0, 0.02)
    if not run.done:
        return float("inf"), float("inf")
    return run.force_rms, run.point_rms


def _holding_errors(choice: Holding) -> tuple[float, float]:
    found = hold(choice)
    return found.creep, found.pressed


def _scanning(choice: Touching) -> Exploration:
    run = Exploration(choice, SPHERE, 2.0, 0.02)
    for _ in range(SCAN):
        run.step()
    return run


def _paired(both: tuple[Exploration, Exploration] | tuple[Hold, Hold], rounds: int) -> Ratio:
    """Time MuJoCo alone, in turns, from the same state: what is the same in both would hide the difference."""
    taken: tuple[list[float], list[float]] = ([], [])
    for i in range(rounds):
        for which in (0, 1) if i % 2 else (1, 0):
            backend = both[which].backend
            model, data = backend.scene.model, backend._data
            began = time.thread_time()
            for _ in range(STEPS):
                mujoco.mj_step(model, data)
            taken[which].append(time.thread_time() - began)
    return ratio(tuple(taken[1]), tuple(taken[0]))
