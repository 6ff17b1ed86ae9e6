"""The report on the friction of a surface, put together."""

import numpy as np

from palpate.errors import FloatArray
from palpate.experiments.friction_file import Finding, FrictionFile, How
from palpate.experiments.friction_run import RubbingRun
from palpate.experiments.friction_summary import measured_lengths
from palpate.experiments.friction_words import bound_words, outcome, settings
from palpate.friction import LimitSurface
from palpate.friction.rubbing.stroke import Stroke
from palpate.friction.rubbing.twisting import SpinMeasured
from palpate.reporting import KeyFigure, TimeSeries
from palpate.reporting.friction_data import (
    FrictionReport,
    MaterialMatch,
    Measured,
    RecognitionReport,
    StrokeCurve,
    SurfacePoints,
)

CURVE_POINTS = 80
"""Of mu over speed, along the fitted curve."""

SMOOTHED = 0.01
"""Over how long mu along a stroke is averaged for its picture [s]: with 10 mN of noise at 1 N it is a cloud else.
"""


def friction_report(rubbing: RubbingRun) -> FrictionReport:
    """Return the report."""
    record, planned, found = rubbing.record, rubbing.planned, rubbing.found
    wanted = np.full(len(record), np.nan)
    for pair in rubbing.pairs:
        for stroke in pair.pair.both:
            inside = (record.time >= stroke.time[0]) & (record.time <= stroke.time[-1])
            wanted[inside] = pair.rub.normal_force
    file = rubbing.file
    return FrictionReport(
        title=f"Friction of {_article(planned.config.object)} by touch",
        outcome=outcome(rubbing),
        summary=key_figures(rubbing),
        settings=settings(rubbing),
        series=TimeSeries(
            time=record.time,
            phase=[str(phase) for phase in record.phase],
            measured_force=np.where(record.touching, record.normal_force, np.nan),
            set_force=wanted,
            spin_torque=np.where(record.touching, record.spin_torque, np.nan),
            speed=np.linalg.norm(record.velocity, axis=1),
        ),
        timing=rubbing.run.timing,
        strokes=_strokes(rubbing),
        friction=() if file is None else _frictions(rubbing, file),
        lengths=() if file is None else _lengths(rubbing, file),
        growth=None if file is None or file.spin_length is None else _growth(rubbing, file),
        speeds=() if file is None else _speeds(rubbing, file),
        curve=_curve(rubbing),
        surface=None if file is None or not found.slips else _surface(rubbing, file),
        recognition=_recognition(rubbing),
    )


def key_figures(rubbing: RubbingRun) -> tuple[KeyFigure, ...]:
    """Return the figures that matter, most important first."""
    file, planned = rubbing.file, rubbing.planned
    run = (KeyFigure("simulated time", rubbing.run.duration, "s"),)
    if file is None:
        return run
    plant = planned.plant
    truth = {
        "mu": planned.true_friction(file.speed),
        "gamma": 0.0 if plant is None else plant.load_exponent,
        "p": 2.0 if plant is None else plant.norm_exponent,
    }
    slipped = file.friction.how is How.MEASURED
    note = f"slipping at {1e3 * file.speed:.3g} mm/s" if slipped else ""
    figures = [_figure("friction mu", file.friction, truth["mu"], note=note)]
    if file.static_friction is not None:
        static = None if plant is None else plant.static_friction
        figures.append(_figure("static friction", file.static_friction, static))
    if file.spin_length is not None:
        true_length = planned.true_spin_length(1.0)
        figures.append(_figure("spin length e at 1 N", file.spin_length, true_length, "mm", 1e3))
        figures.append(_figure("growth of e with load, gamma", file.load_exponent, truth["gamma"]))
        figures.append(_figure("norm exponent p", file.norm_exponent, truth["p"]))
    curve = rubbing.found.curve
    if curve is not None:
        slope = "constant" if curve.viscous_friction == 0.0 and curve.stribeck_speed == np.inf else "see picture"
        creep = f"; crept at {', '.join(f'{1e3 * v:.2g}' for v in curve.creeping)} mm/s" if curve.creeping else ""
        figures.append(KeyFigure("friction over speed", slope, "", f"{len(rubbing.found.speeds)} speeds{creep}"))
    known = rubbing.recognised
    if known is not None:
        figures.append(KeyFigure("surface", known.material, "", f"by the library {planned.config.library}"))
    return (*figures, *run)


def _figure(
    name: str, found: Finding, true: float | None, unit: str = "", factor: float = 1.0, note: str = ""
) -> KeyFigure:
    parts = []
    if found.how is How.MEASURED:
        upper = f"to {factor * found.upper:.4g}" if np.isfinite(found.upper) else "upwards"
        parts.append(f"95 %: {factor * found.lower:.4g} {upper}")
    elif found.how is How.BOUND:
        parts.append("it never slipped: a lower bound")
    else:
        parts.append("assumed, not measured" + ("; --fit-exponents measures it" if name.endswith(" p") else ""))
    if note:
        parts.append(note)
    if true is not None:
        parts.append(f"true {factor * true:.4g}")
    value: float | str = factor * found.value
    if found.how is How.BOUND:
        value = bound_words(factor * found.value)
    return KeyFigure(name, value, unit, "; ".join(parts))


def _frictions(rubbing: RubbingRun, file: FrictionFile) -> tuple[Measured, ...]:
    true = rubbing.planned.true_friction(file.speed)
    return tuple(_told(at.normal_force, at.friction, true) for at in file.loads)


