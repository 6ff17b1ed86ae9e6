"""The world of an episode: a robot with a fingertip, and its limits."""

from dataclasses import dataclass
from importlib.metadata import entry_points
from typing import Protocol, cast

import numpy as np

from palpate.errors import not_negative, vector
from palpate.runtime import Backend, FingerDescription, Limits
from palpate.spatial import ZERO, Vector

_WORLD_GROUP = "palpate.worlds"
"""Group of entry points that name a `WorldMaker`."""


@dataclass(frozen=True, slots=True, eq=False)
class World:
    """A robot that stands ready.

    Attributes:
        backend: Back end of the robot.
        finger: Finger for touch.
        limits: Limits for the supervisor, which is always on.
        approach: Velocity with which a reset brings the tip to the surface, base frame [m/s]; zero for none.
        farthest: Longest approach [m]; without contact, the episode begins at its end.
    """

    backend: Backend
    finger: FingerDescription
    limits: Limits
    approach: Vector = ZERO
    farthest: float = 0.0

    def __post_init__(self) -> None:
        vector("approach", self.approach, 3, "m/s")
        not_negative("farthest", self.farthest, "m")


class WorldMaker(Protocol):
    """Makes the world of an episode."""

    def __call__(self, rng: np.random.Generator) -> World:
        """Return a world.

        The back end may be that of the previous episode, which is then started again; another one is closed first.

        Args:
            rng: Source of all random numbers, so that a seed repeats the episodes.
        """
        ...


def usual_worlds() -> WorldMaker:
    """Return the default worlds of an environment: the first that packages declare.

    Entry points of the group `palpate.worlds` name what makes a `WorldMaker`.
    """
    return cast("WorldMaker", next(iter(entry_points(group=_WORLD_GROUP))).load()())
