"""Figures of a tip calibration: the tip typed and found with the touches on it, and what is left over."""

from collections.abc import Iterator
from functools import partial

import numpy as np

from palpate.errors import FloatArray
from palpate.experiments.tip_calibration.found_tip import found_points
from palpate.experiments.tip_calibration.places import tip_points
from palpate.experiments.tip_calibration.result import TipCalibrationResult
from palpate.reporting.figure import Axis, Figure, Panel, Space
from palpate.reporting.marks import Band, Colouring, ColourScale, Mark, Points, Rule, look_of
from palpate.reporting.report import FigureSource
from palpate.reporting.solids import Solid, Spots, Surface
from palpate.runtime.palette import BOUND, FELT, QUIET_COLOUR, SET, TRUTH
from palpate.sensing.tip_calibration import TipFit

TURNS, RINGS = 48, 25
"""Normals of a drawn tip, around and from pole to pole."""

MICRO = 1e6


def calibration_figures(result: TipCalibrationResult) -> Iterator[FigureSource]:
    """Return the figures; none without touches."""
    if result.fit is not None:
        yield partial(tip_figure, result, result.fit)
        yield partial(residual_figure, result.fit)
        yield partial(time_figure, result.fit)


def tip_figure(result: TipCalibrationResult, fit: TipFit) -> Figure:
    """Return the tip found beside the typed one, with the touches on it."""
    gap = MICRO * fit.residuals[:, 0]
    normals, triangles = _sphere()
    typed, found = tip_points(result.known.tip, normals), found_points(fit, normals)
    off = MICRO * np.einsum("ni,ni->n", found - typed, normals)
    colouring = Colouring("found less typed", off, "um", scale=ColourScale.ERROR, **_even(off))
    names = [target.name for target in fit.unknowns.targets]
    texts = tuple(
        f"touch {i}, {names[at]}: {each:.1f} um"
        for i, (at, each) in enumerate(zip(fit.touches.target, gap, strict=True))
    )
    marks: list[Solid] = [
        Surface(found, triangles, "found", (colouring,), opacity=0.85),
        Surface(typed, triangles, "typed", colour=SET, opacity=0.25),
        Spots(fit.solved.centroid, "touches", FELT, 5.0, texts=texts),
    ]
    if result.true is not None:
        marks.append(
            Surface(
                tip_points(result.true.tip, normals), triangles, "true", colour=TRUTH, opacity=0.3, shown=False
            )
        )
    return Figure(
        title="The tip, typed and found",
        caption=(
            "In the sensor frame. Colours tell how far the tip that was found lies outside of the typed one; dots "
            "are where it was touched. Good is a tip with touches on every side that is to be used."
        ),
        panels=(Space(tuple(marks), height=520, view=(0.7, -1.0, -0.5)),),
        wide=True,
    )


def residual_figure(fit: TipFit) -> Figure:
    """Return what each touch leaves over, in its standard deviations."""
    which = ("gap, by the arm", "lever, by the sensor", "lever, across it")
    panels = []
    for k, name in enumerate(which):
        rows = np.arange(float(len(fit.touches)))
        expected = MICRO * 1.96 * fit.expected[:, k]
        marks: list[Mark] = [Band(rows, -expected, expected, "95 % as expected", QUIET_COLOUR)]
        for j, target in enumerate(fit.unknowns.targets):
            at = fit.touches.target == j
            marks.append(_dots(rows[at], MICRO * fit.residuals[at, k], target.name, j))
        marks.append(Rule(0.0, "", QUIET_COLOUR, upright=False))
        panels.append(Panel(tuple(marks), Axis("number of the touch"), Axis(name, "um"), height=220))
    return Figure(
        title="What each touch leaves over",
        caption=(
            "Of each touch, in order: by how much tip and target overlap in the model, and how far the contact "
            "lies beside the line of the force. Good is white scatter, 95 % of it within the band."
        ),
        panels=tuple(panels),
    )


def time_figure(fit: TipFit) -> Figure:
    """Return the overlap over force and time: a skin of another law, and what has moved, show here."""
    force, time = fit.solved.normal_force, fit.touches.time - fit.touches.time.min()
    gap, panels = MICRO * fit.residuals[:, 0], []
    for x, axis in ((force, Axis("normal force", "N")), (time, Axis("time", "s"))):
        marks: list[Mark] = [
            _dots(x[at], gap[at], target.name, j)
            for j, target in enumerate(fit.unknowns.targets)
            if (at := fit.touches.target == j).any()
        ]
        marks.append(Rule(0.0, "", BOUND, upright=False))
        panels.append(Panel(tuple(marks), axis, Axis("gap", "um"), height=260))
    return Figure(
        title="Over force and time",
        caption=(
            "What is left of the overlap, over the normal force, where a skin of another law shows as a bend, and "
            "over time, where a tip or target that has moved shows as a step."
        ),
        panels=tuple(panels),
        columns=2,
    )


def _dots(x: FloatArray, y: FloatArray, name: str, target: int) -> Points:
    colour, _, symbol, _ = look_of(target)
    return Points(x, y, name, colour, 6.0, symbol)


def _even(values: FloatArray) -> dict[str, float]:
    most = max(float(np.abs(values).max()), 1.0)
    return {"low": -most, "high": most}


def _sphere() -> tuple[FloatArray, np.ndarray[tuple[int, int], np.dtype[np.intp]]]:
    """Normals all around, and triangles between them."""
    polar = np.linspace(1e-3, np.pi - 1e-3, RINGS)
    around = np.linspace(0.0, 2.0 * np.pi, TURNS, endpoint=False)
    p, a = (each.ravel() for each in np.meshgrid(polar, around, indexing="ij"))
    normals = np.column_stack([np.sin(p) * np.cos(a), np.sin(p) * np.sin(a), np.cos(p)])
    i, j = (each.ravel() for each in np.meshgrid(np.arange(RINGS - 1), np.arange(TURNS), indexing="ij"))
    here, beside = i * TURNS + j, i * TURNS + (j + 1) % TURNS
    first = np.column_stack([here, beside, here + TURNS])
    second = np.column_stack([beside, beside + TURNS, here + TURNS])
    return normals, np.concatenate([first, second])
