"""The forces of a grasp in space, and how much of each contact's limit the load takes."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from mpl_toolkits.mplot3d import Axes3D  # type: ignore[import-untyped]
from mpl_toolkits.mplot3d.art3d import Poly3DCollection  # type: ignore[import-untyped]

from palpate.errors import FloatArray, InvalidValueError
from palpate.grasp.contacts import GraspContacts
from palpate.reporting.style import (
    CONE,
    CONE_EDGE,
    DASH_DOT,
    FONT_SIZE,
    INK,
    LIMIT,
    MEASURED,
    MILLI,
    SMALL_SIZE,
    SPIN,
    TRUE,
    WANTED,
    Picture,
    Width,
    new_figure,
    style_axes,
    style_space,
)

ELEVATION, AZIMUTH = 24.0, -55.0

LONGEST_ARROW = 0.7
"""The largest force is drawn so long, over the grasp's size."""

FRAME = 0.3
"""Axes of a contact's frame, and the height of its cone, over the grasp's size."""

CORNERS = 40
"""Of a drawn cone."""

FULL_DEPTH, HEIGHT = 5.0, 3.6
"""Sizes [inch]: in space, and of the bars."""


def grasp_force_picture(
    grasp: GraspContacts,
    forces: FloatArray,
    load: FloatArray,
    disturbance: FloatArray | None = None,
) -> Picture:
    """Return the picture of a grasp under a load.

    Args:
        grasp: Contacts, in the object's frame.
        forces: (f_n, f_t1, f_t2, tau_n) of each on the object, shape (n, 4) [N, N, N, N m].
        load: What else acts on the object, about its origin, shape (6,) [N, N m].
        disturbance: The worst direction of a further load, shape (6,); None for none.

    Raises:
        InvalidValueError: Shapes that do not go with the grasp.
    """
    n = len(grasp)
    for name, value, shape in (
        ("forces", forces, (n, 4)),
        ("load", load, (6,)),
        ("disturbance", disturbance, (6,)),
    ):
        if value is not None and value.shape != shape:
            raise InvalidValueError(f"{name} has shape {value.shape}: must be {shape}")
    worst = ", and the worst disturbance from the middle of the contacts" if disturbance is not None else ""
    return Picture(
        title="Forces of the grasp",
        caption=(
            f"Left: what contacts exert on the object inside their friction cones (drawn without spin), and "
            f"the load{worst}. Right: how much of its limit each contact uses, together and by tangential force "
            f"or spin alone; below the limit with room is good."
        ),
        full=_draw(grasp, forces, load, disturbance, Width.FULL),
        narrow=_draw(grasp, forces, load, disturbance, Width.HALF),
    )


def limit_shares(grasp: GraspContacts, forces: FloatArray) -> FloatArray:
    """Return |(f_t, tau / e)|_p, |f_t| and |tau| / e over mu f_n, shape (n, 3); NaN where nothing presses."""
    out = np.full((len(grasp), 3), np.nan)
    for i, (surface, (f, a, b, tau)) in enumerate(zip(grasp.surfaces, forces.tolist(), strict=True)):
        if f > 0.0:
            along = float(np.hypot(a, b))
            each = ((along, tau), (along, 0.0), (0.0, tau))
            out[i] = [surface.load_ratio(f, x, abs(spin)) for x, spin in each]
    return out


def _draw(
    grasp: GraspContacts,
    forces: FloatArray,
    load: FloatArray,
    disturbance: FloatArray | None,
    width: Width,
) -> Figure:
    bars = max(HEIGHT, 0.5 * len(grasp))
    if width is Width.FULL:
        figure = new_figure(width, max(FULL_DEPTH, bars))
        grid = figure.add_gridspec(1, 2, width_ratios=(1.5, 1.0))
    else:
        figure = new_figure(width, FULL_DEPTH + bars)
        grid = figure.add_gridspec(2, 1, height_ratios=(FULL_DEPTH, bars))
    space = figure.add_subplot(grid[0], projection="3d", computed_zorder=False)
    _draw_space(space, grasp, forces, load, disturbance)
    _draw_shares(figure.add_subplot(grid[1]), grasp, forces)
    return figure


