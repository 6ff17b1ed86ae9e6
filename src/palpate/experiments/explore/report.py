"""The report on an exploration."""

import math
from collections.abc import Iterator
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from palpate.errors import FloatArray
from palpate.estimation import Assumption
from palpate.experiments.explore.exploration import ExplorationResult, marks_text, missed_marks
from palpate.experiments.explore.explored_map import ExploredMap
from palpate.experiments.explore.explored_object import object_line
from palpate.experiments.explore.findings import explored_enough
from palpate.experiments.explore.map_growth import growth_figure, snapshots_figure
from palpate.experiments.explore.surface_figure import MICRO, MILLI, contour_figure, surface_figure
from palpate.experiments.explore.tables import candidate_rows, layer_rows, map_rows, shape_rows, shape_sentence
from palpate.experiments.kit.metric import NOT_KNOWN
from palpate.experiments.kit.recorded_periods import recorded_series
from palpate.experiments.kit.recorded_run import change_rows
from palpate.experiments.kit.run_report import log_row, report_of
from palpate.mapping import TouchCloud
from palpate.reporting.data import Quantity, TimeSeries
from palpate.reporting.figure import TIME, Axis, Figure, Panel
from palpate.reporting.marks import Bars, Line, Rule, unnamed
from palpate.reporting.report import Figures, FigureSource, Paragraph, QuantityTable, Report, Section, TextTable
from palpate.reporting.run_figures import force_overview, force_zoom, phase_spans, true_and_felt
from palpate.robots.known_truth import cost_of, cost_row
from palpate.runtime import Ending

if TYPE_CHECKING:
    from palpate.experiments.explore.experiment import Explore

MIN_SPIN_SPAN = 0.01
"""Least span of the scale of torque to either side [mN m]; fine sensors resolve no less (ATI Nano17 SI-12-0.12:
1/64 mN m)."""


def exploration_report(experiment: "Explore", result: ExplorationResult) -> Report:
    """Return the report on an exploration."""
    config, found = result.config, result.map
    surface = contour_figure if result.plan.scan.kind == "contour" else surface_figure
    nothing = "" if len(result.cloud) else "The finger felt nothing, so there is no surface to show."
    run = result.run
    # the band is widened for fine detail, but not for a model at a limit of its search
    within_bounds = found is None or not found.verdict.breaks(Assumption.WITHIN_BOUNDS)
    speed = (
        Quantity("real-time factor", run.real_time_factor, "", f"control at {1 / run.timing.period:g} Hz"),
        Quantity("sensing and control, median", MICRO * run.timing.compute_spread.p50, "µs", "per period"),
    )
    return report_of(
        experiment,
        result,
        title=f"Exploration of {config.thing} by touch",
        outcome=_outcome(result),
        sections=(
            Section("The surface", (Paragraph(nothing), Figures(lambda: (surface(result),)))),
            *(() if found is None else _map_sections(result, found)),
            Section("Errors of single points", (Figures(lambda: _error_figures(result)),)),
            Section("Over time", (QuantityTable(speed), Figures(lambda: _time_figures(result)))),
        ),
        asked=(
            f"to touch {config.thing} with {config.force:g} N at {MILLI * config.speed:g} mm/s, "
            f"strategy {config.strategy}, carried by {config.robot}"
        ),
        settings=settings(result),
        footer="Lengths and forces in the robot's base frame.",
        reached=run.ending is Ending.DONE and within_bounds and explored_enough(result),
    )


def _outcome(result: ExplorationResult) -> str:
    """Return the ending of the run in one sentence."""
    run = result.run
    share = f"{100.0 * result.coverage:.0f} %" if math.isfinite(result.coverage) else ""
    felt = f"{len(result.cloud)} contacts{f' over {share} of what could be felt' if share else ''}"
    if run.ending is Ending.DONE:
        why = "" if result.stop_reason is None else f"; {result.stop_reason.value}"
        left = missed_marks(result.marks)
        places = "one place" if len(left) == 1 else f"{len(left)} places"
        missed = f", but {places} could not be felt ({marks_text(left)})" if left else ""
        return f"Finished: {felt} in {run.duration:.1f} s{missed}{why}; {run.rest}."
    if run.ending is Ending.TRIPPED:
        return f"Stopped by the supervisor: {run.why}; {run.rest}. Until then {felt}."
    nothing = ", nothing was met" if run.ending is Ending.LOST and not len(result.cloud) else ""
    marked = f"; marked: {marks_text(result.marks)}" if result.marks else ""
    found = f" and {felt}" if len(result.cloud) else ""
    return f"Not finished ({run.ending.value}{nothing}{marked}) after {run.duration:.1f} s{found}; {run.rest}."


