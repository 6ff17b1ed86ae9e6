"""A replay study: one recorded run, many questions.

A log keeps every sample as the sensors gave it. A replay feeds it through sensing, control and supervision
again: with nothing changed the commands come out the same bit for bit; with something changed one sees what
would have been commanded. The script records one exploration, then replays it with other set forces, and with
a fingertip that is taken for larger than it is. Another force shifts the centroids, too: the fingertip is taken
as compressed by the set force.

    python examples/replay_study.py

It prints a table: how far, RMS, the commanded velocity and the contact centroid are from those of the run.
The samples stay as they were: a replay answers what a change does to one step, not where it would have led.
"""

from pathlib import Path

import numpy as np
import tyro

from palpate.commands.replay.run import replay_log
from palpate.experiments.explore.config import ExploreConfig
from palpate.experiments.explore.experiment import Explore
from palpate.experiments.kit.recorded_run import carry_out
from palpate.experiments.kit.recording import log_writer
from palpate.robots.values import load_named_robot

STUDY = (
    {},  # nothing changed
    {"force": 1.5},  # [N]; 2 in the run
    {"force": 3.0},
    {"tip": (0.0084,)},  # radius [m]; 0.008 in the run
    {"tip": (0.0088,)},
)


def record(folder: Path) -> None:
    """Explore a sphere, and leave the log in a folder."""
    experiment = Explore()
    config = ExploreConfig(robot="stage-nano17", speed=0.05, width=0.01, depth=0.004)
    plan = experiment.plan(config, load_named_robot(config.robot), {})
    print(carry_out(plan, sinks=(log_writer(experiment, plan, folder),)).run)


def main(out: Path = Path("runs/example-replay")) -> None:
    """Record a run in a folder, and replay it."""
    record(out)
    print(f"{'changed':<20}{'the same':>10}{'velocity mm/s':>15}{'centroid mm':>13}")
    for settings in STUDY:
        replayed = replay_log(out, settings)
        before, after = replayed.records()
        touching = before.touching & after.touching
        velocity = replayed.velocity_difference[touching]
        centroid = (after.centroid - before.centroid)[touching]
        rms = [1e3 * np.sqrt(np.mean(np.sum(off**2, axis=1))) for off in (velocity, centroid)]
        name = ", ".join(f"{name} {value}" for name, value in settings.items()) or "nothing"
        print(f"{name:<20}{'yes' if replayed.identical else 'no':>10}{rms[0]:>15.3f}{rms[1]:>13.4f}")


if __name__ == "__main__":
    tyro.cli(main)
