"""The palpate command."""

import inspect
import sys
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import make_dataclass
from functools import cache, partial
from importlib import import_module
from typing import Annotated, Any, NamedTuple, Union

import tyro

from palpate import interruption
from palpate.commands import start_up
from palpate.commands.calibrate.config import MatrixConfig, NewSensorConfig, PayloadConfig, TareConfig
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
    EmulateUrConfig,
)
from palpate.commands.log.config import LogExportConfig, LogInfoConfig
from palpate.commands.output_format import JsonOutput, OutputFormat, TextOutput
from palpate.commands.replay.config import ReplayConfig
from palpate.commands.robot.config import RobotCheckConfig, RobotListConfig, RobotShowConfig
from palpate.commands.sweep.config import SweepConfig
from palpate.commands.typed_options import Flag, flagged, read_experiment, read_flagged
from palpate.commands.view.config import ViewConfig
from palpate.commands.warm_up.config import WarmUpConfig
from palpate.errors import InvalidValueError
from palpate.experiments.kit.experiment import Experiment
from palpate.experiments.kit.registry import experiment_named, experiment_names
from palpate.nearest_name import nearest
from palpate.version import __version__

DESCRIPTION = (
    "palpate: hybrid force control with the sense of touch.\n\n"
    "Example: palpate {first}; then open the report that it names. `palpate {first} --help` explains every "
    "option.\n\n"
    "Experiments come first below; one of your own is typed as module:Class or file.py:Class. "
    "Every command takes --json; where something moves, --dry-run says what it would do. "
    "Exit code: 0 done; 1 not finished, or something is not as it should be; 2 wrong input, nothing was done; "
    "128 + its number for a signal, as 130 for Ctrl-C. palpate --version says which palpate this is."
)


CALIBRATION = (
    "Find out about a force/torque sensor, and keep it in its sensor file.\n\n"
    "In this order: `new` makes the file; `matrix` finds the calibration matrix from known loads (only for a "
    "sensor that gives raw channels); `payload` finds what it carries; `tare` finds the bias, before every "
    "use.\n\n"
    "Example: palpate calibrate new sensor.yaml --preset nano17"
)
"""What `palpate calibrate` says of itself."""


class TypedCommand(NamedTuple):
    """What people can type.

    Attributes:
        config: Its options, light to import.
        runner: What runs it, as module:function; need not be light.
        summary: One line.
        document: What carries it out for --json, where its runner writes its rows to standard output.
    """

    config: type
    runner: str
    summary: str
    document: str = ""


class CommandGroup(NamedTuple):
    """Commands that belong together: `palpate robot list`.

    Attributes:
        commands: By the word that follows.
        summary: One line.
        about: More of them, for their help; the summary, if not given.
    """

    commands: Mapping[str, TypedCommand]
    summary: str
    about: str = ""


EXPERIMENT_FLAGS = (Flag.DRY_RUN, Flag.JSON)

