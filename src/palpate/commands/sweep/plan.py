"""From what is typed to every single run, checked before anything moves."""

import hashlib
import itertools
import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import cache
from pathlib import Path
from typing import Any

from palpate.commands.sweep.attempt import RunCase
from palpate.commands.sweep.config import SweepConfig
from palpate.commands.sweep.swept import EXPERIMENTS, Swept
from palpate.commands.sweep.typed_values import Varied, fixed_options, shown_value, varied_options
from palpate.errors import InvalidValueError
from palpate.experiments.kit.config_checks import LARGEST_SEED
from palpate.experiments.kit.experiment_file import plain_values

MOST_RUNS = 100_000
"""Each is a small file; more of them are a mistake, or several sweeps."""

DIGITS = 6
"""Of values in the name of a combination: those of a range have up to 17."""

ROBOT = "robot"
"""The option that names a robot file, which may name others."""

NO_PART = ("seed", "out")
"""Options that do not belong to what a combination is."""


@dataclass(frozen=True, slots=True, eq=False)
class Combination:
    """What is the same in some runs that differ in their seeds.

    Attributes:
        values: Of the options that are varied, in their order.
        config: With the first seed.
    """

    values: tuple[object, ...]
    config: Any


@dataclass(frozen=True, slots=True, eq=False)
class PlannedRun:
    """A run.

    Attributes:
        number: Its place, from 0: combinations in their order, the seeds of each one after the other.
        combination: What is varied.
        case: What its worker is given.
    """

    number: int
    combination: Combination
    case: RunCase


@dataclass(frozen=True, slots=True, eq=False)
class SweepPlan:
    """Every run of a sweep.

    Attributes:
        asked: As typed.
        swept: What is done.
        varied: The options that are varied.
        fixed: Those that are set, typed.
        combinations: Every one, the last option varying fastest.
        seeds: Of each.
        runs: All of them, by number.
    """

    asked: SweepConfig
    swept: Swept
    varied: tuple[Varied, ...]
    fixed: Mapping[str, object]
    combinations: tuple[Combination, ...]
    seeds: range
    runs: tuple[PlannedRun, ...]

    @property
    def title(self) -> str:
        """What it is, in a few words."""
        names = ", ".join(each.name for each in self.varied)
        return f"Sweep of {self.swept.name}" + (f" over {names}" if names else " over seeds")

    @property
    def size(self) -> str:
        """How many runs there are, in words."""
        seeds = f"{len(self.seeds)} seed{'s' if len(self.seeds) > 1 else ''}"
        if not self.varied:
            return f"{len(self.runs)} run{'s' if len(self.runs) > 1 else ''}: {seeds}"
        counts = " x ".join(f"{len(each.values)} {each.name}" for each in self.varied)
        return f"{len(self.runs)} run{'s' if len(self.runs) > 1 else ''}: {counts} x {seeds}"

    def name_of(self, combination: Combination) -> str:
        """Return a combination about as people type it."""
        return _named(self.varied, combination.values)


def sweep_plan(config: SweepConfig) -> SweepPlan:
    """Return every run that is asked for.

    Raises:
        InvalidValueError: A name is not known, a value impossible, or a combination of them; nothing has run.
    """
    swept = EXPERIMENTS[config.experiment]
    varied = varied_options(config.varied_words, swept.kind)
    fixed = fixed_options(config.set_words, swept.kind)
    for each in varied:
        if each.name in fixed:
            raise InvalidValueError(f"{each.name} is varied and set: leave --set {each.name}=... out")
    count = config.seeds
    for each in varied:
        count *= len(each.values)
    if count > MOST_RUNS:
        raise InvalidValueError(f"{count} runs: at most {MOST_RUNS}; vary less, or make several sweeps")
    combinations = tuple(_combinations(config, swept, varied, fixed))
    first = combinations[0].config.seed
    if first + config.seeds - 1 > LARGEST_SEED:
        raise InvalidValueError(
            f"seed = {first}: with {config.seeds} of them the last would be above {LARGEST_SEED}"
        )
    seeds = range(first, first + config.seeds)
    runs: list[PlannedRun] = []
    robot_texts = cache(_robot_texts)  # for as long as files are not looked at anew
    for combination in combinations:
        common = _identity(swept, combination.config, robot_texts)
        for seed in seeds:
            number = len(runs)
            out = config.folder.absolute() / "reports" / f"{number:06d}" if config.keep_reports else Path("runs")
            asked = replace(combination.config, seed=seed, out=out)
            digest = hashlib.sha256(f"{common} seed {seed}".encode()).hexdigest()[:16]
            case = RunCase(number, digest, swept.name, asked, config.keep_reports)
            runs.append(PlannedRun(number, combination, case))
    return SweepPlan(config, swept, varied, fixed, combinations, seeds, tuple(runs))


