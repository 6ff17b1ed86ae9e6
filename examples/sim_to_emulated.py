"""From the simulation to the wire by one word.

The same exploration, first by a simulated UR5e, then by one behind emulated devices: an emulated controller
that ur_rtde, the maker's client library, talks to over real sockets, and an emulated Net F/T box. All that
changes is the name of the robot. A robot file of your own cell is the third word: `--robots my_cell.yaml`
(see `palpate doctor`).

    python examples/sim_to_emulated.py

It prints for each how it went: both hold the force and find the sphere's radius, 40 mm. The emulated one keeps
real time.
"""

import tyro

from palpate.experiments.explore import explore
from palpate.experiments.explore.config import ExploreConfig
from palpate.experiments.explore.exploration import Exploration


def experiment(robot: str) -> Exploration:
    """Explore a sphere; nothing in here knows which robot it is."""
    return explore(
        ExploreConfig(
            robot=robot,
            object="sphere",
            size=(0.04,),  # radius [m]
            force=2.0,  # to press with [N]
            speed=0.05,  # along the surface [m/s]
            width=0.012,  # of what is explored [m]
            depth=0.002,  # [m]
        )
    )


def main(robots: tuple[str, ...] = ("ur5e-sim", "emulated-ur5e")) -> None:
    """Do the experiment on each of these robots."""
    for robot in robots:
        found = experiment(robot)
        timing = found.run.timing
        print(f"{robot}: {found.run}")
        print(f"  {len(timing.compute)} periods of {1e3 * timing.period:g} ms, {timing.overruns} overruns")
        if found.sphere is not None:  # it has felt enough to tell
            force = found.record.normal_force[found.scanning]
            print(f"  {len(found.cloud)} contacts, felt {force.mean():.2f} +- {force.std():.2f} N")
            print(f"  radius {1e3 * found.sphere.radius:.2f} mm")


if __name__ == "__main__":  # needed: emulators run in a process of their own, which imports this file
    tyro.cli(main)
