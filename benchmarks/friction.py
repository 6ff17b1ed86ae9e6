"""Friction from rubbing and turning a finger: asked for, and found.

    python benchmarks/friction.py [touch | slip | exponents | ways ...] [--quick] [--seed N]

touch: runs in MuJoCo on a stage that turns: a plate of unknown mu (0.1 to 1.2) and e (1 to 8 mm), pressed with 1
to 5 N so that mu e f_n >= 0.3 mN m; one stroke there and back, two twists there and back, 0.5 s each; white noise
of 10 mN and 0.1 mN m at 500 Hz, zeros that drift by 1 mN/s and 0.01 mN m/s. In half of the figures the assumed
normal is off by 2 degrees, and the sensor's origin by 0.5 mm, in random directions. slip: elastic surfaces that
never slip, in closed form with the same noise, and on the friction plant. exponents: from 18 slips there and back,
planned with e known within 15 %, loads by the plant's law with 3 % scatter; and on the plant in MuJoCo, where the
sensor's zero, measured in free air before and after, is taken off: over 40 s it drifts by 40 mN, with 20 mm from
sensor to contact 0.5 mN m of a spin torque of 2. ways: ways to rub a surface, by the time that they take. Shares
come with their 95 % interval (Clopper & Pearson 1934).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from harness.command import start
from harness.study import Check, Effort, Errors, Row, Study
from harness.tables import share

from palpate.experiments.friction.config import FrictionConfig
from palpate.experiments.friction.experiment import FindFriction
from palpate.experiments.kit.recorded_run import carry_out
from palpate.friction.rubbing.sliding import FrictionMeasured, measure_friction
from palpate.friction.rubbing.slip_load import SlipLoad
from palpate.friction.rubbing.slip_loads import slip_load
from palpate.friction.rubbing.stroke import TwoWay
from palpate.friction.rubbing.stroke_plan import planned_slips
from palpate.friction.rubbing.surface_fit import PLACE_ERROR, fit_limit_surface
from palpate.friction.rubbing.twisting import SpinMeasured, measure_spin
from palpate.robots.values import load_named_robot
from palpate.sim.friction.law import FrictionLaw
from support.closed_strokes import Sensed, elastic_pair, elastic_turns
from support.rubbing_runs import Motion, Place, Rubber

LEAST_TORQUE, LEAST_PRESS, MOST_PRESS = 0.3e-3, 1.0, 5.0
TILT, ORIGIN_ERROR = math.radians(2.0), 0.5e-3
SLIP_SPEED, FASTEST_SPIN = 0.01, 2.5
EXPONENTS = (1.1, 1.3, 1.5, 1.75, 2.0)
Rng = np.random.Generator


def log_uniform(rng: Rng, low: float, high: float) -> float:
    """Return a number whose logarithm is evenly distributed."""
    return float(np.exp(rng.uniform(math.log(low), math.log(high))))


def accuracy(name: str, limit: float, unit: float, errors: Sequence[float], held: Sequence[bool]) -> list[Check]:
    """Return the checks of an estimate: errors within a limit in 95 % of the runs, and coverage of its
    interval."""
    sizes, n = np.abs(errors), len(errors)
    good, inside = int(np.count_nonzero(sizes <= limit)), int(np.count_nonzero(held))
    spread = ", ".join(f"{each / unit:.3g}" for each in np.nanquantile(sizes, (0.5, 0.95, 1.0)))
    got = f"{share(good, n)}; median, 95 %, largest {spread}"
    return [
        Check(f"{name} within {limit / unit:g}", ">= 95 %", got, good >= 0.95 * n),
        Check(f"  {name} within its 95 % interval", "93 to 100 %", share(inside, n), inside >= 0.93 * n),
    ]


# ------------------------------------------------------------------------------------------------------- touch


@dataclass(frozen=True)
class Touched:
    """One run: relative errors (NaN where only a bound was found), and whether the intervals hold the truth."""

    friction_error: float = math.nan
    spin_error: float = math.nan
    friction_held: bool = False
    spin_held: bool = False


def place_of(rng: Rng, seed: int, exact: bool) -> Place:
    """Draw a surface and a touch."""
    least = math.inf
    while least > MOST_PRESS:
        mu, e = log_uniform(rng, 0.1, 1.2), log_uniform(rng, 1e-3, 8e-3)
        least = max(LEAST_PRESS, LEAST_TORQUE / (mu * e))
    angle, way = rng.uniform(0.0, 2.0 * math.pi), rng.normal(size=3)
    force = float(rng.uniform(least, MOST_PRESS))
    if exact:
        return Place(mu, e, force, seed=seed)
    tilt = (TILT * math.cos(angle), TILT * math.sin(angle))
    return Place(mu, e, force, tilt, tuple((ORIGIN_ERROR * way / np.linalg.norm(way)).tolist()), seed)


def touched(place: Place) -> Touched:
    """Rub and turn once."""
    finger = Rubber(place)
    found = measure_friction([finger.two_way(Motion(speed=0.02))])
    spin = min(FASTEST_SPIN, SLIP_SPEED / place.spin_length)
    twists = [finger.two_way(Motion(spin=sense * spin)) for sense in (1.0, -1.0)]
    if not isinstance(found, FrictionMeasured):
        return Touched()
    mu, e, turned = place.friction, place.spin_length, measure_spin(twists, found)
    low, high = found.friction.interval()
    friction = Touched(found.friction.value / mu - 1.0, friction_held=low <= mu <= high)
    if not isinstance(turned, SpinMeasured):
        return friction
    low, high = turned.spin_length.interval()
    return replace(friction, spin_error=turned.spin_length.value / e - 1.0, spin_held=low <= e <= high)


def touch(effort: Effort) -> Study:
    """Measure mu and e by one stroke and two twists."""
    checks, seed = [], effort.seed or 1
    for exact, runs, name in (
        (False, effort.of(200, 20), "2 degrees, 0.5 mm off"),
        (True, effort.of(40, 4), "exact"),
    ):
        found = []
        for i in range(runs):
            effort.tell(f"touch: {name}, {i + 1} of {runs}")
            rng = np.random.default_rng((seed, exact, i))
            found.append(touched(place_of(rng, 1_000_000 * seed + 2 * i + exact, exact)))
        friction = [each.friction_error for each in found], [each.friction_held for each in found]
        checks += accuracy(f"mu [%], {name}", 0.03, 0.01, *friction)
        spin = [each.spin_error for each in found], [each.spin_held for each in found]
        checks += accuracy(f"e [%], {name}", 0.05, 0.01, *spin)
    return Study("Mu and e by one touch", checks=tuple(checks))


# -------------------------------------------------------------------------------------------------------- slip


def never_slipped(rng: Rng) -> tuple[bool, bool]:
    """Return whether strokes and twists of a random elastic surface, in closed form, passed for slip."""
    sensed, way, turn = Sensed(rng, noise=1.0, force=float(rng.uniform(0.5, 5.0))), 0.009, 0.9
    level = log_uniform(rng, 0.02, 1.0)
    pair = elastic_pair(sensed, level / way, float(rng.uniform(-0.5, 1.0)) * way, 0.02)
    slid = isinstance(measure_friction([pair]), FrictionMeasured)
    torque = log_uniform(rng, 5e-5, 4e-3)
    known = measure_friction([sensed.two_way(lambda s: np.where(s > 1e-4, 0.5, 0.0), np.zeros_like, 0.02)])
    assert isinstance(known, FrictionMeasured)
    twist = elastic_turns(sensed, torque / turn, float(rng.uniform(-0.5, 1.0)) * turn, 2.0)
    return slid, isinstance(measure_spin([twist], known), SpinMeasured)


def soft_plate(seed: int) -> bool:
    """Return whether a plate on the friction plant whose skin gives way for 20 to 50 mm passed for slip."""
    rng = np.random.default_rng(seed)
    mu, force = float(rng.uniform(0.3, 1.2)), float(rng.uniform(1.0, 4.0))
    law = FrictionLaw(mu, mu, stiffness=mu * force / float(rng.uniform(0.02, 0.05)))
    finger = Rubber(Place(mu, 0.004, force, seed=seed, law=law))
    return isinstance(measure_friction([finger.two_way(Motion(speed=0.02))]), FrictionMeasured)


def slip(effort: Effort) -> Study:
    """Count elastic surfaces that are taken for slip."""
    runs, plates, seed = effort.of(4000, 400), effort.of(20, 2), effort.seed or 1
    strokes, twists = np.sum([never_slipped(np.random.default_rng((seed, 2, i))) for i in range(runs)], axis=0)
    soft = sum(soft_plate(1_000_000 * seed + i) for i in range(plates))
    checks = (
        Check("elastic strokes taken for slip", "<= 0.1 %", share(strokes, runs), strokes <= 0.001 * runs),
        Check("elastic twists taken for slip", "<= 0.1 %", share(twists, runs), twists <= 0.001 * runs),
        Check("soft plates in MuJoCo taken for slip", "0", share(soft, plates), soft == 0),
    )
    return Study("Surfaces that never slip", checks=checks)


# --------------------------------------------------------------------------------------------------- exponents


def drawn_law(
    rng: Rng, p: float, mu: tuple[float, float], e: tuple[float, float], gamma: tuple[float, float]
) -> FrictionLaw:
    """Draw a law of one mu at every speed."""
    m, c, g = (float(rng.uniform(*each)) for each in (mu, e, gamma))
    return FrictionLaw(m, m, spin_length=c, load_exponent=g, norm_exponent=p)


def assumed_lengths(rng: Rng, law: FrictionLaw, forces: tuple[float, float]) -> tuple[float, float]:
    """Return e at two forces, known within 15 % [m]."""
    low, high = (law.spin_length_at(force) * math.exp(0.15 * rng.normal()) for force in forces)
    return low, high


def exponent_errors(
    loads: Sequence[SlipLoad], law: FrictionLaw, **options: float
) -> tuple[float, float, bool, bool]:
    """Return errors of p and gamma, and whether their 95 % intervals hold the truth."""
    found = fit_limit_surface(loads, **options)
    p, gamma = found.surface.norm_exponent - law.norm_exponent, found.surface.load_exponent - law.load_exponent
    sd = found.standard_deviations
    return p, gamma, abs(p) <= 1.96 * sd[3], abs(gamma) <= 1.96 * sd[2]


def fitted(rng: Rng, p: float) -> tuple[float, float, bool, bool]:
    """Fit the loads of one random surface, which scatter by 3 %."""
    law, forces, loads = drawn_law(rng, p, (0.2, 1.0), (1e-3, 6e-3), (0.0, 1.0 / 3.0)), (0.7, 5.0), []
    for each in planned_slips(forces, assumed_lengths(rng, law, forces), 18):
        force, torque = law.slipping_load(each.normal_force, each.speed, each.spin)
        a, b = 1.0 + 0.03 * rng.normal(size=2)
        loads.append(SlipLoad(each.normal_force, a * force, b * torque, each.speed, each.spin))
    return exponent_errors(loads, law)


def zero_in_air(finger: Rubber) -> tuple[float, np.ndarray]:
    """Lift off, measure for a second and land again; return the time [s] and the sensor's zero."""
    stand, times, wrenches = np.zeros(3), [], []
    for _ in range(200):
        finger.step(-0.01 * finger.normal, stand)  # 4 mm: the tip is pressed in by up to 1.3
    for _ in range(500):
        finger.step(stand, stand)
        times.append(finger.sample.wrenches[0].time)
        wrenches.append(finger.wrench())
    while finger.wrench()[:3] @ finger.rotation().T @ finger.normal > -0.3:
        finger.step(0.003 * finger.normal, stand)
    finger.rub(Motion(duration=0.4))
    return float(np.mean(times)), np.mean(wrenches, axis=0)


