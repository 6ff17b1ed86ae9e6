"""The growing surface on the screen: its triangles, their colours with a legend, and its edge."""

import html
import math
from enum import StrEnum

import matplotlib as mpl
import numpy as np
import numpy.typing as npt
import trimesh
import viser
from matplotlib.colors import Colormap

from palpate.errors import FloatArray
from palpate.runtime import palette
from palpate.runtime.palette import rgb
from palpate.viewing.surface_view import GrownSurface

EDGE_COLOUR = rgb(palette.QUIET_COLOUR)
EDGE_WIDTH = 2.0
"""Of the line around what is known [pixels]."""

RIM_COLOUR = rgb(palette.MAP_COLOUR)
RIM_OPACITY = 0.35
"""Of what lies beyond it."""

UNKNOWN = (140, 140, 140, 255)
"""Where a quantity is not known on a surface that is [RGBA]."""

SHOWN_PERCENT = 98.0
"""Colours span this share of the values, so that a few outliers do not hide the rest."""

LIFT = 2e-4
"""How far outside its place a surface is drawn [m]: the object's own, which is translucent, would lie over it."""

LATE = 2.0
"""A surface that is so far behind the contacts is not what was felt [s]: usual ones take a second."""

STOPS = 9
"""Colours of a legend's bar, between which the browser blends."""

COLOURS: Colormap = mpl.colormaps["viridis"]
"""As in the report: distinct for colour-blind eyes and in grey."""

_PADDED = '<div style="padding: 0 1em">{}</div>'


class SurfaceQuantity(StrEnum):
    """What the colours of a surface mean."""

    HEIGHT = "height"
    UNCERTAINTY = "uncertainty"
    FRICTION = "friction"


class SurfaceDrawing:
    """A surface in a viewer; one thread draws."""

    def __init__(self, server: viser.ViserServer) -> None:
        """Add the choice of colours and the legend to the panel."""
        self._server = server
        self._surface: GrownSurface | None = None
        self._range: dict[SurfaceQuantity, tuple[float, float]] = {}
        self._nodes: list[viser.SceneNodeHandle] = []
        with server.gui.add_folder("Map"):
            names = tuple(colouring.value for colouring in SurfaceQuantity)
            self._choice = server.gui.add_dropdown(
                "colour", names, initial_value=SurfaceQuantity.UNCERTAINTY.value
            )
            self._legend = server.gui.add_html(_PADDED.format(""))
            self._points = server.gui.add_checkbox("contacts", False)
            self._status = server.gui.add_html(_PADDED.format("no surface yet"))
            self._late = server.gui.add_html("")
        self._chosen = self.colouring
        self._points_shown = False

    @property
    def colouring(self) -> SurfaceQuantity:
        """What somebody has chosen."""
        return SurfaceQuantity(self._choice.value)

    @property
    def shows_points(self) -> bool:
        """Whether single contacts are wanted."""
        return bool(self._points.value)

    def fail(self, why: str) -> None:
        """Show why there is no surface any more; the contacts stand in for it."""
        self._drop()
        self._late.content = ""
        self._points.value = True  # type: ignore[misc]  # it has a setter, which mypy does not find
        self._status.content = _PADDED.format(html.escape(why))

    def show_lateness(self, behind: float) -> None:
        """Show how much of what was felt is not in the surface yet [s], where that is worth a word."""
        text = late(behind)
        if text != self._late.content:
            self._late.content = text

    def clear(self) -> None:
        """Forget the surface."""
        self._surface = None
        self._late.content = ""
        self._range.clear()
        self._drop()

    def show(self, surface: GrownSurface) -> None:
        """Draw a surface in the place of the last one."""
        self._surface = surface
        self._status.content = _PADDED.format(summary_of(surface))
        self._draw()

    def follow_choice(self) -> None:
        """Colour the surface anew if somebody has chosen otherwise."""
        if self.colouring is not self._chosen:
            self._chosen = self.colouring
            self._draw()

    def _draw(self) -> None:
        surface = self._surface
        if surface is None:
            return
        kind = self._chosen
        value = values(surface, kind)
        used = value[np.unique(surface.observed)] if len(surface.observed) else np.zeros(0)
        span = self._range[kind] = _span(kind, used, self._range.get(kind))
        self._legend.content = _PADDED.format(legend(kind, span))
        nodes, lift = self._server.scene, LIFT * surface.normals
        vertices = surface.vertices + lift
        with self._server.atomic():
            self._drop()
            if len(surface.observed):
                made = trimesh.Trimesh(
                    vertices, surface.observed, vertex_colors=shades(value, span), process=False
                )
                self._nodes.append(nodes.add_mesh_trimesh("/surface/observed", made))
            if len(surface.rim):
                self._nodes.append(
                    nodes.add_mesh_simple(
                        "/surface/rim",
                        vertices.astype(np.float32),
                        surface.rim.astype(np.uint32),
                        color=RIM_COLOUR,
                        opacity=RIM_OPACITY,
                        side="double",
                    )
                )
            if len(surface.edge):
                self._nodes.append(
                    nodes.add_line_segments(
                        "/surface/edge",
                        vertices[surface.edge].astype(np.float32),
                        EDGE_COLOUR,
                        thickness=EDGE_WIDTH,
                        thickness_units="screen",
                    )
                )

    def _drop(self) -> None:
        for node in self._nodes:
            node.remove()
        self._nodes = []


