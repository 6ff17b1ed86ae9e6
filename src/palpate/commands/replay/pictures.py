"""Recorded and replayed over time, and how far they are apart."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from palpate.errors import FloatArray
from palpate.reporting.envelope import envelope
from palpate.reporting.phases import shade
from palpate.reporting.style import (
    COMMANDED,
    MEASURED,
    MILLI,
    Picture,
    Width,
    legend_above,
    new_figure,
    style_axes,
)
from palpate.runtime import Record

RECORDED, REPLAYED = COMMANDED, MEASURED

SMALLEST_DRAWN = 1e-15
"""[mm/s]. Smaller differences, the last bits of velocities far below 1 mm/s, are drawn as this one."""


def velocity_picture(recorded: Record, replayed: Record) -> Picture:
    """Return the picture of the commanded velocity, axis by axis."""
    return Picture(
        title="Commanded velocity",
        caption=(
            "What was commanded when the run was recorded, and what comes out of the same samples now, for each "
            "axis of the base frame; the lines lie on each other where they agree, as they should if "
            "nothing was changed. The "
            "ground shows what the recorded controller was doing."
        ),
        full=_velocity(recorded, replayed, Width.FULL),
        narrow=_velocity(recorded, replayed, Width.HALF),
    )


def difference_picture(recorded: Record, replayed: Record) -> Picture | None:
    """Return the picture of how far the commands are apart, or None if they are not."""
    apart = _apart(recorded, replayed)
    if not np.nansum(apart) > 0.0:
        return None
    return Picture(
        title="How far the commands are apart",
        caption=(
            "Length of the difference between replayed and recorded velocity in every period, on a logarithmic "
            f"scale; periods without any are left open. The largest is {np.nanmax(apart):.3g} mm/s. "
            f"Nothing at all is "
            "good where nothing was changed."
        ),
        full=_difference(recorded, replayed, apart, Width.FULL),
        narrow=_difference(recorded, replayed, apart, Width.HALF),
    )


def felt_picture(recorded: Record, replayed: Record) -> Picture | None:
    """Return the picture of the felt normal force, or None if nothing was touched."""
    if not any(side.touching.any() for side in (recorded, replayed)):
        return None
    return Picture(
        title="Felt normal force",
        caption=(
            "The normal force that touch found in the same samples, then and now. It differs only if what sensing "
            "goes by was changed: fingertip, sensor, or set force and stiffness (how far the tip yields)."
        ),
        full=_felt(recorded, replayed, Width.FULL),
        narrow=_felt(recorded, replayed, Width.HALF),
    )


def _velocity(recorded: Record, replayed: Record, width: Width) -> Figure:
    figure = new_figure(width, 5.6)
    rows = figure.subplots(3, 1, sharex=True)
    for i, (axes, name) in enumerate(zip(rows, "xyz", strict=True)):
        shade(axes, recorded)
        _draw_both(axes, recorded.time, MILLI * recorded.command[:, i], MILLI * replayed.command[:, i])
        style_axes(axes, x="time [s]" if i == 2 else "", y=f"{name} [mm/s]")
        axes.margins(x=0.0)
    figure.align_ylabels()
    legend_above(figure, rows, columns=9 if width is Width.FULL else 4)
    return figure


def _difference(recorded: Record, replayed: Record, apart: FloatArray, width: Width) -> Figure:
    figure = new_figure(width, 2.8)
    axes = figure.subplots()
    shade(axes, recorded)
    shown = np.where(apart > 0.0, np.maximum(apart, SMALLEST_DRAWN), np.nan)
    axes.plot(*envelope(recorded.time, shown), color=REPLAYED, linewidth=1.0, marker=".", markersize=1.5)
    axes.set_yscale("log")
    axes.set_xlim(recorded.time[0], max(recorded.time[-1], recorded.time[0] + 1e-9))
    style_axes(axes, x="time [s]", y="difference [mm/s]")
    legend_above(figure, [axes], columns=9 if width is Width.FULL else 4)
    return figure


def _felt(recorded: Record, replayed: Record, width: Width) -> Figure:
    figure = new_figure(width, 3.0)
    axes = figure.subplots()
    shade(axes, recorded)
    _draw_both(axes, recorded.time, _felt_force(recorded), _felt_force(replayed))
    style_axes(axes, x="time [s]", y="normal force [N]")
    axes.margins(x=0.0)
    legend_above(figure, [axes], columns=9 if width is Width.FULL else 4)
    return figure


def _draw_both(axes: Axes, time: FloatArray, recorded: FloatArray, replayed: FloatArray) -> None:
    """A wide pale line below a thin one: where they agree, both are seen."""
    axes.plot(*envelope(time, recorded), color=RECORDED, linewidth=3.2, alpha=0.5, label="recorded")
    axes.plot(*envelope(time, replayed), color=REPLAYED, linewidth=1.0, label="replayed")


def _apart(recorded: Record, replayed: Record) -> FloatArray:
    """Length of the difference of velocities, shape (k,) [mm/s]."""
    return np.asarray(MILLI * np.linalg.norm(replayed.command - recorded.command, axis=1))


def _felt_force(side: Record) -> FloatArray:
    """Normal force that touch found, shape (k,) [N]; NaN without contact."""
    return np.where(side.touching, side.normal_force, np.nan)
