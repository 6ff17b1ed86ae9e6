"""`palpate explore`: an exploration with its progress, its files and its summary on the terminal."""

from dataclasses import replace

from rich.console import Console

from palpate.commands.answer import Answer, ExitCode, report_answer
from palpate.commands.earlier_run import earlier_told
from palpate.commands.output_folder import make_folder
from palpate.commands.progress import doing, step_progress
from palpate.commands.run_told import kept_if_interrupted, log_writer, run_shown, tell_of, written
from palpate.commands.said import say
from palpate.commands.sweep.explored import figures_of
from palpate.experiments.explore.config import ExploreConfig
from palpate.experiments.explore.dry import FILES
from palpate.experiments.explore.explored_map import STEPS
from palpate.experiments.explore.objects import FROM_FILE
from palpate.experiments.explore.plan import ExplorationPlan, plan
from palpate.experiments.explore.pressing import prepared
from palpate.experiments.explore.report import exploration_report
from palpate.experiments.explore.run import Attempt, write_exploration
from palpate.reporting.terminal import summary_table
from palpate.robots.drivers import check_drivers
from palpate.runtime import Ending


def run_explore(config: ExploreConfig) -> Answer:
    """Explore, record, write the files and print the summary; what was found until a Ctrl-C is written too.

    Returns:
        What was found; it is done if the exploration finished.

    Raises:
        InvalidValueError: The configuration cannot be realised, pressing has found nothing, or the folder cannot
            be written.
        KeyboardInterrupt: While it pressed, before the exploration had begun: there is nothing to write yet; or
            while the report was made.
        OSError: A file cannot be written.
    """
    console = Console()
    with doing(console, "planning"):
        planned = plan(config)
    check_drivers(config.robot)
    make_folder(config.out)
    notes = earlier_told(console, config.out, "explore", FILES)
    if config.identify:
        with doing(console, "pressing, to find stiffness and delay"):
            planned = prepared(planned)
    attempt = Attempt(planned)
    log = log_writer(planned)
    result, interrupted = run_shown(
        console, planned.expected_duration, lambda observer: attempt.run((observer,), (log,))
    )
    with kept_if_interrupted(result):
        with step_progress(console, STEPS) as tell:
            exploration = attempt.found(result, tell)
        with doing(console, "drawing the report"):
            files = write_exploration(exploration, config.out)
    report = exploration_report(exploration)
    console.print(summary_table(report))
    _warn_of_walls(console, planned)
    tell_of(console, result, files)
    code = ExitCode.DONE if result.ending is Ending.DONE else ExitCode.UNFINISHED
    answer = report_answer(
        ExitCode.INTERRUPTED if interrupted else code,
        report.outcome,
        figures_of(exploration),
        report.summary,
        written(result, files),
        ending=result.ending.value,
    )
    return replace(answer, warnings=notes)


def _warn_of_walls(console: Console, planned: ExplorationPlan) -> None:
    """Say that the next object may have a wall, where nobody knows what it is like."""
    config, wall = planned.config, planned.wall
    if config.speed > wall.speed and (config.beyond or config.object in FROM_FILE):
        say(console, f"A wall or step in the way would have been {wall}")
