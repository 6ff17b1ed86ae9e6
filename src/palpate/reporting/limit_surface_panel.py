"""Where the load of a contact was inside its limit surface: how often, and at each moment that is played."""

import numpy as np

from palpate.errors import FloatArray, InvalidValueError
from palpate.friction import LimitSurface
from palpate.reporting.figure import Axis, Panel
from palpate.reporting.marks import Density, Line, Moving, Points, Symbol
from palpate.runtime.palette import BOUND, FELT, INK_COLOUR, Colour

RIM = 1.25
"""Loads beyond this ratio are shown there: while landing and lifting they are noise over noise."""

CELLS = 80
"""Columns of the density, and twice its rows."""


def limit_surface_panel(
    surface: LimitSurface,
    loads: FloatArray,
    moments: FloatArray,
    worst: int,
    title: str = "",
    colour: Colour = FELT,
) -> Panel:
    """Return the panel of a contact's loads inside its limit surface.

    Args:
        surface: As measured, or as assumed.
        loads: Normal force [N], tangential force (its length) [N], spin torque [N m], evenly in time,
            shape (n, 3). Instants that do not push are left out.
        moments: Of each step of the figure, likewise, shape (steps, 3).
        worst: Step of the worst of them.
        title: Of the panel.
        colour: Of the density: whether loads were felt or are true.

    Raises:
        InvalidValueError: Shapes that are no loads.
    """
    for name, each in (("loads", loads), ("moments", moments)):
        if each.ndim != 2 or each.shape[1] != 3:
            raise InvalidValueError(f"{name} has shape {each.shape}: must hold three numbers of each load")
    half = np.linspace(0.0, np.pi, 361)
    power = 2.0 / surface.norm_exponent
    x, y = np.sign(np.cos(half)) * np.abs(np.cos(half)) ** power, np.sin(half) ** power
    shown, at = rimmed_ratios(surface, loads), rimmed_ratios(surface, moments)
    columns, rows = np.linspace(-RIM, RIM, CELLS + 1), np.linspace(0.0, RIM, CELLS // 2 + 1)
    known = shown[np.isfinite(shown).all(axis=1)]
    counts, _, _ = np.histogram2d(known[:, 1], known[:, 0], bins=(rows, columns))
    return Panel(
        (
            Density(columns, rows, counts / max(len(known), 1), "load", colour),
            Line(x, y, colour=INK_COLOUR),
            Points(at[[worst], 0], at[[worst], 1], "worst", BOUND, size=10.0, symbol=Symbol.DIAMOND),
            Moving(at[:, 0], at[:, 1], "now"),
        ),
        Axis("tau / (mu e f_n)", low=-RIM, high=RIM),
        Axis("f_t / (mu f_n)", low=0.0, high=RIM),
        title,
        equal=True,
        height=290,
    )


def load_ratios(surface: LimitSurface, loads: FloatArray) -> FloatArray:
    """Return tau / (mu e f_n) and f_t / (mu f_n), shape (n, 2); NaN where nothing pushes.

    Args:
        surface: That bears the loads.
        loads: f_n [N], f_t [N], tau [N m], shape (n, 3).
    """
    normal = np.where(loads[:, 0] > 0.0, loads[:, 0], np.nan)
    most = surface.friction * normal
    e = surface.spin_length * normal**surface.load_exponent
    return np.column_stack([loads[:, 2] / (most * e), loads[:, 1] / most])


def load_sizes(surface: LimitSurface, loads: FloatArray) -> FloatArray:
    """Return the norm of loads (..., 3) that is 1 on the limit surface, shape (...); NaN where nothing pushes."""
    ratios = load_ratios(surface, loads.reshape(-1, 3))
    p = surface.norm_exponent
    return np.asarray((np.abs(ratios) ** p).sum(axis=1) ** (1.0 / p)).reshape(loads.shape[:-1])


def rimmed_ratios(surface: LimitSurface, loads: FloatArray) -> FloatArray:
    """Return the ratios of loads, those beyond `RIM` drawn in towards it, shape (n, 2)."""
    size = load_sizes(surface, loads)
    beyond = np.where(size > RIM, size / (0.999 * RIM), 1.0)
    return np.asarray(load_ratios(surface, loads) / beyond[:, None])