def _map_sections(result: ExplorationResult, found: ExploredMap) -> Iterator[Section]:
    nothing = "" if len(found.mesh.triangles) else "Contacts are too far apart: nothing of it counts as observed."
    # a line claims no surface, so that its assumptions need no confirmation
    verdict = () if found.is_line and found.verdict.ok else tuple(map(Paragraph, found.verdict.lines()))
    rows = TextTable((*map_rows(found), *layer_rows(found)))
    yield Section("The map", (*verdict, rows, Paragraph(nothing)))
    yield Section("How the map grew", (Figures(lambda: _growth_figures(result)),))
    if found.shape is not None:
        candidates = TextTable(candidate_rows(found.shape), heads=("shape", "misses by", "", "verdict"))
        sentence = Paragraph(shape_sentence(found, found.shape))
        yield Section("Which shape it is", (sentence, TextTable(shape_rows(found.shape)), candidates))


def _growth_figures(result: ExplorationResult) -> Iterator[FigureSource]:
    growth = result.growth
    if growth is not None and growth.area.any():
        yield partial(growth_figure, growth)
    if growth is not None:
        yield partial(snapshots_figure, growth)


def _error_figures(result: ExplorationResult) -> Iterator[Figure]:
    error = MICRO * result.point_error
    if not (result.truth.known and len(error)):
        return
    mean, rms = float(error.mean()), float(np.sqrt((error**2).mean()))
    # it adds mu Dn (b_f v + |a_t|), with Dn and the friction damping rate b_f as in MuJoCo's soft contacts;
    # sensing attributes the whole normal force to compression
    artefact = (
        " Where the finger accelerates, as at corners, points come out outside: MuJoCo's friction adds to the "
        "normal force, an artefact of the simulated contact, not of touch."
        if result.point_error.max() > 2e-6
        else ""
    )
    bars = (Bars.histogram(error), Rule(0.0))
    yield Figure(
        title="How large the errors are",
        caption=(
            f"Signed distances of {len(error)} points from the true surface: root mean square {rms:.3g} µm, "
            f"mean {mean:.3g} µm, largest {np.abs(error).max():.3g} µm. Narrow and about zero is good.{artefact}"
        ),
        panels=(Panel(bars, Axis("error of the points", "µm"), Axis("number of points")),),
    )


def _time_figures(result: ExplorationResult) -> Iterator[FigureSource]:
    record, truth = result.record, result.truth
    series = recorded_series(
        record,
        result.set_force,
        true_force=np.where(truth.touching, result.true_normal_force, np.nan) if truth.known else None,
        true_spin_torque=np.where(truth.touching, result.true_spin_torque, np.nan) if truth.known else None,
    )
    if series.phase:
        yield partial(force_overview, series)
        yield partial(force_zoom, series)
        yield partial(spin_figure, series, result.cloud)


def spin_figure(series: TimeSeries, cloud: TouchCloud) -> Figure:
    """Return the figure of spin torque and force ratio over the whole run."""
    true = None if series.true_spin_torque is None else MILLI * series.true_spin_torque
    spin = true_and_felt(series.time, true, MILLI * series.spin_torque)
    ratio = Line(*_force_ratio(cloud), width=1.2)
    spans = phase_spans(series)
    return Figure(
        title="Spin torque and friction",
        caption=(
            "Torque about the contact normal, and tangential over normal force, which while sliding is the "
            "coefficient of friction; contacts much lighter than usual are left out of the ratio. Torques far "
            f"below {MIN_SPIN_SPAN:g} mN m are rounding. Felt torque on the true one, and an even ratio, "
            "are good."
        ),
        panels=(
            Panel((*spans, *spin), TIME, Axis("spin torque", "mN m", span=2.0 * MIN_SPIN_SPAN), height=240),
            Panel((*unnamed(spans), ratio), TIME, Axis("tangential / normal force", low=0.0), height=200),
        ),
        wide=True,
    )


