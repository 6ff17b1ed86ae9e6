"""The palpate command."""

import os
import sys
from collections.abc import Sequence
from importlib import import_module
from typing import Annotated, NamedTuple, Union

import tyro

from palpate import __version__
from palpate.errors import InvalidValueError, PalpateError
from palpate.experiments.calibrate_config import CalibrateConfig
from palpate.experiments.contact_config import ContactConfig
from palpate.experiments.explore_config import ExploreConfig

DESCRIPTION = (
    "palpate: hybrid force control with the sense of touch. "
    "Try `palpate explore`, then open the report it names; `palpate explore --help` explains every option."
)


class Command(NamedTuple):
    """What people can type.

    Attributes:
        config: Its options, light to import.
        runner: What runs it, as module:function; need not be light.
        summary: One line.
    """

    config: type
    runner: str
    summary: str


COMMANDS = {
    "explore": Command(
        ExploreConfig,
        "palpate.experiments.explore_command:run_explore",
        "Explore the surface of a simulated object by touch, and draw it.",
    ),
    "contact": Command(
        ContactConfig,
        "palpate.experiments.contact_tool:run_contact",
        "Turn wrenches, from a file or standard input, into contacts.",
    ),
    "calibrate": Command(
        CalibrateConfig,
        "palpate.experiments.calibrate:run_calibrate",
        "Find out about a force/torque sensor, and keep it in its sensor file.",
    ),
}

MISTAKE = 2
"""Exit code for wrong input."""

UNFINISHED = 1
"""Exit code for an experiment that did not finish."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; returns the exit code: 0 done, 1 not finished, 2 wrong input."""
    arguments = list(sys.argv[1:] if arguments is None else arguments)
    if not arguments:
        arguments = ["--help"]
    if arguments in (["--version"], ["-V"]):
        sys.stdout.write(f"palpate {__version__}\n")
        return 0
    try:
        return _run(_parse(arguments))
    except InvalidValueError as error:
        sys.stderr.write(f"palpate: {error}\n")
        return MISTAKE
    except PalpateError as error:
        sys.stderr.write(f"palpate: {error}; the robot was stopped\n")
        return UNFINISHED
    except BrokenPipeError:
        # whoever read the output has had enough; nothing more to say, at exit neither
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except OSError as error:
        sys.stderr.write(f"palpate: {error}\n")
        return UNFINISHED
    except KeyboardInterrupt:
        sys.stderr.write("palpate: interrupted; the robot was stopped\n")
        return 130  # 128 + SIGINT, the shell's convention


def _parse(arguments: Sequence[str]) -> object:
    first = arguments[0]
    if first in COMMANDS:
        return tyro.cli(COMMANDS[first].config, prog=f"palpate {first}", args=arguments[1:])
    # help, or a mistake: show the commands, one line each
    listed = tuple(
        Annotated[command.config, tyro.conf.subcommand(name, description=command.summary)]
        for name, command in COMMANDS.items()
    )
    return tyro.cli(Union[listed], prog="palpate", description=DESCRIPTION, args=arguments)  # type: ignore[call-overload]  # noqa: UP007


def _run(config: object) -> int:
    # imported only now: simulation, compiled kernels and drawing take a second that --help need not wait for
    for command in COMMANDS.values():
        if isinstance(config, command.config):
            module, function = command.runner.split(":")
            return int(getattr(import_module(module), function)(config))
    raise AssertionError(f"no command takes {config!r}")
