"""Registry of experiments: those that installed packages declare, and any that is named as module:Class.

Built-in experiments are declared like any others, as entry points of the group `palpate.experiments`. An
experiment declared as `group.word` is typed as two words and belongs to that group of commands.
"""

import sys
from dataclasses import fields, is_dataclass
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, cast

from palpate.errors import InvalidValueError, shown
from palpate.experiments.kit.experiment import Experiment
from palpate.experiments.kit.metric import Metric
from palpate.named_object import named_object
from palpate.nearest_name import nearest
from palpate.open_kinds import declared_in

if TYPE_CHECKING:
    from palpate.reporting.report import Report

TEXTS, METHODS = ("name", "summary"), ("plan", "evaluate", "report", "files", "cloud")
"""Attributes and methods of an experiment besides `Config` and `metrics`; see `Experiment`."""

CONFIG_FIELDS = {
    "robot": 'robot: str = "stage"',
    "seed": "seed: int = 0",
    "out": 'out: Path = Path("runs/mine")',
}
"""Fields that every `Config` has, with an example of each."""

PROTOCOL_HINT = "see palpate.experiments.kit.Experiment"


def check_experiment(reference: str, experiment: Any) -> None:
    """Check that an object is an experiment.

    Args:
        reference: Name of the object, for messages.
        experiment: Object to check.

    Raises:
        InvalidValueError: If it is no experiment; the message names the class, the fault and the remedy.
    """
    problem = _problem(experiment)
    if problem:
        raise InvalidValueError(
            f"experiment = {reference}: {type(experiment).__name__} is no experiment: {problem}"
        )


def _problem(experiment: Any) -> str:
    """Return the fault and the remedy; empty if there is none."""
    missing = [each for each in (*TEXTS, "Config", "metrics", *METHODS) if not hasattr(experiment, each)]
    if missing:
        return f"it lacks {', '.join(missing)}: add {'them' if len(missing) > 1 else 'it'}, {PROTOCOL_HINT}"
    for name in TEXTS:
        if not isinstance(getattr(experiment, name), str):
            return f"{name} = {shown(getattr(experiment, name))}: must be a text"
    for name in METHODS:
        if not callable(getattr(experiment, name)):
            return f"{name} = {shown(getattr(experiment, name))}: must be a method, {PROTOCOL_HINT}"
    metrics = experiment.metrics
    if not isinstance(metrics, tuple) or not all(isinstance(each, Metric) for each in metrics):
        return f"metrics = {shown(metrics)}: must be a tuple of Metric; write (Metric(...),) for one"
    return _problem_of_config(experiment.Config)


def _problem_of_config(kind: Any) -> str:
    if not (isinstance(kind, type) and is_dataclass(kind)) or not kind.__dataclass_params__.frozen:  # type: ignore[attr-defined]
        return f"Config = {shown(kind)}: must be a frozen dataclass; write @dataclass(frozen=True) above its class"
    missing = [name for name in CONFIG_FIELDS if name not in {each.name for each in fields(kind)}]
    if not missing:
        return ""
    examples = "; ".join(CONFIG_FIELDS[name] for name in missing)
    return f"{kind.__name__} lacks the field {', '.join(missing)}: add it, for example {examples}"


ENTRY_POINTS = "palpate.experiments"
"""Group of the entry points: name = "module:Class"."""


def experiment_names() -> tuple[str, ...]:
    """Return the names of all experiments that installed packages declare, palpate's own first."""
    return tuple(declared_in(ENTRY_POINTS))


@cache
def experiment_named(name: str) -> Experiment:
    """Return an experiment.

    Args:
        name: Declared name, `module:Class`, or `file.py:Class`; the present folder is searched first.

    Raises:
        InvalidValueError: If there is no such experiment; the message lists the known ones.
    """
    declared = declared_in(ENTRY_POINTS).get(name)
    if declared is not None:
        try:
            made = declared.load()
        except Exception as error:
            raise InvalidValueError(
                f"experiment = {name}: {declared.value} cannot be loaded: {type(error).__name__}: {error}"
            ) from error
    elif ":" in name:
        made = named_object("experiment", name, "mine:Mine or mine.py:Mine for the class Mine in mine.py")
    else:
        near = nearest(name, experiment_names())
        meant = f"did you mean {near}? " if near else ""
        raise InvalidValueError(
            f"experiment = {name}: no such experiment; {meant}there are {', '.join(experiment_names())}, one "
            "of your own is named as module:Class"
        )
    try:
        experiment = made() if isinstance(made, type) else made
    except TypeError as error:
        raise InvalidValueError(
            f"experiment = {name}: cannot be made without arguments ({error}); name the experiment's class"
        ) from None
    check_experiment(name, experiment)
    return cast("Experiment", experiment)


def typed_words(name: str) -> tuple[str, ...]:
    """Return the words typed after `palpate` for an experiment: its group, if it has one, and its name."""
    return (name,) if ":" in name else tuple(name.split(".", 1))


def reference_to(experiment: Experiment) -> str:
    """Return the reference of an experiment for logs and other processes: its name, or its file and class."""
    kind = type(experiment)
    if experiment.name in declared_in(ENTRY_POINTS) and type(experiment_named(experiment.name)) is kind:
        return experiment.name
    file = getattr(sys.modules[kind.__module__], "__file__", None)
    return f"{kind.__module__ if file is None else Path(file).resolve()}:{kind.__qualname__}"


class ShownResult:
    """A result that is shown by title, outcome and main metrics, in a notebook also by the first figure.

    Attributes:
        experiment: Name of the experiment, or `module:Class`; unused where `_report` is overridden.
    """

    __slots__ = ()

    experiment: ClassVar[str]

    def __init_subclass__(cls, **more: Any) -> None:
        super().__init_subclass__(**more)
        if "__repr__" not in vars(cls):
            setattr(cls, "__repr__", ShownResult.__repr__)  # noqa: B010 - or a dataclass would print every array

    def _report(self) -> "Report":
        return experiment_named(self.experiment).report(self)

    def __repr__(self) -> str:
        from palpate.reporting.report import report_summary

        try:
            return report_summary(self._report())
        except Exception:  # debuggers and tests print results that are not whole
            return f"<{type(self).__name__}>"

    def _repr_html_(self) -> str:
        from palpate.reporting.report import report_fragment

        return report_fragment(self._report())
