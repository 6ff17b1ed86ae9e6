"""The map at a few moments, from above: its uncertainty, the path done, and the path ahead."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import ListedColormap, Normalize
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from palpate.errors import FloatArray
from palpate.experiments.explore.growth_picture import AREA, share_text
from palpate.experiments.explore.map_growth import GrowthSnapshot, MapGrowth
from palpate.experiments.explore.map_picture import draw_mesh
from palpate.reporting.style import (
    COMMANDED,
    DASHED,
    FONT_SIZE,
    HEIGHT_COLOURS,
    INK,
    MAP_GROUND,
    MARK_COLOURS,
    MICRO,
    MILLI,
    OTHER_PHASE,
    PATH,
    RIM,
    Picture,
    Width,
    colour_bar,
    legend_above,
    new_figure,
    rim,
    style_axes,
)

MARKERS = ("o", "s", "^", "D", "v", "P", "X", "*", "<", ">")
"""One per event, in the order in which they came: as many as there are events."""

LARGEST_MARK, SMALLEST_MARK = 8.5, 5.0
"""Of the first event and of the last [points]: later ones do not cover it where they share a place."""

PALE = ListedColormap([OTHER_PHASE])
"""Of what is extrapolated and not claimed."""

DONE_POINTS = 3000
"""About this many points of the path are drawn: more than pixels can resolve."""

ROOM = 0.06
"""Around all that is drawn, of its extent."""

FLATTEST, TALLEST = 0.35, 1.3
"""Height over width of a panel, whatever the shape of what was explored."""

HEADER = 0.95
"""Of a picture, for legend and colour bar [inch]."""


def snapshots_picture(growth: MapGrowth) -> Picture:
    """Return the map at each snapshot, all in one scale of colours and lengths."""
    count = len(growth.snapshots)
    limits = _limits(growth.snapshots)
    across = 2 if count > 1 else 1
    full = _figure(growth, Width.FULL if across == 2 else Width.HALF, across, limits)
    narrow = _figure(growth, Width.HALF, 1, limits) if across == 2 else None
    events = _events(growth.snapshots[-1])
    counts = "; ".join(f"{len(places)} x {event}" for event, places in events.items())
    marks = f" Marks: {counts}." if counts else ""
    return Picture(
        title="The map while it grew",
        caption=f"{_known(growth)} Dashed: the rest of the leg at that moment. Dark, without "
        f"holes, is good.{marks}",
        full=full,
        narrow=narrow,
        dense=True,
    )


def _known(growth: MapGrowth) -> str:
    """What is seen of the map, as text."""
    if not growth.curve.area.any():
        return (
            "Seen from above. Contacts are too far apart, or on one line: nothing of the surface counts as "
            "observed, and what is extrapolated beside a line is pale."
        )
    return (
        "Seen from above; over each, the area observed and its median standard deviation. The colour shows the "
        "standard deviation of the surface's position; grey ground is unknown."
    )


def _figure(growth: MapGrowth, width: Width, across: int, limits: FloatArray) -> Figure:
    rows = -(-len(growth.snapshots) // across)
    shape = float(np.clip((limits[1, 1] - limits[1, 0]) / (limits[0, 1] - limits[0, 0]), FLATTEST, TALLEST))
    panel = width.value / across
    figure = new_figure(width, HEADER + rows * (shape * (panel - 0.7) + 0.6))
    axes = figure.subplots(rows, across, squeeze=False).ravel().tolist()
    most = MICRO * max(growth.largest_sd, 1e-9)
    norm = Normalize(0.0, most) if growth.curve.area.any() else None
    names = list(_events(growth.snapshots[-1]))
    for each, place in zip(growth.snapshots, axes, strict=False):
        _draw(each, place, norm, names)
        place.set_title(_heading(growth, each.moment), fontsize=FONT_SIZE, color=INK, loc="left")
        place.set_xlim(*limits[0].tolist())
        place.set_ylim(*limits[1].tolist())
    for place in axes[len(growth.snapshots) :]:
        place.set_visible(False)
    if norm is not None:
        mapped = ScalarMappable(norm, HEIGHT_COLOURS)
        bar = colour_bar(figure, mapped, axes, "standard deviation [µm]", extend="max", shrink=0.7, aspect=40)
        bar.locator = MaxNLocator(6)
        bar.update_ticks()
    legend_above(figure, axes, 4 if width is Width.FULL else 3)
    return figure


def _draw(each: GrowthSnapshot, axes: Axes, norm: Normalize | None, events: Sequence[str]) -> None:
    """Draw a map with path and marks; without a scale of deviations it is not coloured."""
    mesh = each.mesh
    if len(mesh.triangles):
        draw_mesh(axes, mesh, MICRO * mesh.sd, PALE if norm is None else HEIGHT_COLOURS, norm)
    done = MILLI * each.done[:: max(len(each.done) // DONE_POINTS, 1)]
    if len(done):
        axes.plot(
            done[:, 0], done[:, 1], color=PATH, linewidth=0.7, label="path of the tip", path_effects=rim(0.7)
        )
        axes.plot(*done[-1, :2], "o", color=PATH, markersize=4.0, label="tip")
    if len(each.to_go) > 1:
        to_go = MILLI * each.to_go
        axes.plot(to_go[:, 0], to_go[:, 1], color=COMMANDED, linewidth=1.3, linestyle=DASHED, label="still to go")
    for event, places in _events(each).items():
        number = events.index(event)
        axes.plot(
            *(MILLI * places[:, :2].T),
            MARKERS[number % len(MARKERS)],
            markerfacecolor=MARK_COLOURS[number % len(MARK_COLOURS)],
            markeredgecolor=RIM,
            markersize=max(LARGEST_MARK - 0.5 * number, SMALLEST_MARK),
            markeredgewidth=0.8,
            linewidth=0.0,
            label=event,
            zorder=5.0,
        )
    axes.set_facecolor(MAP_GROUND)
    axes.set_aspect("equal", adjustable="box")
    style_axes(axes, x="x [mm]", y="y [mm]", grid=False)
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(MaxNLocator(5))


def _heading(growth: MapGrowth, moment: int) -> str:
    curve = growth.curve
    if not curve.area.any():
        return f"{share_text(growth, moment)} of the path, {curve.time[moment]:.1f} s"
    known = f"{AREA * curve.area[moment]:.3g} cm²"
    if np.isfinite(curve.middle[moment]):
        known += f", sd {MICRO * curve.middle[moment]:.3g} µm"
    return f"{share_text(growth, moment)} of the path, {curve.time[moment]:.1f} s: {known}"


def _events(each: GrowthSnapshot) -> dict[str, FloatArray]:
    """Return where each event was, in the order in which they came first, shapes (n, 3) [m]."""
    found: dict[str, list[tuple[float, ...]]] = {}
    for mark in each.marks:
        found.setdefault(str(mark.event), []).append(mark.position)
    return {event: np.array(places) for event, places in found.items()}


def _limits(snapshots: Sequence[GrowthSnapshot]) -> FloatArray:
    """Return lowest and highest x and y of all that is drawn, with room, shape (2, 2) [mm]."""
    seen = [each.mesh.vertices[:, :2] for each in snapshots]
    seen += [part[:, :2] for each in snapshots for part in (each.done, each.to_go) if len(part)]
    seen += [np.array([mark.position[:2] for mark in each.marks]).reshape(-1, 2) for each in snapshots]
    points = np.concatenate(seen)
    if not len(points):
        return np.array([[-1.0, 1.0], [-1.0, 1.0]])
    low, high = points.min(axis=0), points.max(axis=0)
    room = max(ROOM * float((high - low).max()), 1e-4)
    return np.asarray(MILLI * np.column_stack([low - room, high + room]))
