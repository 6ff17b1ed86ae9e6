"""The report on a grasp."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from palpate.errors import FloatArray
from palpate.experiments.grasp.account import account, outcome
from palpate.experiments.grasp.config import GraspConfig
from palpate.experiments.grasp.figures import grasp_figures
from palpate.experiments.grasp.friction_belief import rubbed_by_plant
from palpate.experiments.grasp.metrics import METRICS, delay_note
from palpate.experiments.grasp.result import GraspResult
from palpate.experiments.kit.experiment import ExperimentDefaults
from palpate.experiments.kit.metric import NOT_KNOWN
from palpate.experiments.kit.run_report import log_row, report_of
from palpate.grasp import GraspContacts, GraspForceOptimizer, SolveStatus, worst_disturbance
from palpate.reporting.data import Quantity
from palpate.reporting.figure import Figure
from palpate.reporting.grasp_figures import grasp_force_figure
from palpate.reporting.report import Figures, Paragraph, QuantityTable, Report, Section
from palpate.runtime import Ending
from palpate.sim.fidelity import GRAVITY

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
            Section("From the first touch to the last", (Figures(lambda: grasp_figures(grasp)),)),
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
        figures = Figures(lambda: grasp_figures(other, _IGNORING_SPIN))
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
