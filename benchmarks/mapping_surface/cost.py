"""What a map costs, and how that grows with the number of contacts."""

import time
from collections.abc import Callable
from typing import TypeVar

import numpy as np
import psutil
from rich.table import Table

from mapping_surface.honesty import Tell
from mapping_surface.shapes import Errors, Shape, felt, torus
from palpate.mapping import SurfaceMap, surface_mesh

Answer = TypeVar("Answer")

BATCH = 100  # contacts, 0.2 s of a scan at 500 Hz
BATCHES = 30


def timed(work: Callable[[], Answer]) -> tuple[Answer, float, float]:
    """Return the answer, the processor's seconds and those of the clock on the wall."""
    wall, processor = time.perf_counter(), time.process_time()
    answer = work()
    return answer, time.process_time() - processor, time.perf_counter() - wall


ASKED_AT, BUILD, UPDATE, MESH, MEMORY = 100_000, 5.0, 50.0, 3.0, 400.0
"""Contacts at which the figures are asked: [s], [ms], [s] of the processor and [MB]."""


RING, TUBE = 0.075, 0.008
"""Radii of `long_torus` [m]."""


def long_torus() -> Shape:
    """Return a torus whose rows of 25 mm go round its tube, so that area grows with contacts: 330000 of them."""
    turned = torus(RING, TUBE)
    half_turn = 0.5 * np.pi
    return Shape("torus", lambda u, v: turned(v, u), (-half_turn, half_turn), (0.0, 2.0 * np.pi))


def cost(counts: tuple[int, ...], tell: Tell) -> tuple[Table, int]:
    """Map growing parts of one scan of a torus, rows 1 mm apart; and how many figures are missed."""
    table = Table(title="Cost against contacts: processor seconds (wall clock)")
    for heading in (
        "contacts",
        "patches",
        "full build s",
        "of it learning s",
        "100 more ms",
        "mesh 0.5 mm s",
        "vertices",
        "resident growth MB",
    ):
        table.add_column(heading, justify="right")
    shape = long_torus()
    rng = np.random.default_rng(0)
    u, v = shape.rows(1e-3)
    needed = counts[-1] + BATCH * BATCHES
    scan = felt(*shape.surface(u[:needed], v[:needed]), Errors(), rng)
    misses = 0
    index = np.arange(len(scan))
    for count in counts:
        part, rest = scan.select(index < count), scan.select((index >= count) & (index < count + BATCH * BATCHES))
        before = psutil.Process().memory_info().rss
        made, build, build_wall = timed(lambda part=part: SurfaceMap.learned(part))
        _, learning, learning_wall = timed(made.relearn)
        mesh, meshing, meshing_wall = timed(lambda made=made: surface_mesh(made, 0.5e-3))
        grown = (psutil.Process().memory_info().rss - before) / 1e6
        updates, walls = [], []
        at = np.arange(len(rest))
        for i in range(len(rest) // BATCH):
            batch = rest.select(at // BATCH == i)
            _, spent, wall = timed(lambda made=made, batch=batch: made.add(batch))
            updates.append(spent)
            walls.append(wall)
        if count == ASKED_AT:
            spent_ms = 1e3 * float(np.median(updates))
            misses += sum((build > BUILD, spent_ms > UPDATE, meshing > MESH, grown > MEMORY))
        table.add_row(
            f"{len(part)}",
            f"{len(made.patches)}",
            f"{build:.2f} ({build_wall:.2f})",
            f"{learning:.2f} ({learning_wall:.2f})",
            f"{1e3 * np.median(updates):.0f} ({1e3 * np.median(walls):.0f})" if updates else "-",
            f"{meshing:.2f} ({meshing_wall:.2f})",
            f"{len(mesh.vertices)}",
            f"{grown:.0f}",
        )
        tell(f"cost of {count} contacts: build {build:.2f} s, mesh {meshing:.2f} s")
        del made, mesh
    return table, misses
