"""The palpate command."""

import inspect
import sys
from collections.abc import Mapping, Sequence
from dataclasses import make_dataclass
from functools import partial
from importlib import import_module
from typing import Annotated, Any, NamedTuple, Union

import tyro

from palpate import __version__
from palpate.commands import start_up
from palpate.commands.answer import Answer
from palpate.commands.calibrate.config import MatrixConfig, NewSensorConfig, PayloadConfig, TareConfig
from palpate.commands.colours import HELP_WORDS, parser_colours
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
from palpate.commands.manner import JsonDocument, Manner, Words
from palpate.commands.replay.config import ReplayConfig
from palpate.commands.robot.config import RobotCheckConfig, RobotListConfig, RobotShowConfig
from palpate.commands.sweep.config import SweepConfig
from palpate.commands.typed_options import Flag, flagged, read_flagged
from palpate.commands.view.config import ViewConfig
from palpate.commands.warm_up.config import WarmUpConfig
from palpate.errors import InvalidValueError
from palpate.experiments.explore.config import ExploreConfig
from palpate.experiments.explore.options import ExploreOptions
from palpate.experiments.friction.config import FrictionConfig
from palpate.experiments.friction.options import FrictionOptions
from palpate.experiments.grasp.config import GraspConfig
from palpate.experiments.grasp.options import GraspOptions
from palpate.experiments.regulate.config import RegulateConfig
from palpate.experiments.regulate.options import RegulateOptions
from palpate.nearest_name import nearest

DESCRIPTION = (
    "palpate: hybrid force control with the sense of touch. "
    "Try `palpate explore`, then open the report it names; `palpate explore --help` explains every option.\n\n"
    "Every command takes --json; where something moves, --dry-run says what it would do. "
    "Exit code: 0 done; 1 not finished, or something is not as it should be; 2 wrong input, nothing was done; "
    "130 interrupted by Ctrl-C. palpate --version says which palpate this is.\n\n"
    "Example: palpate explore --object ellipsoid --force 2 --out runs/first"
)


CALIBRATION = (
    "Find out about a force/torque sensor, and keep it in its sensor file.\n\n"
    "In this order: `new` makes the file; `matrix` finds the calibration matrix from known loads (only for a "
    "sensor that gives raw channels); `payload` finds what it carries; `tare` finds the bias, before every "
    "use.\n\n"
    "Example: palpate calibrate new sensor.yaml --preset nano17"
)
"""What `palpate calibrate` says of itself."""


class Command(NamedTuple):
    """What people can type.

    Attributes:
        config: Its options, light to import.
        runner: What runs it, as module:function; need not be light.
        summary: One line.
        defaults: What finds out its defaults from the files that are named, as module:function of the arguments;
            empty if its defaults are fixed. Its result has `settled`, which is what the runner gets.
        about: Whose docstring explains it; its options' own, if not given.
        dry: What says for --dry-run what it would do, as module:function; empty if nothing moves.
        document: What carries it out for --json, where its runner writes its rows to standard output.
    """

    config: type
    runner: str
    summary: str
    defaults: str = ""
    about: type | None = None
    dry: str = ""
    document: str = ""


class Group(NamedTuple):
    """Commands that belong together: `palpate robot list`.

    Attributes:
        commands: By the word that follows.
        summary: One line.
        about: More of them, for their help; the summary, if not given.
    """

    commands: Mapping[str, Command]
    summary: str
    about: str = ""


