"""Hybrid force/position control: what was asked for, and what it does, in simulation.

    python benchmarks/control.py [--quick] [--asked]

Noise of a Nano17-class sensor (white, 3.1 mN and 0.016 mNm), 2 N, 1 kHz, mu 0.3, 20 kN/m and a path's acceleration
of 0.1 m/s^2 unless said; forces are the simulation's own. "Identified" is: pressed on a plate of that stiffness
first, with the law that this gives. Surfaces that move are given 0.8 s to be picked up after landing. "Stated" is
the bound on the landing's peak that `LandingModel` gives beforehand; "as computed" the speed of landing that keeps
it to the set force and 1 N, but 5 mm/s at most. Ends with 1 if a figure that was asked for is missed; --asked
leaves out everything for which nothing was asked.
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
    Admittance,
    ExploreController,
    ExploreParameters,
    ForceGain,
    Identification,
    IdentifyController,
    IdentifyParameters,
    LandingModel,
    NormalAxis,
    Orientation,
    Raster,
    force_gain,
    series_stiffness,
    stiffness_range,
    surface_filter,
    tracking_delay,
)
from palpate.controllers.landing import meeting_speed, moved_mass
from palpate.controllers.measured_admittance import MeasuredAdmittance
from palpate.controllers.paths import Follow
from palpate.runtime import Finger, Limits, Phase, Supervisor, Touch, run
from palpate.runtime.data import Command, Observation
from palpate.runtime.loop import Observer
from palpate.runtime.protocols import Controller
from palpate.sensing.compensation import SensorPayload
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
NOISE, QUIET = (3.1e-3, 1.6e-5), (1e-9, 1e-12)
PLATE = Box((0.2, 0.2, 0.04))
FIELD, LAW = Raster(0.04, 0.008, 0.008), ContactLaw()
SMALL = Raster(0.012, 0.004, 0.002)
ACCELERATION = 0.1
"""[m/s^2] Of the path: 0.2 s from rest to 20 mm/s."""

MARGIN = FORCE + 1.0
"""[N] What a landing may reach."""

MEETING, LIMIT = 10.0, 20.0
"""[N] With which a surface that goes up and down may be met; and may never be exceeded, whatever is misjudged."""


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
        noise: Of the sensor [N, N m].
        turns: Whether the tip turns with the surface.
        settle: From the touch to the sweep [s].
        surface_speed: Of a surface that goes up and down [m/s].
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
    noise: tuple[float, float] = NOISE
    turns: bool = False
    settle: float = 0.3
    surface_speed: float = 0.0


@dataclass(frozen=True, slots=True)
class Got:
    """What came of it.

    Attributes:
        rms: Of the force's error while it swept [N].
        worst: Largest error then [N].
        lost: Share of the sweep without contact.
        landing: Peak of landing [N].
        stated: Bound on it, given beforehand [N].
        speed: Of landing [m/s].
        tilt: RMS angle between the tip's axis and the surface's normal while it swept [rad].
        ending: How the run ended.
    """

    rms: float
    worst: float
    lost: float
    landing: float
    stated: float
    speed: float
    tilt: float
    ending: str


def shaken(stroke: float = 0.01, speed: float = 0.02) -> MovingTarget:
    """Return a plate that moves up and down as a sine."""
    motion = Sine(stroke, speed / stroke / (2.0 * math.pi), math.pi / 2.0)
    return MovingTarget(PLATE, [DrivenJoint(JointKind.SLIDE, (0.0, 0.0, 1.0), motion)], (0.0, 0.0, -stroke))


def turning(rate: float) -> MovingTarget:
    """Return a plate that turns [rad/s]."""
    return MovingTarget(PLATE, [DrivenJoint(JointKind.HINGE, (0.0, 0.0, 1.0), Ramp(rate))])


def landings(arm: bool) -> list[Case]:
    """Return landings at 5 mm/s and as computed, on a contact as assumed and on one five times as stiff."""
    short = Raster(0.004, 0.002, 0.002)
    ball, hard = SphereObject(0.04), ContactLaw(stiffness=100e3)
    some = []
    for law, name in ((LAW, "20 kN/m"), (hard, "100 kN/m")):
        for noise, sensor in ((NOISE, ""), (QUIET, ", no noise")):
            for speed, how in ((0.005, "at 5 mm/s"), (0.0, "as computed")):
                limit = MARGIN if law is LAW or speed == 0.0 else None
                some.append(
                    Case(
                        f"landing {how}, {name}{sensor}", ball, None, 0.02, short, law=law, arm=arm,
                        landing=speed, landing_limit=limit, noise=noise,
                    )
                )  # fmt: skip
    return some


def sweeps_on(arm: bool) -> list[Case]:
    """Return sweeps, on the stage or on the arm with the law that was identified."""
    ball, egg = SphereObject(0.04), EllipsoidObject()
    hill = Raster(0.04, 0.008, 0.008, (0.0, 0.015))  # over the full height of the bumps
    over = Raster(0.046, 0.008, 0.008)  # 5 mm beyond both edges: the tip's side of 39 degrees touches them
    hole = Raster(0.004, 0.02, 0.02, (0.03, 0.0))
    soft, hard = ContactLaw(stiffness=1e3), ContactLaw(stiffness=200e3)
    rough, slick = ContactLaw(friction=1.0), ContactLaw(friction=0.05)
    some = [
        Case("sphere, 20 mm/s", ball, 0.05),
        Case("ellipsoid, 20 mm/s", egg, 0.05),
        Case("ellipsoid, 20 mm/s, no noise", egg, 0.05, noise=QUIET),
        Case("sphere, 50 mm/s", ball, 0.10, 0.05),
        Case("ellipsoid, 50 mm/s", egg, 0.10, 0.05),
        Case("ellipsoid, 12 x 4 mm", egg, 0.05, raster=SMALL),
        Case("bumps of 3 mm, 20 mm/s", bumps(), 0.15, raster=hill, tip=0.004),
        Case("torus, 20 mm/s", Torus(0.03, 0.012), 0.15, raster=hole, tip=0.004),
        Case("box, over two edges", Box((0.036, 0.04, 0.03)), math.inf, raster=over),
        Case("mu 0.05", ball, 0.05, law=slick),
        Case("mu 1.0", ball, 0.05, law=rough),
        Case("mu 1.0, 12 x 4 mm", ball, None, law=rough, raster=SMALL),
        Case(
            "plate, sine of 20 mm/s, 10 mm",
            shaken(),
            0.10,
            follow=True,
            surface_speed=0.02,
            landing_limit=MEETING,
        ),
        Case("turntable, 1 rad/s", turning(1.0), 0.05, follow=True),
        Case("1 kN/m", ball, 0.05, law=soft, identified=True, landing=0.0, settle=1.0),
        Case("200 kN/m", ball, 0.05, law=hard, identified=True, landing=0.0),
    ]
    if arm:
        some = [replace(case, arm=True, identified=True, landing=0.0) for case in some]
        some += [
            replace(some[i], name=f"{some[i].name}, tip turns", turns=True, raster=raster)
            for i, raster in ((1, FIELD), (6, hill))
        ]
        some += [
            replace(some[i], name=f"{some[i].name}, not identified", identified=False) for i in (0, 1, 4, 5, 10)
        ]
    else:
        some += [
            replace(
                some[12], name=f"plate, sine, {name}", law=law, identified=True, landing=0.0, limit=None
            )
            for law, name in ((soft, "1 kN/m"), (hard, "200 kN/m"))
        ]  # fmt: skip
    return some


def misjudged(arm: bool) -> list[Case]:
    """Return plates whose stiffness is not what it is taken for."""
    some = []
    for target, name in ((PLATE, "plate"), (shaken(), "plate, sine")):
        speed = 0.02 if isinstance(target, MovingTarget) else 0.0
        for assumed, how in ((20e3 / 3.0, "a third"), (60e3, "three times")):
            some.append(
                Case(
                    f"{name}, K assumed {how}", target, math.inf, assumed=assumed, follow=True, arm=arm,
                    surface_speed=speed, landing_limit=LIMIT if speed else None,
                )
            )  # fmt: skip
    return some


def cases(quick: bool, asked: bool = False) -> list[Case]:
    """Return what is run."""
    found: list[Case] = []
    for arm in (False,) if quick else (False, True):
        found += [*landings(arm), *sweeps_on(arm), *misjudged(arm)]
    if asked:
        found = [case for case in found if case.limit is not None or case.landing_limit is not None]
    return [replace(case, name=f"UR5e: {case.name}") if case.arm else case for case in found]


def backend_for(case: Case, target: SceneObject | MovingTarget, corner: tuple[float, float]) -> MujocoBackend:
    """Return the scene, the tip a millimetre above the target's top."""
    shape = target.shape if isinstance(target, MovingTarget) else target
    step = 0.5e-3 if case.law.stiffness < 1.1e5 else 0.25e-3
    start = (*corner, shape.top + case.tip + 0.001)
    carrier = ArmCarrier() if case.arm else Stage()
    tip = Tip(Sphere(case.tip))
    scene = build_scene(tip, target, case.law, start, carrier, Fidelity(step))
    return MujocoBackend(scene, PERIOD, white_noise(*case.noise, seed=1))


