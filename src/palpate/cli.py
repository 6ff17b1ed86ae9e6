"""The palpate command."""

import inspect
import sys
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import make_dataclass
from functools import cache, partial
from importlib import import_module
from pathlib import Path
from typing import Annotated, Any, NamedTuple, Union

import tyro

from palpate import interruption
from palpate.commands import start_up
from palpate.commands.calibrate.config import (
    MatrixConfig,
    MountingConfig,
    NewSensorConfig,
    PayloadConfig,
    TareConfig,
)
from palpate.commands.command_result import CommandResult
from palpate.commands.compare.config import CompareConfig
from palpate.commands.completion import CompletionConfig, completion_script
from palpate.commands.contact.config import ContactConfig
from palpate.commands.devices.config import (
    DoctorConfig,
    EmulateDynamixelConfig,
    EmulateFaultConfig,
    EmulateNetftConfig,
    EmulateRobotConfig,
    EmulateUrConfig,
    RecoverConfig,
    RobotCheckConfig,
    RobotListConfig,
    RobotShowConfig,
)
from palpate.commands.log.config import LogExportConfig, LogInfoConfig, LogRos2Config
from palpate.commands.output_format import run_with_json, run_with_text
from palpate.commands.replay.config import ReplayConfig
from palpate.commands.sweep.config import SweepConfig
from palpate.commands.typed_options import (
    DRY_RUN,
    FIGURES,
    JSON,
    parsed,
    read_experiment,
    read_options,
    with_shared,
)
from palpate.commands.view.config import ViewConfig
from palpate.commands.warm_up.config import WarmUpConfig
from palpate.errors import InvalidValueError
from palpate.experiments.kit.experiment import Experiment
from palpate.experiments.kit.registry import experiment_named, experiment_names, typed_words
from palpate.nearest_name import nearest
from palpate.version import __version__

_DESCRIPTION = (
    "palpate: hybrid force control with the sense of touch.\n\n"
    "Example: palpate {first}; then open the report that it names. `palpate {first} --help` explains every "
    "option.\n\n"
    "Experiments come first below; one of your own is typed as module:Class or file.py:Class. "
    "Every command takes --json; where something moves, --dry-run shows what it would do. "
    "Exit code: 0 done; 1 not finished, or a check failed; 2 wrong input, nothing was done; "
    "128 + its number for a signal, as 130 for Ctrl-C. palpate --version prints the version."
)


_CALIBRATION = (
    "Calibrate a force/torque sensor, and the fingertip on it.\n\n"
    "The file of the sensor keeps the results. In this order: `new` makes the file; `matrix` finds the "
    "calibration matrix from known loads (only for a sensor that gives raw channels); `payload` finds the load "
    "that the sensor carries, or `mounting` finds the load and the sensor's rotation on a robot's flange; `tare` "
    "finds the bias, before every use.\n\n"
    "Example: palpate calibrate new sensor.yaml --preset nano17"
)


class TypedCommand(NamedTuple):
    """A command of the command line.

    Attributes:
        config: Class of its options, light to import; the docstring is its help.
        runner: Function that runs it, as module:function; imported when the command runs. By default the method
            `run` of the options.
        document: Function that runs it with --json, if `runner` writes rows to standard output.
    """

    config: type
    runner: str = ""
    document: str = ""

    @property
    def summary(self) -> str:
        """First line of its help."""
        return (inspect.getdoc(self.config) or "").partition("\n")[0]


class CommandGroup(NamedTuple):
    """Commands that belong together: `palpate robot list`.

    Attributes:
        commands: Commands, experiments among them, by the word that follows the group's.
        about: Help of the group.
    """

    commands: "Mapping[str, TypedCommand | CommandGroup | Experiment]"
    about: str

    @property
    def summary(self) -> str:
        """First line of its help."""
        return self.about.partition("\n")[0]


_EXPERIMENT_OPTIONS = (DRY_RUN, FIGURES, JSON)
_HELP_WORDS = frozenset({"-h", "--help"})

