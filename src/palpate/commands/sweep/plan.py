"""Plan of a sweep: every run, derived from the typed options and checked before anything moves."""

import hashlib
import itertools
import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import cache
from pathlib import Path
from typing import Any

from palpate.commands.sweep.config import SweepConfig
from palpate.commands.typed_values import Varied, set_options, shown_value, varied_options
from palpate.errors import InvalidValueError
from palpate.experiments.kit.checks import MAX_SEED
from palpate.experiments.kit.config_file import NAME_KEY, config_text, load_overlay, plain_values
from palpate.experiments.kit.experiment import Experiment
from palpate.experiments.kit.options import specs_of
from palpate.experiments.kit.registry import experiment_named, reference_to

MOST_RUNS = 100_000
"""Largest number of runs; each is a small file."""

NAME_DIGITS = 6
"""Significant digits of values in the name of a combination."""

ROBOT_OPTION = "robot"
"""Option that names a robot file, which may name other files."""

SWEEP_OPTIONS: Mapping[str, str] = {
    "out": "a sweep decides where its runs go: --out is its folder",
    "config": "give it as --config FILE.YAML",
}
"""Options that a sweep has itself, and the remedy."""

NOT_VARIED = {"seed": "for runs with other seeds give --seeds and how many"}
"""Options that --vary refuses, and the option to type instead."""

NOT_IDENTIFYING = ("seed", "out")
"""Options that do not identify a combination."""


@dataclass(frozen=True, slots=True, eq=False)
class RunCase:
    """Input of a worker: texts that do not depend on the process that started the sweep.

    Attributes:
        run: Number of the run.
        digest: Digest of the case.
        experiment: Name or file that finds the experiment from any folder.
        config: Configuration, as `palpate.experiments.kit.config_file` writes it.
        seed: Seed that replaces the seed of the configuration.
        folder: Folder for report, log and files of the run; None if they are not kept.
    """

    run: int
    digest: str
    experiment: str
    config: str
    seed: int
    folder: Path | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Combination:
    """Configuration of runs that differ only in their seeds.

    Attributes:
        values: Values of the varied options, in their order.
        config: Configuration with the first seed.
    """

    values: tuple[object, ...]
    config: Any


@dataclass(frozen=True, slots=True, eq=False)
class PlannedRun:
    """A run.

    Attributes:
        number: Number from 0, combination by combination, seed by seed.
        combination: Combination that the run belongs to.
        case: Input of the worker.
    """

    number: int
    combination: Combination
    case: RunCase


@dataclass(frozen=True, slots=True, eq=False)
class SweepPlan:
    """Every run of a sweep.

    Attributes:
        config: Options of the sweep.
        experiment: Experiment of every run.
        varied: Varied options.
        fixed: Set options by name.
        combinations: Every combination, the last option varying fastest.
        seeds: Seeds of each combination.
        runs: Runs by number.
        folder: Output folder.
    """

    config: SweepConfig
    experiment: Experiment
    varied: tuple[Varied, ...]
    fixed: Mapping[str, object]
    combinations: tuple[Combination, ...]
    seeds: range
    runs: tuple[PlannedRun, ...]
    folder: Path

    @property
    def title(self) -> str:
        """Title in a few words."""
        names = ", ".join(each.name for each in self.varied)
        return f"Sweep of {self.experiment.name}" + (f" over {names}" if names else " over seeds")

    @property
    def size(self) -> str:
        """Number of runs as text."""
        seeds = f"{len(self.seeds)} seed{'s' if len(self.seeds) > 1 else ''}"
        if not self.varied:
            return f"{len(self.runs)} run{'s' if len(self.runs) > 1 else ''}: {seeds}"
        counts = " x ".join(f"{len(each.values)} {each.name}" for each in self.varied)
        return f"{len(self.runs)} run{'s' if len(self.runs) > 1 else ''}: {counts} x {seeds}"

    def unit(self, option: str) -> str:
        """Return the unit of an option; empty if it has none."""
        return specs_of(self.experiment.Config)[option].unit

    def name_of(self, combination: Combination) -> str:
        """Return the name of a combination: option=value, ..."""
        return _named(self.varied, combination.values)


