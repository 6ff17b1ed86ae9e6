"""Figures of a grasp: grip, slip and spin over time, and the forces and loads of each moment."""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import partial

import numpy as np
import numpy.typing as npt
import trimesh
from scipy.spatial.transform import Rotation
from trimesh.graph import smooth_shade

from palpate.controllers.grip.grasp import GraspStage
from palpate.errors import FloatArray
from palpate.experiments.grasp.config import GraspConfig
from palpate.experiments.grasp.friction_belief import tip_radius
from palpate.experiments.grasp.result import BoolArray, GraspResult
from palpate.experiments.grasp.truth import STAGES
from palpate.reporting.figure import Axis, Figure, Panel, Space
from palpate.reporting.grasp_figures import limit_surface_panel, load_sizes
from palpate.reporting.marks import Dash, Line, Points, Symbol
from palpate.reporting.report import FigureSource
from palpate.reporting.run_figures import phase_spans, true_and_felt
from palpate.reporting.solids import Arrows, Labels, Placed, Solid, Surface
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


def grasp_figures(grasp: GraspResult, note: str = "") -> Iterator[FigureSource]:
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
