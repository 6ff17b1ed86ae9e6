"""Touch as an environment for those who learn: `gymnasium.make("palpate.learning:palpate/Touch-v0")`."""

try:
    import gymnasium
except ImportError as missing:
    raise ImportError(
        'palpate.learning needs gymnasium, which is not installed: pip install "palpate[learn]"'
    ) from missing

from palpate.learning.explored_worlds import ExploredWorlds
from palpate.learning.guarded_robot import GuardedRobot
from palpate.learning.reward import HoldWhileSliding, Reward
from palpate.learning.touch_env import TouchEnv
from palpate.learning.world import World, WorldMaker

__all__ = [
    "ExploredWorlds",
    "GuardedRobot",
    "HoldWhileSliding",
    "Reward",
    "TouchEnv",
    "World",
    "WorldMaker",
]

gymnasium.register(id="palpate/Touch-v0", entry_point="palpate.learning.touch_env:TouchEnv")
