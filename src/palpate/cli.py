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
from palpate.commands.colours import HELP_WORDS, parser_colours
from palpate.commands.command_result import CommandResult
from palpate.commands.compare.config import CompareConfig
from palpate.commands.completion import CompletionConfig, completion_script
from palpate.commands.contact.config import ContactConfig
from palpate.commands.doctor.config import DoctorConfig
from palpate.commands.emulate.config import (
    EmulateDynamixelConfig,
    EmulateFaultConfig,
    EmulateNetftConfig,
    EmulateRobotConfig,
    EmulateUrConfig,
)
from palpate.commands.log.config import LogExportConfig, LogInfoConfig, LogRos2Config
from palpate.commands.output_format import JsonOutput, OutputFormat, TextOutput
from palpate.commands.recover.config import RecoverConfig
from palpate.commands.replay.config import ReplayConfig
from palpate.commands.robot.config import RobotCheckConfig, RobotListConfig, RobotShowConfig
from palpate.commands.sweep.config import SweepConfig
from palpate.commands.typed_options import DRY_RUN, FIGURES, JSON, read_experiment, read_with_shared, with_shared
from palpate.commands.view.config import ViewConfig
from palpate.commands.warm_up.config import WarmUpConfig
from palpate.errors import InvalidValueError
from palpate.experiments.kit.experiment import Experiment
from palpate.experiments.kit.registry import experiment_named, experiment_names, typed_words
from palpate.nearest_name import nearest
from palpate.version import __version__

DESCRIPTION = (
    "palpate: hybrid force control with the sense of touch.\n\n"
    "Example: palpate {first}; then open the report that it names. `palpate {first} --help` explains every "
    "option.\n\n"
    "Experiments come first below; one of your own is typed as module:Class or file.py:Class. "
    "Every command takes --json; where something moves, --dry-run shows what it would do. "
    "Exit code: 0 done; 1 not finished, or a check failed; 2 wrong input, nothing was done; "
    "128 + its number for a signal, as 130 for Ctrl-C. palpate --version prints the version."
)


CALIBRATION = (
    "Calibrate a force/torque sensor, and the fingertip on it.\n\n"
    "Of the sensor, whose file keeps the result, in this order: `new` makes the file; `matrix` finds the "
    "calibration matrix from known loads (only for a sensor that gives raw channels); `payload` finds what it "
    "carries, or `mounting` that and how it is turned on a robot's flange; `tare` finds the bias, before every "
    "use.\n\n"
    "Example: palpate calibrate new sensor.yaml --preset nano17"
)
"""Help of `palpate calibrate`."""


class TypedCommand(NamedTuple):
    """A command of the command line.

    Attributes:
        config: Its options, light to import; the docstring is its help.
        runner: Function that runs it, as module:function; imported when the command runs.
        document: Function that runs it with --json, if `runner` writes rows to standard output.
    """

    config: type
    runner: str
    document: str = ""

    @property
    def about(self) -> str:
        """Its help."""
        return inspect.getdoc(self.config) or ""

    @property
    def summary(self) -> str:
        """First line of its help."""
        return self.about.partition("\n")[0]


class CommandGroup(NamedTuple):
    """Commands that belong together: `palpate robot list`.

    Attributes:
        commands: By the word that follows; experiments among them.
        about: Their help.
    """

    commands: "Mapping[str, TypedCommand | Experiment]"
    about: str

    @property
    def summary(self) -> str:
        """First line of their help."""
        return self.about.partition("\n")[0]


EXPERIMENT_OPTIONS = (DRY_RUN, FIGURES, JSON)

