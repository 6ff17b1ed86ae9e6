"""A grasp from the lift on, moment by moment: forces in space, and each load in its limit surface."""

import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import Rotation

from palpate.controllers.grip.grasp import GraspStage
from palpate.errors import FloatArray
from palpate.experiments.grasp.belief import tip_radius
from palpate.experiments.grasp.config import GraspConfig
from palpate.experiments.grasp.result import GraspResult
from palpate.experiments.grasp.truth import STAGES
from palpate.reporting.figure import Figure, Space
from palpate.reporting.grasp_figures import limit_surface_panel, load_sizes
from palpate.reporting.solids import Arrows, Labels, Placed, Solid, Surface
from palpate.runtime.palette import FELT, QUIET_COLOUR, SET, TRUTH
from palpate.sim.fidelity import GRAVITY

ROUND = 36
"""Corners of what is round."""

Mesh = tuple[FloatArray, npt.NDArray[np.intp]]
"""Vertices (n, 3) [m] and triangles (m, 3)."""


def held_mesh(config: GraspConfig) -> Mesh:
    """Return what is held, in the object's frame; a cylinder's axis is x."""
    sizes = config.sizes
    if config.object == "sphere":
        return sphere_mesh(sizes[0])
    if config.object == "cylinder":
        half, radius = 0.5 * sizes[1], sizes[0]
        # each rim twice, so that it is an edge
        return _turned(half * np.array([-1, -1, -1, 1, 1, 1.0]), radius * np.array([0, 1, 1, 1, 1, 0.0]), ROUND)
    vertices, triangles = _turned(np.array([-1, -1, 1, 1.0]), np.array([0, 1, 1, 0.0]), 4)
    corners = vertices[triangles.ravel()] * np.array([0.5, np.sqrt(0.5), np.sqrt(0.5)]) * np.array(sizes)
    return corners, np.arange(len(corners)).reshape(-1, 3)