def fitted_on_plant(seed: int, p: float) -> tuple[float, float, bool, bool]:
    """Fit strokes in MuJoCo with noise and drift; normal and origin are exact.

    The stage turns no faster than it can: otherwise it lags behind the arm that it corrects for, and slides along.
    """
    rng, forces = np.random.default_rng(seed), (1.0, 5.0)
    law = drawn_law(rng, p, (0.3, 0.9), (2e-3, 5e-3), (0.05, 0.3))
    finger = Rubber(Place(law.kinetic_friction, law.spin_length, forces[0], seed=seed, law=law))
    e = assumed_lengths(rng, law, forces)
    slips = planned_slips(forces, e, 18, min(0.02, FASTEST_SPIN * min(e)))
    before, rubbed = zero_in_air(finger), []
    for each in sorted(slips, key=lambda s: (s.normal_force, s.spin)):
        if each.normal_force != finger.force:
            finger.press(each.normal_force)
        rubbed.append((each, finger.two_way(Motion(speed=each.speed, spin=each.spin))))
    after, loads, normal = zero_in_air(finger), [], None
    for each, raw in rubbed:
        strokes = []
        for stroke in raw.both:  # the zero goes evenly from one measurement to the other
            part = ((stroke.time - before[0]) / (after[0] - before[0]))[:, None]
            strokes.append(replace(stroke, wrench=stroke.wrench - (1.0 - part) * before[1] - part * after[1]))
        pair = TwoWay(*strokes)
        if each.spin == 0.0:
            normal = measure_friction([pair]).normal
        assert normal is not None
        load = slip_load(pair, normal, e[forces.index(each.normal_force)])
        loads += [load] if load is not None else []
    return exponent_errors(loads, law, place_error=PLACE_ERROR)


