"""Worlds for learning from the configuration of an exploration."""

from dataclasses import dataclass, field, replace

import numpy as np

from palpate.errors import not_negative
from palpate.experiments.explore.config import ExploreConfig
from palpate.experiments.explore.plan import plan
from palpate.experiments.kit.world import World
from palpate.robots.values import load_named_robot
from palpate.spatial import scale

_DEFAULT_RADIUS = 0.02
"""Radius of the tip's area by default [m]; the supervisor's workspace ends 20 mm beyond."""

_MAX_DRAWN_SEED = 2**31
"""Bound on the drawn seeds of the sensor."""


def _sphere_under_nano17() -> ExploreConfig:
    """Return the default exploration: a sphere of 40 mm radius, a stage, and a fingertip on a Nano17."""
    return ExploreConfig(robot="stage-nano17", object="sphere", strategy="spiral", radius=_DEFAULT_RADIUS)


@dataclass(frozen=True, slots=True, eq=False)
class ExploredWorlds:
    """Worlds of planned explorations that begin at drawn places with drawn noise. A `WorldMaker`.

    Robot, object, fingertip, friction, stiffness and noise are those of the configuration; so is the workspace,
    as far as the path would go and a bit beyond. Where it goes, how fast and with which force is the agent's.

    Attributes:
        config: Configuration of an exploration; a spiral begins in the middle.
        spread: Largest distance of the begin of an episode from the middle, along x and y [m].
    """

    config: ExploreConfig = field(default_factory=_sphere_under_nano17)
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
        begun = replace(config, seed=int(rng.integers(_MAX_DRAWN_SEED)), center=(x + dx, y + dy))
        planned = plan(begun, load_named_robot(config.robot), {})
        parameters = planned.parameters
        return World(
            planned.backend(),
            planned.fingers[0],
            planned.limits,
            approach=scale(-parameters.landing_speed, planned.plane.axis),
            farthest=parameters.approach_distance,
        )
