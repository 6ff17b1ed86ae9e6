"""Hybrid force/position control in simulation: what was asked for, and what it does.

    python benchmarks/control.py [sweeps | moving ...] [--quick]

sweeps: noise of a Nano17-class sensor (white, 3.1 mN and 0.016 mNm), 2 N, 1 kHz, mu 0.3, 20 kN/m and a path's
acceleration of 0.1 m/s^2 unless stated; forces are the simulation's own. "Identified": pressed on a plate of that
stiffness first, with the law that this gives. Moving surfaces get 0.8 s after landing. "Stated" is the bound on
the landing's peak that `LandingModel` gives beforehand; "as computed" the landing speed that keeps the peak to the
set force and 1 N, but 5 mm/s at most. moving: a force held on a surface that goes up and down, the faster the
harder. --quick takes the stage alone.
"""

import math
from dataclasses import dataclass, replace

import numpy as np
from harness.command import start
from harness.study import Check, Effort, Errors, Row, Study

import palpate as pp
from palpate.controllers import (
    Admittance,
    ExploreController,
    ExploreParameters,
    Identification,
    IdentifyController,
    IdentifyParameters,
    LandingModel,
    NormalAxis,
    Orientation,
    Raster,
    force_gain,
    series_stiffness,
    surface_filter,
    tracking_delay,
)
from palpate.controllers.landing import meeting_speed, moved_mass
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

PERIOD, FORCE, ACCELERATION = 1e-3, 2.0, 0.1
NOISE, QUIET = (3.1e-3, 1.6e-5), (1e-9, 1e-12)
PLATE, LAW = Box((0.2, 0.2, 0.04)), ContactLaw()
FIELD, SMALL = Raster(0.04, 0.008, 0.008), Raster(0.012, 0.004, 0.002)
LANDING_LIMIT, MEETING, LIMIT = FORCE + 1.0, 10.0, 20.0
"""[N] Largest force on landing, on meeting a surface that goes up and down, and whatever is misjudged."""

Target = SceneObject | MovingTarget


@dataclass(frozen=True, slots=True)
class Case:
    """One run.

    Attributes:
        name: Name in the table.
        target: Surface that is swept.
        limit: Largest RMS error of the force [N]; infinite: only contact is asked for; None: nothing.
        speed: Speed of the sweep [m/s].
        raster: Path.
        tip: Radius [m].
        law: Contact law.
        arm: Whether a UR5e carries the tip.
        follow: Whether the surface's motion is followed.
        assumed: Stiffness that the gain is made for; the true one if 0 [N/m].
        identified: Whether stiffness and gain come from an identification on a plate.
        landing: Landing speed [m/s]; from the landing's model if 0.
        landing_limit: Largest force on landing [N].
        noise: Noise of the sensor [N, N m].
        turns: Whether the tip turns with the surface.
        settle: Time from the touch to the sweep [s].
        surface_speed: Largest speed of a surface that goes up and down [m/s].
    """

    name: str
    target: Target
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


def shaken(stroke: float = 0.01, speed: float = 0.02) -> MovingTarget:
    """Return a plate that moves up and down as a sine."""
    motion = Sine(stroke, speed / stroke / (2.0 * math.pi), math.pi / 2.0)
    return MovingTarget(PLATE, [DrivenJoint(JointKind.SLIDE, (0.0, 0.0, 1.0), motion)], (0.0, 0.0, -stroke))


def turning(rate: float) -> MovingTarget:
    """Return a plate that turns [rad/s]."""
    return MovingTarget(PLATE, [DrivenJoint(JointKind.HINGE, (0.0, 0.0, 1.0), Ramp(rate))])