def _combinations(
    config: SweepConfig, swept: Swept, varied: tuple[Varied, ...], fixed: Mapping[str, object]
) -> Iterator[Combination]:
    defaults = _defaults(config, swept)
    for values in itertools.product(*(each.values for each in varied)):
        given = {**fixed, **{each.name: value for each, value in zip(varied, values, strict=True)}}
        try:
            asked = swept.kind(**{**defaults, **given})
        except InvalidValueError as error:
            where = _named(varied, values)
            raise InvalidValueError(f"with {where}: {error}" if where else str(error)) from None
        yield Combination(values, _with_whole_paths(asked))


def _named(varied: Sequence[Varied], values: Sequence[object]) -> str:
    pairs = zip(varied, values, strict=True)
    return ", ".join(f"{each.name}={shown_value(value, DIGITS)}" for each, value in pairs)


def _defaults(config: SweepConfig, swept: Swept) -> dict[str, object]:
    """Return the options that hold if nothing else is said: as the experiment itself would have them."""
    options = swept.defaults([] if config.config is None else ["--config", str(config.config)])
    return {field.name: getattr(options, field.name) for field in fields(swept.kind)}


def _with_whole_paths(config: Any) -> Any:
    """Files by their whole paths: workers may stand in another folder."""
    whole: dict[str, object] = {}
    for field in fields(config):
        value = getattr(config, field.name)
        names_file = isinstance(value, Path) or (field.name == ROBOT and isinstance(value, str))
        if field.name == "out" or not names_file or not Path(value).is_file():
            continue
        whole[field.name] = type(value)(Path(value).absolute())
    return replace(config, **whole) if whole else config


def _identity(swept: Swept, config: Any, robot_texts: Callable[[str], Mapping[str, str]]) -> str:
    """Return everything that a run depends on but its seed; of a file what is in it, wherever it lies."""
    values = {name: value for name, value in plain_values(config).items() if name not in NO_PART}
    robot = values.pop(ROBOT, None)
    if isinstance(robot, str):
        values[ROBOT] = robot_texts(robot)
    for name, value in values.items():
        if isinstance(value, str) and Path(value).is_absolute() and Path(value).is_file():
            values[name] = hashlib.sha256(Path(value).read_bytes()).hexdigest()
    return json.dumps({"experiment": swept.name, **values})


def _robot_texts(name: str) -> Mapping[str, str]:
    """Return what the files of a robot say: its own, and those of its sensors."""
    from palpate.robots.values import load_named_robot  # the simulator: a second

    return load_named_robot(name).texts


def simulated_durations(plan: SweepPlan) -> list[float]:
    """Plan every combination once, with a world of its own; return about how long a run of each is, simulated [s].

    Raises:
        InvalidValueError: One cannot be realised, or would move a real robot.
    """
    from palpate.robots.values import load_named_robot
    from palpate.runtime.robot_backend import SimulatedUr5eEntry, StageEntry, TurningStageEntry

    carrier, durations = plan.swept.carrier, []
    for combination in plan.combinations:
        try:
            robot = getattr(combination.config, ROBOT, None)
            if robot is not None:
                backend = load_named_robot(robot).file.backend
                if not isinstance(backend, StageEntry | TurningStageEntry | SimulatedUr5eEntry):
                    raise InvalidValueError(
                        f"robot = {robot}: a sweep runs many at a time, unwatched: simulated robots only, none "
                        "that is real or behind a wire; `palpate robot list` names some"
                    )
            durations.append(carrier.duration_of(combination.config))
        except InvalidValueError as error:
            where = plan.name_of(combination)
            raise InvalidValueError(f"with {where}: {error}" if where else str(error)) from None
    return durations
