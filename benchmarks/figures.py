"""Figures of README and documents: measured, kept in figures.csv and history.csv, and written into the pages.

    python benchmarks/figures.py [contact | exploration | simulation | period ...] [--only-write]

Five minutes on an idle computer. Topics that are left out keep their last figures. A page marks its tables:

    <!-- figures: contact -->
    ...
    <!-- end of figures -->
"""

import csv
import os
import platform
import re
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from datetime import date
from pathlib import Path
from time import perf_counter

import mujoco
import numpy as np
from contact import CATEGORIES, errors_of, hard_case, speeds
from contact_methods import ONE_FORMULA, PALPATE, ROOT, SOLVER
from costs.loop import period_parts
from harness import ROOT as REPOSITORY
from harness.command import chosen, parser_of
from harness.tables import grid
from rich.console import Console
from rich.progress import track

import palpate as pp
from palpate.experiments.explore import explore
from palpate.runtime.timing import Distribution
from palpate.sim import ContactLaw, SphereObject, Tip, build_scene
from palpate.surfaces import Sphere
from palpate.version import __version__

FILE, HISTORY = (REPOSITORY / "benchmarks" / name for name in ("figures.csv", "history.csv"))
PAGES = (REPOSITORY / "README.md", REPOSITORY / "docs" / "numerics.md", REPOSITORY / "docs" / "running.md")
BLOCK = re.compile(r"(<!-- figures: (\w+) -->\n).*?(<!-- end of figures -->)", re.DOTALL)


@dataclass(frozen=True, slots=True)
class Figure:
    """A measured figure: name in the tables, value, unit ("" for a ratio), what was asked ("": nothing),
    meaning."""

    name: str
    value: float
    unit: str
    asked: str
    means: str

    @property
    def row(self) -> tuple[str, ...]:
        """Row of the file; three digits are what two shared cores are good for."""
        return self.name, f"{self.value:.3g}", self.unit, self.asked, self.means


@dataclass(frozen=True, slots=True)
class Measured:
    """All figures of one run of `make figures`, by name, with its date, machine and version of palpate."""

    date: str
    machine: str
    version: str
    figures: dict[str, Figure]

    def write(self, path: Path = FILE) -> None:
        """Write the file anew."""
        head = (("date", self.date), ("machine", self.machine), ("version", self.version))
        with path.open("w", newline="", encoding="utf-8") as file:
            table = csv.writer(file, lineterminator="\n")
            table.writerows((*head, ("name", "value", "unit", "asked", "means")))
            table.writerows(figure.row for figure in self.figures.values())


def read(path: Path = FILE) -> Measured:
    """Return the content of a file of `Measured.write`."""
    with path.open(newline="", encoding="utf-8") as file:
        (_, date_), (_, machine_), (_, version), _, *rows = csv.reader(file)
    return Measured(date_, machine_, version, by_name(Figure(a, float(b), c, d, e) for a, b, c, d, e in rows))


def by_name(figures: Iterable[Figure]) -> dict[str, Figure]:
    """Return figures by their names."""
    return {figure.name: figure for figure in figures}


def write_history(measured: Measured, path: Path = HISTORY) -> None:
    """Write the row of this version; it replaces an older one of the same version."""
    kept = {"version": measured.version, "date": measured.date, "machine": measured.machine}
    kept |= {name: figure.row[1] for name, figure in measured.figures.items()}
    rows = [row for row in history(path) if row["version"] != measured.version] + [kept]
    columns = list(dict.fromkeys(name for row in rows for name in row))
    with path.open("w", newline="", encoding="utf-8") as file:
        table = csv.DictWriter(file, columns, restval="", lineterminator="\n")
        table.writeheader()
        table.writerows(rows)


def history(path: Path = HISTORY) -> list[dict[str, str]]:
    """Return a row per release, the oldest first."""
    if not path.exists():
        return []
    with path.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


# --------------------------------------------------------------------------------------------------- measuring

CASES, BATCH, ROUNDS = 300, 1_000_000, 9
SECONDS, TRIES = 10.0, 3
"""Duration of the paced loop [s]; tries of a simulated run, of which the fastest counts: other load only slows
it."""