COMMANDS: Mapping[str, TypedCommand | CommandGroup] = {
    "sweep": TypedCommand(
        SweepConfig,
        "palpate.commands.sweep.command:run_sweep",
        "Do an experiment for every combination of some options, with several seeds; tables and a picture.",
    ),
    "contact": TypedCommand(
        ContactConfig,
        "palpate.commands.contact.tool:run_contact",
        "Turn wrenches, from a file or standard input, into contacts.",
        document="palpate.commands.contact.tool:answer_contact",
    ),
    "compare": TypedCommand(
        CompareConfig,
        "palpate.commands.compare.command:run_compare",
        "Compare a map with a reference mesh, or runs of one experiment side by side.",
    ),
    "calibrate": CommandGroup(
        {
            "new": TypedCommand(
                NewSensorConfig,
                "palpate.commands.calibrate.run:run_calibrate",
                "Make a first sensor file, with comments and units, to start from.",
            ),
            "matrix": TypedCommand(
                MatrixConfig,
                "palpate.commands.calibrate.run:run_calibrate",
                "Find the calibration matrix from known loads.",
            ),
            "payload": TypedCommand(
                PayloadConfig,
                "palpate.commands.calibrate.run:run_calibrate",
                "Find mass, centre of mass and bias from static poses.",
            ),
            "tare": TypedCommand(
                TareConfig,
                "palpate.commands.calibrate.run:run_calibrate",
                "Find the bias from readings at rest: from a CSV file, or live.",
            ),
        },
        "Find out about a force/torque sensor, and keep it in its sensor file.",
        CALIBRATION,
    ),
    "log": CommandGroup(
        {
            "info": TypedCommand(
                LogInfoConfig,
                "palpate.commands.log.command:run_log_info",
                "Tell what is in a log: how long, how regular, what happened, what is missing.",
            ),
            "export": TypedCommand(
                LogExportConfig,
                "palpate.commands.log.command:run_log_export",
                "Write a log as tables, CSV or Parquet.",
            ),
        },
        "Logs of runs: what is in them, and as tables.",
        "Logs of runs: what is in them, and as tables.\n\nExample: palpate log info runs/explore",
    ),
    "replay": TypedCommand(
        ReplayConfig,
        "palpate.commands.replay.command:run_replay",
        "Feed the log of a run through sensing and control again, and compare the commands.",
    ),
    "view": TypedCommand(
        ViewConfig,
        "palpate.commands.view.command:run_view",
        "Watch a run in the browser, live or from its log; or draw it.",
    ),
    "robot": CommandGroup(
        {
            "list": TypedCommand(
                RobotListConfig,
                "palpate.commands.robot.tool:run_list",
                "List the robots that come with palpate.",
            ),
            "show": TypedCommand(
                RobotShowConfig,
                "palpate.commands.robot.tool:run_show",
                "Print a robot file: a start for your own.",
            ),
            "check": TypedCommand(
                RobotCheckConfig,
                "palpate.commands.robot.tool:run_check",
                "Say how palpate understands a robot file, or what is wrong with it.",
            ),
        },
        "Robot files: those that there are, and yours.",
        "Robot files: those that there are, and yours.\n\nExample: palpate robot check mine.yaml",
    ),
    "doctor": TypedCommand(
        DoctorConfig,
        "palpate.commands.doctor.command:run_doctor",
        "Connect to a robot's devices, measure how they are, and say what to fix. Moves nothing.",
    ),
    "emulate": CommandGroup(
        {
            "ur": TypedCommand(
                EmulateUrConfig,
                "palpate.commands.emulate.command:run_emulate",
                "Emulate a controller of Universal Robots, on its ports at an address of this computer.",
            ),
            "dynamixel": TypedCommand(
                EmulateDynamixelConfig,
                "palpate.commands.emulate.command:run_emulate",
                "Emulate a bus of Dynamixel servos on a terminal.",
            ),
            "netft": TypedCommand(
                EmulateNetftConfig,
                "palpate.commands.emulate.command:run_emulate",
                "Emulate an ATI Net F/T box or an OnRobot HEX.",
            ),
            "fault": TypedCommand(
                EmulateFaultConfig,
                "palpate.commands.emulate.command:run_fault",
                "Switch a fault of a device that is being emulated.",
            ),
        },
        "Emulated devices, for palpate or any other software that speaks to the real ones.",
        "Emulated devices, for palpate or any other software that speaks to the real ones.\n\n"
        "Example: palpate emulate ur",
    ),
    "warm-up": TypedCommand(
        WarmUpConfig,
        "palpate.commands.warm_up.command:run_warm_up",
        "Compile once what would otherwise be compiled when it is first needed.",
    ),
    "completion": TypedCommand(
        CompletionConfig,
        "palpate.cli:run_completion",
        "Print a script that makes a shell complete all of this.",
    ),
}


Typed = Mapping[str, "TypedCommand | CommandGroup | Experiment"]
"""What can be typed, by the word that does so."""


