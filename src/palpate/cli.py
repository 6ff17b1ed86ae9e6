"""The palpate command."""

import inspect
import os
import sys
from collections.abc import Mapping, Sequence
from dataclasses import make_dataclass
from importlib import import_module
from typing import Annotated, Any, NamedTuple, Union

import tyro

from palpate import __version__
from palpate.errors import InvalidValueError, PalpateError
from palpate.experiments import start_up
from palpate.experiments.calibrate_config import MatrixConfig, NewSensorConfig, PayloadConfig, TareConfig
from palpate.experiments.compare_config import CompareConfig
from palpate.experiments.contact_config import ContactConfig
from palpate.experiments.doctor_config import DoctorConfig
from palpate.experiments.emulate_config import (
    EmulateDynamixelConfig,
    EmulateFaultConfig,
    EmulateNetftConfig,
    EmulateUrConfig,
)
from palpate.experiments.explore_config import ExploreConfig
from palpate.experiments.explore_options import ExploreOptions
from palpate.experiments.friction_config import FrictionConfig
from palpate.experiments.friction_options import FrictionOptions
from palpate.experiments.grasp_config import GraspConfig
from palpate.experiments.grasp_options import GraspOptions
from palpate.experiments.log_config import LogExportConfig, LogInfoConfig
from palpate.experiments.regulate_config import RegulateConfig
from palpate.experiments.regulate_options import RegulateOptions
from palpate.experiments.replay_config import ReplayConfig
from palpate.experiments.robot_config import RobotCheckConfig, RobotListConfig, RobotShowConfig
from palpate.experiments.typed_options import read_typed
from palpate.experiments.view_config import ViewConfig

