"""What the reader of a report is told to do because of how the run ended."""

from palpate.runtime import Ending, RunResult


def advice_on_ending(result: RunResult) -> tuple[str, ...]:
    """Return what to do after a run that did not get to its end; nothing after one that did."""
    if not result.stopped:
        return ("Switch the robot off: it did not come to rest.",)
    if result.ending is Ending.TRIPPED:
        return (
            "The supervisor stopped it, for the reason above: take that away, or press less hard (--force) and go "
            "slower, and repeat.",
        )
    if result.ending is Ending.DONE:
        return ()
    return ("It did not get to its end: what is shown is what there was until then; repeat it.",)