def exponents(effort: Effort) -> Study:
    """Measure the exponents of limit surfaces."""
    checks, seed, plants = [], effort.seed or 1, effort.of(40, 4)
    trials = effort.of(200, 20)
    rows = {
        f"p = {p:g}": [fitted(np.random.default_rng((seed, 3, round(100 * p), i)), p) for i in range(trials)]
        for p in EXPONENTS
    }
    rows["plant in MuJoCo"] = [fitted_on_plant(1_000_000 * seed + i, EXPONENTS[1:][i % 4]) for i in range(plants)]
    for name, found in rows.items():
        p, gamma, p_held, gamma_held = zip(*found, strict=True)
        checks += accuracy(f"p, {name}", 0.15, 1.0, p, p_held) + accuracy(
            f"gamma, {name}", 0.05, 1.0, gamma, gamma_held
        )
    return Study("Exponents of limit surfaces", checks=tuple(checks))


# -------------------------------------------------------------------------------------------------------- ways

FRICTIONS = (0.3, 0.5, 0.8)
WAYS: dict[str, dict[str, object]] = {
    "one load, no twist, one speed": {"quick": True, "loads": (2.0,), "robot": "stage"},
    "two loads, one speed": {"quick": True},
    "three loads, five speeds": {},
    "three loads, five speeds, each stroke twice": {"repeats": 2},
}


