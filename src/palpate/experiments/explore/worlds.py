"""Worlds for learning, described as explorations are: objects, robots and robot files by name."""

from dataclasses import dataclass, field, replace

import numpy as np

from palpate.errors import not_negative
from palpate.experiments.explore.config import ExploreConfig
from palpate.experiments.explore.plan import plan
from palpate.experiments.kit.world import World
from palpate.robots.values import load_named_robot
from palpate.spatial import scale

DISC = 0.02
"""[m] Within which the tip may go by default; the supervisor's workspace ends 20 mm beyond."""

SEEDS = 2**31
"""From which the sensor's are drawn."""


def sphere_under_nano17() -> ExploreConfig:
    """Return what is explored by default: a sphere of 40 mm radius, by a stage with a fingertip on a Nano17."""
    return ExploreConfig(robot="stage-nano17", object="sphere", strategy="spiral", radius=DISC)


@dataclass(frozen=True, slots=True, eq=False)
class ExploredWorlds:
    """A `WorldMaker`: what an exploration would be planned with, begun each time elsewhere and with other noise.

    Robot, object, fingertip, friction, stiffness and noise are those of the configuration; so is the workspace,
    as far as the path would go and a bit beyond. Where it goes, how fast and with which force is the agent's.

    Attributes:
        config: Of any robot; a spiral begins in the middle.
        spread: How far from its middle an episode begins, at most, along x and y [m].
    """

    config: ExploreConfig = field(default_factory=sphere_under_nano17)
    spread: float = 0.005

    def __post_init__(self) -> None:
        not_negative("spread", self.spread, "m")

    def __call__(self, rng: np.random.Generator) -> World:
        """See `WorldMaker`.

        Raises:
            InvalidValueError: The configuration cannot be realised there.
        """
        config, (x, y) = self.config, self.config.middle
        dx, dy = rng.uniform(-self.spread, self.spread, 2).tolist()
        begun = replace(config, seed=int(rng.integers(SEEDS)), center=(x + dx, y + dy))
        planned = plan(begun, load_named_robot(config.robot), {})
        parameters = planned.parameters
        return World(
            planned.backend(),
            planned.fingers[0],
            planned.limits,
            approach=scale(-parameters.landing_speed, planned.plane.axis),
            farthest=parameters.approach_distance,
        )
