"""Hybrid force/position control: what was asked for, and what it does, in simulation.

    python benchmarks/control.py [--quick]

Noise of a Nano17-class sensor (white, 3.1 mN and 0.016 mNm), 2 N, 1 kHz, mu 0.3 and 20 kN/m unless said; forces
are the simulation's own. Surfaces that move are given 0.8 s to be picked up after landing. Ends with 1 if a figure
that was asked for is missed.
"""

import argparse
import math
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from rich.console import Console
from rich.progress import track
from rich.table import Table

from palpate.controllers import (
    ExploreController,
    ExploreParameters,
    ForceGain,
    Identification,
    IdentifyController,
    IdentifyParameters,
    LandingModel,
    Raster,
    force_gain,
    series_stiffness,
    stiffness_range,
    surface_filter,
    tracking_delay,
)
from palpate.runtime import Finger, Limits, Phase, Supervisor, Touch, run
from palpate.runtime.loop import Observer
from palpate.runtime.protocols import Controller
from palpate.sensing.compensation import Payload
from palpate.sim import (
    ArmCarrier,
    Box,
    ContactLaw,
    EllipsoidObject,
    Fidelity,
    MujocoBackend,
    SceneObject,
    SphereObject,
    Stage,
    Tip,
    Torus,
    build_scene,
    bumps,
    white_noise,
)
from palpate.sim.objects.motion import DrivenJoint, JointKind, MovingTarget, Ramp, Sine
from palpate.surfaces import Sphere

PERIOD, FORCE = 1e-3, 2.0
NOISE = (3.1e-3, 1.6e-5)
PLATE = Box((0.2, 0.2, 0.04))
FIELD, LAW = Raster(0.04, 0.008, 0.008), ContactLaw()
ARM_MASS = 7.0
"""[kg] What the arm's tip weighs along the normal, from the simulated contact's own damping."""


@dataclass(frozen=True, slots=True)
class Case:
    """One run.

    Attributes:
        name: For the table.
        target: What is swept.
        limit: Of the force's RMS error [N]; none if nothing was asked.
        speed: [m/s].
        raster: Where.
        tip: Radius [m].
        law: Of the contact.
        arm: Whether a UR5e carries the tip.
        follow: Whether the surface's motion is followed.
        assumed: Stiffness that the gain is made for; the true one if 0 [N/m].
        identified: Whether stiffness and gain come from an identification on a plate.
        landing: Speed [m/s]; from the landing's model if 0.
        landing_limit: Largest force on landing [N].
    """

    name: str
    target: SceneObject | MovingTarget
    limit: float | None = None
    speed: float = 0.02
    raster: Raster = FIELD
    tip: float = 0.008
    law: ContactLaw = LAW
    arm: bool = False
    follow: bool = False
    assumed: float = 0.0
    identified: bool = False
    landing: float = 0.005
    landing_limit: float | None = None


@dataclass(frozen=True, slots=True)
class Got:
    """What came of it: RMS and largest error while it swept, share without contact, peak of landing, ending."""

    rms: float
    worst: float
    lost: float
    landing: float
    ending: str


def shaken(stroke: float = 0.01, speed: float = 0.02) -> MovingTarget:
    """Return a plate that moves up and down as a sine."""
    motion = Sine(stroke, speed / stroke / (2.0 * math.pi), math.pi / 2.0)
    return MovingTarget(PLATE, [DrivenJoint(JointKind.SLIDE, (0.0, 0.0, 1.0), motion)], (0.0, 0.0, -stroke))


def turning(rate: float) -> MovingTarget:
    """Return a plate that turns [rad/s]."""
    return MovingTarget(PLATE, [DrivenJoint(JointKind.HINGE, (0.0, 0.0, 1.0), Ramp(rate))])