COMMANDS: Mapping[str, TypedCommand | CommandGroup] = {
    "sweep": TypedCommand(SweepConfig, "palpate.commands.sweep.command:run_sweep"),
    "contact": TypedCommand(
        ContactConfig, "palpate.commands.contact.tool:run_contact", "palpate.commands.contact.tool:contact_result"
    ),
    "compare": TypedCommand(CompareConfig, "palpate.commands.compare:run_compare"),
    "calibrate": CommandGroup(
        {
            "new": TypedCommand(NewSensorConfig, "palpate.commands.calibrate.run:run_calibrate"),
            "matrix": TypedCommand(MatrixConfig, "palpate.commands.calibrate.run:run_calibrate"),
            "payload": TypedCommand(PayloadConfig, "palpate.commands.calibrate.run:run_calibrate"),
            "mounting": TypedCommand(MountingConfig, "palpate.commands.calibrate.run:run_calibrate"),
            "tare": TypedCommand(TareConfig, "palpate.commands.calibrate.run:run_calibrate"),
        },
        CALIBRATION,
    ),
    "log": CommandGroup(
        {
            "info": TypedCommand(LogInfoConfig, "palpate.commands.log.command:run_log_info"),
            "export": TypedCommand(LogExportConfig, "palpate.commands.log.command:run_log_export"),
            "ros2": TypedCommand(LogRos2Config, "palpate.commands.log.command:run_log_ros2"),
        },
        "Logs of runs: what is in them; as tables, and for ROS 2.\n\nExample: palpate log info runs/explore",
    ),
    "replay": TypedCommand(ReplayConfig, "palpate.commands.replay.command:run_replay"),
    "view": TypedCommand(ViewConfig, "palpate.commands.view.command:run_view"),
    "robot": CommandGroup(
        {
            "list": TypedCommand(RobotListConfig, "palpate.commands.robot.tool:run_list"),
            "show": TypedCommand(RobotShowConfig, "palpate.commands.robot.tool:run_show"),
            "check": TypedCommand(RobotCheckConfig, "palpate.commands.robot.tool:run_check"),
        },
        "Robot files: those that come with palpate, and yours.\n\nExample: palpate robot check mine.yaml",
    ),
    "doctor": TypedCommand(DoctorConfig, "palpate.commands.doctor.command:run_doctor"),
    "recover": TypedCommand(RecoverConfig, "palpate.commands.recover.command:run_recover"),
    "emulate": CommandGroup(
        {
            "ur": TypedCommand(EmulateUrConfig, "palpate.commands.emulate.command:run_emulate"),
            "dynamixel": TypedCommand(EmulateDynamixelConfig, "palpate.commands.emulate.command:run_emulate"),
            "netft": TypedCommand(EmulateNetftConfig, "palpate.commands.emulate.command:run_emulate"),
            "robot": TypedCommand(EmulateRobotConfig, "palpate.commands.emulate.command:run_emulate_robot"),
            "fault": TypedCommand(EmulateFaultConfig, "palpate.commands.emulate.command:run_fault"),
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
    """
    experiments: dict[str, Experiment] = {}
    groups: dict[str, dict[str, Experiment]] = {}
    for name in experiment_names():
        with suppress(InvalidValueError):
            *group, word = typed_words(name)
            (groups.setdefault(group[0], {}) if group else experiments)[word] = experiment_named(name)
    return {**experiments, **COMMANDS, **_with_experiments(groups)}


def _with_experiments(groups: Mapping[str, Mapping[str, Experiment]]) -> Mapping[str, CommandGroup]:
    """Return the groups of commands to which experiments belong, with these; no group is called like a command."""
    found: dict[str, CommandGroup] = {}
    for name, experiments in groups.items():
        there = COMMANDS.get(name)
        if there is None:
            found[name] = CommandGroup(experiments, "\n\n".join(each.summary for each in experiments.values()))
        elif isinstance(there, CommandGroup):
            found[name] = CommandGroup({**experiments, **there.commands}, there.about)
    return found


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; returns the exit code, see `palpate.commands.command_result.ExitCode`."""
    arguments = list(sys.argv[1:] if arguments is None else arguments)
    if arguments in (["--version"], ["-V"]):
        sys.stdout.write(f"palpate {__version__}\n")
        return 0
    interruption.forget()
    return _output_format(arguments).carry_out(partial(_run_typed, arguments or ["--help"]))


def _run_typed(arguments: Sequence[str]) -> CommandResult | int:
    commands = typed_commands()
    return _run(commands, "palpate", DESCRIPTION.format(first=next(iter(commands))), arguments)


def _output_format(arguments: Sequence[str]) -> OutputFormat:
    """Return the output format, before the arguments are checked: errors need it, too."""
    if "--json" not in arguments or HELP_WORDS & set(arguments):
        return TextOutput()
    words: list[str] = []
    found: object = typed_commands()
    for word in arguments:
        commands = found.commands if isinstance(found, CommandGroup) else found
        if not isinstance(commands, Mapping) or word not in commands:
            break
        found = commands[word]
        words.append(word)
    return JsonOutput(" ".join(words) or next((word for word in arguments[:1] if ":" in word), ""))


def _run(commands: Typed, typed: str, about: str, arguments: Sequence[str]) -> CommandResult | int:
    word = arguments[0] if arguments else ""
    chosen = commands.get(word)
    if chosen is None and not word.startswith("-") and (":" in word or word in experiment_names()):
        chosen = experiment_named(word)
    if isinstance(chosen, CommandGroup):
        return _run(chosen.commands, f"{typed} {word}", chosen.about, arguments[1:] or ["--help"])
    if isinstance(chosen, TypedCommand):
        return _carry_out(chosen, f"{typed} {word}", arguments[1:])
    if chosen is not None:
        return _carry_out_experiment(chosen, f"{typed} {word}", arguments[1:])
    if word and not word.startswith("-"):
        raise InvalidValueError(_no_command(word, commands, typed))
    with parser_colours(arguments):  # help, or a mistake: show the commands, one line each
        tyro.cli(_subcommands(commands), prog=typed, description=about, args=arguments)
    raise AssertionError(f"{word!r} is no command, and the parser accepted it")


def _no_command(word: str, commands: Typed, typed: str) -> str:
    """Return the message for a word that is no command."""
    flags = ("--help", "--version") if commands is typed_commands() else ("--help",)
    near = nearest(word, (*commands, *flags))
    meant = f"did you mean {typed} {near}? " if near else ""
    if word.endswith(".py") and Path(word).exists():
        return f"{word}: a file is no command; name the experiment's class in it, as {word}:Class"
    above = typed.split()[1:]  # without the program's name, which begins every refusal
    return f"{' '.join((*above, word))}: no such command; {meant}there are {', '.join(commands)}"


def _carry_out(command: TypedCommand, typed: str, arguments: Sequence[str]) -> CommandResult | int:
    config: Any
    config, shared = read_with_shared(command.config, typed, arguments, (JSON,), description=command.about)
    # imported only now: simulation, compiled kernels and drawing take a second that --help need not wait for
    runner = _function(command.document if shared[JSON.name] and command.document else command.runner)
    start_up.over()
    result: CommandResult | int = runner(config)
    return result


def _carry_out_experiment(experiment: Experiment, typed: str, arguments: Sequence[str]) -> CommandResult:
    config, shared = read_experiment(experiment.Config, experiment.name, typed, arguments, EXPERIMENT_OPTIONS)
    if shared.get(DRY_RUN.name):
        from palpate.commands.run import dry_run_experiment

        start_up.over()
        return dry_run_experiment(experiment, config)
    from palpate.commands.run import run_experiment

    start_up.over()
    return run_experiment(experiment, config, shared.get(FIGURES.name))


def run_completion(config: CompletionConfig) -> CommandResult:
    """Print what makes a shell complete these commands."""
    script = completion_script(_subcommands(typed_commands()), config.shell)
    sys.stdout.write(script)
    return CommandResult(facts={"shell": config.shell, "script": script})


def _function(name: str) -> Any:
    module, function = name.split(":")
    return getattr(import_module(module), function)


def _subcommands(commands: Typed) -> Any:
    """Return the union type from which tyro makes subcommands."""
    return Union[  # noqa: UP007
        tuple(
            Annotated[_taken(name, what), tyro.conf.subcommand(name, description=what.summary)]
            for name, what in commands.items()
        )
    ]


def _taken(name: str, what: "TypedCommand | CommandGroup | Experiment") -> Any:
    if isinstance(what, TypedCommand):
        return with_shared(what.config, name, (JSON,))
    if isinstance(what, CommandGroup):
        below: Any = _subcommands(what.commands)
        return make_dataclass(name, [("command", Annotated[below, tyro.conf.OmitSubcommandPrefixes])])
    return with_shared(what.Config, name, EXPERIMENT_OPTIONS, experiment_file=True)
