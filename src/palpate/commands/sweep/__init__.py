"""Sweeps: an experiment for every combination of some options, with several seeds, on one computer or many.

The options become a plan (`plan`). A runner (`run`, `ray_runner`) carries out its runs, calling the same function
for each (`attempt`). Records are written as runs finish (`store`), and give tables, a figure and a report. A
script calls `sweep`.
"""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:  # --help and every worker import this module
    from palpate.commands.sweep.config import SweepConfig
    from palpate.commands.sweep.result import SweepResult
    from palpate.runtime.batch import ShowProgress

__all__ = ["SweepConfig", "sweep"]


def sweep(config: "SweepConfig", progress: "ShowProgress | None" = None) -> "SweepResult":
    """Carry out the remaining runs, and write tables, figure and report of all.

    Args:
        config: Options of the sweep.
        progress: Called with the progress; a bar on the terminal after two seconds, if not given;
            `palpate.runtime.batch.quiet` for nothing.

    Raises:
        InvalidValueError: If an option is impossible, or if the folder belongs to another sweep; nothing has run.
        BatchError: If no worker lives long enough to do anything; finished runs are kept.
        KeyboardInterrupt: On Ctrl-C; finished runs are kept.
        OSError: If a file cannot be written.
    """
    from palpate.commands.sweep.plan import sweep_plan
    from palpate.commands.sweep.run import SweepAtWork, check, finished
    from palpate.commands.sweep.store import SweepFolder
    from palpate.runtime.batch import batch_bar

    checked = check(sweep_plan(config))
    folder = SweepFolder(checked.plan.folder)
    with folder.alone():
        work = SweepAtWork(checked, folder, finished(checked, folder))
        if progress is None:
            with batch_bar() as show:
                work.carry_out(show)
        else:
            work.carry_out(progress)
        work.write()
    return work.result


def __getattr__(name: str) -> Any:
    if name == "SweepConfig":
        from palpate.commands.sweep.config import SweepConfig

        return SweepConfig
    raise AttributeError(f"module 'palpate.commands.sweep' has no attribute {name!r}")