def cases(quick: bool) -> list[Case]:
    """Return what is run."""
    ball, egg = SphereObject(0.04), EllipsoidObject()
    hill = Raster(0.04, 0.008, 0.008, (0.0, 0.015))  # over the full height of the bumps
    over = Raster(0.046, 0.008, 0.008)  # 5 mm beyond both edges: the tip's side of 39 degrees touches them
    soft, hard = ContactLaw(stiffness=1e3), ContactLaw(stiffness=200e3)
    some = [
        Case("sphere, 20 mm/s", ball, 0.05, landing_limit=FORCE + 1.0),
        Case("ellipsoid, 20 mm/s", egg, 0.05, landing_limit=FORCE + 1.0),
        Case("sphere, 50 mm/s", ball, 0.10, 0.05),
        Case("ellipsoid, 50 mm/s", egg, 0.10, 0.05),
        Case("bumps of 3 mm, 20 mm/s", bumps(), 0.15, raster=hill, tip=0.004),
        Case("torus, 20 mm/s", Torus(0.03, 0.012), 0.15, raster=Raster(0.004, 0.02, 0.02, (0.03, 0.0)), tip=0.004),
        Case("box, over two edges", Box((0.036, 0.04, 0.03)), None, raster=over),
        Case("mu 0.05", ball, 0.05, law=ContactLaw(friction=0.05)),
        Case("mu 1.0", ball, 0.05, law=ContactLaw(friction=1.0)),
        Case("plate, sine of 20 mm/s, 10 mm", shaken(), 0.10, follow=True),
        Case("turntable, 1 rad/s", turning(1.0), 0.05, follow=True),
        Case("K assumed a third", PLATE, None, assumed=20e3 / 3.0, follow=True),
        Case("K assumed three times", PLATE, None, assumed=60e3, follow=True),
        Case("plate, sine, K assumed a third", shaken(), None, assumed=20e3 / 3.0, follow=True),
        Case("plate, sine, K assumed three times", shaken(), None, assumed=60e3, follow=True),
        Case("1 kN/m, identified", ball, 0.05, law=soft, identified=True, landing=0.0, landing_limit=FORCE + 1.0),
        Case(
            "200 kN/m, identified", ball, 0.05, law=hard, identified=True, landing=0.0, landing_limit=FORCE + 1.0
        ),
    ]
    moving_hard = replace(
        some[9], name="plate, sine, 200 kN/m, identified", law=hard, identified=True, landing=0.0
    )
    moving_soft = replace(moving_hard, name="plate, sine, 1 kN/m, identified", law=soft)
    if quick:
        return some
    on_arm = [replace(case, name=f"UR5e: {case.name}", arm=True) for case in some]
    landing = Case("UR5e: sphere, landing as computed", ball, None, arm=True, landing=0.0, landing_limit=3.0)
    return [*some, moving_hard, moving_soft, *on_arm, landing]


def backend_for(case: Case, target: SceneObject | MovingTarget, corner: tuple[float, float]) -> MujocoBackend:
    """Return the scene, the tip a millimetre above the target's top."""
    shape = target.shape if isinstance(target, MovingTarget) else target
    step = 0.5e-3 if case.law.stiffness < 1.1e5 else 0.25e-3
    start = (*corner, shape.top + case.tip + 0.001)
    carrier = ArmCarrier() if case.arm else Stage()
    tip = Tip(Sphere(case.tip))
    scene = build_scene(tip, target, case.law, start, carrier, Fidelity(step))
    return MujocoBackend(scene, PERIOD, white_noise(*NOISE, seed=1))


def identified(case: Case) -> Identification:
    """Press on a plate of the case's stiffness."""
    controller = IdentifyController(IdentifyParameters(), PERIOD)
    carry_out(case, backend_for(case, PLATE, (0.0, 0.0)), controller, ())
    return controller.result()


def carry_out(case: Case, backend: MujocoBackend, controller: Controller, observers: tuple[Observer, ...]) -> str:
    """Run a controller and return how it ended."""
    tip = backend.scene.tip
    finger = Finger(Sphere(case.tip - FORCE / (2.0 * case.law.stiffness)), Payload(tip.mass))
    result = run(
        backend, Touch(finger), controller, Supervisor(Limits(force=60.0)), duration=30.0, observers=observers
    )
    return str(result.trip) if result.trip is not None else result.ending.value


