"""A grasp over time: grip against the least, slip and spin with alarms; and each load in its limit surface."""

from itertools import pairwise

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from palpate.experiments.grasp.result import Grasp
from palpate.experiments.grasp.truth import STAGES
from palpate.reporting.envelope import envelope
from palpate.reporting.limit_surface_picture import limit_surface_picture
from palpate.reporting.style import (
    DASH_DOT,
    DASHED,
    INK,
    LIMIT,
    MEASURED,
    MILLI,
    OTHER_PHASE,
    SPIN,
    STAGE_COLOURS,
    TRUE,
    WANTED,
    Picture,
    Width,
    legend_above,
    new_figure,
    style_axes,
)

HIGHEST = 1.15
"""Grip is drawn up to this share of the largest while it was held: impacts are left out."""

NO_SLIP, NO_SPIN = 0.01, 0.1
"""The scales span at least this [mm], [degrees]: below is the elastic deflection of contacts."""

SLIDES, SPINS = TRUE, SPIN


def grip_picture(grasp: Grasp, note: str = "") -> Picture:
    """Return the picture of grip, wanted and true, against the least that would do.

    Args:
        grasp: What came of it.
        note: For the end of the title.
    """
    return Picture(
        title=f"Grip against the least{note}",
        caption=(
            "Normal force of each finger (mean), as it was set and as it was, and the least that the true load "
            "needs with the true friction, shared as best it can be; known while the object is held in the air. "
            "At the end the table pushes the object up between the fingers, and the grip that would hold against "
            "that jumps. From there on the hand keeps its grip until it lets go. A grip slightly above the "
            "least is good."
        ),
        full=_grip(grasp, Width.FULL, "true", TRUE),
        narrow=_grip(grasp, Width.HALF, "true", TRUE),
    )


def felt_grip_picture(grasp: Grasp) -> Picture:
    """Return the picture of grip, wanted and felt, of a robot on which nobody knows what would do."""
    return Picture(
        title="Grip",
        caption=("Normal force of each finger (mean), as set and as felt: the closer together the better."),
        full=_grip(grasp, Width.FULL, "felt", MEASURED),
        narrow=_grip(grasp, Width.HALF, "felt", MEASURED),
    )


def slip_picture(grasp: Grasp, note: str = "") -> Picture:
    """Return the picture of slip and spin by the truth, with alarms.

    Args:
        grasp: What came of it.
        note: For the end of the title.
    """
    alarms = f"{len(grasp.alarms_aloft)} alarm{'' if len(grasp.alarms_aloft) == 1 else 's'}, drawn as short lines"
    return Picture(
        title=f"Slip and spin{note}",
        caption=(
            "How far the object moved over the fingertips, and turned about the contact normals, in the air, "
            "since the lift began: the larger of the fingers, by the simulation's truth. Next to nothing is good. "
            f"Above: when slip was detected ({alarms})."
        ),
        full=_slip(grasp, Width.FULL),
        narrow=_slip(grasp, Width.HALF),
    )


def load_pictures(grasp: Grasp, note: str = "") -> list[Picture]:
    """Return for each finger the path of its load inside the limit surface, while figures count.

    Args:
        grasp: What came of it.
        note: For the end of the titles.
    """
    at, truth, surface = grasp.counted, grasp.truth, grasp.planned.true
    if not at.any():
        return []
    pictures = []
    for k in range(truth.fingers):
        drawn = limit_surface_picture(surface, truth.time[at], truth.loads[at, k], grasp.slipping[at, k])
        pictures.append(Picture(f"Load of finger {k + 1} in its limit surface{note}", drawn.caption, drawn.full))
    return pictures


def _grip(grasp: Grasp, width: Width, name: str, colour: str) -> Figure:
    figure = new_figure(width, 3.4)
    axes = figure.subplots()
    time = grasp.truth.time
    _shade(axes, grasp)
    axes.plot(*envelope(time, grasp.truth.target), color=WANTED, linewidth=1.0, linestyle=DASHED, label="set")
    axes.plot(*envelope(time, grasp.felt), color=colour, linewidth=1.1, label=name)
    held = np.isfinite(grasp.least)
    if held.any():
        axes.plot(*envelope(time, grasp.least), color=LIMIT, linewidth=1.6, linestyle=DASH_DOT, label="least")
        axes.set_ylim(0.0, HIGHEST * float(np.nanmax(np.maximum(grasp.felt[held], grasp.least[held]))))
    axes.margins(x=0.0)
    style_axes(axes, x="time [s]", y="grip [N]")
    legend_above(figure, [axes], columns=9 if width is Width.FULL else 4)
    return figure


def _slip(grasp: Grasp, width: Width) -> Figure:
    figure = new_figure(width, 4.0)
    slip, spin = figure.subplots(2, 1, sharex=True)
    truth, shown = grasp.truth, grasp.aloft
    time = truth.time
    at, alarms = time[shown], [alarm.time for alarm in grasp.alarms_aloft]
    for axes, values, colour, least in (
        (slip, MILLI * truth.slid, SLIDES, NO_SLIP),
        (spin, np.degrees(truth.turned), SPINS, NO_SPIN),
    ):
        if len(at):
            axes.axvspan(float(at[0]), float(at[-1]), color=STAGE_COLOURS["hold"], linewidth=0, zorder=0)
        worst = np.where(shown, values.max(axis=1), np.nan)
        axes.plot(*envelope(time, worst), color=colour, linewidth=1.4)
        top = max(least, 1.1 * float(values[shown].max(initial=0.0)))
        axes.set_ylim(0.0, 1.12 * top)
        if alarms:
            axes.vlines(alarms, 1.03 * top, 1.12 * top, color=INK, linewidth=0.8, label="alarm")
    style_axes(slip, x="", y="slip [mm]")
    style_axes(spin, x="time [s]", y="spin [degrees]")
    if len(at):
        spin.set_xlim(float(at[0]) - 0.2, float(at[-1]) + 0.2)
    figure.align_ylabels()
    legend_above(figure, [slip], columns=9 if width is Width.FULL else 4)
    return figure


def _shade(axes: Axes, grasp: Grasp) -> None:
    """Lay the stages on the ground of a plot over time, each once in its legend."""
    names, time = np.array([str(STAGES[i]) for i in grasp.truth.stage], dtype=np.str_), grasp.truth.time
    begins = np.concatenate([[0], np.flatnonzero(names[1:] != names[:-1]) + 1, [len(names) - 1]])
    named = set()
    for i, j in pairwise(begins):
        if i >= j:
            continue
        name = str(names[i])
        label = None if name in named else name
        colour = STAGE_COLOURS.get(name, OTHER_PHASE)
        axes.axvspan(float(time[i]), float(time[j]), color=colour, linewidth=0, label=label, zorder=0)
        named.add(name)