def identified(case: Case) -> Identification:
    """Press on a plate of the case's stiffness."""
    controller = IdentifyController(IdentifyParameters(), PERIOD)
    carry_out(case, backend_for(case, PLATE, (0.0, 0.0)), controller, ())
    return controller.result()


def carry_out(case: Case, backend: MujocoBackend, controller: Controller, observers: tuple[Observer, ...]) -> str:
    """Run a controller and return how it ended."""
    tip = backend.scene.tip
    finger = Finger(Sphere(case.tip - FORCE / (2.0 * case.law.stiffness)), SensorPayload(tip.mass))
    result = run(
        backend, Touch(finger), controller, Supervisor(Limits(force=60.0)), duration=30.0, observers=observers
    )
    return str(result.trip) if result.trip is not None else result.ending.value


def servo_of(backend: MujocoBackend, arm: bool) -> tuple[float, float, float]:
    """Return the carrier's stiffness [N/m], its response and its lag [s]."""
    carrier, tip = backend.scene.carrier, backend.scene.tip
    if isinstance(carrier, ArmCarrier):
        joints = carrier.joint_start((0.0, 0.0, 0.05))
        return (
            carrier.arm.push(joints, (0.0, 0.0, -1.0)) / carrier.arm.following_error_limit.distance,
            carrier.arm.lead,
            0.0,
        )
    assert isinstance(carrier, Stage)
    return carrier.stiffness(tip.mass), carrier.lag, carrier.lag