def _lengths(rubbing: RubbingRun, file: FrictionFile) -> tuple[Measured, ...]:
    planned = rubbing.planned
    return tuple(
        _told(at.normal_force, at.spin_length, planned.true_spin_length(at.normal_force))
        for at in file.loads
        if at.spin_length is not None
    )


def _speeds(rubbing: RubbingRun, file: FrictionFile) -> tuple[Measured, ...]:
    return tuple(
        _told(each.speed, each.friction, rubbing.planned.true_friction(each.speed)) for each in file.speeds
    )


def _growth(rubbing: RubbingRun, file: FrictionFile) -> tuple[float, float] | None:
    if file.spin_length is None or len(measured_lengths(rubbing.found.loads)) < 2:
        return None
    return file.spin_length.value, file.load_exponent.value


def _told(at: float, found: Finding, true: float | None) -> Measured:
    return Measured(at, found.value, found.lower, found.upper, true, found.how is How.BOUND)


def _strokes(rubbing: RubbingRun) -> tuple[StrokeCurve, ...]:
    """Of each load the last stroke at the main speed: the longest, where it went on until it slipped."""
    last = {
        pair.rub.normal_force: pair
        for pair in rubbing.pairs
        if pair.rub.spin == 0.0 and pair.rub.speed == rubbing.planned.wanted.speed
    }
    normals = {at.load: at.friction.normal for at in rubbing.found.loads}
    return tuple(
        _stroke_curve(load, back, stroke, normals[load], pair.rub.speed)
        for load, pair in last.items()
        if load in normals
        for back, stroke in ((False, pair.pair.there), (True, pair.pair.back))
    )


def _stroke_curve(load: float, back: bool, stroke: Stroke, normal: FloatArray, speed: float) -> StrokeCurve:
    velocity = stroke.contact_velocity
    along = velocity - np.outer(velocity @ normal, normal)
    way = along.sum(axis=0) / np.linalg.norm(along.sum(axis=0))
    travel = np.concatenate([[0.0], np.cumsum((along @ way)[:-1] * np.diff(stroke.time))])
    ratio = (stroke.force @ way) / (stroke.force @ normal)
    step = float(np.median(np.diff(stroke.time)))
    width = max(1, round(SMOOTHED / step))
    ratio = np.convolve(ratio, np.full(width, 1.0 / width), "same")
    # the ends of a mean over less than all of its width say nothing
    kept = slice(width, len(ratio) - width)
    return StrokeCurve(load, back, travel[kept], ratio[kept])


def _curve(rubbing: RubbingRun) -> FloatArray | None:
    curve, speeds = rubbing.found.curve, rubbing.found.speeds
    if curve is None:
        return None
    v = np.geomspace(0.8 * speeds[0].speed, 1.25 * speeds[-1].speed, CURVE_POINTS)
    return np.stack([v, [curve.friction_at(speed) for speed in v.tolist()]])


def _surface(rubbing: RubbingRun, file: FrictionFile) -> SurfacePoints | None:
    if file.spin_length is None or file.friction.how is not How.MEASURED:
        return None
    found, planned = rubbing.found, rubbing.planned
    surface = file.limit_surface()
    lengths = {at.load: at.spin.spin_length.value for at in found.loads if isinstance(at.spin, SpinMeasured)}
    points = np.array(
        [
            (
                slip.tangential_force / (surface.friction * slip.normal_force),
                slip.spin_torque
                / (surface.friction * surface.spin_length_at(slip.normal_force) * slip.normal_force),
            )
            for slip in found.slips
        ]
    )
    if not lengths:
        return None
    scatter = 0.0 if found.fitted is None else found.fitted.scatter
    half = 0.5 * (file.friction.upper - file.friction.lower) / file.friction.value
    torque = 0.5 * (file.spin_length.upper - file.spin_length.lower) / file.spin_length.value
    relative = np.array([np.hypot(half, 2.0 * scatter), np.hypot(torque, 2.0 * scatter)])
    plant = planned.plant
    true = (
        LimitSurface(planned.config.friction, planned.config.spin_length)
        if plant is None
        else plant.limit_surface(plant.kinetic_friction)
    )
    return SurfacePoints(
        surface,
        true,
        found.fitted is not None,
        points,
        np.abs(points) * relative,
        np.array([slip.normal_force for slip in found.slips]),
    )


def _recognition(rubbing: RubbingRun) -> RecognitionReport | None:
    known = rubbing.recognised
    if known is None:
        return None
    found = known.recognition
    likelihood = found.known.log_likelihood[:-1]
    order = np.lexsort((-likelihood, -found.posterior)).tolist()
    matches = tuple(
        MaterialMatch(
            found.library.names[i],
            float(likelihood[i] - likelihood.max()),
            float(found.posterior[i]),
            float(found.fit[i]),
        )
        for i in order
    )
    setting = ""
    if known.confusion is not None:
        count, shown = len(found.library.materials), len(known.confusion.truths)
        drawn = int(known.confusion.counts[0].sum())
        of = "each material" if shown == count else f"each of the {shown} likeliest of {count} materials"
        setting = (
            f"The rubs of this run, drawn {drawn} times for {of} as the library says that it scatters: "
            f"{100.0 * known.confusion.right:.3g} % of the answers are right."
        )
    return RecognitionReport(known.words, matches, known.confusion, setting)


def _article(name: str) -> str:
    return f"a {name}"
