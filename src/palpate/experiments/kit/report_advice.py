"""What the reader of a report is told to do: from how the run ended, and from its figures."""

import math
import shlex

from palpate.commands.replay.run import ReplayedLog
from palpate.experiments.explore.run import Exploration
from palpate.experiments.friction.run import FILE_NAME, RubbingRun
from palpate.experiments.regulate.run import Regulation
from palpate.reporting.story import NOTHING
from palpate.runtime import Ending, RunResult

WELL_OBSERVED = 0.95
"""Share of what can be felt from which on a map counts as whole."""

LEAST_GAIN_MARGIN = 2.0
"""Below it a loop is nearer to swinging than is usual (6 dB)."""

WIDE = 0.2
"""An interval whose half is more than this share of its value is worth another measurement."""


def advice_on_exploration(exploration: Exploration) -> tuple[str, ...]:
    """Return what to do after an exploration."""
    said = list(_of_ending(exploration.run))
    found = exploration.map
    if not len(exploration.cloud):
        said.append(
            "Nothing was felt: check where the object is, and --center, --width and --depth; --dry-run says "
            "where the tip would go."
        )
    elif found is None or not found.claimed.any():
        said.append(
            "No surface is claimed, for contacts are too far apart or on one line: rows that lie closer "
            "(--spacing) make a map."
        )
    else:
        if found.truth_known and found.observed_share < WELL_OBSERVED:
            said.append(
                f"Of what could be felt {100.0 * found.observed_share:.0f} % were observed: closer rows "
                "(--spacing) or --strategy active find more."
            )
        said.append(
            "To compare the map with a model of the object: palpate compare "
            f"{shlex.quote(str(exploration.asked.out / 'contacts.ply'))} part.stl, both in metres."
        )
    return tuple(said)


def advice_on_regulation(regulation: Regulation) -> tuple[str, ...]:
    """Return what to do after a regulation of force."""
    said, config = list(_of_ending(regulation.run)), regulation.planned.config
    if regulation.guard_trips and not config.identify:
        said.append(
            "Force control swung: repeat with --identify, which measures stiffness and delay of this contact."
        )
    margin = regulation.planned.parameters.gain.gain_margin
    if math.isfinite(margin) and margin < LEAST_GAIN_MARGIN:
        said.append(f"The gain margin of {margin:.2g} is small: a stiffer --assumed-stiffness lowers the gain.")
    if regulation.peak > regulation.planned.limits.force:
        said.append("The force went beyond its limit: land more slowly (--landing-speed), or press with less.")
    return tuple(said)


def advice_on_friction(rubbing: RubbingRun) -> tuple[str, ...]:
    """Return what to do after a surface was rubbed."""
    said, file = list(_of_ending(rubbing.run)), rubbing.file
    if file is None:
        said.append("Nothing was rubbed: check where the surface is, and repeat.")
    else:
        found = file.friction
        if math.isfinite(found.upper) and found.upper - found.lower > 2.0 * WIDE * found.value:
            said.append("The interval of mu is wide: --repeats 3, or larger --loads, narrow it.")
        elif not math.isfinite(found.upper):
            said.append("It never slipped for long enough: longer strokes (--most-travel) or less load tell mu.")
        said.append(f"To hold an object by what was found: palpate grasp --friction-file {FILE_NAME}.")
    return tuple(said)


def advice_on_replay(done: ReplayedLog) -> tuple[str, ...]:
    """Return what to do after a replay."""
    if not done.should_be_identical:
        return ("To see what the change does to a run, do the run again with it: samples here stay as they were.",)
    if done.identical:
        return (f"{NOTHING} Sensing and control do what they did.",)
    return (
        "It should have been identical: look at the first difference above, and whether another version of "
        "palpate, numpy or MuJoCo recorded it (palpate log info).",
    )


def _of_ending(result: RunResult) -> tuple[str, ...]:
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