def sweep(case: Case) -> Got:
    """Run one case."""
    backend = backend_for(case, case.target, case.raster.corners()[0])
    servo, response, lag = servo_of(backend, case.arm)
    delay, lead = tracking_delay(PERIOD, response), tracking_delay(PERIOD, lag)
    contact = case.assumed or case.law.stiffness
    gain: ForceGain = force_gain(series_stiffness(contact, servo), delay)
    model = LandingModel(series_stiffness(contact, servo), delay, contact, moved_mass(servo, response))
    law = None
    if case.identified:
        found = identified(case)
        contact, gain = found.stiffness.value, found.gain
        if found.admittance is not None:
            law, gain = Admittance(found.admittance.body, PERIOD), found.admittance.gain
    landing = case.landing or min(0.005, model.speed(FORCE, 0.2))
    if case.surface_speed:
        landing = min(landing, model.speed_on_motion(MEETING, case.surface_speed))
    parameters = ExploreParameters(
        force=FORCE,
        speed=case.speed,
        gain=gain,
        lead=lead,
        acceleration=ACCELERATION,
        landing_speed=landing,
        settle_time=0.8 if case.follow else case.settle,
    )
    follow = surface_filter(contact, gain, lead) if case.follow else None
    orientation = Orientation(NormalAxis(), PERIOD) if case.turns else None
    controller = ExploreController(
        parameters, Follow(case.raster), PERIOD, law=law, follow=follow, orientation=orientation
    )
    rows: list[tuple[float, float, float, float, float]] = []

    def watch(_: object, now: Observation, command: Command) -> None:
        truth = backend.truth()
        contact_normal = now.fingers[0].contact.normal
        n = np.array(now.arm.rotation_base_tip) @ contact_normal
        felt = -float(np.dot(truth.force, n)) if truth.touching else 0.0
        tilt = math.acos(min(1.0, max(-1.0, -float(n @ np.array(now.arm.rotation_base_tip)[:, 2]))))
        phase = command.phase
        rows.append((felt, float(truth.touching), float(phase is Phase.SCAN), float(phase is Phase.SETTLE), tilt))

    ending = carry_out(case, backend, controller, (watch,))
    force, touching, scan, settle, tilt = np.array(rows).T
    scanning, landing = scan > 0.0, settle > 0.0
    speed = parameters.landing_speed
    met = meeting_speed(speed, case.surface_speed) if case.surface_speed else speed
    stated = model.peak(met)
    if not scanning.any():
        return Got(math.nan, math.nan, math.nan, math.nan, stated, speed, math.nan, ending)
    error = force[scanning] - FORCE
    return Got(
        float(np.sqrt(np.mean(error**2))),
        float(np.abs(error).max()),
        float(1.0 - touching[scanning].mean()),
        float(np.nanmax(force[landing])),
        stated,
        speed,
        float(np.sqrt(np.mean(tilt[scanning] ** 2))),
        ending,
    )