def servo_of(backend: MujocoBackend, arm: bool) -> tuple[float, float, float]:
    """Return the carrier's stiffness [N/m], its response and its lag [s]."""
    carrier, tip = backend.scene.carrier, backend.scene.tip
    if isinstance(carrier, ArmCarrier):
        joints = carrier.joint_start((0.0, 0.0, 0.05))
        return carrier.arm.push(joints, (0.0, 0.0, -1.0)) / carrier.arm.leash.distance, carrier.arm.lead, 0.0
    assert isinstance(carrier, Stage)
    return carrier.stiffness(tip.mass), carrier.lag, carrier.lag


def sweep(case: Case) -> Got:
    """Run one case."""
    backend = backend_for(case, case.target, case.raster.corners()[0])
    servo, response, lag = servo_of(backend, case.arm)
    delay, lead = tracking_delay(PERIOD, response), tracking_delay(PERIOD, lag)
    contact = case.assumed or case.law.stiffness
    gain: ForceGain = force_gain(series_stiffness(contact, servo), delay)
    if case.identified:
        found = identified(case)
        contact, gain = found.stiffness.value, found.gain
    mass = ARM_MASS if case.arm else Stage().mass + backend.scene.tip.mass
    model = LandingModel(series_stiffness(contact, servo), delay, contact, mass)
    parameters = ExploreParameters(
        force=FORCE,
        speed=case.speed,
        gain=gain,
        lead=lead,
        landing_speed=case.landing or min(0.005, model.speed(FORCE, 0.2)),
        settle_time=0.8 if case.follow else 0.3,
    )
    follow = surface_filter(contact, gain, lead) if case.follow else None
    controller = ExploreController(parameters, case.raster, PERIOD, follow=follow)
    rows: list[tuple[float, float, float, float]] = []

    def watch(_: object, now: object, command: object) -> None:
        truth = backend.truth()
        contact_normal = now.fingers[0].contact.normal  # type: ignore[attr-defined]
        felt = -float(np.dot(truth.force, contact_normal)) if truth.touching else 0.0
        phase = command.phase  # type: ignore[attr-defined]
        rows.append((felt, float(truth.touching), float(phase is Phase.SCAN), float(phase is Phase.SETTLE)))

    ending = carry_out(case, backend, controller, (watch,))
    force, touching, scan, settle = np.array(rows).T
    scanning, landing = scan > 0.0, settle > 0.0
    error = force[scanning] - FORCE
    if not scanning.any():
        return Got(math.nan, math.nan, math.nan, math.nan, ending)
    return Got(
        float(np.sqrt(np.mean(error**2))),
        float(np.abs(error).max()),
        float(1.0 - touching[scanning].mean()),
        float(np.nanmax(force[landing])),
        ending,
    )


def sweeps(quick: bool) -> tuple[Table, bool]:
    """Run all cases; return a table, and whether all is as it was asked for."""
    table = Table(title="Force while sweeping, true contact force, 2 N")
    for heading in ("case", "RMS N: asked", "got", "worst N", "lost %", "landing N: asked", "got", "ending", ""):
        table.add_column(heading, justify="left" if heading == "case" else "right")
    fine = True
    for case in track(cases(quick), "sweeping", transient=True):
        got = sweep(case)
        kept = got.ending == "done" and got.lost == 0.0
        kept &= case.limit is None or got.rms < case.limit
        kept &= case.landing_limit is None or got.landing <= case.landing_limit
        fine &= kept
        table.add_row(
            case.name,
            "-" if case.limit is None else f"{case.limit:.2f}",
            f"{got.rms:.4f}",
            f"{got.worst:.3f}",
            f"{100 * got.lost:.2f}",
            "-" if case.landing_limit is None else f"{case.landing_limit:.2f}",
            f"{got.landing:.2f}",
            got.ending[:30],
            "" if kept else "MISSED",
        )
    return table, fine


