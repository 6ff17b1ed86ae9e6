"""The report on an exploration."""

import math
import shlex
from collections.abc import Iterator

import numpy as np

from palpate.controllers.paths import GoalError, PathEvent, StopReason
from palpate.errors import FloatArray
from palpate.experiments.explore.assumption_check import assumption_sentences
from palpate.experiments.explore.config import ExploreConfig
from palpate.experiments.explore.contour_figure import contour_figure
from palpate.experiments.explore.exploration import ExplorationResult
from palpate.experiments.explore.explored_map import ExploredMap
from palpate.experiments.explore.explored_marks import NOT_FELT, marks_text, not_felt
from palpate.experiments.explore.explored_object import object_line
from palpate.experiments.explore.growth_figure import growth_figure
from palpate.experiments.explore.map_growth import MapGrowth
from palpate.experiments.explore.scans import ActiveScan, ContourScan, Scan
from palpate.experiments.explore.snapshots_figure import snapshots_figure
from palpate.experiments.explore.surface_figure import surface_figure
from palpate.experiments.explore.tables import (
    TOO_LITTLE,
    as_known,
    candidate_rows,
    layer_rows,
    map_rows,
    median_sd,
    shape_name,
    shape_rows,
    shape_sentence,
)
from palpate.experiments.kit.recorded_periods import recorded_series
from palpate.experiments.kit.recorded_run import change_rows, change_sentences
from palpate.experiments.kit.run_report import log_row
from palpate.mapping import TouchCloud
from palpate.mapping.layers import VertexLayer
from palpate.reporting.computing import computing
from palpate.reporting.data import Quantity, TimeSeries
from palpate.reporting.figure import TIME, Axis, Figure, Panel
from palpate.reporting.force_figure import force_overview, force_zoom
from palpate.reporting.lines import true_and_felt
from palpate.reporting.marks import Bars, Line, Rule, unnamed
from palpate.reporting.phases import phase_spans
from palpate.reporting.report import Figures, Paragraph, Report, Section, TextTable
from palpate.robots.known_truth import NOT_KNOWN, cost_of, cost_row, time_name
from palpate.runtime import Ending
from palpate.sim.scene_cost import SceneCost

MILLI = 1e3

GAP_PERIODS = 5.0
"""The line of the ratio is broken where contacts are further apart than this many median periods."""

LIGHTEST = 0.1
"""Below this share of the median normal force no ratio is drawn: while landing and lifting it is noise over
noise, and would set the scale."""

LEAST_SPIN = 0.01
"""The scale of torque spans at least plus and minus this [mN m]; fine sensors resolve no less (ATI Nano17
SI-12-0.12: 1/64 mN m)."""


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
            f"below {LEAST_SPIN:g} mN m are rounding. Felt torque on the true one, and an even ratio, "
            f"are good."
        ),
        panels=(
            Panel((*spans, *spin), TIME, Axis("spin torque", "mN m", span=2.0 * LEAST_SPIN), height=240),
            Panel((*unnamed(spans), ratio), TIME, Axis("tangential / normal force", low=0.0), height=200),
        ),
        wide=True,
    )


def _force_ratio(cloud: TouchCloud) -> tuple[FloatArray, FloatArray]:
    """Return time and |tangential| / normal force, with a NaN in each gap to break the line."""
    if not len(cloud):
        return cloud.time, cloud.time
    pushing = cloud.normal_force > LIGHTEST * max(float(np.median(cloud.normal_force)), 0.0)
    time = cloud.time[pushing]
    ratio = np.linalg.norm(cloud.tangential_force[pushing], axis=1) / cloud.normal_force[pushing]
    steps = np.diff(time)
    if len(steps) == 0:
        return time, ratio
    gaps = np.flatnonzero(steps > GAP_PERIODS * np.median(steps)) + 1
    return np.insert(time, gaps, time[gaps - 1]), np.insert(ratio, gaps, np.nan)


MICRO = 1e6