def values(surface: GrownSurface, kind: SurfaceQuantity) -> FloatArray:
    """Return what a colouring shows, at each vertex, shape (n,)."""
    match kind:
        case SurfaceQuantity.HEIGHT:
            return surface.vertices[:, 2]
        case SurfaceQuantity.UNCERTAINTY:
            return surface.sd
        case SurfaceQuantity.FRICTION:
            return surface.friction


def shades(value: FloatArray, span: tuple[float, float]) -> npt.NDArray[np.uint8]:
    """Return colours of values (n,) within a span, shape (n, 4), RGBA; grey where there is none."""
    found = np.asarray(COLOURS((np.nan_to_num(value) - span[0]) / (span[1] - span[0]), bytes=True), np.uint8)
    found[~np.isfinite(value)] = UNKNOWN
    return found


def legend(kind: SurfaceQuantity, span: tuple[float, float]) -> str:
    """Return a bar of colours with both its ends and what it means, as HTML."""
    stops = ", ".join(
        f"rgb({r}, {g}, {b})" for r, g, b, _ in (COLOURS(i / (STOPS - 1), bytes=True) for i in range(STOPS))
    )
    low, high = span
    match kind:
        case SurfaceQuantity.FRICTION:
            name, ends = "tangential over normal force", (f"{low:.2g}", f"{high:.2g}")
        case SurfaceQuantity.HEIGHT:
            name, ends = "height", (f"{1e3 * low:.2f} mm", f"{1e3 * high:.2f} mm")
        case SurfaceQuantity.UNCERTAINTY:
            name, ends = "standard deviation", ("0", f"{1e3 * high:.3g} mm")
    return (
        f'<div style="height: 0.7em; border-radius: 3px; background: linear-gradient(to right, {stops})"></div>'
        f'<div style="display: flex; justify-content: space-between; gap: 0.5em; font-size: 0.85em">'
        f"<span>{ends[0]}</span><span>{name}</span><span>{ends[1]}</span></div>"
    )


def summary_of(surface: GrownSurface) -> str:
    """Return a surface in a line of numbers, as HTML; nothing in it was typed by anybody."""
    metrics = surface.metrics
    parts = [f"{surface.contacts} contacts", f"{1e4 * metrics.area:.3g} cm² observed"]
    if math.isfinite(metrics.middle):
        parts.append(f"sd {1e3 * metrics.middle:.2g} mm (median), {1e3 * metrics.tail:.2g} mm (95 %)")
    return " &middot; ".join(parts)


def late(behind: float) -> str:
    """Return how far behind a surface is [s], as HTML; nothing where nobody would notice."""
    if behind < LATE:
        return ""
    return _PADDED.format(f"<b>the map is {behind:.0f} s behind what was felt: more of it is being worked out</b>")


def _span(kind: SurfaceQuantity, value: FloatArray, before: tuple[float, float] | None) -> tuple[float, float]:
    """Return the span of colours; the one before while it fits, lest they change with every contact."""
    value = value[np.isfinite(value)]
    if not len(value):
        return before or (0.0, 1e-3 if kind is SurfaceQuantity.UNCERTAINTY else 1.0)
    low, high = np.percentile(value, [100.0 - SHOWN_PERCENT, SHOWN_PERCENT]).tolist()
    if kind is not SurfaceQuantity.HEIGHT:
        return (0.0, round_up(high))  # in steps: seldom another one
    if before is not None and before[0] <= low and high <= before[1]:
        return before
    room = 0.25 * max(high - low, 1e-3)
    return (low - room, high + room)


def round_up(value: float) -> float:
    """Return the next 1, 2 or 5 times a power of ten; 1e-6 for nothing."""
    if not value > 1e-6:
        return 1e-6
    power = 10.0 ** math.floor(math.log10(value))
    return next(factor * power for factor in (1.0, 2.0, 5.0, 10.0) if factor * power >= value * (1.0 - 1e-9))
