"""Advice to the reader of a report that follows from how the run ended."""

from palpate.runtime import Ending, RunResult


def advice_on_ending(result: RunResult) -> tuple[str, ...]:
    """Return what to do after a run that did not get to its end; nothing after one that did."""
    if not result.stopped:
        return ("Switch the robot off: it did not come to rest.",)
    if result.ending is Ending.TRIPPED:
        return (
            "The supervisor stopped it for the reason above: remove that, or reduce force (--force) and speed, "
            "and repeat.",
        )
    if result.ending is Ending.DONE:
        return ()
    return ("The run did not finish: the results cover the time until then; repeat it.",)