def _draw_space(
    axes: Axes3D, grasp: GraspContacts, forces: FloatArray, load: FloatArray, disturbance: FloatArray | None
) -> None:
    places = MILLI * grasp.positions
    middle = places.mean(axis=0)
    size = max(float(np.linalg.norm(places - middle, axis=1).max()), MILLI * float(grasp.spin_length.max()))
    pushes = np.einsum("nij,nj->ni", grasp.frames, forces[:, :3])
    longest = max(float(np.linalg.norm(np.vstack([pushes, load[None, :3]]), axis=1).max()), 1e-300)
    per_newton = LONGEST_ARROW * size / longest
    ends = [places]
    for i, (place, frame) in enumerate(zip(places, grasp.frames, strict=True)):
        axes.add_collection3d(_cone(place, frame, float(grasp.friction[i]), FRAME * size))
        for k, style in ((0, "-"), (1, "--"), (2, ":")):
            tip = place + FRAME * size * frame[:, k]
            axes.plot(*np.stack([place, tip]).T, color=INK, linewidth=0.8, linestyle=style, zorder=4)
        # an arrow that ends at the contact: contacts push, and what is inside stays free
        tail = place - per_newton * pushes[i]
        ends.append(tail[None])
        _arrow(axes, tail, per_newton * pushes[i], MEASURED)
        axes.plot(*place[:, None], "o", color=INK, markersize=4, zorder=6)
        away = (place - middle) / max(float(np.linalg.norm(place - middle)), 1e-12)
        axes.text(
            *(tail + 0.12 * size * away), str(i + 1), fontsize=FONT_SIZE + 1.0, color=INK, ha="center", va="center"
        )
    _arrow(axes, middle, per_newton * load[:3], WANTED)
    ends.append((middle + per_newton * load[:3])[None])
    entries = [
        Line2D([], [], color=MEASURED, linewidth=2.0, label="contact force"),
        Patch(facecolor=CONE, edgecolor=CONE_EDGE, alpha=0.6, label="friction cone"),
        Line2D([], [], color=WANTED, linewidth=2.0, label="load"),
        Line2D([], [], color=INK, linewidth=0.8, label="n (solid), t1, t2"),
    ]
    if disturbance is not None:
        ends.extend(_draw_disturbance(axes, middle, disturbance, size))
        entries.append(Line2D([], [], color=TRUE, linewidth=2.0, label="worst force"))
        entries.append(Line2D([], [], color=SPIN, linewidth=2.0, label="worst moment"))
    _frame_space(axes, np.vstack(ends))
    axes.figure.legend(
        handles=entries,
        loc="outside upper center",
        ncols=6 if axes.figure.get_size_inches()[0] > 6.0 else 3,
        fontsize=SMALL_SIZE,
        frameon=False,
        labelcolor=INK,
        handlelength=1.4,
    )


def _draw_disturbance(axes: Axes3D, middle: FloatArray, disturbance: FloatArray, size: float) -> list[FloatArray]:
    """Draw force and moment about the middle of the contacts; return their tips."""
    force = disturbance[:3]
    moment = disturbance[3:] - np.cross(middle / MILLI, force)
    by_size = moment / (size / MILLI)
    longest = max(float(np.linalg.norm(force)), float(np.linalg.norm(by_size)), 1e-300)
    tips = []
    for part, colour in ((force, TRUE), (by_size, SPIN)):
        if np.linalg.norm(part) > 0.02 * longest:
            along = 0.7 * LONGEST_ARROW * size / longest * part
            _arrow(axes, middle, along, colour)
            tips.append((middle + along)[None])
    return tips


def _cone(apex: FloatArray, frame: FloatArray, friction: float, height: float) -> Poly3DCollection:
    """The cone of forces that friction bears, its apex at the contact and open along n."""
    angle = np.linspace(0.0, 2.0 * np.pi, CORNERS + 1)
    aside = np.cos(angle)[:, None] * frame[:, 1] + np.sin(angle)[:, None] * frame[:, 2]
    rim = apex + height * (frame[:, 0] + friction * aside)
    sides = np.stack([np.broadcast_to(apex, rim[:-1].shape), rim[:-1], rim[1:]], axis=1)
    return Poly3DCollection(sides, facecolors=CONE, edgecolors=CONE_EDGE, linewidths=0.15, alpha=0.35, zorder=2)


def _arrow(axes: Axes3D, start: FloatArray, along: FloatArray, colour: str) -> None:
    if np.linalg.norm(along) > 0.0:
        axes.quiver(*start, *along, color=colour, linewidth=2.0, arrow_length_ratio=0.16, zorder=5)


def _frame_space(axes: Axes3D, ends: FloatArray) -> None:
    low, high = ends.min(axis=0), ends.max(axis=0)
    # one contact without load has no size: then it is drawn in a box of 1 mm
    half = max(0.55 * float((high - low).max()), 0.5)
    for axis, centre in zip((axes.xaxis, axes.yaxis, axes.zaxis), 0.5 * (low + high), strict=True):
        axis.set_view_interval(centre - half, centre + half, ignore=True)
    style_space(axes)
    axes.set_box_aspect((1.0, 1.0, 1.0), zoom=1.08)
    axes.view_init(elev=ELEVATION, azim=AZIMUTH)


def _draw_shares(axes: Axes, grasp: GraspContacts, forces: FloatArray) -> None:
    shares = np.nan_to_num(limit_shares(grasp, forces), posinf=0.0)
    at = np.arange(len(grasp), dtype=float)
    axes.barh(at, shares[:, 0], 0.34, color=MEASURED, label="together")
    axes.barh(at + 0.27, shares[:, 1], 0.16, color=CONE_EDGE, label="tangential force")
    axes.barh(at + 0.45, shares[:, 2], 0.16, color=SPIN, label="spin")
    axes.axvline(1.0, color=LIMIT, linewidth=1.4, linestyle=DASH_DOT, label="limit")
    axes.set_yticks(at + 0.15, [f"{i + 1}: {f:.2f} N" for i, f in enumerate(forces[:, 0])])
    axes.set_ylim(len(grasp) - 0.3, -0.5)
    axes.set_xlim(0.0, max(1.05, 1.05 * float(shares.max(initial=0.0))))
    style_axes(axes, x="share of the limit", y="contact, and its normal force [N]")
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.14), ncols=2, fontsize=SMALL_SIZE, frameon=False)
