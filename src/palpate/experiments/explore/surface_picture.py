"""The touched surface and the true one, in space."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d import Axes3D  # type: ignore[import-untyped]
from mpl_toolkits.mplot3d.art3d import Poly3DCollection  # type: ignore[import-untyped]

from palpate.errors import FloatArray
from palpate.mapping import Knowledge, SurfaceMesh, TouchCloud
from palpate.reporting.style import (
    HEIGHT_COLOURS,
    MILLI,
    PATH,
    Picture,
    Width,
    colour_bar,
    new_figure,
    rim,
    style_space,
)

IndexArray = npt.NDArray[np.integer]

ELEVATION, AZIMUTH = 38.0, -58.0
LIGHT = np.array([-0.35, -0.45, 0.82])
"""Direction to the light, of unit length within a percent."""
AMBIENT = 0.62
"""Share of a colour that is left on a face turned away from the light."""

PATH_STRETCHES = 2500.0
"""The path is drawn with about this many points: more than pixels can resolve."""
BROKEN_PATH = 4.0
"""The drawn path is broken where neighbours are further apart than this many stretches."""
MARGIN = 0.08
"""Room around the touched points, relative to their extent."""
LEAST_RELIEF = 0.05
"""Colours span at least this share of the horizontal extent, so that a flat surface looks flat."""


@dataclass(frozen=True, slots=True, eq=False)
class View:
    """The box and the colours that both pictures share.

    Attributes:
        low: Lower corner, shape (3,) [m].
        high: Upper corner, shape (3,) [m].
        touched: Lowest and highest x, y of the touched points, shape (2, 2) [m].
        norm: Heights [mm] to colours.
    """

    low: FloatArray
    high: FloatArray
    touched: FloatArray
    norm: Normalize

    @classmethod
    def around(cls, cloud: TouchCloud) -> "View":
        """Return the view of the touched part; `cloud` holds at least one contact."""
        low, high = cloud.position.min(axis=0), cloud.position.max(axis=0)
        room = MARGIN * max(float((high - low).max()), 1e-6)
        width, depth, height = (high - low).tolist()
        middle, half = 0.5 * (low[2] + high[2]), 0.5 * max(height, LEAST_RELIEF * max(width, depth), 1e-6)
        return cls(
            low=low - room,
            high=high + room,
            touched=np.stack([low[:2], high[:2]]),
            norm=Normalize(MILLI * (middle - half), MILLI * (middle + half)),
        )


def touched_surface(cloud: TouchCloud, mesh: SurfaceMesh | None) -> Picture:
    """Return the touched surface with the path of the finger; without a mesh, the points alone."""
    view = View.around(cloud)
    figure, axes = _empty_view(view)
    if mesh is None:
        thin = _drawn_path(cloud)
        x, y, z = MILLI * thin.position.T
        axes.scatter(x, y, z, c=z, cmap=HEIGHT_COLOURS, norm=view.norm, s=2.0)
        caption = "Touched points, coloured by height; there are too few, or too far apart, for a surface."
    else:
        _draw_triangles(axes, view, mesh.vertices, mesh.triangles)
        path = _broken_line(_drawn_path(cloud))
        axes.plot(*(MILLI * path.T), color=PATH, linewidth=0.6, zorder=10, path_effects=rim(0.6))
        caption = (
            "The map with the path of the finger: where contacts lie on all sides; holes and what is beyond the "
            "rim were not felt. Good is a surface without holes that looks as the object does."
            if (mesh.knowledge == Knowledge.OBSERVED).any()
            else "The finger's path. The ribbon along it is extrapolated, not claimed: beside it nothing was felt."
        )
    return Picture(title="Touched surface", caption=caption, full=figure, dense=True)


def true_surface(cloud: TouchCloud, vertices: FloatArray, triangles: IndexArray) -> Picture:
    """Return the true surface in the same view and colours; only the touched region is drawn.

    Args:
        cloud: What was touched.
        vertices: Of the surface, base frame, shape (n, 3) [m].
        triangles: Indices of vertices, shape (m, 3).
    """
    view = View.around(cloud)
    figure, axes = _empty_view(view)
    centres = vertices[triangles].mean(axis=1)
    low, high = view.touched
    inside = ((centres[:, :2] >= low) & (centres[:, :2] <= high)).all(axis=1)
    inside &= (centres[:, 2] >= view.low[2]) & (centres[:, 2] <= view.high[2])
    _draw_triangles(axes, view, vertices, triangles[inside])
    return Picture(
        title="True surface",
        caption="The surface of the simulated object over the same region, in the same view and colours: "
        "the touched one "
        "should look the same.",
        full=figure,
        dense=True,
    )


def _empty_view(view: View) -> tuple[Figure, Axes3D]:
    figure = new_figure(Width.HALF, 3.9)
    axes = figure.add_subplot(projection="3d", computed_zorder=False)
    low, high = MILLI * view.low, MILLI * view.high
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]))
    axes.set_box_aspect(tuple(high - low), zoom=1.0)
    axes.view_init(elev=ELEVATION, azim=AZIMUTH)
    shares = (high - low) / (high - low).max()
    style_space(axes, shares.tolist())
    axes.zaxis.labelpad = -2.0  # else it is cut off at the rim
    colours = ScalarMappable(view.norm, HEIGHT_COLOURS)
    bar = colour_bar(figure, colours, axes, "height z [mm]", shrink=0.7, pad=0.02)
    bar.ax.ticklabel_format(axis="x", useOffset=False)
    return figure, axes


def _draw_triangles(axes: Axes3D, view: View, vertices: FloatArray, triangles: IndexArray) -> None:
    corners = vertices[triangles]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(normal, axis=1)
    real = length > 0.0  # meshes of spheres have triangles without area at the poles
    if not real.any():
        return
    corners, normal = corners[real], normal[real] / length[real, np.newaxis]
    # Either side is lit: meshes do not agree on the order of corners.
    lit = np.minimum(np.abs(normal @ LIGHT), 1.0)
    colours: npt.NDArray[np.float64] = HEIGHT_COLOURS(view.norm(MILLI * corners[:, :, 2].mean(axis=1)))
    colours[:, :3] *= (AMBIENT + (1.0 - AMBIENT) * lit)[:, np.newaxis]
    # Edges in the colour of the face close the hairlines between neighbours.
    faces = Poly3DCollection(MILLI * corners, facecolors=colours, edgecolors=colours, linewidths=0.25, zorder=1)
    axes.add_collection3d(faces)


def _drawn_path(cloud: TouchCloud) -> TouchCloud:
    length = float(np.linalg.norm(np.diff(cloud.position, axis=0), axis=1).sum())
    return cloud.thinned(max(length / PATH_STRETCHES, 1e-6))


def _broken_line(path: TouchCloud) -> FloatArray:
    """Return the points of `path` with a row of NaN in each gap."""
    steps = np.linalg.norm(np.diff(path.position, axis=0), axis=1)
    if not len(steps):
        return path.position
    gaps = np.flatnonzero(steps > BROKEN_PATH * np.median(steps)) + 1
    return np.insert(path.position, gaps, np.nan, axis=0)
