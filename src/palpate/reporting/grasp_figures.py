"""Figures of grasps: forces in space, shares of each contact's limit, and loads inside a limit surface."""

import numpy as np

from palpate.errors import FloatArray, InvalidValueError
from palpate.friction import LimitSurface
from palpate.grasp.problem.contacts import GraspContacts
from palpate.reporting.figure import Axis, Figure, Panel, Space
from palpate.reporting.marks import Bars, Dash, Density, Line, Moving, Points, Rule, Symbol
from palpate.reporting.solids import Arrows, Labels, Solid, Spots, Surface
from palpate.runtime.palette import (
    BOUND,
    CONE_COLOUR,
    CONE_RIM,
    FELT,
    INK_COLOUR,
    SET,
    SPIN_COLOUR,
    TRUTH,
    Colour,
)

MAX_RATIO = 1.25
"""Largest ratio of load to limit in the panel. Larger ones are drawn at its rim: they are noise over noise, while
landing and lifting."""

_CELLS = 80
"""Columns of the density, and twice its rows."""

_LONGEST_ARROW = 0.7
"""Length of the largest force, relative to the grasp's size."""

_CONE_HEIGHT = 0.3
"""Height of a friction cone, relative to the grasp's size."""

_CORNERS = 40
"""Corners of a friction cone."""

_MIN_SHARE = 0.02
"""Force or moment of a disturbance, relative to the other, below which its arrow is left out."""


def grasp_force_figure(
    grasp: GraspContacts,
    forces: FloatArray,
    load: FloatArray,
    disturbance: FloatArray | None = None,
) -> Figure:
    """Return the figure of a grasp under a load.

    Args:
        grasp: Contacts, in the object's frame.
        forces: (f_n, f_t1, f_t2, tau_n) of each contact on the object, shape (n, 4) [N, N, N, N m].
        load: Wrench of everything else on the object, about its origin, shape (6,) [N, N m].
        disturbance: Worst direction of a further load, shape (6,); None for none.

    Raises:
        InvalidValueError: If a shape does not fit the grasp.
    """
    for name, value, shape in (
        ("forces", forces, (len(grasp), 4)),
        ("load", load, (6,)),
        ("disturbance", disturbance, (6,)),
    ):
        if value is not None and value.shape != shape:
            raise InvalidValueError(f"{name} has shape {value.shape}: must be {shape}")
    worst = ", and the worst disturbance from the middle of the contacts" if disturbance is not None else ""
    return Figure(
        title="Forces of the grasp",
        caption=(
            "In space: what contacts exert on the object inside their friction cones (drawn without spin), and "
            f"the load{worst}. Bars: how much of its limit each contact uses, together and by tangential force "
            "or spin alone; below the limit with room is good."
        ),
        panels=(_space(grasp, forces, load, disturbance), _shares(grasp, forces)),
        columns=2,
        wide=True,
    )


def limit_shares(grasp: GraspContacts, forces: FloatArray) -> FloatArray:
    """Return |(f_t, tau / e)|_p, |f_t| and |tau| / e over mu f_n, shape (n, 3); NaN without normal force."""
    out = np.full((len(grasp), 3), np.nan)
    for i, (surface, (f, a, b, tau)) in enumerate(zip(grasp.surfaces, forces.tolist(), strict=True)):
        along = float(np.hypot(a, b))
        if f > 0.0:
            out[i] = [surface.load_ratio(f, x, abs(spin)) for x, spin in ((along, tau), (along, 0.0), (0.0, tau))]
    return out


def _space(grasp: GraspContacts, forces: FloatArray, load: FloatArray, disturbance: FloatArray | None) -> Space:
    places, middle = grasp.positions, grasp.positions.mean(axis=0)
    distances = np.linalg.norm(places - middle, axis=1)
    size = max(float(distances.max()), float(grasp.spin_length.max()))
    pushes = np.einsum("nij,nj->ni", grasp.frames, forces[:, :3])
    longest = max(float(np.linalg.norm(np.vstack([pushes, load[None, :3]]), axis=1).max()), 1e-300)
    along = _LONGEST_ARROW * size / longest * pushes
    outwards = (places - middle) / np.maximum(distances, 1e-12)[:, None]
    names = tuple(str(i + 1) for i in range(len(grasp)))
    marks: list[Solid] = [
        # an arrow that ends at the contact shows a push, and leaves the inside of the grasp free
        Arrows(places - along, along, "contact force", FELT),
        _cones(grasp, _CONE_HEIGHT * size),
        Arrows(middle[None], _LONGEST_ARROW * size / longest * load[None, :3], "load", SET),
        Spots(places, colour=INK_COLOUR),
        Labels(places - along + 0.12 * size * outwards, names),
    ]
    if disturbance is not None:
        marks += _disturbance(middle, disturbance, size)
    return Space(tuple(marks), height=400)


def _disturbance(middle: FloatArray, disturbance: FloatArray, size: float) -> list[Solid]:
    """Force, and moment about the middle of the contacts."""
    force = disturbance[:3]
    by_size = (disturbance[3:] - np.cross(middle, force)) / size
    longest = max(float(np.linalg.norm(force)), float(np.linalg.norm(by_size)), 1e-300)
    return [
        Arrows(middle[None], 0.7 * _LONGEST_ARROW * size / longest * part[None], name, colour)
        for part, name, colour in ((force, "worst force", TRUTH), (by_size, "worst moment", SPIN_COLOUR))
        if np.linalg.norm(part) > _MIN_SHARE * longest
    ]


