"""The report on the friction of a surface, put together."""

import numpy as np

from palpate.errors import FloatArray
from palpate.experiments.friction.figures import key_figures
from palpate.experiments.friction.found import FrictionFound
from palpate.experiments.friction.recognised import recognition_report
from palpate.experiments.friction.report_data import (
    FrictionReport,
    Measured,
    StrokeCurve,
    SurfacePoints,
)
from palpate.experiments.friction.run import RubbingRun
from palpate.experiments.friction.summary import measured_lengths
from palpate.experiments.friction.words import bound_reason, outcome, settings
from palpate.experiments.kit.repeat_words import repeat_commands
from palpate.experiments.kit.report_advice import advice_on_friction
from palpate.friction import LimitSurface
from palpate.friction.friction_file import Finding, FrictionFile, How
from palpate.friction.rubbing.stroke import Stroke
from palpate.friction.rubbing.twisting import SpinMeasured
from palpate.reporting.data import TimeSeries

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
        creeping=file is not None and any(each.creeping for each in file.speeds),
        bent=planned.config.object == "sphere",
        surface=None if file is None or not found.slips else _surface(rubbing, file),
        recognition=recognition_report(rubbing),
        asked=_asked_for(rubbing),
        advice=advice_on_friction(rubbing),
        repeat=repeat_commands("friction", planned.config, rubbing.run),
    )


def _asked_for(rubbing: RubbingRun) -> str:
    config, wanted = rubbing.planned.config, rubbing.planned.wanted
    loads = ", ".join(f"{load:g}" for load in wanted.loads)
    return f"to rub a {config.object} with {loads} N at {1e3 * wanted.speed:g} mm/s, carried by {config.robot}"


def _frictions(rubbing: RubbingRun, file: FrictionFile) -> tuple[Measured, ...]:
    true = rubbing.planned.true_friction(file.speed)
    return tuple(
        _told(at.normal_force, at.friction, true, bound_reason(each.friction))
        for at, each in zip(file.loads, rubbing.found.loads, strict=True)
    )


def _lengths(rubbing: RubbingRun, file: FrictionFile) -> tuple[Measured, ...]:
    planned = rubbing.planned
    return tuple(
        _told(at.normal_force, at.spin_length, planned.true_spin_length(at.normal_force))
        for at in file.loads
        if at.spin_length is not None
    )


def _speeds(rubbing: RubbingRun, file: FrictionFile) -> tuple[Measured, ...]:
    return tuple(
        _told(each.speed, each.friction, rubbing.planned.true_friction(each.speed), bound_reason(at.friction))
        for each, at in zip(file.speeds, rubbing.found.speeds, strict=True)
    )


def _growth(rubbing: RubbingRun, file: FrictionFile) -> tuple[float, float] | None:
    if file.spin_length is None or len(measured_lengths(rubbing.found.loads)) < 2:
        return None
    return file.spin_length.value, file.load_exponent.value


def _told(at: float, found: Finding, true: float | None, why: str = "") -> Measured:
    return Measured(at, found.value, found.lower, found.upper, true, found.how is How.BOUND, why)


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
        np.array([_asked(found, slip.normal_force) for slip in found.slips]),
        (file.norm_exponent.lower, file.norm_exponent.upper),
    )


def _asked(found: FrictionFound, normal_force: float) -> float:
    """The load that was asked for where this was felt [N]."""
    return min((at.load for at in found.loads), key=lambda load: abs(load - normal_force))


def _article(name: str) -> str:
    return f"a {name}"
