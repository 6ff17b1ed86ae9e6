"""The same experiment many times: every combination of some options, with several seeds, on one computer or many.

What is typed becomes a plan (`plan`). A runner (`runner`, `ray_runner`) carries out its runs, calling the same
function for each (`attempt`). They are kept one by one as they finish (`store`), and end as tables, a figure and
a report. A script calls `sweep`.
"""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:  # --help imports this module, and every worker, which has nothing to do with what is typed
    from palpate.commands.sweep.config import SweepConfig
    from palpate.commands.sweep.result import SweepResult
    from palpate.runtime.batch import ShowProgress

__all__ = ["SweepConfig", "sweep"]


def sweep(config: "SweepConfig", progress: "ShowProgress | None" = None) -> "SweepResult":
    """Do the runs that are not done yet, and write tables, figure and report of all of them.

    Args:
        config: What to do.
        progress: Called with the progress; a bar on the terminal after two seconds, if not given;
            `palpate.runtime.batch.quiet` for nothing.

    Raises:
        InvalidValueError: Something typed cannot be, or the folder is another sweep's; nothing has run.
        BatchError: No worker lives long enough to do anything. What is finished is kept.
        KeyboardInterrupt: Ctrl-C. What is finished is kept.
        OSError: A file cannot be written.
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