def _force_ratio(cloud: TouchCloud) -> tuple[FloatArray, FloatArray]:
    """Return time and |tangential| / normal force, with a NaN in each gap to break the line."""
    if not len(cloud):
        return cloud.time, cloud.time
    # while landing and lifting the ratio is noise over noise, and would set the scale
    pushing = cloud.normal_force > 0.1 * max(float(np.median(cloud.normal_force)), 0.0)
    time = cloud.time[pushing]
    ratio = np.linalg.norm(cloud.tangential_force[pushing], axis=1) / cloud.normal_force[pushing]
    steps = np.diff(time)
    if len(steps) == 0:
        return time, ratio
    gaps = np.flatnonzero(steps > 5.0 * np.median(steps)) + 1
    return np.insert(time, gaps, time[gaps - 1]), np.insert(ratio, gaps, np.nan)


def settings(result: ExplorationResult) -> tuple[tuple[str, str], ...]:
    """Return the request with units, and the gain that followed from it."""
    config, known = result.config, result.truth.known
    friction = f"{config.friction:g}, {MILLI * config.spin_length:g} mm" if known else NOT_KNOWN
    force_noise, moment_noise = config.noise
    swing = f", ± {config.force_swing:g} N as a sine of {config.force_period:g} s" if config.force_swing else ""
    return (
        ("object", object_line(result.plan.setup.task.target, config)),
        ("fingertip", f"{' x '.join(f'{MILLI * s:g}' for s in config.tip)} mm"),
        ("normal force", f"{config.force:g} N{swing}"),
        ("speed along the surface", f"{MILLI * config.speed:g} mm/s"),
        ("a wall in its path", str(result.plan.wall)),
        (config.strategy, result.plan.scan.line),
        ("friction, spin length", friction),
        (f"contact stiffness, {'simulated and ' if known else ''}assumed", f"{config.stiffness / 1e3:g} kN/m"),
        ("sensor noise", f"{MILLI * force_noise:g} mN, {MILLI * moment_noise:g} mN m, seed {config.seed}"),
        ("robot", config.robot),
        *cost_row(cost_of(result.plan.ready.backend)),
        ("control period", f"{MILLI * result.run.timing.period:g} ms"),
        *_force_law(result),
        *change_rows(result.changes),
        *log_row(result.run),
    )


def _force_law(result: ExplorationResult) -> tuple[tuple[str, str], ...]:
    """Return the law of force control with its margins, and the contact that it is made for."""
    gain, found = result.plan.parameters.gain, result.plan.identified
    if found is None:
        gains = (
            f"{MILLI * gain.gain:.3g} mm/s/N from K = {gain.stiffness / 1e3:.3g} kN/m and T = "
            f"{MILLI * gain.delay:.3g} ms: loop gain k K T = {gain.loop_gain:.2g} (unstable from 1.57), gain "
            f"margin {gain.gain_margin:.2g}, phase margin {gain.phase_margin_deg:.0f} degrees"
        )
        return (("force gain", gains),)
    law = f"an admittance of {found.mass:.3g} kg and {found.damping:.3g} N s/m" if found.mass else "the direct law"
    return (
        (
            "identified by pressing",
            f"contact {found.contact_stiffness / 1e3:.3g} ± {found.contact_stiffness_sd / 1e3:.1g} kN/m, with the "
            f"robot {found.series_stiffness / 1e3:.3g} kN/m",
        ),
        (
            "force gain",
            f"{MILLI * gain.gain:.3g} mm/s/N by {law}; as measured, gain margin {found.gain_margin:.2g}, phase "
            f"margin {found.phase_margin_deg:.0f} degrees",
        ),
    )
