"""The map seen from above: its errors, and how sure it is."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import Collection
from matplotlib.colors import Colormap, Normalize
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from palpate.errors import FloatArray
from palpate.experiments.explore.explored_map import ExploredMap
from palpate.mapping import SurfaceMesh
from palpate.reporting.style import (
    ERROR_COLOURS,
    HEIGHT_COLOURS,
    MAP_GROUND,
    MICRO,
    MILLI,
    TRUE,
    Picture,
    Width,
    colour_bar,
    legend_above,
    new_figure,
    style_axes,
)

SHOWN_PERCENT = 99.0
"""Colours span this share of the values, so that a few outliers do not hide the rest."""

MISSED_DRAWN = 4000
"""Marks drawn of what was not observed: more cover each other."""


def map_picture(found: ExploredMap) -> Picture | None:
    """Return errors, if they are known, and standard deviations of a map; None if nothing of it is claimed."""
    if not found.claimed.any():
        return None
    panels = 2 if found.truth_known else 1
    full = new_figure(Width.HALF if panels == 1 else Width.FULL, 4.7)
    narrow = new_figure(Width.HALF, 4.6 * panels) if panels == 2 else None
    _draw(found, full, full.subplots(1, panels, squeeze=False).ravel().tolist())
    if narrow is not None:
        _draw(found, narrow, narrow.subplots(panels, 1, squeeze=False).ravel().tolist())
    inside = f" {100.0 * found.covered:.1f} % of the true errors are inside it." if found.truth_known else ""
    return Picture(
        title="The map and its uncertainty",
        caption=(
            f"Seen from above. Standard deviations are of random errors; together with what may be off "
            f"everywhere, {MICRO * found.mesh.bias:.3g} µm, they make a 95 % band of "
            f"±{MICRO * found.band:.3g} µm (median).{inside} Nothing is claimed on grey ground. Good "
            f"is a map that "
            "is even, without holes, and off by no more than its band."
        ),
        full=full,
        narrow=narrow,
        dense=True,
    )


def _draw(found: ExploredMap, figure: Figure, axes: list[Axes]) -> None:
    if found.truth_known:
        error = MICRO * found.error
        limit = max(float(np.percentile(np.abs(error), SHOWN_PERCENT)), 1e-3)
        label = "error of the map [µm], + is outside the surface"
        from_above(figure, axes[0], found.mesh, error, ERROR_COLOURS, (-limit, limit), label)
    sd = MICRO * found.mesh.sd
    largest = max(float(np.percentile(sd, SHOWN_PERCENT)), 1e-3)
    from_above(figure, axes[-1], found.mesh, sd, HEIGHT_COLOURS, (0.0, largest), "standard deviation [µm]")
    if len(found.missed):
        missed = MILLI * found.missed[:: -(-len(found.missed) // MISSED_DRAWN)]
        for each in axes:
            label = "could be felt, is not observed"
            each.plot(missed[:, 0], missed[:, 1], "x", color=TRUE, markersize=2.5, linewidth=0.0, label=label)
        legend_above(figure, axes, 1)


def from_above(
    figure: Figure,
    axes: Axes,
    mesh: SurfaceMesh,
    value: FloatArray,
    colours: Colormap,
    limits: tuple[float, float],
    label: str,
) -> None:
    """Draw a value at vertices, seen from above, with its colour bar."""
    drawn = draw_mesh(axes, mesh, value, colours, Normalize(*limits))
    bar = colour_bar(figure, drawn, axes, label, extend="both", shrink=0.85)
    bar.locator = MaxNLocator(6)
    bar.update_ticks()
    axes.set_facecolor(MAP_GROUND)
    axes.set_aspect("equal", adjustable="datalim")
    style_axes(axes, x="x [mm]", y="y [mm]", grid=False)


def draw_mesh(
    axes: Axes, mesh: SurfaceMesh, value: FloatArray, colours: Colormap, norm: Normalize | None
) -> Collection:
    """Draw a value at vertices where it is finite; upper triangles last, so that they hide those below."""
    corners = mesh.triangles[np.isfinite(value[mesh.triangles]).all(axis=1)]
    corners = corners[np.argsort(mesh.vertices[corners, 2].mean(axis=1), kind="stable")]
    drawn: Collection = axes.tripcolor(
        MILLI * mesh.vertices[:, 0],
        MILLI * mesh.vertices[:, 1],
        corners,
        facecolors=value[corners].mean(axis=1),
        cmap=colours,
        norm=norm,
        edgecolors="face",
        linewidth=0.2,
        antialiaseds=False,  # or the ground is seen between triangles
        rasterized=True,
    )
    return drawn
