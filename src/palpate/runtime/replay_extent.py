"""How much of a run a replay can give again: until supervisor or loop brought the robot to rest."""

from dataclasses import dataclass

import numpy as np

from palpate.errors import FloatArray, InvalidValueError
from palpate.runtime.data import Phase
from palpate.runtime.log import Log
from palpate.runtime.log.period_codec import PeriodCodec
from palpate.runtime.replay import Replay

FROM_OUTSIDE = ("back end", "observer", "live parameters", "touch")
"""Measures of trips that do not follow from the recorded samples. (When touch raises, there is no row: the sample
that it could not read is not in the log.)"""


@dataclass(frozen=True, slots=True)
class Extent:
    """Which rows of a log are replayed.

    Attributes:
        count: The first so many.
        missing: Why not all until the robot was brought to rest; empty if they all are.
    """

    count: int
    missing: str


def extent_of(log: Log) -> Extent:
    """Return which rows of a log can be replayed.

    Rows after a gap cannot: what sensing and controller remember from earlier ones is not known. Neither can those
    in which the robot was brought to rest, since they depend on when, and this on more than the samples: but for
    the first one, if a limit was broken or the controller raised.

    Raises:
        InvalidValueError: None can.
    """
    gaps = log.gaps
    whole = gaps[0].after + 1 if gaps else len(log)
    damage = f" ({log.damage})" if log.damage else ""
    missing = ""
    if gaps:
        first, last = gaps[0].after + 1, gaps[0].after + gaps[0].count
        missing = f"periods {first} to {last} are missing in the log{damage}: replayed up to there"
    elif log.damage:
        missing = f"the log is damaged{damage}: what was read of it is replayed"
    if whole == 0:
        reason = f"its beginning is missing{damage}" if gaps else f"it has no periods{damage}"
        raise InvalidValueError(f"{log.path}: {reason}, so there is nothing to replay")
    return Extent(_rows_until_rest(log.codec, log.rows[:whole], _caused_inside(log)), missing)


def rows_of_replay(replay: Replay) -> int:
    """Return how many rows of a replay there are, likewise."""
    trip = replay.trip
    return _rows_until_rest(replay.codec, replay.rows, trip is not None and trip.measure not in FROM_OUTSIDE)


def _rows_until_rest(codec: PeriodCodec, rows: FloatArray, caused_inside: bool) -> int:
    """Rows without those at the end in which the robot stood still; with the first of these, if it is caused."""
    stop = codec.heading.codes.phases.index(Phase.STOP.name)
    others = np.flatnonzero(rows[:, codec.columns["command.phase"].start] != stop)
    moving = int(others[-1]) + 1 if len(others) else 0
    return min(moving + 1, len(rows)) if caused_inside else moving


def _caused_inside(log: Log) -> bool:
    """Whether sensing, control or supervision ended the run, and no device was lost on top of it."""
    trips = [event for event in log.events if event.source == "supervisor"]
    if not trips or any(event.source == "back end" for event in log.events):
        return False
    return not trips[0].text.startswith(tuple(f"{measure} was " for measure in FROM_OUTSIDE))
