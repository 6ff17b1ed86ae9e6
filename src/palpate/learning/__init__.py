"""Touch as an environment for reinforcement learning: `gymnasium.make("palpate.learning:palpate/Touch-v0")`."""

from palpate.extras import require

try:
    import gymnasium
except ImportError:
    require("gymnasium", "learn", "palpate.learning")
    raise

from palpate.experiments.kit.world import World, WorldMaker
from palpate.learning.guarded_robot import GuardedRobot
from palpate.learning.reward import HoldWhileSliding, Reward
from palpate.learning.touch_env import TouchEnv

__all__ = ["GuardedRobot", "HoldWhileSliding", "Reward", "TouchEnv", "World", "WorldMaker"]

gymnasium.register(id="palpate/Touch-v0", entry_point="palpate.learning.touch_env:TouchEnv")
