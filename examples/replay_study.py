"""A replay study: one recorded run, many questions.

A log keeps every sample as the sensors gave it. A replay feeds it through sensing, control and supervision
again: with nothing changed the commands come out the same bit for bit; with something changed one sees what
would have been commanded. The script records one exploration, then replays it with other set forces, and with
a fingertip that is taken for larger than it is. Another force shifts the centroids, too: the fingertip is taken
as compressed by the set force.

    python examples/replay_study.py

It prints a table: how far, RMS, the commanded velocity and the contact centroid are from those of the run.
The samples stay as they were: a replay shows what a change does to each step, not where it would have led.
"""

from pathlib import Path

import numpy as np
import tyro

import palpate as pp

STUDY = (
    {},  # nothing changed
    {"force": 1.5},  # [N]; 2 in the run
    {"force": 3.0},
    {"tip": (0.0084,)},  # radius [m]; 0.008 in the run
    {"tip": (0.0088,)},
)


def main(out: Path = Path("runs/example-replay")) -> None:
    """Explore a sphere, and replay the log."""
    config = pp.ExploreConfig(robot="stage-nano17", speed=0.05, width=0.01, depth=0.004)
    print(pp.explore(config, out).run)
    print(f"{'changed':<20}{'the same':>10}{'velocity mm/s':>15}{'centroid mm':>13}")
    for settings in STUDY:
        replayed = pp.replay_log(out, settings)
        before, after = replayed.records()
        touching = before.touching & after.touching
        velocity = replayed.velocity_difference[touching]
        centroid = (after.centroid - before.centroid)[touching]
        rms = [1e3 * np.sqrt(np.mean(np.sum(off**2, axis=1))) for off in (velocity, centroid)]
        name = ", ".join(f"{name} {value}" for name, value in settings.items()) or "nothing"
        print(f"{name:<20}{'yes' if replayed.identical else 'no':>10}{rms[0]:>15.3f}{rms[1]:>13.4f}")


if __name__ == "__main__":
    tyro.cli(main)