def cases(arm: bool) -> list[Case]:
    """Return landings, sweeps and misjudged plates on the stage, or on the arm with the law that was
    identified."""
    ball, egg = SphereObject(0.04), EllipsoidObject()
    soft, hard, stiff = (ContactLaw(stiffness=stiffness) for stiffness in (1e3, 100e3, 200e3))
    short, hill = Raster(0.004, 0.002, 0.002), Raster(0.04, 0.008, 0.008, (0.0, 0.015))
    over = Raster(0.046, 0.008, 0.008)  # 5 mm beyond both edges: the tip's side of 39 degrees touches them
    hole = Raster(0.004, 0.02, 0.02, (0.03, 0.0))
    moving = {"follow": True, "surface_speed": 0.02}
    landings = [
        Case(f"landing {how}, {name}{sensor}", ball, None, 0.02, short, law=law, landing=speed,
             landing_limit=LANDING_LIMIT if law is LAW or not speed else None, noise=noise)
        for law, name in ((LAW, "20 kN/m"), (hard, "100 kN/m"))
        for noise, sensor in ((NOISE, ""), (QUIET, ", no noise"))
        for speed, how in ((0.005, "at 5 mm/s"), (0.0, "as computed"))
    ]  # fmt: skip
    sphere, ellipsoid = Case("sphere, 20 mm/s", ball, 0.05), Case("ellipsoid, 20 mm/s", egg, 0.05)
    fast = Case("sphere, 50 mm/s", ball, 0.10, 0.05), Case("ellipsoid, 50 mm/s", egg, 0.10, 0.05)
    hilly = Case("bumps of 3 mm, 20 mm/s", bumps(), 0.15, raster=hill, tip=0.004)
    rough = Case("mu 1.0", ball, 0.05, law=ContactLaw(friction=1.0))
    sine = Case("plate, sine of 20 mm/s, 10 mm", shaken(), 0.10, landing_limit=MEETING, **moving)
    sweeps = [
        sphere,
        ellipsoid,
        replace(ellipsoid, name="ellipsoid, 20 mm/s, no noise", noise=QUIET),
        *fast,
        replace(ellipsoid, name="ellipsoid, 12 x 4 mm", raster=SMALL),
        hilly,
        Case("torus, 20 mm/s", Torus(0.03, 0.012), 0.15, raster=hole, tip=0.004),
        Case("box, over two edges", Box((0.036, 0.04, 0.03)), math.inf, raster=over),
        Case("mu 0.05", ball, 0.05, law=ContactLaw(friction=0.05)),
        rough,
        replace(rough, name="mu 1.0, 12 x 4 mm", limit=None, raster=SMALL),
        sine,
        Case("turntable, 1 rad/s", turning(1.0), 0.05, follow=True),
        Case("1 kN/m", ball, 0.05, law=soft, identified=True, landing=0.0, settle=1.0),
        Case("200 kN/m", ball, 0.05, law=stiff, identified=True, landing=0.0),
    ]
    if arm:
        sweeps = [replace(case, arm=True, identified=True, landing=0.0) for case in sweeps]
        plain = [case for case in sweeps if case.name in {sphere.name, ellipsoid.name, *(c.name for c in fast)}]
        plain += [case for case in sweeps if case.name == rough.name]
        tilted = [(case, case.raster) for case in sweeps if case.name in (ellipsoid.name, hilly.name)]
        sweeps += [replace(case, name=f"{case.name}, tip turns", turns=True) for case, _ in tilted]
        sweeps += [replace(case, name=f"{case.name}, not identified", identified=False) for case in plain]
    else:
        sweeps += [
            replace(sine, name=f"plate, sine, {name}", law=law, identified=True, landing=0.0, limit=None)
            for law, name in ((soft, "1 kN/m"), (stiff, "200 kN/m"))
        ]
    still = Case("plate", PLATE, math.inf, follow=True)
    sine = replace(sine, name="plate, sine", limit=math.inf, landing_limit=LIMIT)
    misjudged = [
        replace(case, name=f"{case.name}, K assumed {how}", assumed=assumed)
        for case in (still, sine)
        for assumed, how in ((20e3 / 3.0, "a third"), (60e3, "three times"))
    ]
    found = [*landings, *sweeps, *misjudged]
    return [replace(case, name=f"UR5e: {case.name}", arm=True) for case in found] if arm else found


def backend_for(case: Case, target: Target, corner: tuple[float, float]) -> MujocoBackend:
    """Return the scene, the tip a millimetre above the target's top."""
    shape = target.shape if isinstance(target, MovingTarget) else target
    fidelity = Fidelity(0.5e-3 if case.law.stiffness < 1.1e5 else 0.25e-3)
    carrier, start = ArmCarrier() if case.arm else Stage(), (*corner, shape.top + case.tip + 0.001)
    scene = build_scene(Tip(Sphere(case.tip)), target, case.law, start, carrier, fidelity)
    return MujocoBackend(scene, PERIOD, white_noise(*case.noise, seed=1))


def identified(case: Case) -> Identification:
    """Press on a plate of the case's stiffness."""
    controller = IdentifyController(IdentifyParameters(), PERIOD)
    carry_out(case, backend_for(case, PLATE, (0.0, 0.0)), controller, ())
    return controller.result()


def carry_out(case: Case, backend: MujocoBackend, controller: Controller, observers: tuple[Observer, ...]) -> str:
    """Run a controller; return the ending."""
    surface, payload = Sphere(case.tip - FORCE / (2.0 * case.law.stiffness)), SensorPayload(backend.scene.tip.mass)
    supervisor = Supervisor(Limits(force=60.0))
    touch = Touch(Finger(surface, payload))
    result = run(backend, touch, controller, supervisor, duration=30.0, observers=observers)
    return str(result.trip) if result.trip is not None else result.ending.value


def servo_of(backend: MujocoBackend) -> tuple[float, float, float]:
    """Return the carrier's stiffness [N/m], its response and its lag [s]."""
    carrier = backend.scene.carrier
    if isinstance(carrier, ArmCarrier):
        push = carrier.arm.push(carrier.joint_start((0.0, 0.0, 0.05)), (0.0, 0.0, -1.0))
        return push / carrier.arm.following_error_limit.distance, carrier.arm.lead, 0.0
    assert isinstance(carrier, Stage)
    return carrier.stiffness(backend.scene.tip.mass), carrier.lag, carrier.lag