def rubbed(config: FrictionConfig) -> tuple[float, float, float, bool]:
    """Rub once: time [s], relative errors of mu and e, whether the interval of mu holds the truth."""
    experiment = FindFriction()
    plan = experiment.plan(config, load_named_robot(config.robot), {})
    found = experiment.evaluate(plan, carry_out(plan))
    file = found.file
    if file is None:
        return found.run.duration, math.nan, math.nan, False
    true, spin = plan.true_friction(file.speed), plan.true_spin_length(1.0)
    assert true is not None  # it is simulated
    e = math.nan if file.spin_length is None or spin is None else file.spin_length.value / spin - 1.0
    inside = file.friction.lower <= true <= file.friction.upper
    return found.run.duration, abs(file.friction.value / true - 1.0), abs(e), inside


def ways(effort: Effort) -> Study:
    """Measure ways to rub."""
    rows = []
    for name, options in list(WAYS.items())[: 3 if effort.quick else None]:
        found = []
        for mu in FRICTIONS:
            for i in range(effort.of(3, 1)):
                effort.tell(f"ways: {name}, mu {mu:g}")
                noise = {"force_noise": 0.01, "moment_noise": 1e-4, "seed": effort.seed + i}
                found.append(rubbed(FrictionConfig(friction=mu, **noise, **options)))
        times, mus, spins, inside = zip(*found, strict=True)
        errors = Errors.of(mus, rms=True), Errors.of(spins, rms=True)
        note = f"{sum(inside)} of {len(inside)} intervals hold mu"
        rows.append(Row("rubber on a plate", name, float(np.median(times)), errors, "rubbing", note=note))
    about = (
        "A rubber fingertip on a plate in simulation (mu 0.3, 0.5 and 0.8, e 3 mm), noise of 10 mN and 0.1 mN m. "
        "The cost is the time of rubbing. Errors are relative, root mean square and largest over plates and seeds."
    )
    return Study("Ways to rub a surface", about, "time of rubbing", "s", (("mu", ""), ("e", "")), tuple(rows))


PARTS = {"touch": touch, "slip": slip, "exponents": exponents, "ways": ways}

if __name__ == "__main__":
    start(__doc__, PARTS)
