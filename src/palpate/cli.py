"""The palpate command."""

import sys
from collections.abc import Sequence

import tyro

from palpate import __version__
from palpate.errors import InvalidValueError, PalpateError
from palpate.experiments.explore_config import ExploreConfig

DESCRIPTION = (
    "palpate: hybrid force control with the sense of touch. "
    "Try `palpate explore`, then open the report it names; `palpate explore --help` explains every option."
)

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
        config = _parse(arguments)
        return _explore(config)
    except InvalidValueError as error:
        sys.stderr.write(f"palpate: {error}\n")
        return MISTAKE
    except PalpateError as error:
        sys.stderr.write(f"palpate: {error}; the robot was stopped\n")
        return UNFINISHED
    except OSError as error:
        sys.stderr.write(f"palpate: cannot write: {error}\n")
        return UNFINISHED
    except KeyboardInterrupt:
        sys.stderr.write("palpate: interrupted; the robot was stopped\n")
        return 130  # 128 + SIGINT, the shell's convention


def _parse(arguments: Sequence[str]) -> ExploreConfig:
    return tyro.extras.subcommand_cli_from_dict(
        {"explore": ExploreConfig}, prog="palpate", description=DESCRIPTION, args=arguments
    )


def _explore(config: ExploreConfig) -> int:
    # imported here: simulation, compiled kernels and drawing take a second that --help need not wait for
    from rich.console import Console

    from palpate.experiments.explore import carry_out, make_folder, write_exploration
    from palpate.experiments.explore_plan import plan
    from palpate.experiments.explore_report import exploration_report
    from palpate.experiments.progress import run_progress
    from palpate.reporting import summary_table
    from palpate.runtime import Ending

    console = Console()
    planned = plan(config)
    make_folder(config.out)
    with run_progress(console, planned.expected_duration) as observer:
        exploration = carry_out(planned, (observer,))
    with console.status("drawing the report"):
        files = write_exploration(exploration, config.out)
    console.print(summary_table(exploration_report(exploration)))
    console.print("Written: " + ", ".join(str(file) for file in files), highlight=False, soft_wrap=True)
    return 0 if exploration.run.ending is Ending.DONE else UNFINISHED
