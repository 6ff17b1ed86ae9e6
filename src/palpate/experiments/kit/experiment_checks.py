"""Whether an object that somebody names is an experiment, checked when it is found."""

from dataclasses import fields, is_dataclass
from typing import Any

from palpate.errors import InvalidValueError, shown
from palpate.experiments.kit.figure import Figure

TEXTS, METHODS = ("name", "summary"), ("plan", "found", "report", "files", "cloud")
"""What an experiment has besides `Config` and `figures`; see `Experiment`."""

CONFIG_FIELDS = {
    "robot": 'robot: str = "stage"',
    "seed": "seed: int = 0",
    "out": 'out: Path = Path("runs/mine")',
}
"""Fields that every `Config` has, with an example of each."""

PROTOCOL = "see palpate.experiments.kit.Experiment"


def check_experiment(reference: str, experiment: Any) -> None:
    """Refuse what is no experiment.

    Args:
        reference: How it was named, for messages.
        experiment: An instance.

    Raises:
        InvalidValueError: It is none; the message names the class, what it lacks, and how to mend it.
    """
    problem = _problem(experiment)
    if problem:
        raise InvalidValueError(
            f"experiment = {reference}: {type(experiment).__name__} is no experiment: {problem}"
        )


def _problem(experiment: Any) -> str:
    """Return what is wrong, and the remedy; empty if nothing is."""
    missing = [each for each in (*TEXTS, "Config", "figures", *METHODS) if not hasattr(experiment, each)]
    if missing:
        return f"it lacks {', '.join(missing)}: add {'them' if len(missing) > 1 else 'it'}, {PROTOCOL}"
    for name in TEXTS:
        if not isinstance(getattr(experiment, name), str):
            return f"{name} = {shown(getattr(experiment, name))}: must be a text"
    for name in METHODS:
        if not callable(getattr(experiment, name)):
            return f"{name} = {shown(getattr(experiment, name))}: must be a method, {PROTOCOL}"
    figures = experiment.figures
    if not isinstance(figures, tuple) or not all(isinstance(each, Figure) for each in figures):
        return f"figures = {shown(figures)}: must be a tuple of Figure; write (Figure(...),) for one"
    return _problem_of_config(experiment.Config)


def _problem_of_config(kind: Any) -> str:
    if not (isinstance(kind, type) and is_dataclass(kind)) or not kind.__dataclass_params__.frozen:  # type: ignore[attr-defined]
        return f"Config = {shown(kind)}: must be a frozen dataclass; write @dataclass(frozen=True) above its class"
    missing = [name for name in CONFIG_FIELDS if name not in {each.name for each in fields(kind)}]
    if not missing:
        return ""
    examples = "; ".join(CONFIG_FIELDS[name] for name in missing)
    return f"{kind.__name__} lacks the field {', '.join(missing)}: add it, for example {examples}"
