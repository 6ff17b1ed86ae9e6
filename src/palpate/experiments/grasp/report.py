"""The report on a grasp: its sections, and the figures of grip, slip, spin, forces and loads."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
import numpy.typing as npt
import trimesh
from scipy.spatial.transform import Rotation
from trimesh.graph import smooth_shade

from palpate.controllers.grip.grasp import GraspStage
from palpate.errors import FloatArray
from palpate.experiments.grasp.account import account, outcome
from palpate.experiments.grasp.config import GraspConfig
from palpate.experiments.grasp.friction_belief import rubbed_by_plant, tip_radius
from palpate.experiments.grasp.metrics import METRICS, delay_note
from palpate.experiments.grasp.result import BoolArray, GraspResult
from palpate.experiments.grasp.truth import STAGES
from palpate.experiments.kit.experiment import ExperimentDefaults
from palpate.experiments.kit.metric import NOT_KNOWN
from palpate.experiments.kit.run_report import log_row, report_of
from palpate.grasp import GraspContacts, GraspForceOptimizer, SolveStatus, worst_disturbance
from palpate.reporting.data import Quantity
from palpate.reporting.figure import Axis, Figure, Panel, Space
from palpate.reporting.grasp_figures import grasp_force_figure, limit_surface_panel, load_sizes
from palpate.reporting.marks import Dash, Line, Points, Symbol
from palpate.reporting.report import Figures, FigureSource, Paragraph, QuantityTable, Report, Section
from palpate.reporting.run_figures import phase_spans, true_and_felt
from palpate.reporting.solids import Arrows, Labels, Placed, Solid, Surface
from palpate.runtime import Ending
from palpate.runtime.palette import (
    APPROACH,
    BOUND,
    FELT,
    INK_COLOUR,
    LIFT,
    OTHER,
    QUIET_COLOUR,
    SCAN,
    SET,
    SETTLE,
    SPIN_COLOUR,
    TRAVEL,
    TRUTH,
    Colour,
)
from palpate.sim.fidelity import GRAVITY

_STAGE_COLOURS: Mapping[str, Colour] = {
    GraspStage.CLOSE: APPROACH,
    GraspStage.NUDGE: SETTLE,
    GraspStage.LIFT: LIFT,
    GraspStage.HOLD: OTHER,
    GraspStage.SET_DOWN: TRAVEL,
    GraspStage.LET_GO: SCAN,
}
"""Grounds of figures over time."""

_AXIS_HEADROOM = 1.15
"""Top of an axis over its largest value; for the grip, the largest while it was held, without impacts."""

_MIN_SLIP_AXIS, _MIN_SPIN_AXIS = 0.01, 0.1
"""Least spans of the axes [mm], [degrees]; below is the elastic motion of contacts."""

_CIRCLE_CORNERS = 36
"""Number of corners of a drawn circle."""

_MAX_SMOOTH_ANGLE = 1.0
"""Largest angle between two triangles that are drawn as one smooth surface [rad]."""

MOMENT_COUNT = 120
"""Number of moments that are played, evenly in time, besides the worst."""

_ARROW_LENGTH = 1.2
"""Length of the largest force over the distance of the fingertips from their middle."""

Mesh = tuple[FloatArray, npt.NDArray[np.intp]]
"""Vertices (n, 3) [m] and triangles (m, 3)."""

_COMPARED_KEYS = (
    "dropped",
    "gave_way",
    "slip_m",
    "spin_rad",
    "slip_aloft_m",
    "spin_aloft_rad",
    "grip_ratio",
    "tightest",
)
"""Metrics that are compared with those of a control that ignores spin."""

_IGNORING_SPIN = ", ignoring spin"
"""End of the titles of rows and figures of such a control."""


@dataclass(frozen=True, slots=True, eq=False)
class HeaviestLoad:
    """The least forces that hold the load at its heaviest moment; object frame, turned as the base.

    Attributes:
        time: Time of the moment [s].
        grasp: True contacts.
        forces: Forces on the object, shape (k, 4) [N, N, N, N m].
        load: Other load on the object, shape (6,) [N, N m].
        disturbance: Largest further load in the worst direction that the true grip held, shape (6,) [N, N m]; None
            where it is not known.
    """

    time: float
    grasp: GraspContacts
    forces: FloatArray
    load: FloatArray
    disturbance: FloatArray | None


def heaviest_load(grasp: GraspResult) -> HeaviestLoad | None:
    """Return the moment of the pull whose load takes most grip, and the least forces there; None if it was lost.

    The forces have the least effort by the true limit surface. Any further load, from any direction, is held at
    least up to the size of the disturbance.
    """
    truth, planned = grasp.truth, grasp.planned
    known = grasp.counted & np.isfinite(grasp.least) & truth.touching.all(axis=1)
    if not known.any():
        return None
    at = int(np.where(known, grasp.least, -np.inf).argmax())
    places, normals = truth.contact[at], truth.normal[at]
    aside = np.cross(normals, np.eye(3)[np.abs(normals).argmin(axis=1)])
    aside /= np.linalg.norm(aside, axis=1)[:, None]
    frames = np.stack([normals, aside, np.cross(normals, aside)], axis=2)
    true, pressed = planned.true, np.maximum(truth.loads[at, :, 0], 0.0)
    contacts = GraspContacts(
        places,
        frames,
        true.friction,
        true.spin_length,
        load_exponent=true.load_exponent,
        norm_exponent=true.norm_exponent,
    )
    load = truth.pull[at] + np.array([0.0, 0.0, -planned.config.mass * GRAVITY, 0.0, 0.0, 0.0])
    least = GraspForceOptimizer(contacts).solve(load)
    if least.status is not SolveStatus.SOLVED:
        return None
    disturbance = None
    if contacts.is_convex:
        # normal forces are commanded, friction takes the rest: the load that these normal forces still hold
        held = GraspContacts(places, frames, true.friction, true.spin_length, 0.0, np.maximum(pressed, 1e-6))
        worst = worst_disturbance(held, float(np.linalg.norm(places, axis=1).max()), load)
        disturbance = worst.direction * worst.factor if worst.factor > 0.0 else None
    return HeaviestLoad(float(truth.time[at]), contacts, least.forces, load, disturbance)


def grasp_report(experiment: ExperimentDefaults, grasp: GraspResult) -> Report:
    """Return the report on a grasp."""
    config = grasp.planned.config
    return report_of(
        experiment,
        grasp,
        title=_title(config),
        outcome=outcome(grasp),
        sections=(
            Section("What happened", tuple(Paragraph(each) for each in account(grasp))),
            *_alarms_by_finger(grasp),
            Section("From the first touch to the last", (Figures(lambda: _figures(grasp)),)),
            *_least_forces(grasp),
            *_ignoring_spin(grasp),
        ),
        asked=(
            f"to hold a {config.object} of {config.mass:g} kg with {config.fingers} fingers and a margin of "
            f"{100.0 * config.margin:g} %, friction {config.known}, load {config.load}"
        ),
        settings=_settings(grasp),
        footer="Loads that the object exerts on the fingers.",
        reached=grasp.run.ending is Ending.DONE and not grasp.dropped,
    )


def _title(config: GraspConfig) -> str:
    fingers = {2: "two", 3: "three"}[config.fingers]
    pulled = {
        "ramp": "pulled at ever harder",
        "step": "suddenly pulled at",
        "shake": "shaken",
        "none": "just held",
    }[config.load]
    return f"A {config.object} in {fingers} fingers, {pulled}{_IGNORING_SPIN if config.ignores_spin else ''}"


def _alarms_by_finger(grasp: GraspResult) -> Iterator[Section]:
    if grasp.truth_known and grasp.onsets:
        rows = (
            Quantity(
                f"alarm after slip, finger {onset.finger + 1}",
                1e3 * onset.latency,
                "ms",
                delay_note(onset.latency),
                3,
            )
            for onset in grasp.onsets
        )
        yield Section("Alarms of each finger that slipped", (QuantityTable(tuple(rows)),))


def _least_forces(grasp: GraspResult) -> Iterator[Section]:
    at = heaviest_load(grasp)
    if at is None:
        return

    def draw() -> Iterator[Figure | None]:
        yield grasp_force_figure(at.grasp, at.forces, at.load, at.disturbance)

    moment = Paragraph(f"At {at.time:.3g} s, by the true friction of the contacts.")
    yield Section("The least forces where the load is heaviest", (moment, Figures(draw)))


def compared(grasp: GraspResult, other: GraspResult) -> tuple[Quantity, ...]:
    """Return metrics of the control that ignores spin, noted with those of the grasp."""
    found = []
    for metric in METRICS:
        with_spin, without = metric.row(grasp), metric.row(other)
        if metric.key in _COMPARED_KEYS and with_spin is not None and without is not None:
            note = f"with spin {with_spin.text} {with_spin.unit}".rstrip()
            found.append(replace(without, name=f"{metric.meaning}{_IGNORING_SPIN}", note=note))
    return tuple(found)


def _ignoring_spin(grasp: GraspResult) -> Iterator[Section]:
    other = grasp.comparison
    if other is not None:
        figures = Figures(lambda: _figures(other, _IGNORING_SPIN))
        yield Section("A control that ignores spin", (QuantityTable(compared(grasp, other)), figures))


def _settings(grasp: GraspResult) -> tuple[tuple[str, str], ...]:
    """Return name and value with unit of each setting."""
    planned, config, known = grasp.planned, grasp.planned.config, grasp.truth_known
    size = " x ".join(f"{1e3 * length:g}" for length in config.sizes)
    rubbing = "the friction plant" if rubbed_by_plant(config) else "MuJoCo"
    noise = f"noise {1e3 * config.force_noise:g} mN and {1e3 * config.moment_noise:g} mN m"
    drift = f", drift {1e3 * config.drift_rate:g} mN/s, seed {config.seed}"
    return (
        ("object", f"{config.object}, {size} mm, {config.mass:g} kg"),
        ("hand", f"{config.fingers} fingers"),
        ("robot", "simulated hand" if planned.robot is None else planned.robot.file.name),
        ("friction is simulated by", rubbing) if known else ("true friction", NOT_KNOWN),
        ("friction is", config.known if config.friction_file is None else f"from {config.friction_file}"),
        ("load", _load(config) if known else "its own weight, and any pull by hand"),
        ("lifted", f"{1e3 * config.lift_height:g} mm, at {1e3 * config.lift_speed:g} mm/s"),
        ("margin", f"{100.0 * config.margin:.3g} %"),
        ("control", config.controller),
        ("sensors", f"{noise}{drift}" if known else noise),
        ("control period", f"{1e3 * planned.period:g} ms"),
        *log_row(grasp.run),
    )


def _load(config: GraspConfig) -> str:
    if config.load == "none":
        return "its own weight"
    beside = f"{1e3 * config.offset:g} mm beside the contacts"
    if config.load == "shake":
        shake = f"{config.largest_pull:g} N at {config.shake_frequency:g} Hz, up and down and sideways"
        return f"{config.pull_before:g} N down and {shake}, {beside}, for {config.rising:g} s"
    return f"{config.pull_before:g} to {config.largest_pull:g} N down in {config.rising:g} s, {beside}"


def _figures(grasp: GraspResult, note: str = "") -> Iterator[FigureSource]:
    """Yield both figures of a grasp; `note` ends their titles."""
    yield partial(over_time, grasp, note)
    yield partial(moments_figure, grasp, note)


def over_time(grasp: GraspResult, note: str = "") -> Figure | None:
    """Return the figure of a grasp over time; None for a run of one period."""
    if len(grasp.truth) < 2:
        return None
    count = len(grasp.alarms_aloft)
    alarms = f"when slip was detected ({count} alarm{'' if count == 1 else 's'} in the air)"
    if not grasp.truth_known:
        return Figure(
            title=f"Grip{note}",
            caption="Normal force of each finger (mean), as set and as felt: the closer together the better. "
            f"Above: {alarms}.",
            panels=(_grip_panel(grasp),),
            wide=True,
        )
    return Figure(
        title=f"Grip, slip and spin{note}",
        caption=(
            "Normal force of each finger (mean): set, true, and the least that holds the true load with the true "
            "friction, known while the object is in the air. A grip slightly above the least is good. At the end "
            "the table pushes the object up between the fingers, and the grip that would hold against that jumps; "
            "the hand keeps its grip until it lets go. Below: how far the object moved over the fingertips, and "
            "turned about the contact normals, in the air since the lift began: the larger of the fingers, by the "
            f"simulation's truth. Next to nothing is good. Triangles: {alarms}."
        ),
        panels=(
            _grip_panel(grasp),
            _motion_panel(grasp, Axis("slip", "mm"), 1e3 * grasp.truth.slid, _MIN_SLIP_AXIS, TRUTH),
            _motion_panel(
                grasp, Axis("spin", "degrees"), np.degrees(grasp.truth.turned), _MIN_SPIN_AXIS, SPIN_COLOUR
            ),
        ),
        wide=True,
    )


def _grip_panel(grasp: GraspResult) -> Panel:
    truth = grasp.truth
    target = Line(truth.time, truth.target, "set", SET, dash=Dash.DASHED)
    if not grasp.truth_known:
        top = float(np.nanmax(np.maximum(grasp.felt, truth.target), initial=0.0))
        return _panel(grasp, Axis("grip", "N", 0.0, top), (*true_and_felt(truth.time, None, grasp.felt), target))
    pressed = Line(truth.time, grasp.felt, "true", TRUTH, width=4.0, opacity=0.55)
    least = Line(truth.time, grasp.least, "least", BOUND, width=1.8, dash=Dash.DASH_DOT)
    held = np.isfinite(grasp.least)
    top = float(np.maximum(grasp.felt, grasp.least)[held].max()) if held.any() else float(grasp.felt.max())
    return _panel(grasp, Axis("grip", "N", 0.0, top), (pressed, target, least), alarms=False)


def _motion_panel(grasp: GraspResult, axis: Axis, values: FloatArray, min_span: float, colour: Colour) -> Panel:
    """Return the panel of the largest value of the fingers since the lift."""
    largest = np.where(grasp.aloft, values.max(axis=1), np.nan)
    top = max(min_span, float(values[grasp.aloft].max(initial=0.0)))
    return _panel(grasp, replace(axis, low=0.0, high=top), (Line(grasp.truth.time, largest, colour=colour),))


def _panel(grasp: GraspResult, axis: Axis, lines: tuple[Line, ...], *, alarms: bool = True) -> Panel:
    """Return lines over time with the stages behind them."""
    truth, top, is_grip = grasp.truth, _AXIS_HEADROOM * (axis.high or 1.0), axis.quantity == "grip"
    spans = phase_spans(truth, grounds=_STAGE_COLOURS)
    if not is_grip:  # one legend is enough
        spans = tuple(replace(span, name="") for span in spans)
    times = np.array([alarm.time for alarm in grasp.alarms_aloft])
    signals = tuple(f"finger {each.finger + 1}: {each.signal.value}" for each in grasp.alarms_aloft)
    marks = Points(
        times, np.full(len(times), 0.96 * top), "alarm", INK_COLOUR, symbol=Symbol.TRIANGLE, texts=signals
    )
    return Panel(
        (*spans, *lines, *((marks,) if alarms and signals else ())),
        Axis("time", "s", float(truth.time[0]), float(truth.time[-1]), run_time=True),
        replace(axis, high=top),
        height=300 if is_grip else 220,
    )


def moments_figure(grasp: GraspResult, note: str = "") -> Figure | None:
    """Return the figure that plays a grasp, its worst moment first; None if nothing was lifted."""
    lifted = np.flatnonzero(grasp.aloft)
    if not len(lifted):
        return None
    truth, surface, known = grasp.truth, grasp.planned.true, grasp.truth_known
    worst, alone = worst_moment(grasp), _held_alone(grasp)
    evenly = lifted[np.linspace(0, len(lifted) - 1, min(MOMENT_COUNT, len(lifted))).round().astype(np.intp)]
    at = np.union1d(evenly, [worst])
    step = int(np.searchsorted(at, worst))
    names = [f"{truth.time[i]:.3f} s, {truth.phase[i]}" for i in at]
    names[step] += ", the worst"
    size = float(np.nanmax(load_sizes(surface, truth.loads[worst]), initial=0.0))
    by = "by the truth" if known else "as felt, and by the estimate of friction"
    surfaces = (
        limit_surface_panel(
            surface,
            truth.loads[alone, k],
            truth.loads[at, k],
            step,
            f"finger {k + 1}",
            TRUTH if known else FELT,
        )
        for k in range(truth.fingers)
    )
    return Figure(
        title=f"Forces and loads{note}",
        caption=(
            "Fingertips, their contact forces, and the load of each in its limit surface while they alone carried "
            f"the object, {by}: spin torque and tangential force, each over the largest that the contact carries, "
            "in a stronger colour where it was more often (by the logarithm). On the line a contact slips; well "
            f"inside is good. First shown is the worst moment, at {truth.time[worst]:.3f} s: there a load is at "
            f"{size:.2f} of the limit. The player goes through all moments from the lift on."
        ),
        panels=(_space(grasp, at, step), *surfaces),
        columns=3 if truth.fingers == 2 else 2,
        steps=tuple(names),
        step=step,
        wide=True,
    )


def worst_moment(grasp: GraspResult) -> int:
    """Return the row at which the load of any finger came closest to its limit, or went farthest beyond."""
    sizes = load_sizes(grasp.planned.true, grasp.truth.loads).max(axis=1)
    return int(np.where(_held_alone(grasp) & np.isfinite(sizes), sizes, -1.0).argmax())


def _held_alone(grasp: GraspResult) -> BoolArray:
    """Return when all fingers alone carried the object; where that is unknown, when it was held, or lifted."""
    touching = grasp.truth.touching.all(axis=1)
    held = grasp.truth.stage == STAGES.index(GraspStage.HOLD)
    return next((each for each in (grasp.carried & touching, held & touching) if each.any()), grasp.aloft)


def _space(grasp: GraspResult, at: npt.NDArray[np.intp], step: int) -> Space:
    """Return the forces in space: the origin is the middle of the fingertips, the axes are the base's."""
    truth, hand = grasp.truth, grasp.planned.hand.geometry
    middle = truth.tip[at].mean(axis=1)
    tips = truth.tip[at] - middle[:, None]
    touching = truth.touching[at][:, :, None]
    pushes = np.where(touching, -truth.force[at], 0.0)
    places = np.where(touching, truth.contact[at] - middle[:, None], tips)
    marks: list[Solid] = []
    still = np.broadcast_to(np.eye(3), (len(at), 3, 3))
    for k, tip in enumerate(hand.tips):
        name = "" if k else "fingertips"
        ball = Surface(*_sphere_mesh(tip_radius(tip)), name, colour=QUIET_COLOUR, opacity=0.6)
        marks.append(Placed(ball, tips[:, k], still))
    longest = float(np.linalg.norm(pushes, axis=2).max(initial=0.0))
    distances = np.linalg.norm(tips[step], axis=1)
    per_newton = _ARROW_LENGTH * float(distances.max()) / max(longest, 1e-9)
    if grasp.truth_known:
        turns = Rotation.from_quat(np.roll(truth.quat_wxyz[at], -1, axis=1)).as_matrix()
        body = Surface(*held_mesh(grasp.planned.config), "object", colour=QUIET_COLOUR, opacity=0.22)
        marks.append(Placed(body, -middle, turns))
        pull, moment = truth.pull[at, :3], truth.pull[at, 3:]
        weight = np.zeros_like(pull)
        weight[:, 2] = -grasp.planned.config.mass * GRAVITY
        # the point of the pull's line of action that is nearest to the object's origin
        beside = np.cross(pull, moment) / np.maximum((pull**2).sum(axis=1), 1e-12)[:, None]
        starts = np.stack([np.zeros_like(beside), beside], axis=1) - middle[:, None]
        marks.append(Arrows(starts, per_newton * np.stack([weight, pull], axis=1), "weight and pull", SET))
    # an arrow ends at the contact: contacts push, and the inside of the object stays free
    colour = TRUTH if grasp.truth_known else FELT
    marks.append(Arrows(places - per_newton * pushes, per_newton * pushes, "contact force", colour))
    outwards = tips[step] * (1.0 + 0.6 * tip_radius(hand.tips[0]) / distances)[:, None]
    marks.append(Labels(outwards, tuple(str(k + 1) for k in range(truth.fingers))))
    return Space(tuple(marks), height=380, view=(0.4, -0.9, 0.45))


def held_mesh(config: GraspConfig) -> Mesh:
    """Return the mesh of the held object in its frame, with sharp edges; a cylinder's axis is x."""
    size = config.sizes
    if config.object == "sphere":
        return _sphere_mesh(size[0])
    if config.object == "box":
        mesh = trimesh.creation.box(size)
    else:
        mesh = trimesh.creation.cylinder(radius=size[0], height=size[1], sections=_CIRCLE_CORNERS)
        mesh.vertices = np.roll(mesh.vertices, 1, axis=1)
    mesh = smooth_shade(mesh, angle=_MAX_SMOOTH_ANGLE)
    return np.array(mesh.vertices), np.array(mesh.faces)


def _sphere_mesh(radius: float) -> Mesh:
    """Return a sphere about the origin."""
    ball = trimesh.creation.icosphere(3, radius)
    return np.array(ball.vertices), np.array(ball.faces)
