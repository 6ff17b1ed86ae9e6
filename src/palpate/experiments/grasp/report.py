"""The report on one grasp."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from palpate.errors import FloatArray
from palpate.experiments.grasp.figures import over_time
from palpate.experiments.grasp.moments_figure import moments_figure
from palpate.experiments.grasp.quantities import compared, quantities
from palpate.experiments.grasp.result import GraspResult
from palpate.experiments.grasp.words import account, advice, asked, outcome, settings, title
from palpate.grasp import GraspContacts, GraspForceOptimizer, SolveStatus, worst_disturbance
from palpate.reporting.figure import Figure
from palpate.reporting.grasp_figures import grasp_force_figure
from palpate.reporting.report import Figures, Paragraph, QuantityTable, Report, Section
from palpate.reporting.run_figures import computing
from palpate.runtime import Ending
from palpate.sim.fidelity import GRAVITY


@dataclass(frozen=True, slots=True, eq=False)
class HeaviestLoad:
    """The least forces that hold the load where it takes most grip; object frame turned as the base is.

    Attributes:
        time: When [s].
        grasp: Contacts, and what they really bear.
        forces: On the object, shape (k, 4) [N, N, N, N m].
        load: What else acts on it, shape (6,) [N, N m].
        disturbance: The largest further load that the true grip held in the worst direction, shape (6,) [N, N m];
            None where that is not known.
    """

    time: float
    grasp: GraspContacts
    forces: FloatArray
    load: FloatArray
    disturbance: FloatArray | None


def heaviest_load(grasp: GraspResult) -> HeaviestLoad | None:
    """Return where the load takes most grip while it is pulled, and the least forces there; None if it was lost.

    The forces are those of least effort by the true limit surface, and with them the worst further push: what is
    added there from any direction is held at least up to its size.
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
    grip = GraspContacts(
        places,
        frames,
        true.friction,
        true.spin_length,
        load_exponent=true.load_exponent,
        norm_exponent=true.norm_exponent,
    )
    load = truth.pull[at] + np.array([0.0, 0.0, -planned.config.mass * GRAVITY, 0.0, 0.0, 0.0])
    least = GraspForceOptimizer(grip).solve(load)
    if least.status is not SolveStatus.SOLVED:
        return None
    disturbance = None
    if grip.is_convex:
        # what fingers that press as they did still hold; normal forces are commanded, friction takes what it must
        held = GraspContacts(places, frames, true.friction, true.spin_length, 0.0, np.maximum(pressed, 1e-6))
        worst = worst_disturbance(held, float(np.linalg.norm(places, axis=1).max()), load)
        disturbance = worst.direction * worst.factor if worst.factor > 0.0 else None
    return HeaviestLoad(float(truth.time[at]), grip, least.forces, load, disturbance)


IGNORING = ", ignoring spin"
"""At the end of the titles of figures of such a control."""


def grasp_report(grasp: GraspResult) -> Report:
    """Return the report on a grasp."""
    return Report(
        title=title(grasp),
        outcome=outcome(grasp),
        metrics=quantities(grasp),
        sections=(
            Section("What was seen", tuple(Paragraph(each) for each in account(grasp))),
            Section("From the first touch to the last", (Figures(lambda: _over_time(grasp)),)),
            *_least_forces(grasp),
            *_ignoring_spin(grasp),
            computing(grasp.run.timing),
        ),
        asked=asked(grasp),
        advice=advice(grasp),
        settings=settings(grasp),
        footer="Loads that the object exerts on the fingers.",
        reached=grasp.run.ending is Ending.DONE and not grasp.dropped,
    )


def _over_time(grasp: GraspResult, note: str = "") -> Iterator[Figure | None]:
    yield over_time(grasp, note)
    yield moments_figure(grasp, note)


def _least_forces(grasp: GraspResult) -> Iterator[Section]:
    at = heaviest_load(grasp)
    if at is None:
        return

    def draw() -> Iterator[Figure | None]:
        yield grasp_force_figure(at.grasp, at.forces, at.load, at.disturbance)

    yield Section(
        "The least forces where the load is heaviest",
        (Paragraph(f"At {at.time:.3g} s, by what the contacts really bear."), Figures(draw)),
    )


def _ignoring_spin(grasp: GraspResult) -> Iterator[Section]:
    other = grasp.comparison
    if other is None:
        return

    figures = Figures(lambda: _over_time(other, IGNORING))
    yield Section("A control that ignores spin", (QuantityTable(compared(grasp)), figures))