def sweep_plan(config: SweepConfig) -> SweepPlan:
    """Return every run of a sweep.

    Raises:
        InvalidValueError: If a name is unknown, or if a value or a combination is impossible; nothing has run.
    """
    experiment = experiment_named(config.experiment)
    kind, reference = experiment.Config, reference_to(experiment)
    folder = config.out or Path(f"runs/sweep-{experiment.name}")
    varied = varied_options(config.varied_words, kind, {**SWEEP_OPTIONS, **NOT_VARIED})
    fixed = set_options(config.set_words, kind, SWEEP_OPTIONS)
    for each in varied:
        if each.name in fixed:
            raise InvalidValueError(f"{each.name} is varied and set: leave --set {each.name}=... out")
    count = config.seeds
    for each in varied:
        count *= len(each.values)
    if count > MOST_RUNS:
        raise InvalidValueError(f"{count} runs: at most {MOST_RUNS}; vary less, or make several sweeps")
    combinations = tuple(_combinations(config, experiment, varied, fixed))
    first = combinations[0].config.seed
    if first + config.seeds - 1 > MAX_SEED:
        raise InvalidValueError(f"seed = {first}: with {config.seeds} of them the last would be above {MAX_SEED}")
    seeds = range(first, first + config.seeds)
    runs: list[PlannedRun] = []
    robot_texts = cache(_robot_texts)  # each robot is read once
    for combination in combinations:
        common = _identity(experiment.name, combination.config, robot_texts)
        text = config_text(reference, combination.config)
        for seed in seeds:
            number = len(runs)
            kept = folder.absolute() / "reports" / f"{number:06d}" if config.keep_reports else None
            digest = hashlib.sha256(f"{common} seed {seed}".encode()).hexdigest()[:16]
            case = RunCase(number, digest, reference, text, seed, kept)
            runs.append(PlannedRun(number, combination, case))
    return SweepPlan(config, experiment, varied, fixed, combinations, seeds, tuple(runs), folder)


def _combinations(
    config: SweepConfig, experiment: Experiment, varied: tuple[Varied, ...], fixed: Mapping[str, object]
) -> Iterator[Combination]:
    kind, file = experiment.Config, config.config
    overlay = {} if file is None else load_overlay(file, experiment.name, kind)
    for values in itertools.product(*(each.values for each in varied)):
        given = {each.name: value for each, value in zip(varied, values, strict=True)}
        try:
            options = kind(**{**overlay, **fixed, **given})
        except InvalidValueError as error:
            where = _named(varied, values)
            raise InvalidValueError(f"with {where}: {error}" if where else str(error)) from None
        yield Combination(values, _with_whole_paths(options))


def _named(varied: Sequence[Varied], values: Sequence[object]) -> str:
    pairs = zip(varied, values, strict=True)
    return ", ".join(f"{each.name}={shown_value(value, NAME_DIGITS)}" for each, value in pairs)


def _with_whole_paths(config: Any) -> Any:
    """Return the configuration with absolute paths, since workers may start in another folder."""
    whole: dict[str, object] = {}
    for field in fields(config):
        value = getattr(config, field.name)
        names_file = isinstance(value, Path) or (field.name == ROBOT_OPTION and isinstance(value, str))
        if field.name == "out" or not names_file or not Path(value).is_file():
            continue
        whole[field.name] = type(value)(Path(value).absolute())
    return replace(config, **whole) if whole else config


def _identity(experiment: str, config: Any, robot_texts: Callable[[str], Mapping[str, str]]) -> str:
    """Return everything that a run depends on but its seed; files count by content."""
    values = {name: value for name, value in plain_values(config).items() if name not in NOT_IDENTIFYING}
    robot = values.pop(ROBOT_OPTION, None)
    if isinstance(robot, str):
        values[ROBOT_OPTION] = robot_texts(robot)
    for name, value in values.items():
        if isinstance(value, str) and Path(value).is_absolute() and Path(value).is_file():
            values[name] = hashlib.sha256(Path(value).read_bytes()).hexdigest()
    return json.dumps({NAME_KEY: experiment, **values})


def _robot_texts(name: str) -> Mapping[str, str]:
    """Return the texts of a robot's files: its own, and those of its sensors."""
    from palpate.robots.values import load_named_robot  # imports the simulator, for a second

    return load_named_robot(name).texts


def expected_durations(plan: SweepPlan) -> list[float]:
    """Plan every combination once, and return the expected duration of its runs, simulated [s].

    Raises:
        InvalidValueError: If a combination cannot be realised, or if it would move a real robot.
    """
    from palpate.robots.values import load_named_robot

    durations = []
    for combination in plan.combinations:
        config = combination.config
        try:
            robot = None if config.robot is None else load_named_robot(config.robot)
            if robot is not None and not robot.file.backend.UNATTENDED:
                raise InvalidValueError(
                    f"robot = {config.robot}: a sweep runs many at a time, unwatched: simulated robots only, none "
                    "that is real or behind a wire; `palpate robot list` names some"
                )
            durations.append(plan.experiment.plan(config, robot, {}).expected_duration)
        except InvalidValueError as error:
            where = plan.name_of(combination)
            raise InvalidValueError(f"with {where}: {error}" if where else str(error)) from None
    return durations
