"""`palpate explore`: an exploration with its progress, its files and its summary on the terminal."""

from rich.console import Console

from palpate.experiments.explore import carry_out, make_folder, write_exploration
from palpate.experiments.explore_config import ExploreConfig
from palpate.experiments.explore_plan import plan
from palpate.experiments.explore_report import exploration_report
from palpate.experiments.progress import run_progress
from palpate.reporting import summary_table
from palpate.runtime import Ending


def run_explore(config: ExploreConfig) -> int:
    """Explore, write the files and print the summary.

    Returns:
        0 if the exploration finished, else 1.

    Raises:
        InvalidValueError: The configuration cannot be realised, or its folder not be written.
        OSError: A file cannot be written.
    """
    console = Console()
    planned = plan(config)
    make_folder(config.out)
    with run_progress(console, planned.expected_duration) as observer:
        exploration = carry_out(planned, (observer,))
    with console.status("drawing the report"):
        files = write_exploration(exploration, config.out)
    console.print(summary_table(exploration_report(exploration)))
    console.print("Written: " + ", ".join(str(file) for file in files), highlight=False, soft_wrap=True)
    return 0 if exploration.run.ending is Ending.DONE else 1