DESCRIPTION = (
    "palpate: hybrid force control with the sense of touch. "
    "Try `palpate explore`, then open the report it names; `palpate explore --help` explains every option."
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
    """

    config: type
    runner: str
    summary: str
    defaults: str = ""
    about: type | None = None


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
        "palpate.experiments.explore_command:run_explore",
        "Explore the surface of a simulated object by touch, and draw it.",
        "palpate.experiments.explore_options:default_options",
        ExploreConfig,
    ),
    "regulate": Command(
        RegulateOptions,
        "palpate.experiments.regulate_command:run_regulate",
        "Hold a force on a simulated surface that stands, moves or yields, and show how well.",
        "palpate.experiments.regulate_options:default_options",
        RegulateConfig,
    ),
    "friction": Command(
        FrictionOptions,
        "palpate.experiments.friction_command:run_friction",
        "Rub a simulated surface: its friction, how it bears torque, with intervals.",
        "palpate.experiments.friction_options:default_options",
        FrictionConfig,
    ),
    "grasp": Command(
        GraspOptions,
        "palpate.experiments.grasp_command:run_grasp",
        "Hold an object that is pulled at so that it neither slips nor spins, and show what grip it took.",
        "palpate.experiments.grasp_options:default_options",
        GraspConfig,
    ),
    "contact": Command(
        ContactConfig,
        "palpate.experiments.contact_tool:run_contact",
        "Turn wrenches, from a file or standard input, into contacts.",
    ),
    "compare": Command(
        CompareConfig,
        "palpate.experiments.compare_command:run_compare",
        "Compare a map with a reference mesh: errors, coverage, normals.",
    ),
    "calibrate": Group(
        {
            "new": Command(
                NewSensorConfig,
                "palpate.experiments.calibrate:run_calibrate",
                "Make a first sensor file, with comments and units, to start from.",
            ),
            "matrix": Command(
                MatrixConfig,
                "palpate.experiments.calibrate:run_calibrate",
                "Find the calibration matrix from known loads.",
            ),
            "payload": Command(
                PayloadConfig,
                "palpate.experiments.calibrate:run_calibrate",
                "Find mass, centre of mass and bias from static poses.",
            ),
            "tare": Command(
                TareConfig,
                "palpate.experiments.calibrate:run_calibrate",
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
                "palpate.experiments.log_command:run_log_info",
                "Tell what is in a log: how long, how regular, what happened, what is missing.",
            ),
            "export": Command(
                LogExportConfig,
                "palpate.experiments.log_command:run_log_export",
                "Write a log as tables, CSV or Parquet.",
            ),
        },
        "Logs of runs: what is in them, and as tables.",
    ),
    "replay": Command(
        ReplayConfig,
        "palpate.experiments.replay_command:run_replay",
        "Feed the log of a run through sensing and control again, and compare the commands.",
    ),
    "view": Command(
        ViewConfig,
        "palpate.experiments.view_command:run_view",
        "Watch a run in the browser, live or from its log; or draw it.",
    ),
    "robot": Group(
        {
            "list": Command(
                RobotListConfig,
                "palpate.experiments.robot_tool:run_list",
                "List the robots that come with palpate.",
            ),
            "show": Command(
                RobotShowConfig,
                "palpate.experiments.robot_tool:run_show",
                "Print a robot file: a start for your own.",
            ),
            "check": Command(
                RobotCheckConfig,
                "palpate.experiments.robot_tool:run_check",
                "Say how palpate understands a robot file, or what is wrong with it.",
            ),
        },
        "Robot files: those that there are, and yours.",
    ),
    "doctor": Command(
        DoctorConfig,
        "palpate.experiments.doctor_command:run_doctor",
        "Connect to a robot's devices, measure how they are, and say what to fix. Moves nothing.",
    ),
    "emulate": Group(
        {
            "ur": Command(
                EmulateUrConfig,
                "palpate.experiments.emulate_command:run_emulate",
                "Emulate a controller of Universal Robots, on its ports at an address of this computer.",
            ),
            "dynamixel": Command(
                EmulateDynamixelConfig,
                "palpate.experiments.emulate_command:run_emulate",
                "Emulate a bus of Dynamixel servos on a terminal.",
            ),
            "netft": Command(
                EmulateNetftConfig,
                "palpate.experiments.emulate_command:run_emulate",
                "Emulate an ATI Net F/T box or an OnRobot HEX.",
            ),
            "fault": Command(
                EmulateFaultConfig,
                "palpate.experiments.emulate_command:run_fault",
                "Switch a fault of a device that is being emulated.",
            ),
        },
        "Emulated devices, for palpate or any other software that speaks to the real ones.",
    ),
}

MISTAKE = 2
"""Exit code for wrong input."""

UNFINISHED = 1
"""Exit code for an experiment that did not finish."""

INTERRUPTED = start_up.INTERRUPTED
"""Exit code after Ctrl-C."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; returns the exit code: 0 done, 1 not finished, 2 wrong input, 130 interrupted."""
    arguments = list(sys.argv[1:] if arguments is None else arguments)
    if arguments in (["--version"], ["-V"]):
        sys.stdout.write(f"palpate {__version__}\n")
        return 0
    try:
        return _run(COMMANDS, "palpate", DESCRIPTION, arguments or ["--help"])
    except InvalidValueError as error:
        _say(str(error))
        return MISTAKE
    except PalpateError as error:
        _say(f"{error}; the robot was stopped")
        return UNFINISHED
    except BrokenPipeError:
        # whoever read the output has had enough; nothing more to say, at exit neither
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except OSError as error:
        _say(str(error))
        return UNFINISHED
    except KeyboardInterrupt as error:
        # a run that is interrupted says that the robot was stopped; without a run, none moved
        _say(str(error) or "interrupted")
        return INTERRUPTED


def _run(commands: Mapping[str, Command | Group], typed: str, about: str, arguments: Sequence[str]) -> int:
    chosen = commands.get(arguments[0]) if arguments else None
    if isinstance(chosen, Group):
        about = chosen.about or chosen.summary
        return _run(chosen.commands, f"{typed} {arguments[0]}", about, arguments[1:] or ["--help"])
    if isinstance(chosen, Command):
        return _carry_out(chosen, f"{typed} {arguments[0]}", arguments[1:])
    # help, or a mistake: show the commands, one line each
    listed = tuple(
        Annotated[_shown_type(name, command), tyro.conf.subcommand(name, description=command.summary)]
        for name, command in commands.items()
    )
    tyro.cli(Union[listed], prog=typed, description=about, args=arguments)  # type: ignore[call-overload]  # noqa: UP007
    raise AssertionError(f"{arguments[0]!r} is no command, and nobody has said so")


def _carry_out(command: Command, typed: str, arguments: Sequence[str]) -> int:
    options: dict[str, Any] = {"description": inspect.getdoc(command.about or command.config)}
    if command.defaults:
        options["default"] = _function(command.defaults)(arguments)
    config: Any = read_typed(command.config, typed, arguments, **options)
    # imported only now: simulation, compiled kernels and drawing take a second that --help need not wait for
    runner = _function(command.runner)
    start_up.over()
    return int(runner(config.settled if command.defaults else config))


def _function(name: str) -> Any:
    module, function = name.split(":")
    return getattr(import_module(module), function)


def _shown_type(name: str, command: Command | Group) -> type:
    """A type to list a command by; of a group, only its name and summary matter."""
    return command.config if isinstance(command, Command) else make_dataclass(name, ())


def _say(message: str) -> None:
    sys.stderr.write(f"palpate: {' '.join(message.split())}\n")