EXPLORED = pp.ExploreConfig(spacing=0.004)
FACTORS = pp.ExploreConfig(object="sphere", force=2.0, speed=0.05, width=0.02, depth=0.02, force_noise=0.01)
"""The exploration that the README shows."""


def contact() -> Iterator[Figure]:
    """Measure one contact and many, and their errors."""
    worst = max(errors_of(PALPATE, hard_case(each, CASES)).largest for each in CATEGORIES)
    yield Figure("contact_error", worst, "", "1e-15", "largest relative error of a centroid, hard categories")
    found = speeds((PALPATE, SOLVER, ONE_FORMULA, ROOT), BATCH, ROUNDS)
    one, solver = (1e6 * found.single[each.name].least for each in (PALPATE, SOLVER))
    yield Figure("contact_time", one, "us", "4", "one contact, result object included")
    yield Figure("solver_time", solver, "us", "2", "one contact by a Solver, in a loop")
    numpy, root = (found.single[each.name].ratio.median for each in (ONE_FORMULA, ROOT))
    yield Figure("numpy_row", numpy, "", "", "one row of numpy over one contact")
    yield Figure("scipy_root", root, "", "", "scipy's root over one contact")
    batch = found.batch[PALPATE.name].ratio.median
    yield Figure("batch_copy", batch, "", "", "1e6 contacts over a copy of as many bytes")


def exploration() -> Iterator[Figure]:
    """Measure force and points of explorations on stage and arm, against the simulation's truth."""
    for robot in ("stage", "ur5e-sim"):
        for shape, speeds_ in (("sphere", (20, 50)), ("ellipsoid", (20, 50)), ("bumps", (20,)), ("torus", (20,))):
            for speed in speeds_:
                found = explore(replace(EXPLORED, robot=robot, object=shape, size=(), speed=1e-3 * speed))
                name, means = f"{robot}_{shape}_{speed}", f"{robot}, {shape}, {speed} mm/s"
                force, points = found.force_rms, 1e3 * found.point_rms
                yield Figure(f"force_{name}", force, "N", "", f"true normal force, RMS error: {means}")
                yield Figure(f"points_{name}", points, "mm", "", f"points to the true surface, RMS: {means}")


def simulation() -> Iterator[Figure]:
    """Measure how many times faster than real time runs are simulated, whole control periods with sensing."""
    hand = pp.GraspConfig(load="step")
    runs: tuple[tuple[str, str, Callable[[], float]], ...] = (
        ("stage", "stage, exploring", lambda: explore(FACTORS).run.real_time_factor),
        ("ur5e", "UR5e, exploring", lambda: explore(replace(FACTORS, robot="ur5e-sim")).run.real_time_factor),
        ("hand", "hand of two fingers that holds an object", lambda: pp.grasp_object(hand).run.real_time_factor),
        ("physics", "stage, MuJoCo's steps alone", physics_factor),
    )
    for name, means, factor in runs:
        yield Figure(f"factor_{name}", max(factor() for _ in range(TRIES)), "", "", f"times real time: {means}")


def physics_factor() -> float:
    """Return how many times faster than real time MuJoCo's steps are, two per period."""
    scene = build_scene(Tip(Sphere(0.008)), SphereObject(0.04), ContactLaw(), (0.0, 0.0, 0.0479))
    data, count = mujoco.MjData(scene.model), 5000
    begun = perf_counter()
    for _ in range(2 * count):
        mujoco.mj_step(scene.model, data)
    return count * 1e-3 / (perf_counter() - begun)


def period() -> Iterator[Figure]:
    """Measure the control period, paced at 1 kHz, without physics."""
    whole, parts = period_parts(SECONDS)
    spread = Distribution.of(whole.work)
    yield Figure("period_median", 1e6 * spread.p50, "us", "45", "paced period, median")
    yield Figure("period_99", 1e6 * spread.p99, "us", "150", "paced period, 99 %")
    yield Figure("period_sensing", 1e6 * float(np.median(parts["sense"])), "us", "15", "sensing of it, median")


TOPICS = {each.__name__: each for each in (contact, exploration, simulation, period)}

# ------------------------------------------------------------------------------------------------------- pages