COMMANDS: Mapping[str, TypedCommand | CommandGroup] = {
    "sweep": TypedCommand(SweepConfig, "palpate.commands.sweep.command:run_sweep"),
    "contact": TypedCommand(
        ContactConfig, "palpate.commands.contact.tool:run_contact", "palpate.commands.contact.tool:contact_result"
    ),
    "compare": TypedCommand(CompareConfig, "palpate.commands.compare:run_compare"),
    "calibrate": CommandGroup(
        {
            "new": TypedCommand(NewSensorConfig),
            "matrix": TypedCommand(MatrixConfig),
            "payload": TypedCommand(PayloadConfig),
            "mounting": TypedCommand(MountingConfig),
            "tare": TypedCommand(TareConfig),
        },
        _CALIBRATION,
    ),
    "log": CommandGroup(
        {
            "info": TypedCommand(LogInfoConfig, "palpate.commands.log.info:run_log_info"),
            "export": TypedCommand(LogExportConfig, "palpate.commands.log.export:run_log_export"),
            "ros2": TypedCommand(LogRos2Config, "palpate.commands.log.export:run_log_ros2"),
        },
        "Logs of runs: their contents; as tables, and for ROS 2.\n\nExample: palpate log info runs/explore",
    ),
    "replay": TypedCommand(ReplayConfig, "palpate.commands.replay.command:run_replay"),
    "view": TypedCommand(ViewConfig, "palpate.commands.view.command:run_view"),
    "robot": CommandGroup(
        {
            "list": TypedCommand(RobotListConfig, "palpate.commands.devices.robot_file:run_list"),
            "show": TypedCommand(RobotShowConfig, "palpate.commands.devices.robot_file:run_show"),
            "check": TypedCommand(RobotCheckConfig, "palpate.commands.devices.robot_file:run_check"),
        },
        "Robot files: those that come with palpate, and yours.\n\nExample: palpate robot check mine.yaml",
    ),
    "doctor": TypedCommand(DoctorConfig, "palpate.commands.devices.doctor:run_doctor"),
    "recover": TypedCommand(RecoverConfig, "palpate.commands.devices.recover:run_recover"),
    "emulate": CommandGroup(
        {
            "ur": TypedCommand(EmulateUrConfig, "palpate.commands.devices.emulate:run_emulate"),
            "dynamixel": TypedCommand(EmulateDynamixelConfig, "palpate.commands.devices.emulate:run_emulate"),
            "netft": TypedCommand(EmulateNetftConfig, "palpate.commands.devices.emulate:run_emulate"),
            "robot": TypedCommand(EmulateRobotConfig, "palpate.commands.devices.emulate:run_emulate"),
            "fault": TypedCommand(EmulateFaultConfig, "palpate.commands.devices.emulate:run_fault"),
        },
        "Emulated devices, for palpate or any other software that talks to the real ones.\n\n"
        "Example: palpate emulate ur",
    ),
    "warm-up": TypedCommand(WarmUpConfig, "palpate.commands.warm_up.command:run_warm_up"),
    "completion": TypedCommand(CompletionConfig, "palpate.cli:run_completion"),
}

Typed = Mapping[str, "TypedCommand | CommandGroup | Experiment"]
"""Commands and experiments by name."""