def sweep(case: Case) -> Check:
    """Run one case."""
    backend = backend_for(case, case.target, case.raster.corners()[0])
    servo, response, lag = servo_of(backend)
    delay, lead = tracking_delay(PERIOD, response), tracking_delay(PERIOD, lag)
    contact, law = case.assumed or case.law.stiffness, None
    gain = force_gain(series_stiffness(contact, servo), delay)
    model = LandingModel(series_stiffness(contact, servo), delay, contact, moved_mass(servo, response))
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
    extras = {
        "law": law,
        "follow": surface_filter(contact, gain, lead) if case.follow else None,
        "orientation": Orientation(NormalAxis(), PERIOD) if case.turns else None,
    }
    controller = ExploreController(parameters, Follow(case.raster), PERIOD, **extras)
    rows: list[tuple[float, float, Phase]] = []

    def watch(_: object, now: Observation, command: Command) -> None:
        truth = backend.truth()
        n = np.array(now.arm.rotation_base_tip) @ now.fingers[0].contact.normal
        force = -float(np.dot(truth.force, n)) if truth.touching else 0.0
        rows.append((force, float(truth.touching), command.phase))

    ending = carry_out(case, backend, controller, (watch,))
    met = meeting_speed(landing, case.surface_speed) if case.surface_speed else landing
    scanning = np.array([row[:2] for row in rows if row[2] is Phase.SCAN])
    return judged(case, ending, scanning, [row[0] for row in rows if row[2] is Phase.SETTLE], model.peak(met))


def judged(case: Case, ending: str, scanning: np.ndarray, landing: list[float], stated: float) -> Check:
    """Return the check of a case."""
    asked = {None: "-", math.inf: "no loss"}.get(case.limit, f"< {case.limit} N")
    asked += f"; landing <= {case.landing_limit:g} N" if case.landing_limit else ""
    if not len(scanning):
        return Check(case.name, asked, ending, case.limit is None and case.landing_limit is None)
    error, lost, peak = scanning[:, 0] - FORCE, 1.0 - scanning[:, 1].mean(), max(landing)
    rms = float(np.sqrt(np.mean(error**2)))
    kept = ending == "done" and lost == 0.0 and rms < (case.limit or math.inf)
    kept = kept and peak <= (case.landing_limit or math.inf)
    worst = f"worst {np.abs(error).max():.3f}, lost {100 * lost:.2f} %"
    got = f"{rms:.4f} N RMS, {worst}; landing {peak:.2f} N, stated {stated:.2f}; {ending[:30]}"
    return Check(case.name, asked, got, kept)


def sweeps(effort: Effort) -> Study:
    """Run all cases."""
    checks = []
    for case in [*cases(arm=False), *([] if effort.quick else cases(arm=True))]:
        effort.tell(f"sweeps: {case.name}")
        checks.append(sweep(case))
    return Study("Force while sweeping, true contact force, 2 N", checks=tuple(checks))


# ------------------------------------------------------------------------------------------------------ moving

SPEEDS = (0.005, 0.01, 0.02, 0.04)
"""[m/s] Largest speed of the surface."""

WAYS: dict[str, dict[str, object]] = {
    "stage, stiffness as assumed": {},
    "stage, identified by pressing": {"identify": True},
    "UR5e, stiffness as assumed": {"robot": "ur5e-sim"},
    "stage, three times as stiff as assumed": {"assumed_stiffness": 20e3 / 3.0},
    "stage, a third as stiff as assumed": {"assumed_stiffness": 60e3},
}


def moving(effort: Effort) -> Study:
    """Hold a force on a plate that goes up and down."""
    rows, duration = [], 4.0 if effort.quick else 8.0
    for name, options in list(WAYS.items())[: 3 if effort.quick else None]:
        for speed in SPEEDS[1::2] if effort.quick else SPEEDS:
            effort.tell(f"moving: {name}, {1e3 * speed:g} mm/s")
            noise = {"force_noise": 0.0031, "moment_noise": 1.6e-5, "seed": effort.seed}
            config = pp.RegulateConfig(surface="sine", surface_speed=speed, duration=duration, **noise, **options)
            found = pp.regulate(config)
            error = np.abs(found.true_force - found.set_force)[found.counted]
            note = "" if len(error) else f"not held: {found.run.ending.value}"
            errors = Errors.of(error.tolist() or [math.nan], rms=True)
            rows.append(Row("sine of 10 mm", f"{name}, {1e3 * speed:g} mm/s", speed, (errors,), name, note=note))
    about = (
        "2 N on a plate that goes up and down by 10 mm as a sine, in simulation, noise of a Nano17 (3.1 mN). "
        "The error is that of the true force, root mean square and largest, from 0.5 s after landing."
    )
    quantities = (("error of the true force", "N"),)
    return Study("A force on a moving surface", about, "largest surface speed", "m/s", quantities, tuple(rows))


PARTS = {"sweeps": sweeps, "moving": moving}

if __name__ == "__main__":
    start(__doc__, PARTS)
