"""The report on a tip calibration, with its figures."""

import math
from collections.abc import Iterator
from dataclasses import replace
from functools import partial

import numpy as np
import trimesh

from palpate.errors import FloatArray
from palpate.experiments.kit.experiment import ExperimentDefaults
from palpate.experiments.kit.run_report import report_of
from palpate.experiments.tip_calibration.findings import ROBOT_FILE, TIP_FILE
from palpate.experiments.tip_calibration.found_tip import found_points, surface_entry, surface_sd_entry
from palpate.experiments.tip_calibration.places import tip_points
from palpate.experiments.tip_calibration.result import TipCalibrationResult
from palpate.reporting.data import Quantity
from palpate.reporting.figure import Axis, Figure, Panel, Space
from palpate.reporting.marks import Band, Colouring, ColourScale, Mark, Points, Rule, look_of
from palpate.reporting.report import Figures, FigureSource, Paragraph, QuantityTable, Report, Section, TextTable
from palpate.reporting.solids import Solid, Spots, Surface
from palpate.runtime import Ending
from palpate.runtime.palette import BOUND, FELT, QUIET_COLOUR, SET, TRUTH
from palpate.sensing.tip_calibration import TipFit
from palpate.yaml_text import yaml_text

_TIP_BLOCKS = ("size", "center", "rotation", "stiffness", "exponent", "deviations", "mount_turn", "mount_shift")
"""Blocks of unknowns that belong to the tip and its mounting."""

_SHOWN_UNITS = {"m": (1e3, "mm"), "rad": (180.0 / math.pi, "degrees")}
"""Factor and unit by which lengths and angles are shown."""

_LOG_PREFIX = "log_"
"""Beginning of the names of unknowns whose logarithm is sought."""

_SPHERE_COUNT = (25, 48)
"""Number of normals of a drawn tip, from pole to pole and around."""


def calibration_report(experiment: ExperimentDefaults, result: TipCalibrationResult) -> Report:
    """Return the report."""
    fit, config = result.fit, result.config
    outcome = f"{result.run}."
    if not config.moves:
        planned = f"{len(result.next_touches)} touches were planned; nothing was moved."
        outcome = planned if fit is None else f"{len(fit.touches)} touches of a file were evaluated."
    report = report_of(
        experiment,
        result,
        title="Calibration of a fingertip by touches",
        outcome=outcome,
        sections=() if fit is None else _sections(result, fit),
        asked=f"to find the fingertip of {config.robot} by touches",
        settings=_settings(result),
        footer=(
            "Lengths in the sensor frame; wrenches that the object exerts on the finger. Standard deviations "
            "count noise, scatter of the arm and errors of the sensor's matrix."
        ),
        reached=fit is None or (result.usable and result.run.ending is Ending.DONE),
    )
    # without motion there is no timing to show
    return report if config.moves else replace(report, sections=report.sections[:-1])


def _sections(result: TipCalibrationResult, fit: TipFit) -> tuple[Section, ...]:
    covariance = fit.model_covariance()
    placed = 1.96e3 * math.sqrt(float(np.trace(covariance[:3, :3])) / 3.0 + float(covariance[6, 6]))
    where = f"{ROBOT_FILE} is the robot file with it." if result.usable else "It is not to be used yet."
    note = (
        f"Entries of the finger, as in {TIP_FILE}. {where} Contacts on this tip are placed to +-{placed:.3g} mm "
        "(95 %), as far as its model decides."
    )
    entry = yaml_text({"surface": surface_entry(fit, result.robot), "surface_sd": surface_sd_entry(fit)})
    lines = TextTable([(line,) for line in entry.splitlines()], ("name",))
    return (
        Section("The tip", (QuantityTable(tuple(_tip_rows(fit))),)),
        Section("Figures", (Figures(lambda: _calibration_figures(result, fit)),)),
        Section("What was touched", (TextTable(_place_rows(fit)),)),
        Section("For the robot file", (Paragraph(note), lines)),
    )


def _tip_rows(fit: TipFit) -> Iterator[Quantity]:
    """Yield the found numbers, each with its standard deviation and typed value."""
    unknowns = fit.unknowns
    for i in (i for block in _TIP_BLOCKS for i in range(len(unknowns.each))[unknowns.blocks[block]]):
        each, value, sd = unknowns.each[i], float(fit.values[i]), float(fit.sd[i])
        typed, certain = each.typed, "determined" if fit.told[i] else "NOT determined by these touches"
        if each.name.startswith(_LOG_PREFIX):
            name, unit = each.name.removeprefix(_LOG_PREFIX), "N/m"
            typed, value = math.exp(typed), math.exp(value)
            sd *= value
        else:
            stem, _, ending = each.name.rpartition("_")
            factor, unit = _SHOWN_UNITS.get(ending, (1.0, ""))
            name = stem if ending in _SHOWN_UNITS else each.name
            typed, value, sd = factor * typed, factor * value, factor * sd
        note = f"+- {sd:.2g}; typed {typed:.6g}; {certain}"
        yield Quantity(name.replace("_", " "), value, unit, note, digits=6)
    if len(unknowns.tip.shape.round_about) == 3:
        yield Quantity("orientation", "-", "", "NOT determined: a sphere has none")