@cache
def typed_commands() -> Typed:
    """Return every command by name, experiments first.

    An experiment that cannot be loaded is left out, so that the others can be used; typing its name shows why.
    An experiment whose name has a dot belongs to a group: one of `COMMANDS`, or a group of its own.
    """
    experiments: dict[str, Experiment] = {}
    groups: dict[str, dict[str, Experiment]] = {}
    for name in experiment_names():
        with suppress(InvalidValueError):
            *group, word = typed_words(name)
            (groups.setdefault(group[0], {}) if group else experiments)[word] = experiment_named(name)
    commands: dict[str, TypedCommand | CommandGroup | Experiment] = {**experiments, **COMMANDS}
    for name, members in groups.items():
        existing = COMMANDS.get(name)
        if existing is None:
            commands[name] = CommandGroup(members, "\n\n".join(each.summary for each in members.values()))
        elif isinstance(existing, CommandGroup):
            commands[name] = CommandGroup({**members, **existing.commands}, existing.about)
    return commands


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; returns the exit code, see `palpate.commands.command_result.ExitCode`."""
    arguments = list(sys.argv[1:] if arguments is None else arguments)
    if arguments in (["--version"], ["-V"]):
        sys.stdout.write(f"palpate {__version__}\n")
        return 0
    interruption.forget()
    run = partial(_run, arguments)
    if "--json" not in arguments or _HELP_WORDS & set(arguments):
        return run_with_text(run)
    words, _, rest = _resolved(arguments)
    return run_with_json(run, " ".join(words) or next((word for word in rest[:1] if ":" in word), ""))


def _resolved(arguments: Sequence[str]) -> tuple[list[str], "TypedCommand | CommandGroup | Experiment", list[str]]:
    """Return the words that name a command, the command or group that they name, and the words after them."""
    commands, words, rest = typed_commands(), list[str](), list(arguments)
    found: TypedCommand | CommandGroup | Experiment = CommandGroup(
        commands, _DESCRIPTION.format(first=next(iter(commands)))
    )
    while isinstance(found, CommandGroup) and rest and rest[0] in found.commands:
        words.append(rest.pop(0))
        found = found.commands[words[-1]]
    return words, found, rest


def _run(arguments: Sequence[str]) -> CommandResult | int:
    words, found, rest = _resolved(arguments)
    typed = " ".join(("palpate", *words))
    if isinstance(found, CommandGroup):
        word = rest[0] if rest else "--help"
        if not word.startswith("-") and (":" in word or word in experiment_names()):
            return _run_experiment(experiment_named(word), f"{typed} {word}", rest[1:])
        if not _HELP_WORDS & {word, *rest}:
            raise InvalidValueError(_no_command(word, found.commands, words))
        parsed(_subcommands(found.commands), typed, found.about, ["--help"], None)
        raise AssertionError("help ends the program")
    if isinstance(found, TypedCommand):
        return _run_command(found, typed, rest)
    return _run_experiment(found, typed, rest)


def _no_command(word: str, commands: Typed, words: Sequence[str]) -> str:
    """Return the message for a word that is no command; `words` name the group in which it was looked for."""
    if word.endswith(".py") and Path(word).exists():
        return f"{word}: a file is no command; name the experiment's class in it, as {word}:Class"
    near = nearest(word, (*commands, *_HELP_WORDS, *(() if words else ("--version",))))
    meant = f"did you mean {' '.join(('palpate', *words, near))}? " if near else ""
    return f"{' '.join((*words, word))}: no such command; {meant}there are {', '.join(commands)}"


def _run_command(command: TypedCommand, typed: str, arguments: Sequence[str]) -> CommandResult | int:
    config: Any
    config, shared = read_options(command.config, typed, arguments, (JSON,))
    runner = _runner(command, json=bool(shared[JSON.name]))
    start_up.over()
    result: CommandResult | int = runner(config)
    return result


def _run_experiment(experiment: Experiment, typed: str, arguments: Sequence[str]) -> CommandResult:
    config, shared = read_experiment(experiment.Config, experiment.name, typed, arguments, _EXPERIMENT_OPTIONS)
    from palpate.commands.run import dry_run_experiment, run_experiment

    start_up.over()
    if shared.get(DRY_RUN.name):
        return dry_run_experiment(experiment, config)
    return run_experiment(experiment, config, shared.get(FIGURES.name))


def run_completion(config: CompletionConfig) -> CommandResult:
    """Print a script that makes a shell complete these commands."""
    script = completion_script(_subcommands(typed_commands()), config.shell)
    sys.stdout.write(script)
    return CommandResult(facts={"shell": config.shell, "script": script})


def _runner(command: TypedCommand, *, json: bool) -> Any:
    """Return the function that carries a command out, imported only now: it takes a second that --help saves."""
    name = command.document if json and command.document else command.runner
    if not name:
        return command.config.run  # type: ignore[attr-defined]
    module, function = name.split(":")
    return getattr(import_module(module), function)


def _subcommands(commands: Typed) -> Any:
    """Return the union type from which tyro makes subcommands."""
    subcommands = []
    for name, what in commands.items():
        if isinstance(what, TypedCommand):
            options = with_shared(what.config, name, (JSON,))
        elif isinstance(what, CommandGroup):
            below: Any = _subcommands(what.commands)
            options = make_dataclass(name, [("command", Annotated[below, tyro.conf.OmitSubcommandPrefixes])])
        else:
            options = with_shared(what.Config, name, _EXPERIMENT_OPTIONS, experiment_file=True)
        subcommands.append(Annotated[options, tyro.conf.subcommand(name, description=what.summary)])
    return Union[tuple(subcommands)]  # noqa: UP007