def sphere_mesh(radius: float) -> Mesh:
    """Return a sphere about the origin."""
    angle = np.linspace(0.0, np.pi, ROUND // 2 + 1)
    return _turned(-radius * np.cos(angle), radius * np.sin(angle), ROUND)


def _turned(x: FloatArray, radius: FloatArray, corners: int) -> Mesh:
    """A profile turned about the x axis; of four corners it has its sides across y and z."""
    angle = 2.0 * np.pi * (np.arange(corners) + 0.5) / corners
    ring = np.stack([np.ones(corners), np.cos(angle), np.sin(angle)], axis=1)
    vertices = np.stack([x, radius, radius], axis=1)[:, None] * ring
    i, j = np.meshgrid(np.arange(len(x) - 1), np.arange(corners), indexing="ij")
    a, b = (i * corners + j).ravel(), (i * corners + (j + 1) % corners).ravel()
    triangles = np.concatenate([np.stack([a, b, a + corners], 1), np.stack([b, b + corners, a + corners], 1)])
    return vertices.reshape(-1, 3), triangles


MOMENTS = 120
"""That are played, evenly in time, besides the worst."""

LONGEST_ARROW = 1.2
"""The largest force is drawn so long, over how far the fingertips are from their middle."""

IntArray = npt.NDArray[np.intp]


def moments_figure(grasp: GraspResult, note: str = "") -> Figure | None:
    """Return the figure that plays a grasp, its worst moment first; None if nothing was lifted.

    Args:
        grasp: What came of it.
        note: For the end of the title.
    """
    lifted = np.flatnonzero(grasp.aloft)
    if not len(lifted):
        return None
    truth, surface, known = grasp.truth, grasp.planned.true, grasp.truth_known
    worst, borne = worst_moment(grasp), _borne(grasp)
    evenly = lifted[np.linspace(0, len(lifted) - 1, min(MOMENTS, len(lifted))).round().astype(np.intp)]
    at = np.union1d(evenly, [worst])
    step = int(np.searchsorted(at, worst))
    colour = TRUTH if known else FELT
    names = [f"{truth.time[i]:.3f} s, {truth.phase[i]}" for i in at]
    names[step] += ", the worst"
    size = float(np.nanmax(load_sizes(surface, truth.loads[worst]), initial=0.0))
    by = "by the truth" if known else "as felt, and by what contacts are believed to bear"
    return Figure(
        title=f"Forces and loads{note}",
        caption=(
            "Fingertips, what they press with, and where the load of each was in its limit surface while they "
            f"alone bore the object, {by}: spin torque and tangential force over what the contact bears of each "
            "alone, in a stronger colour where it was more often (by the logarithm). On the line a contact slips; "
            "well inside is good. "
            f"First shown is the worst moment, at {truth.time[worst]:.3f} s: there a load is at {size:.2f} of the "
            "limit. The player goes through all moments from the lift on."
        ),
        panels=(
            _space(grasp, at, step),
            *(
                limit_surface_panel(
                    surface, truth.loads[borne, k], truth.loads[at, k], step, f"finger {k + 1}", colour
                )
                for k in range(truth.fingers)
            ),
        ),
        columns=3 if truth.fingers == 2 else 2,
        steps=tuple(names),
        step=step,
        wide=True,
    )


def worst_moment(grasp: GraspResult) -> int:
    """Return the row at which the load of any finger came closest to its limit, or went farthest beyond."""
    sizes = load_sizes(grasp.planned.true, grasp.truth.loads).max(axis=1)
    return int(np.where(_borne(grasp) & np.isfinite(sizes), sizes, -1.0).argmax())


def _borne(grasp: GraspResult) -> npt.NDArray[np.bool_]:
    """When fingers alone, all of them, bore it; where that is not known, while it was held, or since the lift."""
    touching = grasp.truth.touching.all(axis=1)
    held = grasp.truth.stage == STAGES.index(GraspStage.HOLD)
    return next((each for each in (grasp.carried & touching, held & touching) if each.any()), grasp.aloft)


def _space(grasp: GraspResult, at: IntArray, step: int) -> Space:
    """Seen from the hand: the origin is the middle of the fingertips, axes are the base's."""
    truth, hand = grasp.truth, grasp.planned.hand.geometry
    middle = truth.tip[at].mean(axis=1)
    tips = truth.tip[at] - middle[:, None]
    touching = truth.touching[at][:, :, None]
    pushes = np.where(touching, -truth.force[at], 0.0)
    places = np.where(touching, truth.contact[at] - middle[:, None], tips)
    marks: list[Solid] = []
    still = np.broadcast_to(np.eye(3), (len(at), 3, 3))
    for k, tip in enumerate(hand.tips):
        ball = Surface(*sphere_mesh(tip_radius(tip)), "" if k else "fingertips", colour=QUIET_COLOUR, opacity=0.6)
        marks.append(Placed(ball, tips[:, k], still))
    longest = float(np.linalg.norm(pushes, axis=2).max(initial=0.0))
    per_newton = LONGEST_ARROW * float(np.linalg.norm(tips[step], axis=1).max()) / max(longest, 1e-9)
    if grasp.truth_known:
        turns = Rotation.from_quat(np.roll(truth.quat_wxyz[at], -1, axis=1)).as_matrix()
        body = Surface(*held_mesh(grasp.planned.config), "object", colour=QUIET_COLOUR, opacity=0.22)
        marks.append(Placed(body, -middle, turns))
        starts, along = _loads(grasp, at)
        marks.append(Arrows(starts - middle[:, None], per_newton * along, "weight and pull", SET))
    # an arrow that ends at the contact: contacts push, and what is inside stays free
    colour = TRUTH if grasp.truth_known else FELT
    marks.append(Arrows(places - per_newton * pushes, per_newton * pushes, "contact force", colour))
    outwards = tips[step] * (1.0 + 0.6 * tip_radius(hand.tips[0]) / np.linalg.norm(tips[step], axis=1))[:, None]
    marks.append(Labels(outwards, tuple(str(k + 1) for k in range(truth.fingers))))
    return Space(tuple(marks), height=380, view=(0.4, -0.9, 0.45))


def _loads(grasp: GraspResult, at: IntArray) -> tuple[FloatArray, FloatArray]:
    """Where weight and pull act, from the object's origin [m], and the forces [N]; each of shape (n, 2, 3)."""
    pull, moment = grasp.truth.pull[at, :3], grasp.truth.pull[at, 3:]
    weight = np.zeros_like(pull)
    weight[:, 2] = -grasp.planned.config.mass * GRAVITY
    square = np.maximum((pull**2).sum(axis=1), 1e-12)
    # the point of its line of action that is nearest to the origin
    beside = np.cross(pull, moment) / square[:, None]
    return np.stack([np.zeros_like(beside), beside], axis=1), np.stack([weight, pull], axis=1)