@cache
def typed_commands() -> Typed:
    """Return all that can be typed after the program's name: experiments first.

    An experiment that cannot be loaded is left out, so that the others can be used; typing its name says why.
    """
    experiments = {}
    for name in experiment_names():
        with suppress(InvalidValueError):
            experiments[name] = experiment_named(name)
    return {**experiments, **COMMANDS}


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; returns the exit code, see `palpate.commands.command_result.ExitCode`."""
    arguments = list(sys.argv[1:] if arguments is None else arguments)
    if arguments in (["--version"], ["-V"]):
        sys.stdout.write(f"palpate {__version__}\n")
        return 0
    interruption.forget()
    return _manner(arguments).carry_out(partial(_run_typed, arguments or ["--help"]))


def _run_typed(arguments: Sequence[str]) -> CommandResult | int:
    commands = typed_commands()
    return _run(commands, "palpate", DESCRIPTION.format(first=next(iter(commands))), arguments)


def _manner(arguments: Sequence[str]) -> OutputFormat:
    """How to say what there is to say, before anybody has judged what is typed: a refusal has to be said, too."""
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
        about = chosen.about or chosen.summary
        return _run(chosen.commands, f"{typed} {word}", about, arguments[1:] or ["--help"])
    if isinstance(chosen, TypedCommand):
        return _carry_out(chosen, f"{typed} {word}", arguments[1:])
    if chosen is not None:
        return _carry_out_experiment(chosen, f"{typed} {word}", arguments[1:])
    if word and not word.startswith("-"):
        raise InvalidValueError(_no_command(word, commands, typed))
    with parser_colours(arguments):  # help, or a mistake: show the commands, one line each
        tyro.cli(_subcommands(commands), prog=typed, description=about, args=arguments)
    raise AssertionError(f"{word!r} is no command, and nobody has said so")


def _no_command(word: str, commands: Typed, typed: str) -> str:
    """What to say of a word that is no command."""
    flags = ("--help", "--version") if commands is typed_commands() else ("--help",)
    near = nearest(word, (*commands, *flags))
    meant = f"did you mean {typed} {near}? " if near else ""
    above = typed.split()[1:]  # without the program's name, which begins every refusal
    return f"{' '.join((*above, word))}: no such command; {meant}there are {', '.join(commands)}"


def _carry_out(command: TypedCommand, typed: str, arguments: Sequence[str]) -> CommandResult | int:
    about = inspect.getdoc(command.config)
    config: Any
    config, flags = read_flagged(command.config, typed, arguments, (Flag.JSON,), description=about)
    # imported only now: simulation, compiled kernels and drawing take a second that --help need not wait for
    runner = _function(command.document if Flag.JSON in flags and command.document else command.runner)
    start_up.over()
    answer: CommandResult | int = runner(config)
    return answer


def _carry_out_experiment(experiment: Experiment, typed: str, arguments: Sequence[str]) -> CommandResult:
    config, flags = read_experiment(experiment.Config, experiment.name, typed, arguments, EXPERIMENT_FLAGS)
    if Flag.DRY_RUN in flags:
        from palpate.commands.dry_run import dry_run_experiment as carry_out
    else:
        from palpate.commands.run import run_experiment as carry_out
    start_up.over()
    return carry_out(experiment, config)


def run_completion(config: CompletionConfig) -> CommandResult:
    """Print what makes a shell complete these commands."""
    script = completion_script(_subcommands(typed_commands()), config.shell)
    sys.stdout.write(script)
    return CommandResult(facts={"shell": config.shell, "script": script})


def _function(name: str) -> Any:
    module, function = name.split(":")
    return getattr(import_module(module), function)


def _subcommands(commands: Typed) -> Any:
    """The type by which tyro knows commands: a union of what each takes, by its name."""
    return Union[  # noqa: UP007
        tuple(
            Annotated[_taken(name, what), tyro.conf.subcommand(name, description=what.summary)]
            for name, what in commands.items()
        )
    ]


def _taken(name: str, what: "TypedCommand | CommandGroup | Experiment") -> Any:
    if isinstance(what, TypedCommand):
        return flagged(what.config, name, (Flag.JSON,))
    if isinstance(what, CommandGroup):
        below: Any = _subcommands(what.commands)
        return make_dataclass(name, [("command", Annotated[below, tyro.conf.OmitSubcommandPrefixes])])
    return flagged(what.Config, name, EXPERIMENT_FLAGS, experiment_file=True)