def error_histogram(point_error: FloatArray, note: str = "") -> Figure:
    """Return the histogram of signed errors; `point_error` (n,) [m], n at least 1.

    `note` goes to the end of the caption.
    """
    error = MICRO * point_error
    mean, rms = float(error.mean()), float(np.sqrt((error**2).mean()))
    return Figure(
        title="How large the errors are",
        caption=(
            f"Signed distances of {len(error)} points from the true surface: root mean square {rms:.3g} µm, "
            f"mean {mean:.3g} µm, largest {np.abs(error).max():.3g} µm. Narrow and about zero is good. {note}"
        ).rstrip(),
        panels=(
            Panel((Bars.histogram(error), Rule(0.0)), Axis("error of the points", "µm"), Axis("number of points")),
        ),
    )


CONTACT_NOTE = (
    "Where the finger accelerates, as at corners, points come out outside: MuJoCo's friction adds to the normal "
    "force, an artefact of the simulated contact, not of touch."
)
"""It adds mu Dn (b_f v + |a_t|), with Dn and the friction damping rate b_f as in MuJoCo's soft contacts; touch
takes the whole normal force for compression."""

OUTSIDE = 2e-6
"""An error of points from which on this is worth a sentence [m]."""

WELL_OBSERVED = 0.95
"""Share of what can be felt from which on a map counts as whole."""

HALF_FELT = 0.5
"""Share of what can be felt below which an exploration has not reached what it is for."""

AIM = {"contour": "--center", "spiral": "--center and --radius"}
"""Options of strategies that say where; of all others `USUAL_AIM`."""

USUAL_AIM = "--center, --width and --depth"

CLOSER = {
    "raster": "closer rows (--spacing) or --strategy active find more",
    "spiral": "closer turns (--spacing) or --strategy active find more",
    "taps": "closer taps (--spacing) find more",
}
"""What finds more, by strategy; a contour follows its line as it is."""

LONGER = {StopReason.SPENT: "more --time finds more", StopReason.REACHED: "a finer --accuracy finds more"}
"""What finds more where an active exploration ended so."""


def exploration_report(exploration: ExplorationResult) -> Report:
    """Return the report on an exploration."""
    config = exploration.config
    return Report(
        title=f"Exploration of {config.thing} by touch",
        outcome=outcome(exploration),
        metrics=quantities(exploration),
        sections=(
            _surface(exploration),
            *_map(exploration.map),
            *_growth(exploration.growth),
            *_shape(exploration.map),
            Section("Errors of single points", (Figures(lambda: _error_figures(exploration)),)),
            Section("Over time", (Figures(lambda: _time_figures(exploration)),)),
            computing(exploration.run.timing),
        ),
        asked=_asked(config),
        advice=_advice(exploration),
        settings=settings(exploration),
        footer="Lengths and forces in the robot's base frame.",
        reached=exploration.run.ending is Ending.DONE
        and (exploration.map is None or exploration.map.usable)
        and _felt_enough(exploration),
    )


def _felt_enough(exploration: ExplorationResult) -> bool:
    """Whether at least half of what could be felt was; taken for granted where nobody knows the surface."""
    return not exploration.coverage < HALF_FELT


def _surface(exploration: ExplorationResult) -> Section:
    nothing = "" if len(exploration.cloud) else "The finger felt nothing, so there is no surface to show."

    def draw() -> Iterator[Figure | None]:
        line = isinstance(exploration.plan.scan, ContourScan)
        yield contour_figure(exploration) if line else surface_figure(exploration)

    return Section("The surface", (Paragraph(nothing), Figures(draw)))


def _map(found: ExploredMap | None) -> tuple[Section, ...]:
    if found is None:
        return ()

    nothing = "" if len(found.mesh.triangles) else "Contacts are too far apart: nothing of it counts as observed."
    # of a line nothing is claimed that could have held
    verdict = () if found.is_line and found.verdict.ok else tuple(map(Paragraph, found.verdict.lines()))
    return (Section("The map", (*verdict, TextTable((*map_rows(found), *layer_rows(found))), Paragraph(nothing))),)


def _growth(growth: MapGrowth | None) -> tuple[Section, ...]:
    if growth is None:
        return ()

    def draw() -> Iterator[Figure]:
        if growth.curve.area.any():
            yield growth_figure(growth)
        yield snapshots_figure(growth)

    return (Section("How the map grew", (Figures(draw),)),)


def _shape(found: ExploredMap | None) -> tuple[Section, ...]:
    if found is None or found.shape is None:
        return ()
    shape = found.shape
    candidates = TextTable(candidate_rows(shape), heads=("shape", "misses by", "", "verdict"))
    sentence = Paragraph(shape_sentence(shape, found.felt_little))
    return (Section("Which shape it is", (sentence, TextTable(shape_rows(shape)), candidates)),)


