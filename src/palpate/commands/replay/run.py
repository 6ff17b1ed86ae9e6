"""Replay the log of an experiment, as it was or with something changed."""

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from itertools import islice
from pathlib import Path
from typing import Any, cast

from palpate.errors import FloatArray, InvalidValueError, shown
from palpate.experiments.kit.experiment import Plan
from palpate.experiments.kit.from_log import NOTHING_SET, LoggedRun
from palpate.experiments.kit.options import foreign_options, specs_of
from palpate.named_object import named_object, raised
from palpate.nearest_name import nearest, without_unit
from palpate.runtime import Controller, Observer, Record, Supervisor, Touch
from palpate.runtime.live import Change, live_parameters_of
from palpate.runtime.log import Log, log_in, read_log
from palpate.runtime.log.record import record_of
from palpate.runtime.replay import Replay, replay
from palpate.runtime.replay_difference import Difference, difference_of_commands, difference_of_sensing
from palpate.runtime.replay_extent import Extent, extent_of, rows_of_replay
from palpate.strict_decode import decode_some


def changeable(kind: type) -> tuple[str, ...]:
    """Return the options of a `Config` that a replay can change."""
    return tuple(name for name, spec in specs_of(kind).items() if not spec.fixed)


def unchangeable(kind: type) -> dict[str, str]:
    """Return why a replay cannot change the others, by name."""
    return {
        name: f"a replay cannot change it: {spec.fixed}" for name, spec in specs_of(kind).items() if spec.fixed
    }


def changed_config(config: Any, settings: Mapping[str, object]) -> Any:
    """Return a configuration with other values for what a replay can change.

    What was given for a choice that is changed, as the time of steps for another profile, is left out.

    Raises:
        InvalidValueError: A name is not known or cannot be changed, or a value is impossible.
    """
    kind = type(config)
    specs, refused = specs_of(kind), unchangeable(kind)
    for name in settings:
        if name not in specs:
            near = nearest(name, tuple(specs)) or nearest(without_unit(name), tuple(specs))
            advice = f"did you mean {near}?" if near else f"a replay can change {', '.join(changeable(kind))}"
            raise InvalidValueError(f"{name}: there is no such option; {advice}")
        if name in refused:
            raise InvalidValueError(f"{name}: {refused[name]}")
    changed = decode_some(settings, kind)
    recorded = {each.name: getattr(config, each.name) for each in fields(kind)}
    foreign = foreign_options(kind, recorded | changed) - changed.keys()
    default = {each.name: each.default for each in fields(kind) if each.name in foreign}
    return replace(config, **default, **changed)


ControllerMaker = Callable[[Any], Controller]
"""From the plan of the recorded run, with what is set otherwise, to a fresh controller for it."""


def load_controller_maker(name: str) -> ControllerMaker:
    """Return the function that `module:function` names; the present folder is looked in first.

    What it returns when it is called is checked to be a controller.

    Raises:
        InvalidValueError: There is no such module or function, or the module cannot be imported.
    """
    function = named_object("controller", name, "mine:make for the function make in mine.py")
    wanted = name.rpartition(":")[2]
    if not callable(function):
        raise InvalidValueError(
            f"controller = {name}: {wanted} is {shown(function, 80)}: must be a function that takes the "
            "plan of the run and returns a controller"
        )

    def make(planned: object) -> Controller:
        try:
            made = function(planned)
        except Exception as error:
            raise InvalidValueError(f"controller = {name}: {raised(wanted, error)}") from error
        missing = [step for step in ("start", "step") if not callable(getattr(made, step, None))]
        if missing or isinstance(made, type):
            raise InvalidValueError(
                f"controller = {name}: {wanted} returned {shown(made, 80)}: must be a controller, with the "
                "methods start(first) and step(now)"
            )
        return cast(Controller, made)

    return make


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
