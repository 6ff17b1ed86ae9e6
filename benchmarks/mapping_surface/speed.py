"""Time, error and honesty of maps of growing parts of one scan: to compare two states of the code, in turns."""

import time
from collections.abc import Sequence

import numpy as np
from rich.table import Table

from mapping_surface.cost import RING, TUBE, long_torus
from mapping_surface.honesty import Tell
from mapping_surface.shapes import Errors, felt
from palpate.mapping import SurfaceMap, surface_mesh
from palpate.mapping.curvature_layers import curvature_layers

COUNTS = (10_000, 100_000, 300_000)


def speed(counts: Sequence[int], tell: Tell) -> Table:
    """Fit, mesh at 0.5 mm and layers, in processor seconds; RMS error and coverage at the vertices."""
    table = Table(title="Maps of a torus, rows 1 mm apart: processor seconds")
    for heading in ("contacts", "fit", "mesh", "layers", "all", "RMS um", "inside the 95 % band"):
        table.add_column(heading, justify="right")
    shape = long_torus()
    u, v = (each[: max(counts)] for each in shape.rows(1e-3))
    scan = felt(*shape.surface(u, v), Errors(), np.random.default_rng(0))
    first = SurfaceMap.learned(scan.select(np.arange(len(scan)) < 1500))  # what is compiled, is compiled now
    curvature_layers(first, surface_mesh(first))
    for count in counts:
        part = scan.select(np.arange(len(scan)) < count)
        clock = [time.process_time()]
        made = SurfaceMap.learned(part)
        clock.append(time.process_time())
        mesh = surface_mesh(made)
        clock.append(time.process_time())
        curvature_layers(made, mesh)
        clock.append(time.process_time())
        x, y, z = mesh.vertices.T
        error = np.hypot(np.hypot(x, y) - RING, z) - TUBE
        row = [f"{each:.2f}" for each in (*np.diff(clock), clock[-1] - clock[0])]
        row += [f"{1e6 * np.sqrt(np.mean(error**2)):.3f}", f"{np.mean(np.abs(error) <= mesh.band()):.4f}"]
        table.add_row(str(count), *row)
        tell(f"speed of {count} contacts: " + "  ".join(row))
    return table