def sweeps(quick: bool, asked: bool) -> tuple[Table, bool]:
    """Run all cases; return a table, and whether all is as it was asked for."""
    table = Table(title="Force while sweeping, true contact force, 2 N")
    headings = (
        "case",
        "RMS N: asked",
        "got",
        "worst N",
        "lost %",
        "tilt deg",
        "landing mm/s",
        "N: asked",
        "stated",
    )
    for heading in (*headings, "got", "ending", ""):
        table.add_column(heading, justify="left" if heading == "case" else "right")
    fine = True
    for case in track(cases(quick, asked), "sweeping", transient=True):
        got = sweep(case)
        kept = got.ending == "done" and got.lost == 0.0
        kept &= case.limit is None or got.rms < case.limit
        kept &= case.landing_limit is None or got.landing <= case.landing_limit
        fine &= kept
        table.add_row(
            case.name,
            {None: "-", math.inf: "no loss"}.get(case.limit, f"{case.limit:.2f}" if case.limit else "-"),
            f"{got.rms:.4f}",
            f"{got.worst:.3f}",
            f"{100 * got.lost:.2f}",
            f"{math.degrees(got.tilt):.1f}",
            f"{1e3 * got.speed:.2f}",
            "-" if case.landing_limit is None else f"{case.landing_limit:.2f}",
            f"{got.stated:.2f}",
            f"{got.landing:.2f}",
            got.ending[:30],
            "" if kept else "MISSED",
        )
    return table, fine


def identifications(quick: bool) -> Table:
    """Identify contacts of known stiffness."""
    table = Table(title="Identification on a plate")
    headings = ("robot, K kN/m", "K found", "sd", "servo kN/m", "in contact: lag ms", "T ms", "k mm/s/N")
    for heading in (*headings, "gain margin", "phase margin", "admittance: k", "lag ms", "margins", "K x 3"):
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
            *_told(found.admittance),
        )
    return table


def _told(found: MeasuredAdmittance | None) -> tuple[str, str, str, str]:
    if found is None:
        return ("-", "-", "-", "-")
    return (
        f"{1e3 * found.gain.gain:.2f}",
        f"{1e3 * found.body.lag:.1f}",
        f"{found.gain_margin:.1f}, {found.phase_margin_deg:.0f} deg",
        f"{found.stiffer_phase_margin_deg:.0f} deg",
    )


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
    controller = ExploreController(parameters, Follow(case.raster), PERIOD)
    carry_out(case, backend, controller, (lambda _, now, command: seen.append((now, command)),))
    scanning = [now for now, command in seen if command.phase is Phase.SCAN][:1000]  # type: ignore[misc, attr-defined]
    table = Table(title="One step of the controller, sweeping")
    table.add_column("with")
    table.add_column("us (median of 15)", justify="right")
    makers: dict[str, Callable[[], ExploreController]] = {
        "nothing more": lambda: ExploreController(parameters, Follow(case.raster), PERIOD),
        "the surface followed": lambda: ExploreController(
            parameters, Follow(case.raster), PERIOD, follow=surface_filter(20e3, gain, 0.0215)
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
    parser.add_argument("--asked", action="store_true", help="only what figures were asked for")
    arguments = parser.parse_args()
    console = Console(width=160)
    table, fine = sweeps(arguments.quick, arguments.asked)
    console.print(table)
    if arguments.asked:
        return 0 if fine else 1
    console.print(identifications(arguments.quick))
    console.print(margins())
    console.print(costs())
    return 0 if fine else 1


if __name__ == "__main__":
    sys.exit(main())