def identifications(quick: bool) -> Table:
    """Identify contacts of known stiffness."""
    table = Table(title="Identification on a plate")
    headings = ("robot, K kN/m", "K found", "sd", "servo kN/m", "in contact: lag ms", "T ms", "k mm/s/N")
    for heading in (*headings, "gain margin", "phase margin"):
        table.add_column(heading, justify="right")
    stiffnesses = (1e3, 20e3, 200e3) if quick else (0.5e3, 1e3, 20e3, 200e3)
    pairs = [(arm, K) for arm in ((False,) if quick else (False, True)) for K in stiffnesses]
    for arm, K in track(pairs, "pressing", transient=True):
        found = identified(Case("", PLATE, law=ContactLaw(stiffness=K), arm=arm))
        servo = found.servo_stiffness
        table.add_row(
            f"{'UR5e' if arm else 'stage'}, {1e-3 * K:g}",
            f"{1e-3 * found.stiffness.value:.4g}",
            f"{1e-3 * found.stiffness.sd:.1g}",
            "-" if servo is None else f"{1e-3 * servo.value:.4g}",
            f"{1e3 * found.lag.value:.2f}",
            f"{1e3 * found.delay.value:.2f}",
            f"{1e3 * found.gain.gain:.2f}",
            f"{found.gain.gain_margin:.1f}",
            f"{found.phase_margin_deg:.0f} deg",
        )
    return table


def margins() -> Table:
    """How wrong a stiffness may be, on a delayed integrator without any damping."""
    gain = force_gain(14.3e3, 0.0215)
    table = Table(title="True per assumed stiffness, between which the loop is stable: k K T = 0.5, T = 21.5 ms")
    for heading in ("loop", "softest", "stiffest"):
        table.add_column(heading, justify="right")
    follow = surface_filter(20e3, gain, 0.0215)
    for name, settings, share in (
        ("force control alone", None, 1.0),
        ("surface followed", follow, 1.0),
        ("surface followed, guard at a half", follow, 0.5),
        ("surface followed, guard at a quarter", follow, 0.25),
    ):
        found = stiffness_range(gain, settings, PERIOD, share)
        table.add_row(name, f"{found.softest:.2f}", f"{found.stiffest:.2f}")
    return table


def costs() -> Table:
    """Time a step of the controller in contact."""
    case = Case("", SphereObject(0.04))
    backend = backend_for(case, case.target, (0.0, 0.0))
    gain = force_gain(14.3e3, 0.0215)
    parameters = ExploreParameters(FORCE, 0.02, gain, 0.0215)
    seen: list[object] = []
    controller = ExploreController(parameters, case.raster, PERIOD)
    carry_out(case, backend, controller, (lambda _, now, command: seen.append((now, command)),))
    scanning = [now for now, command in seen if command.phase is Phase.SCAN][:1000]  # type: ignore[misc, attr-defined]
    table = Table(title="One step of the controller, sweeping")
    table.add_column("with")
    table.add_column("us (median of 15)", justify="right")
    makers: dict[str, Callable[[], ExploreController]] = {
        "nothing more": lambda: ExploreController(parameters, case.raster, PERIOD),
        "the surface followed": lambda: ExploreController(
            parameters, case.raster, PERIOD, follow=surface_filter(20e3, gain, 0.0215)
        ),
    }
    for name, make in makers.items():
        taken = []
        for _ in range(15):
            stepped = make()
            stepped.start(scanning[0])
            before = time.perf_counter()
            for now in scanning:
                stepped.step(now)
            taken.append((time.perf_counter() - before) / len(scanning))
        table.add_row(name, f"{1e6 * float(np.median(taken)):.1f}")
    return table


def main() -> int:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="the stage only")
    arguments = parser.parse_args()
    console = Console(width=130)
    table, fine = sweeps(arguments.quick)
    console.print(table)
    console.print(identifications(arguments.quick))
    console.print(margins())
    console.print(costs())
    return 0 if fine else 1


if __name__ == "__main__":
    sys.exit(main())