COMMANDS: Mapping[str, Command | Group] = {
    "explore": Command(
        ExploreOptions,
        "palpate.experiments.explore.command:run_explore",
        "Explore the surface of a simulated object by touch, and draw it.",
        "palpate.experiments.explore.options:default_options",
        ExploreConfig,
        dry="palpate.experiments.explore.dry:foretell_explore",
    ),
    "regulate": Command(
        RegulateOptions,
        "palpate.experiments.regulate.command:run_regulate",
        "Hold a force on a simulated surface that stands, moves or yields, and show how well.",
        "palpate.experiments.regulate.options:default_options",
        RegulateConfig,
        dry="palpate.experiments.regulate.dry:foretell_regulate",
    ),
    "friction": Command(
        FrictionOptions,
        "palpate.experiments.friction.command:run_friction",
        "Rub a simulated surface: its friction, how it bears torque, with intervals.",
        "palpate.experiments.friction.options:default_options",
        FrictionConfig,
        dry="palpate.experiments.friction.dry:foretell_friction",
    ),
    "grasp": Command(
        GraspOptions,
        "palpate.experiments.grasp.command:run_grasp",
        "Hold an object that is pulled at so that it neither slips nor spins, and show what grip it took.",
        "palpate.experiments.grasp.options:default_options",
        GraspConfig,
        dry="palpate.experiments.grasp.dry:foretell_grasp",
    ),
    "sweep": Command(
        SweepConfig,
        "palpate.commands.sweep.command:run_sweep",
        "Do an experiment for every combination of some options, with several seeds; tables and a picture.",
    ),
    "contact": Command(
        ContactConfig,
        "palpate.commands.contact.tool:run_contact",
        "Turn wrenches, from a file or standard input, into contacts.",
        document="palpate.commands.contact.tool:answer_contact",
    ),
    "compare": Command(
        CompareConfig,
        "palpate.commands.compare.command:run_compare",
        "Compare a map with a reference mesh, or runs of one experiment side by side.",
    ),
    "calibrate": Group(
        {
            "new": Command(
                NewSensorConfig,
                "palpate.commands.calibrate.run:run_calibrate",
                "Make a first sensor file, with comments and units, to start from.",
            ),
            "matrix": Command(
                MatrixConfig,
                "palpate.commands.calibrate.run:run_calibrate",
                "Find the calibration matrix from known loads.",
            ),
            "payload": Command(
                PayloadConfig,
                "palpate.commands.calibrate.run:run_calibrate",
                "Find mass, centre of mass and bias from static poses.",
            ),
            "tare": Command(
                TareConfig,
                "palpate.commands.calibrate.run:run_calibrate",
                "Find the bias from readings at rest: from a CSV file, or live.",
            ),
        },
        "Find out about a force/torque sensor, and keep it in its sensor file.",
        CALIBRATION,
    ),
    "log": Group(
        {
            "info": Command(
                LogInfoConfig,
                "palpate.commands.log.command:run_log_info",
                "Tell what is in a log: how long, how regular, what happened, what is missing.",
            ),
            "export": Command(
                LogExportConfig,
                "palpate.commands.log.command:run_log_export",
                "Write a log as tables, CSV or Parquet.",
            ),
        },
        "Logs of runs: what is in them, and as tables.",
        "Logs of runs: what is in them, and as tables.\n\nExample: palpate log info runs/explore",
    ),
    "replay": Command(
        ReplayConfig,
        "palpate.commands.replay.command:run_replay",
        "Feed the log of a run through sensing and control again, and compare the commands.",
    ),
    "view": Command(
        ViewConfig,
        "palpate.commands.view.command:run_view",
        "Watch a run in the browser, live or from its log; or draw it.",
    ),
    "robot": Group(
        {
            "list": Command(
                RobotListConfig,
                "palpate.commands.robot.tool:run_list",
                "List the robots that come with palpate.",
            ),
            "show": Command(
                RobotShowConfig,
                "palpate.commands.robot.tool:run_show",
                "Print a robot file: a start for your own.",
            ),
            "check": Command(
                RobotCheckConfig,
                "palpate.commands.robot.tool:run_check",
                "Say how palpate understands a robot file, or what is wrong with it.",
            ),
        },
        "Robot files: those that there are, and yours.",
        "Robot files: those that there are, and yours.\n\nExample: palpate robot check mine.yaml",
    ),
    "doctor": Command(
        DoctorConfig,
        "palpate.commands.doctor.command:run_doctor",
        "Connect to a robot's devices, measure how they are, and say what to fix. Moves nothing.",
    ),
    "emulate": Group(
        {
            "ur": Command(
                EmulateUrConfig,
                "palpate.commands.emulate.command:run_emulate",
                "Emulate a controller of Universal Robots, on its ports at an address of this computer.",
            ),
            "dynamixel": Command(
                EmulateDynamixelConfig,
                "palpate.commands.emulate.command:run_emulate",
                "Emulate a bus of Dynamixel servos on a terminal.",
            ),
            "netft": Command(
                EmulateNetftConfig,
                "palpate.commands.emulate.command:run_emulate",
                "Emulate an ATI Net F/T box or an OnRobot HEX.",
            ),
            "fault": Command(
                EmulateFaultConfig,
                "palpate.commands.emulate.command:run_fault",
                "Switch a fault of a device that is being emulated.",
            ),
        },
        "Emulated devices, for palpate or any other software that speaks to the real ones.",
        "Emulated devices, for palpate or any other software that speaks to the real ones.\n\n"
        "Example: palpate emulate ur",
    ),
    "warm-up": Command(
        WarmUpConfig,
        "palpate.commands.warm_up.command:run_warm_up",
        "Compile once what would otherwise be compiled when it is first needed.",
    ),
    "completion": Command(
        CompletionConfig,
        "palpate.cli:run_completion",
        "Print a script that makes a shell complete all of this.",
    ),
}


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; returns the exit code, see `palpate.commands.answer.ExitCode`."""
    arguments = list(sys.argv[1:] if arguments is None else arguments)
    if arguments in (["--version"], ["-V"]):
        sys.stdout.write(f"palpate {__version__}\n")
        return 0
    return _manner(arguments).carry_out(partial(_run, COMMANDS, "palpate", DESCRIPTION, arguments or ["--help"]))


def _manner(arguments: Sequence[str]) -> Manner:
    """How to say what there is to say, before anybody has judged what is typed: a refusal has to be said, too."""
    if "--json" not in arguments or HELP_WORDS & set(arguments):
        return Words()
    words: list[str] = []
    found: Mapping[str, Command | Group] | Command | Group | None = COMMANDS
    for word in arguments:
        commands = found.commands if isinstance(found, Group) else found
        if not isinstance(commands, Mapping) or word not in commands:
            break
        found = commands[word]
        words.append(word)
    return JsonDocument(" ".join(words))


def _run(
    commands: Mapping[str, Command | Group], typed: str, about: str, arguments: Sequence[str]
) -> Answer | int:
    chosen = commands.get(arguments[0]) if arguments else None
    if isinstance(chosen, Group):
        about = chosen.about or chosen.summary
        return _run(chosen.commands, f"{typed} {arguments[0]}", about, arguments[1:] or ["--help"])
    if isinstance(chosen, Command):
        return _carry_out(chosen, f"{typed} {arguments[0]}", arguments[1:])
    if arguments and not arguments[0].startswith("-"):
        raise InvalidValueError(_no_command(arguments[0], commands, typed))
    with parser_colours(arguments):  # help, or a mistake: show the commands, one line each
        tyro.cli(_subcommands(commands), prog=typed, description=about, args=arguments)
    raise AssertionError(f"{arguments[0]!r} is no command, and nobody has said so")


def _no_command(word: str, commands: Mapping[str, Command | Group], typed: str) -> str:
    """What to say of a word that is no command."""
    flags = ("--help", "--version") if commands is COMMANDS else ("--help",)
    near = nearest(word, (*commands, *flags))
    meant = f"did you mean {typed} {near}? " if near else ""
    above = typed.split()[1:]  # without the program's name, which begins every refusal
    return f"{' '.join((*above, word))}: no such command; {meant}there are {', '.join(commands)}"


def _carry_out(command: Command, typed: str, arguments: Sequence[str]) -> Answer | int:
    options: dict[str, Any] = {"description": inspect.getdoc(command.about or command.config)}
    if command.defaults:
        options["default"] = _function(command.defaults)(arguments)
    config: Any
    config, flags = read_flagged(command.config, typed, arguments, _flags(command), **options)
    # imported only now: simulation, compiled kernels and drawing take a second that --help need not wait for
    name = command.runner
    if Flag.DRY_RUN in flags:
        name = command.dry
    elif Flag.JSON in flags and command.document:
        name = command.document
    runner = _function(name)
    start_up.over()
    answer: Answer | int = runner(config.settled if command.defaults else config)
    return answer


def run_completion(config: CompletionConfig) -> Answer:
    """Print what makes a shell complete these commands."""
    script = completion_script(_subcommands(COMMANDS), config.shell)
    sys.stdout.write(script)
    return Answer(facts={"shell": config.shell, "script": script})


def _flags(command: Command) -> tuple[Flag, ...]:
    return (Flag.DRY_RUN, Flag.JSON) if command.dry else (Flag.JSON,)


def _function(name: str) -> Any:
    module, function = name.split(":")
    return getattr(import_module(module), function)


def _subcommands(commands: Mapping[str, Command | Group]) -> Any:
    """The type by which tyro knows commands: a union of what each takes, by its name."""
    return Union[  # noqa: UP007
        tuple(
            Annotated[_taken(name, what), tyro.conf.subcommand(name, description=what.summary)]
            for name, what in commands.items()
        )
    ]


def _taken(name: str, what: Command | Group) -> Any:
    if isinstance(what, Command):
        return flagged(what.config, name, _flags(what))
    return make_dataclass(
        name, [("command", Annotated[_subcommands(what.commands), tyro.conf.OmitSubcommandPrefixes])]
    )
