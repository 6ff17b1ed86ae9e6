"""Replay an experiment from its log, as it was or with something changed."""

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

from palpate.commands.replay.controller import ControllerMaker
from palpate.commands.replay.settings import changed_config
from palpate.errors import FloatArray, InvalidValueError
from palpate.experiments.kit.experiment import Plan
from palpate.experiments.kit.from_log import NOTHING_SET, LoggedRun
from palpate.runtime import Controller, Observer, Record, Supervisor, Touch
from palpate.runtime.live import Change, live_parameters_of
from palpate.runtime.log import Log, log_in, read_log
from palpate.runtime.log.record import record_of
from palpate.runtime.replay import Replay, replay
from palpate.runtime.replay_difference import Difference, difference_of_commands, difference_of_sensing
from palpate.runtime.replay_extent import Extent, extent_of, rows_of_replay


@dataclass(frozen=True, slots=True, eq=False)
class ReplayedLog:
    """What a replay of a log gave, beside what was recorded.

    Attributes:
        log: What was recorded.
        extent: How much of it was replayed.
        of: What it is of.
        planned: It, as it was replayed.
        settings: What was changed of it.
        other_controller: Whether another controller was in the place of the recorded one.
        left_out: Changes of live parameters that this other controller cannot take.
        replay: What came out.
        replayed: How many of its rows are commands of controller and supervisor.
        commands: How they differ from those recorded.
        sensing: How what was sensed differs, as far as the replay went.
    """

    log: Log
    extent: Extent
    of: LoggedRun
    planned: Plan
    settings: Mapping[str, object]
    other_controller: bool
    left_out: tuple[Change, ...]
    replay: Replay
    replayed: int
    commands: Difference
    sensing: Difference

    @property
    def should_be_identical(self) -> bool:
        """Whether nothing was changed."""
        return not self.settings and not self.other_controller

    @property
    def identical(self) -> bool:
        """Whether every command came out as recorded, bit for bit."""
        return self.commands.first is None

    @property
    def common(self) -> int:
        """Periods of which there is something to compare."""
        return min(self.extent.count, self.replayed)

    def records(self) -> tuple[Record, Record]:
        """Return those periods in base coordinates, as recorded and as replayed."""
        return (
            record_of(self.log.codec, self.log.rows[: self.common], 0),
            record_of(self.replay.codec, self.replay.rows[: self.common], 0),
        )

    @property
    def velocity_difference(self) -> FloatArray:
        """Replayed minus recorded commanded velocity, shape (n, 3) [m/s]."""
        recorded, replayed = self.records()
        return replayed.command - recorded.command


def replay_log(
    log: Log | str | os.PathLike[str],
    settings: Mapping[str, object] = NOTHING_SET,
    controller: ControllerMaker | None = None,
    observers: Sequence[Observer] = (),
) -> ReplayedLog:
    """Replay the log of an experiment.

    For example `replay_log(folder).identical`, or `replay_log(folder, {"force": 3.0}).velocity_difference`.

    Args:
        log: As read, or its file, or a folder with its latest.mcap.
        settings: Other values for options of the experiment: those that sensing, control and supervision go by.
        controller: What makes another controller; the recorded one, if not given.
        observers: Called every period, for example to show progress.

    Raises:
        InvalidValueError: It is a log of something else, nothing of it can be replayed, or what is changed
            cannot be.
        OSError: The log cannot be read.
    """
    if not isinstance(log, Log):
        log = read_log(log_in(Path(log)))
    logged = LoggedRun.of(log)
    planned = logged.plan(changed_config(logged.config, settings), settings) if settings else logged.plan()
    extent = extent_of(log)
    made = planned.controller() if controller is None else controller(planned)
    changes, left_out = (log.changes, ()) if controller is None else _parted(log.changes, made)
    done = _replayed(log, extent, planned, made, changes, observers, changed=bool(settings or controller))
    count = rows_of_replay(done)
    return ReplayedLog(
        log,
        extent,
        logged,
        planned,
        dict(settings),
        controller is not None,
        left_out,
        done,
        count,
        difference_of_commands(log, extent.count, done, count),
        difference_of_sensing(log, min(extent.count, count), done, count),
    )


def _parted(changes: Sequence[Change], controller: Controller) -> tuple[tuple[Change, ...], tuple[Change, ...]]:
    """Changes that a controller has the parameters for, and the others."""
    known = live_parameters_of(controller).parameters
    return (
        tuple(change for change in changes if change.name in known),
        tuple(change for change in changes if change.name not in known),
    )


def _replayed(
    log: Log,
    extent: Extent,
    planned: Plan,
    controller: Controller,
    changes: Sequence[Change],
    observers: Sequence[Observer],
    *,
    changed: bool,
) -> Replay:
    samples = islice(log.samples(), extent.count)
    touch, supervisor = Touch(*planned.fingers), Supervisor(planned.limits, planned.guards())
    try:
        return replay(samples, log.heading.period, touch, controller, supervisor, changes, observers, log.truth)
    except InvalidValueError:
        raise
    except Exception as error:
        if not changed:
            raise
        # the first sample already, and nothing moves: a sensor or controller that is not for this robot
        raise InvalidValueError(f"the replay cannot begin: {type(error).__name__}: {error}") from error