def _error_figures(exploration: ExplorationResult) -> Iterator[Figure]:
    error = exploration.point_error
    if exploration.truth.known and len(error):
        yield error_histogram(error, CONTACT_NOTE if error.max() > OUTSIDE else "")


def _time_figures(exploration: ExplorationResult) -> Iterator[Figure | None]:
    series = time_series(exploration)
    if series.phase:
        yield force_overview(series)
        yield force_zoom(series)
        yield spin_figure(series, exploration.cloud)


def time_series(exploration: ExplorationResult) -> TimeSeries:
    """Return forces, spin torque and speed over time."""
    record, truth = exploration.record, exploration.truth
    return recorded_series(
        record,
        exploration.set_force,
        true_force=np.where(truth.touching, exploration.true_normal_force, np.nan) if truth.known else None,
        true_spin_torque=np.where(truth.touching, exploration.true_spin_torque, np.nan) if truth.known else None,
    )


def _advice(exploration: ExplorationResult) -> tuple[str, ...]:
    """What to do after it."""
    found, config = exploration.claimed_map, exploration.config
    if not len(exploration.cloud):
        aim = AIM.get(config.strategy, USUAL_AIM)
        return (
            f"Nothing was felt: check where the object is, and {aim}; --dry-run shows where the tip would go.",
        )
    advice = list(_advice_on_places(exploration))
    closer = None
    if exploration.run.ending is Ending.DONE:
        reason = exploration.stop_reason
        closer = CLOSER.get(config.strategy) if reason is None else LONGER.get(reason)
    if closer and found is None:
        advice.append(f"No surface is claimed, for contacts are too far apart or on one line: {closer}.")
    elif closer and exploration.coverage < WELL_OBSERVED:
        advice.append(f"Of what could be felt {_coverage(exploration)} were observed: {closer}.")
    if found is not None:
        advice.append(
            "To compare the map with a model of the object: palpate compare "
            f"{shlex.quote(str(config.out / 'contacts.ply'))} part.stl, both in metres."
        )
    return tuple(advice)


def _advice_on_places(exploration: ExplorationResult) -> tuple[str, ...]:
    """What to do about places that were not felt."""
    config, events = exploration.config, {mark.event for mark in exploration.marks}
    if PathEvent.OPEN in events:
        other = (
            "at another height (--below)" if config.curve == "level" else "at a constant height (--curve level)"
        )
        return (f"The contour did not close: begin elsewhere (--center), or go round {other}.",)
    if events & NOT_FELT:
        return ("Places that could not be felt are in marks.csv, each with its reason.",)
    return ()


def _coverage(exploration: ExplorationResult) -> str:
    return f"{100.0 * exploration.coverage:.0f} %"


def _felt(exploration: ExplorationResult) -> str:
    """How much was felt, in words."""
    known = math.isfinite(exploration.coverage)
    share = f" over {_coverage(exploration)} of what could be felt" if known else ""
    return f"{len(exploration.cloud)} contacts{share}"


def _asked(config: ExploreConfig) -> str:
    return (
        f"to touch {config.thing} with {config.force:g} N at {1e3 * config.speed:g} mm/s, "
        f"strategy {config.strategy}, carried by {config.robot}"
    )


def outcome(exploration: ExplorationResult) -> str:
    """Return in one sentence how it ended."""
    result = exploration.run
    if result.ending is Ending.DONE:
        left_out = not_felt(exploration.marks)
        but = f", but {_places(len(left_out))} not be felt ({marks_text(left_out)})" if left_out else ""
        why = "" if exploration.stop_reason is None else f"; {exploration.stop_reason.value}"
        finished = f"Finished: {_felt(exploration)} in {result.duration:.1f} s{but}{why}; {result.rest}."
        little = "" if _felt_enough(exploration) else " That is less than half: it has not been explored."
        return finished + little + _remarks(exploration)
    if result.ending is Ending.TRIPPED:
        stopped = f"Stopped by the supervisor: {result.why}; {result.rest}. Until then {_felt(exploration)}."
        return stopped + _remarks(exploration)
    nothing = ", nothing was met" if result.ending is Ending.LOST and not len(exploration.cloud) else ""
    marked = f"; marked: {marks_text(exploration.marks)}" if exploration.marks else ""
    why = f"{result.ending.value}{nothing}{marked}"
    felt = f" and {_felt(exploration)}" if len(exploration.cloud) else ""
    return f"Not finished ({why}) after {result.duration:.1f} s{felt}; {result.rest}.{_remarks(exploration)}"