def _cones(grasp: GraspContacts, height: float) -> Surface:
    """Friction cones with their apexes at the contacts, open along n."""
    corner, angle = np.arange(_CORNERS), np.linspace(0.0, 2.0 * np.pi, _CORNERS, endpoint=False)
    rings = np.stack([np.ones(_CORNERS), np.cos(angle), np.sin(angle)], axis=1)
    fan = np.stack([np.zeros_like(corner), 1 + corner, 1 + (corner + 1) % _CORNERS], axis=1)
    contacts = zip(grasp.positions, grasp.frames, grasp.friction.tolist(), strict=True)
    vertices = [np.vstack([at, at + height * (rings * [1.0, mu, mu]) @ axes.T]) for at, axes, mu in contacts]
    triangles = [i * (_CORNERS + 1) + fan for i in range(len(grasp))]
    return Surface(
        np.concatenate(vertices), np.concatenate(triangles), "friction cone", colour=CONE_COLOUR, opacity=0.45
    )


def _shares(grasp: GraspContacts, forces: FloatArray) -> Panel:
    shares = np.nan_to_num(limit_shares(grasp, forces), posinf=0.0)
    at, n = np.arange(len(grasp), dtype=float), len(grasp)
    ticks = tuple((i + 0.15, f"{i + 1}: {f:.2f} N") for i, f in enumerate(forces[:, 0].tolist()))
    return Panel(
        (
            Bars(at, shares[:, 0], np.full(n, 0.34), "together", FELT, lying=True),
            Bars(at + 0.27, shares[:, 1], np.full(n, 0.16), "tangential force", CONE_RIM, lying=True),
            Bars(at + 0.45, shares[:, 2], np.full(n, 0.16), "spin", SPIN_COLOUR, lying=True),
            Rule(1.0, "limit", BOUND, 1.4, Dash.DASH_DOT),
        ),
        Axis("share of the limit", low=0.0, high=max(1.05, 1.05 * float(shares.max(initial=0.0)))),
        Axis("contact, and its normal force", "N", low=n - 0.3, high=-0.5, ticks=ticks),
        height=400,
    )


def limit_surface_panel(
    surface: LimitSurface,
    loads: FloatArray,
    moments: FloatArray,
    worst: int,
    title: str = "",
    colour: Colour = FELT,
) -> Panel:
    """Return the panel of a contact's loads inside its limit surface: their density, and each step of the figure.

    Args:
        surface: Limit surface, measured or assumed.
        loads: Normal force [N], magnitude of the tangential force [N] and spin torque [N m], evenly in time,
            shape (n, 3). Instants without normal force are left out.
        moments: The same quantities in each step of the figure, shape (steps, 3).
        worst: Step of the largest load.
        title: Title of the panel.
        colour: Colour of the density, different for felt and true loads.

    Raises:
        InvalidValueError: If a shape is another one.
    """
    for name, each in (("loads", loads), ("moments", moments)):
        if each.ndim != 2 or each.shape[1] != 3:
            raise InvalidValueError(f"{name} has shape {each.shape}: must hold three numbers of each load")
    half = np.linspace(0.0, np.pi, 361)
    power = 2.0 / surface.norm_exponent
    x, y = np.sign(np.cos(half)) * np.abs(np.cos(half)) ** power, np.sin(half) ** power
    shown, at = _rimmed_ratios(surface, loads), _rimmed_ratios(surface, moments)
    columns = np.linspace(-MAX_RATIO, MAX_RATIO, _CELLS + 1)
    rows = np.linspace(0.0, MAX_RATIO, _CELLS // 2 + 1)
    known = shown[np.isfinite(shown).all(axis=1)]
    counts, _, _ = np.histogram2d(known[:, 1], known[:, 0], bins=(rows, columns))
    return Panel(
        (
            Density(columns, rows, "load", colour, shares=counts / max(len(known), 1)),
            Line(x, y, colour=INK_COLOUR),
            Points(at[[worst], 0], at[[worst], 1], "worst", BOUND, size=10.0, symbol=Symbol.DIAMOND),
            Moving(at[:, 0], at[:, 1], "now"),
        ),
        Axis("tau / (mu e f_n)", low=-MAX_RATIO, high=MAX_RATIO),
        Axis("f_t / (mu f_n)", low=0.0, high=MAX_RATIO),
        title,
        equal=True,
        height=290,
    )


def load_ratios(surface: LimitSurface, loads: FloatArray) -> FloatArray:
    """Return tau / (mu e f_n) and f_t / (mu f_n) of loads (f_n, f_t, tau), shape (n, 3) [N, N, N m].

    Returns:
        Ratios, shape (n, 2); NaN without normal force.
    """
    normal = np.where(loads[:, 0] > 0.0, loads[:, 0], np.nan)
    most = surface.friction * normal
    e = surface.spin_length * normal**surface.load_exponent
    return np.column_stack([loads[:, 2] / (most * e), loads[:, 1] / most])


def load_sizes(surface: LimitSurface, loads: FloatArray) -> FloatArray:
    """Return the norm of loads (..., 3) that is 1 on the limit surface, shape (...); NaN without normal force."""
    ratios = load_ratios(surface, loads.reshape(-1, 3))
    p = surface.norm_exponent
    return np.asarray((np.abs(ratios) ** p).sum(axis=1) ** (1.0 / p)).reshape(loads.shape[:-1])


def _rimmed_ratios(surface: LimitSurface, loads: FloatArray) -> FloatArray:
    """Ratios of loads, shape (n, 2); those beyond `MAX_RATIO` are drawn in towards it."""
    size = load_sizes(surface, loads)
    beyond = np.where(size > MAX_RATIO, size / (0.999 * MAX_RATIO), 1.0)
    return np.asarray(load_ratios(surface, loads) / beyond[:, None])