def _place_rows(fit: TipFit) -> list[tuple[str, str, str, str]]:
    """Return name, place, unit and direction of each target."""
    places = fit.unknowns.places(fit.values)
    rows = []
    for target, place, direction in zip(fit.unknowns.targets, places.place, places.direction, strict=True):
        at = ", ".join(f"{1e3 * each:.3f}" for each in place)
        along = "" if not direction.any() else "direction " + ", ".join(f"{each:.5f}" for each in direction)
        rows.append((target.name, at, "mm", along))
    return rows


def _settings(result: TipCalibrationResult) -> tuple[tuple[str, str], ...]:
    """Return name and value with unit of each setting."""
    config, known = result.config, result.known
    return (
        ("robot", config.robot),
        ("fingertip", f"{known.tip.shape.kind}, {known.tip.shape.sizes}"),
        ("forces", ", ".join(f"{force:g} N" for force in config.forces)),
        ("turn of the tip, largest", f"{known.turn:g} rad"),
        ("scatter of the arm, to begin with", f"{known.instrument.position_sd:g} m"),
        ("errors of the sensor's matrix, standard deviation", f"{known.instrument.accuracy:.2g} of full load"),
        ("targets", ", ".join(each.name for each in known.targets)),
        ("seed", str(config.seed)),
    )


def _calibration_figures(result: TipCalibrationResult, fit: TipFit) -> Iterator[FigureSource]:
    """Yield the figures of the tip, the residuals, and the gap over force and time."""
    yield partial(_tip_figure, result, fit)
    yield partial(_residual_figure, fit)
    yield partial(_gap_figure, fit)


def _tip_figure(result: TipCalibrationResult, fit: TipFit) -> Figure:
    """Return the found tip beside the typed one, with the touches on it."""
    gap = 1e6 * fit.residuals[:, 0]
    sphere = trimesh.creation.uv_sphere(count=_SPHERE_COUNT)
    normals, triangles = np.array(sphere.vertices), np.array(sphere.faces)
    typed, found = tip_points(result.known.tip, normals), found_points(fit, normals)
    off = 1e6 * np.einsum("ni,ni->n", found - typed, normals)
    most = max(float(np.abs(off).max()), 1.0)
    colouring = Colouring("found less typed", off, "µm", scale=ColourScale.ERROR, low=-most, high=most)
    names = [target.name for target in fit.unknowns.targets]
    texts = tuple(
        f"touch {i}, {names[at]}: {each:.1f} µm"
        for i, (at, each) in enumerate(zip(fit.touches.target, gap, strict=True))
    )
    marks: list[Solid] = [
        Surface(found, triangles, "found", (colouring,), opacity=0.85),
        Surface(typed, triangles, "typed", colour=SET, opacity=0.25),
        Spots(fit.solved.centroid, "touches", FELT, 5.0, texts=texts),
    ]
    if result.true is not None:
        points = tip_points(result.true, normals)
        marks.append(Surface(points, triangles, "true", colour=TRUTH, opacity=0.3, shown=False))
    return Figure(
        title="The tip, typed and found",
        caption=(
            "In the sensor frame. Colours show how far the found tip lies outside the typed one; dots are the "
            "touches. Good is a tip with touches on every side that is to be used."
        ),
        panels=(Space(tuple(marks), height=520, view=(0.7, -1.0, -0.5)),),
        wide=True,
    )


def _residual_figure(fit: TipFit) -> Figure:
    """Return the residuals of each touch."""
    panels = []
    for k, name in enumerate(("gap, by the arm", "lever, by the sensor", "lever, across it")):
        rows = np.arange(float(len(fit.touches)))
        expected = 1e6 * 1.96 * fit.expected[:, k]
        marks = (
            Band(rows, -expected, expected, "95 % as expected", QUIET_COLOUR),
            *_dots(fit, rows, 1e6 * fit.residuals[:, k]),
            Rule(0.0, "", QUIET_COLOUR, upright=False),
        )
        panels.append(Panel(marks, Axis("number of the touch"), Axis(name, "µm"), height=220))
    return Figure(
        title="What each touch leaves over",
        caption=(
            "Residuals of each touch, in order: the overlap of tip and target in the model, and the distance of "
            "the contact from the line of the force. Good is white scatter, 95 % of it within the band."
        ),
        panels=tuple(panels),
    )


def _gap_figure(fit: TipFit) -> Figure:
    """Return the overlap over force and time."""
    force, time = fit.solved.normal_force, fit.touches.time - fit.touches.time.min()
    panels = (
        Panel(
            (*_dots(fit, x, 1e6 * fit.residuals[:, 0]), Rule(0.0, "", BOUND, upright=False)),
            axis,
            Axis("gap", "µm"),
            height=260,
        )
        for x, axis in ((force, Axis("normal force", "N")), (time, Axis("time", "s")))
    )
    return Figure(
        title="Over force and time",
        caption=(
            "Residual of the overlap over the normal force, where a skin of another law shows as a bend, and over "
            "time, where a tip or target that has moved shows as a step."
        ),
        panels=tuple(panels),
        columns=2,
    )


def _dots(fit: TipFit, x: FloatArray, y: FloatArray) -> Iterator[Mark]:
    """Yield a value of each touch, in a look for each target."""
    for j, target in enumerate(fit.unknowns.targets):
        at, (colour, _, symbol, _) = fit.touches.target == j, look_of(j)
        if at.any():
            yield Points(x[at], y[at], target.name, colour, 6.0, symbol)
