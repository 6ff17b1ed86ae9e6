"""Replay a regulation of force from its log, and tell whether every command comes out as it was.

`palpate replay` is for explorations, and says so of any other log.
"""

import os
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

from palpate.errors import InvalidValueError
from palpate.experiments.regulate_plan import RegulationPlan, plan_from_texts
from palpate.runtime import Supervisor, Touch
from palpate.runtime.log import Log, log_in, read_log
from palpate.runtime.replay import Replay, replay
from palpate.runtime.replay_difference import Difference, difference_of_commands
from palpate.runtime.replay_extent import extent_of, rows_of_replay


@dataclass(frozen=True, slots=True, eq=False)
class ReplayedRegulation:
    """What a replay gave.

    Attributes:
        planned: The regulation as it was recorded.
        replay: What came out.
        commands: How its commands differ from those recorded.
    """

    planned: RegulationPlan
    replay: Replay
    commands: Difference

    @property
    def identical(self) -> bool:
        """Whether every command came out as recorded, bit for bit."""
        return self.commands.first is None


def replay_regulation(log: Log | str | os.PathLike[str]) -> ReplayedRegulation:
    """Replay the log of a regulation.

    Args:
        log: As read, or its file, or a folder with its latest.mcap.

    Raises:
        InvalidValueError: It is no log of a regulation, or nothing of it can be replayed.
        OSError: The log cannot be read.
    """
    if not isinstance(log, Log):
        log = read_log(log_in(Path(log)))
    try:
        planned = plan_from_texts(log.attachments)
    except InvalidValueError as error:
        raise InvalidValueError(f"{log.path} is no log of `palpate regulate`: {error}") from None
    extent = extent_of(log)
    samples = islice(log.samples(), extent.count)
    done = replay(
        samples,
        log.heading.period,
        Touch(planned.finger),
        planned.controller(),
        Supervisor(planned.limits),
        log.changes,
        (),
    )
    return ReplayedRegulation(planned, done, difference_of_commands(log, extent.count, done, rows_of_replay(done)))