PLAIN = {
    "contact": """\
| contact sensing | |
|---|---|
| error of the centroid, every hard category (grazing, slender 1e-3..1e6, scale 1e-200..1e200, zero spin, ...) \
| at most {contact_error} relative |
| 1e6 contacts on an ellipsoid, all fields, one thread | {batch_copy} times a plain copy of as many bytes |
| one contact, result object included; by a `Solver`, in a loop | {contact_time} us; {solver_time} us |
| the same by one row of numpy; by scipy's `root` | {numpy_row} times that; {scipy_root} times |""",
    "simulation": """\
| simulation, one core, whole control period of 1 ms with sensing | times real time |
|---|---|
| stage / UR5e, exploring (MuJoCo's steps alone: {factor_physics} on the stage) | {factor_stage} / {factor_ur5e} |
| hand of two fingers that holds an object | {factor_hand} |""",
    "period": """\
| a period of the loop, paced at 1 kHz: read, sense, control, supervise, record | median | 99 % |
|---|---|---|
| all of it | {period_median} us | {period_99} us |
| of it sensing: calibration, payload, filter, health, contact | {period_sensing} us | |""",
}
"""Tables with the names of their figures."""


def exploration_table() -> str:
    """Return the table of explorations with the names of its figures."""
    rows = [
        "| exploration in simulation, 1 kHz, 2 N, friction 0.3, 20 kN/m: sphere / ellipsoid | 20 mm/s | 50 mm/s |",
        "|---|---|---|",
    ]
    quantities = (
        ("force", "N", "true normal force, RMS error"),
        ("points", "mm", "points to the true surface, RMS"),
    )
    for name, unit, what in quantities:
        for robot, called in (("stage", "stage"), ("ur5e-sim", "UR5e")):
            cells = [
                f"{{{name}_{robot}_sphere_{speed}}} / {{{name}_{robot}_ellipsoid_{speed}}} {unit}"
                for speed in (20, 50)
            ]
            rows.append(f"| {what}, {called} | {' | '.join(cells)} |")
            rough = f"{{{name}_{robot}_bumps_20}}, {{{name}_{robot}_torus_20}}"
            rows.append(f"| the same, bumps of +-3 mm, torus | {rough} {unit} | |")
    return "\n".join(rows)


TABLES = PLAIN | {"exploration": exploration_table()}


def made(page: str, measured: Measured) -> str:
    """Return a page with its tables made anew.

    Raises:
        KeyError: If it marks an unknown table.
    """
    values = {name: shown(figure) for name, figure in measured.figures.items()}
    caption = f"*{measured.date}, palpate {measured.version}, {measured.machine}; `make figures`.*"
    return BLOCK.sub(lambda found: f"{found[1]}{TABLES[found[2]].format(**values)}\n\n{caption}\n{found[3]}", page)


def shown(figure: Figure) -> str:
    """Return a value as the tables have it: two digits."""
    value = float(f"{float(figure.row[1]):.2g}")
    return f"{value:.0f}" if 10.0 <= value < 1e6 else f"{value:g}"


def main() -> None:
    """Read the command line, measure, and write."""
    parser = parser_of(__doc__)
    parser.add_argument("topics", nargs="*", metavar="TOPIC", help=f"{', '.join(TOPICS)}; without any: all")
    parser.add_argument("--only-write", action="store_true", help="measure nothing, write the tables anew")
    given = parser.parse_args()
    names = chosen(parser, given.topics, TOPICS)
    if not given.only_write:
        console, found = Console(width=115), list[Figure]()
        system = f"{platform.system()}, CPython {platform.python_version()}"
        machine = f"{os.cpu_count()} {platform.machine()} cores, {system}"
        known = read().figures if FILE.exists() else {}
        for name in track(names, "measuring", console=console, transient=True):
            found += TOPICS[name]()
            Measured(date.today().isoformat(), machine, __version__, known | by_name(found)).write()
        write_history(read())
        rows = ((figure.means, shown(figure), figure.asked, figure.unit) for figure in found)
        console.print(
            grid(f"{date.today().isoformat()}, {machine}", "figure", "found", "asked", "unit", rows=rows)
        )
    for path in PAGES:
        path.write_text(made(path.read_text(encoding="utf-8"), read()), encoding="utf-8")


if __name__ == "__main__":
    main()
