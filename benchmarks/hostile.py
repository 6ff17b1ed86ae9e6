"""Explorations of what is not as it was said, and of objects that nobody tested on.

    python benchmarks/hostile.py [--quick]

Scenes: friction three times and stiffness ten times what is assumed, objects that leave or are missing, a sensor
whose zero drifts by 0.2 N/min. Asked: the object never presses the tip with more than the robot's limit, the
robot rests in the end, the report says what was the matter, and at least 90 % of a map's true errors lie inside
its band. Walls: how a sweep hits one, against the bound that the report states. Meshes: trimesh's primitives and
files as users have them, by the UR5e with `--identify`; asked: force RMS below 0.05 N at 20 mm/s where they are
smooth, with a Nano17-class sensor's white noise, and then a map RMS below 0.01 mm; 90 % inside the band
everywhere. Ends with 1 if a figure is missed.
"""

import argparse
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from hostile_scenes import NANO17, SCENES, Wall, most_force
from rich.console import Console
from rich.progress import track
from rich.table import Table
from unseen_meshes import CASES, MeshCase

from palpate.experiments.explore import explore
from palpate.experiments.explore.config import ExploreConfig
from palpate.experiments.explore.exploration import Exploration
from palpate.experiments.explore.report import outcome

ROBOTS, STRATEGIES = ("stage", "ur5e"), ("raster", "spiral")
FORCE_RMS, MAP_RMS, COVERED = 0.05, 1e-5, 0.90


def main() -> int:
    """Measure and print; return 1 if a figure is missed."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="the stage and rasters only")
    quick = parser.parse_args().quick
    console, robots = Console(width=170), ROBOTS[:1] if quick else ROBOTS
    strategies = STRATEGIES[:1] if quick else STRATEGIES
    wrong: list[str] = []
    console.print(scenes(robots, strategies, wrong))
    console.print(walls(robots, wrong))
    console.print(meshes(robots, strategies, wrong))
    for each in wrong:
        console.print(f"MISSED: {each}", style="red")
    return 1 if wrong else 0


def scenes(robots: tuple[str, ...], strategies: tuple[str, ...], wrong: list[str]) -> Table:
    """Carry out every hostile scene."""
    table = _table("Hostile scenes", "scene", "robot", "peak N", "limit N", "map RMS um", "inside band", "account")
    tried = [(scene, robot, way) for scene in SCENES for robot in robots for way in strategies]
    for scene, robot, way in track(tried, "hostile scenes", transient=True):
        found = scene.carried_out(robot, way)
        told, name = outcome(found), f"{scene.name}, {way}, {robot}"
        wrong += [f"{name}: {each}" for each in scene.missed(found)]
        table.add_row(
            f"{scene.name}, {way}",
            robot,
            f"{most_force(found):.2f}",
            f"{found.plan.wall.limit:g}",
            *_map(found),
            told,
        )
    return table


def walls(robots: tuple[str, ...], wrong: list[str]) -> Table:
    """Run into a wall."""
    table = _table(
        "A wall in the way of a sweep", "robot", "kN/m", "mm/s", "peak N", "bound N", "below limit up to"
    )
    tried = [
        Wall(robot, stiffness, speed)
        for robot in robots
        for stiffness in (20e3, 100e3)
        for speed in (0.01, 0.02, 0.05)
    ]
    for wall in track(tried, "walls", transient=True):
        found = wall.hit()
        peak = most_force(found)
        if peak > found.plan.wall.force:
            wrong.append(f"wall, {wall}: {peak:.2f} N, the bound is {found.plan.wall.force:.2f} N")
        table.add_row(
            wall.robot,
            f"{wall.stiffness / 1e3:g}",
            f"{1e3 * wall.speed:g}",
            f"{peak:.2f}",
            f"{found.plan.wall.force:.2f}",
            f"{1e3 * found.plan.wall.speed:.1f} mm/s",
        )
    return table


def meshes(robots: tuple[str, ...], strategies: tuple[str, ...], wrong: list[str]) -> Table:
    """Explore meshes that no test was developed with."""
    table = _table("Unseen meshes", "mesh", "robot", "ending", "force RMS N", "map RMS um", "inside band", "marks")
    tried = [(case, robot, way) for case in CASES for robot in robots for way in strategies]
    with tempfile.TemporaryDirectory() as folder:
        for case, robot, way in track(tried, "meshes", transient=True):
            found = explored(case, Path(folder), robot if robot == "stage" else "ur5e-sim", way)
            wrong += [f"{case.name}, {way}, {robot}: {each}" for each in missed(case, found)]
            table.add_row(
                f"{case.name}, {way}",
                robot,
                found.run.ending.value,
                f"{found.force_rms:.3f}",
                *_map(found),
                ", ".join(sorted({mark.event.value for mark in found.marks})),
            )
    return table


def explored(
    case: MeshCase, folder: Path, robot: str, way: str, noise: tuple[float, float] = NANO17
) -> Exploration:
    """Explore the middle of a mesh, with white noise of the force [N] and of the moment [N m]."""
    size = {"radius": 0.5 * case.side} if way == "spiral" else {"width": 2.0 * case.side, "depth": 0.5 * case.side}
    config = ExploreConfig(
        robot=robot,
        object="mesh",
        file=case.write(folder),
        scale=case.unit,
        center=case.center,
        strategy=way,
        force_noise=noise[0],
        moment_noise=noise[1],
        identify=robot != "stage",  # an arm is not one lag: the figures asked of it are those of a measured law
        **size,
    )
    return explore(config)


def missed(case: MeshCase, found: Exploration) -> Iterator[str]:
    """Name the figures that an exploration of a mesh misses."""
    if not found.truth.touching[found.scanning].all() or found.run.ending.value != "done":
        yield f"contact was lost ({outcome(found)})"
    if case.smooth and found.force_rms >= FORCE_RMS:
        yield f"force RMS {found.force_rms:.3f} N"
    if found.map is None or not found.map.claimed.any():
        yield "no map"
    elif found.map.covered < COVERED:
        yield f"{100.0 * found.map.covered:.1f} % inside the band"
    elif case.smooth and found.map.rms >= MAP_RMS:
        yield f"map RMS {1e6 * found.map.rms:.1f} um"


def _table(title: str, *headings: str) -> Table:
    table = Table(title=title)
    for heading in headings:
        table.add_column(heading, overflow="fold")
    return table


def _map(found: Exploration) -> tuple[str, str]:
    """RMS error of the map [um] and the share of errors inside its band, if it claims anything."""
    if found.map is None or not np.isfinite(found.map.rms):
        return ("-", "-")
    return (f"{1e6 * found.map.rms:.2f}", f"{100.0 * found.map.covered:.1f} %")


if __name__ == "__main__":
    sys.exit(main())