def _remarks(exploration: ExplorationResult) -> str:
    """Sentences on live changes and on assumptions that did not hold; "" without any."""
    config = exploration.config
    sentences = (
        *change_sentences(exploration.changes, exploration.run.duration, "the sweep began"),
        *assumption_sentences(exploration.assumptions, config.force, config.stiffness),
        *(f"Of the fingertip it is {each}." for each in (exploration.tip.broken() if exploration.tip else ())),
        *(f"Of the map it is {each}." for each in (exploration.map.verdict.broken if exploration.map else ())),
    )
    return "".join(f" {each}" for each in sentences)


def _places(count: int) -> str:
    return "one place could" if count == 1 else f"{count} places could"


def _held(exploration: ExplorationResult) -> tuple[Quantity, ...]:
    moved = exploration.held_motion
    note = "object, or end of the tool, by elastic contacts and slip, seen from the fingers that hold it"
    return () if moved is None else (Quantity("moved in the fingers, at most", 1e3 * moved, "mm", note),)


def quantities(exploration: ExplorationResult) -> tuple[Quantity, ...]:
    """Return the metrics that matter, most important first."""
    result = exploration.run
    limit = f"limit {exploration.plan.limits.force:g} N"
    return (
        Quantity("contacts", len(exploration.cloud)),
        *_true_metrics(exploration),
        Quantity("largest force felt", exploration.assumptions.most_force, "N", limit),
        *_map_metrics(exploration),
        Quantity("marks", len(exploration.marks), "", marks_text(exploration.marks)),
        Quantity(time_name(_cost(exploration)), result.duration, "s"),
        Quantity("real-time factor", result.real_time_factor, "", f"control at {1 / result.timing.period:g} Hz"),
        Quantity("sensing and control, median", 1e6 * result.timing.compute_spread.p50, "µs", "per period"),
    )


def _true_metrics(exploration: ExplorationResult) -> list[Quantity]:
    """How far points and forces are off."""
    if not exploration.truth.known:
        return [Quantity("points to true surface", NOT_KNOWN), Quantity("true normal force", NOT_KNOWN)]
    return [
        Quantity("points to true surface, RMS", 1e3 * exploration.point_rms, "mm"),
        Quantity("points to true surface, 99 %", 1e3 * exploration.point_p99, "mm"),
        *_held(exploration),
        Quantity("true normal force, RMS error", exploration.force_rms, "N", _set_force(exploration)),
    ]


def _map_metrics(exploration: ExplorationResult) -> list[Quantity]:
    """The map in a few metrics, and which shape it is."""
    found = exploration.map
    if found is None:
        return []
    metrics: list[Quantity] = []
    if found.claimed.any():
        band = 1e3 * found.band
        if found.truth_known:
            metrics += [
                *_accuracy(exploration.plan.scan, found),
                Quantity("map to true surface, RMS", 1e3 * found.rms, "mm", f"95 % band ±{band:.2g} mm"),
                Quantity("true errors inside that band", 100.0 * found.covered, "%"),
            ]
        else:
            metrics.append(Quantity("map, 95 % band", band, "mm", f"its true error is {NOT_KNOWN}"))
    if found.is_line:
        metrics.append(Quantity("map", "a line", "", "claims no surface"))
    elif found.truth_known:
        metrics.append(Quantity("observed of the reachable", 100.0 * found.observed_share, "%"))
    metrics += _layer_metrics(found)
    shape = found.shape
    if shape is not None:
        note = TOO_LITTLE if shape.kind is None and found.felt_little else ""
        if shape.fit is not None and len(shape.fit.shape.SIZES) == 1:
            size, band = 1e3 * float(shape.fit.shape.sizes[0]), 1e3 * float(shape.sizes_band[0])
            note = f"{shape.fit.shape.SIZES[0]} {size:.5g} ± {band:.2g} mm"
        metrics.append(Quantity("shape", shape_name(shape, found.felt_little), "", note))
    return metrics


