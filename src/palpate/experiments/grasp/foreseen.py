"""What a grasp is told of loads before they act, and the grip that it keeps for those that nobody tells of."""

from palpate.controllers.grip.announced_loads import Announcer, LoadAnnouncedBefore, NothingAnnounced
from palpate.controllers.grip.expected_load import ExpectedLoad
from palpate.controllers.grip.preload import Preload
from palpate.experiments.grasp.config import GraspConfig
from palpate.experiments.grasp.scene import PullTimes

FELT_AFTER = 0.05
"""[s] After all of it acts: bus, smoothing, and the swing of the rotors on the contacts."""


def announcer_of(config: GraspConfig, times: PullTimes) -> Announcer:
    """Return who tells the grip of the pull before it grows.

    Args:
        config: What was asked for.
        times: When it is pulled.
    """
    if config.announced is None:
        return NothingAnnounced()
    more = config.largest_pull if config.load == "shake" else max(config.largest_pull - config.pull_before, 0.0)
    if config.load == "shake":
        more *= 2.0**0.5  # up and down and sideways at once
    end = times.grows + config.rising + FELT_AFTER
    load = ExpectedLoad(times.grows, end, more, config.offset * more)
    return LoadAnnouncedBefore(load, config.announced)


def preload_of(config: GraspConfig) -> Preload:
    """Return the steps that are to be borne unannounced."""
    return Preload(config.preload, config.offset * config.preload)
