"""Replay the log of an experiment, as it was or with something changed."""

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

from palpate.errors import FloatArray, InvalidValueError, shown
from palpate.experiments.kit.experiment import Plan
from palpate.experiments.kit.from_log import NOTHING_SET, LoggedRun
from palpate.experiments.kit.options import foreign_options, specs_of
from palpate.experiments.kit.registry import ShownResult
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

if TYPE_CHECKING:
    from palpate.reporting.report import Report


def changeable(kind: type) -> tuple[str, ...]:
    """Return the options of a `Config` that a replay can change."""
    return tuple(name for name, spec in specs_of(kind).items() if not spec.fixed)


def unchangeable(kind: type) -> dict[str, str]:
    """Return the options that a replay cannot change, with the reason."""
    return {
        name: f"a replay cannot change it: {spec.fixed}" for name, spec in specs_of(kind).items() if spec.fixed
    }


def changed_config(config: Any, settings: Mapping[str, object]) -> Any:
    """Return a configuration with changed options.

    Options that belong to a replaced choice, as the time of steps to another profile, return to their defaults.

    Raises:
        InvalidValueError: If a name is unknown or cannot be changed, or if a value is impossible.
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
"""Function from the plan of the replay to a fresh controller."""


def load_controller_maker(name: str) -> ControllerMaker:
    """Return the function that `module:function` names, whose result is checked to be a controller.

    The present folder is searched first.

    Raises:
        InvalidValueError: If there is no such module or function, or if the module cannot be imported.
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
class ReplayedLog(ShownResult):
    """Replay of a log, beside the recording.

    Attributes:
        log: Recording.
        extent: Replayed part of the log.
        of: Experiment and configuration of the log.
        planned: Plan of the replay.
        settings: Changed options by name.
        other_controller: Whether another controller replaced the recorded one.
        left_out: Changes of live parameters that the other controller lacks.
        replay: Replayed periods.
        replayed: Number of replayed rows that are commands of controller and supervisor.
        commands: Difference of the commands.
        sensing: Difference of the observations, as far as the replay went.
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

    def _report(self) -> "Report":
        from palpate.commands.replay.report import replay_report  # which imports this module

        return replay_report(self)

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
        """Number of periods that can be compared."""
        return min(self.extent.count, self.replayed)

    def records(self) -> tuple[Record, Record]:
        """Return the common periods in base coordinates, as recorded and as replayed."""
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
        log: Log, its file, or a folder with latest.mcap.
        settings: Changed options of sensing, control and supervision, by name.
        controller: Maker of another controller; None for the recorded one.
        observers: Observers that are called every period, for example to show progress.

    Raises:
        InvalidValueError: If the log has no experiment or no periods to replay, or if a change is impossible.
        OSError: If the log cannot be read.
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
    """Return the changes whose parameters a controller has, and the others."""
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