def _accuracy(scan: Scan, found: ExploredMap) -> list[Quantity]:
    """The accuracy that an active exploration was asked for, against the true error of its map."""
    if not isinstance(scan, ActiveScan):
        return []
    asked = 1e3 * scan.goal.error
    if scan.goal.measure is GoalError.RMS:
        return [Quantity("accuracy asked for, RMS", asked, "mm", "reached: the next line")]
    largest = 1e3 * float(np.abs(found.error[found.claimed]).max())
    return [
        Quantity("accuracy asked for, largest", asked, "mm", "reached: the next line"),
        Quantity("map to true surface, largest", largest, "mm"),
    ]


def _layer_metrics(found: ExploredMap) -> list[Quantity]:
    """Stiffness and curvature, where they are known."""
    layers = [("stiffness of the object", found.stiffness, 1e-3, "kN/m")]
    layers += [
        ("mean curvature of the map", layer, 1.0, "1/m")
        for layer in found.curvature
        if layer.name == "curvature_mean" and isinstance(layer, VertexLayer)
    ]
    metrics = []
    for name, layer, scale, unit in layers:
        known = np.isfinite(layer.mean)
        if known.any():
            sd, share = median_sd(layer, scale), 100.0 * float(known.mean())
            value = as_known(float(np.median(scale * layer.mean[known])), sd)
            metrics.append(Quantity(name, value, unit, f"± {sd:.2g}, on {share:.0f} %"))
    return metrics


def _set_force(exploration: ExplorationResult) -> str:
    config, set_force = exploration.config, exploration.set_force[exploration.scanning]
    if config.force_swing:
        return f"set {config.force:g} N ± {config.force_swing:g} N"
    if not len(set_force) or set_force.min() == set_force.max():
        return f"set {config.force:g} N"
    return f"set {set_force.min():g} to {set_force.max():g} N, changed while it ran"


def settings(exploration: ExplorationResult) -> tuple[tuple[str, str], ...]:
    """Return what was asked for, with units, and the gain that followed."""
    config, known = exploration.config, exploration.truth.known
    return (
        ("object", object_line(exploration.plan.setup.task.target, config)),
        ("fingertip", f"{' x '.join(f'{1e3 * s:g}' for s in config.tip)} mm"),
        ("normal force", f"{config.force:g} N{_swing(config)}"),
        ("speed along the surface", f"{1e3 * config.speed:g} mm/s"),
        ("a wall in its path", str(exploration.plan.wall)),
        (config.strategy, exploration.plan.scan.line),
        ("friction, spin length", f"{config.friction:g}, {1e3 * config.spin_length:g} mm" if known else NOT_KNOWN),
        (f"contact stiffness, {'simulated and ' if known else ''}assumed", f"{config.stiffness / 1e3:g} kN/m"),
        (
            "sensor noise",
            f"{1e3 * config.noise[0]:g} mN, {1e3 * config.noise[1]:g} mN m, seed {config.seed}",
        ),
        ("robot", config.robot),
        *cost_row(_cost(exploration)),
        ("control period", f"{1e3 * exploration.run.timing.period:g} ms"),
        *_force_law(exploration),
        *change_rows(exploration.changes),
        *log_row(exploration.run),
    )


def _swing(config: ExploreConfig) -> str:
    return f", ± {config.force_swing:g} N as a sine of {config.force_period:g} s" if config.force_swing else ""


def _force_law(exploration: ExplorationResult) -> tuple[tuple[str, str], ...]:
    """The law of force control with its margins, and what they were found from."""
    gain, found = exploration.plan.parameters.gain, exploration.plan.identified
    if found is None:
        gains = (
            f"{1e3 * gain.gain:.3g} mm/s/N from K = {gain.stiffness / 1e3:.3g} kN/m and T = "
            f"{1e3 * gain.delay:.3g} ms: loop gain k K T = {gain.loop_gain:.2g} (unstable from 1.57), gain margin "
            f"{gain.gain_margin:.2g}, phase margin {gain.phase_margin_deg:.0f} degrees"
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
            f"{1e3 * gain.gain:.3g} mm/s/N by {law}; as measured, gain margin {found.gain_margin:.2g}, phase "
            f"margin {found.phase_margin_deg:.0f} degrees",
        ),
    )


def _cost(exploration: ExplorationResult) -> SceneCost | None:
    return cost_of(exploration.plan.ready.backend)
