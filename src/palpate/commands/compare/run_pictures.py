"""Several runs in one picture: lines over one another, and how errors are spread."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure

from palpate.errors import FloatArray
from palpate.experiments.kit.comparable import ErrorSample
from palpate.reporting.envelope import envelope
from palpate.reporting.style import (
    DASHED,
    INK,
    SIDE_BY_SIDE,
    Picture,
    Width,
    label,
    legend_above,
    new_figure,
    style_axes,
)

LONGEST_NAME = 32
"""Letters of a run's name in a legend."""

SHOWN_PERCENT = 99.5
"""Of all errors within the axis: a few outliers do not hide the rest."""

BINS = 60


@dataclass(frozen=True, slots=True, eq=False)
class Curve:
    """One line of one run.

    Attributes:
        run: Whose, from 0.
        time: Since its first period, shape (n,) [s].
        y: Shape (n,), may hold NaN.
        is_set_force: Whether it is the set force, drawn dashed.
    """

    run: int
    time: FloatArray
    y: FloatArray
    is_set_force: bool = False


def overlay_picture(
    title: str, caption: str, y: str, curves: Sequence[Curve], names: Sequence[str]
) -> Picture | None:
    """Return the runs' lines over one another, each in its run's colour; None if there is none."""
    if not any(np.isfinite(curve.y).any() for curve in curves):
        return None
    return Picture(
        title, caption, _overlay(y, curves, names, Width.FULL), narrow=_overlay(y, curves, names, Width.HALF)
    )


def spread_picture(samples: Sequence[ErrorSample | None], names: Sequence[str]) -> Picture | None:
    """Return the shares of each run's errors; None if no run has any."""
    values_of = [np.zeros(0) if each is None else each.values for each in samples]
    known = [values for values in values_of if len(values)]
    first = next((each for each in samples if each is not None and len(each.values)), None)
    if first is None:
        return None
    figure = new_figure(Width.HALF, 3.8)
    axes = figure.subplots()
    together = np.concatenate(known)
    low, high = np.percentile(together, [100.0 - SHOWN_PERCENT, SHOWN_PERCENT]).tolist()
    room = max(0.05 * (high - low), 1e-9)
    bins = np.linspace(low - room, high + room, BINS + 1)
    for run, values in enumerate(values_of):
        if not len(values):
            continue
        share, _ = np.histogram(np.clip(values, bins[0], bins[-1]), bins)
        axes.stairs(
            100.0 * share / len(values),
            bins,
            color=colour_of(run),
            linewidth=1.5,
            label=label(names[run], LONGEST_NAME),
        )
    axes.axvline(0.0, color=INK, linewidth=0.8)
    style_axes(axes, x=first.axis, y="share of the points [%]")
    legend_above(figure, [axes], columns=2)
    return Picture(first.title, first.caption, figure)


def colour_of(run: int) -> str:
    """Return the colour of a run, from 0."""
    return SIDE_BY_SIDE[run % len(SIDE_BY_SIDE)]


def _overlay(y: str, curves: Sequence[Curve], names: Sequence[str], width: Width) -> Figure:
    figure = new_figure(width, 3.6)
    axes = figure.subplots()
    for curve in curves:
        name = label(names[curve.run], LONGEST_NAME)
        axes.plot(
            *envelope(curve.time, curve.y),
            color=colour_of(curve.run),
            linewidth=1.4 if curve.is_set_force else 1.0,
            linestyle=DASHED if curve.is_set_force else ("-", ":")[curve.run // len(SIDE_BY_SIDE) % 2],
            alpha=1.0 if curve.is_set_force else 0.8,
            label=f"{name}, set" if curve.is_set_force else name,
        )
    axes.margins(x=0.0)
    style_axes(axes, x="time [s]", y=y)
    legend_above(figure, [axes], columns=4 if width is Width.FULL else 2)
    return figure
