"""Friction, as `palpate friction` finds it.

Rubs in closed form through the survey and the estimator: default loads and speeds, white noise of 10 mN and
0.1 mN m at 500 Hz, a calibration off by 0.3 % and a zero off by 5 mN that wanders within this by 1 mN/s, as
`SensorErrors` says. Of a surface whose mu differs by place or direction the truth is the mean over the surface.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from trust.study import Case, Run, Study, first_finding

from palpate.controllers.rub_program import Survey, SurveyWanted
from palpate.controllers.rubs import RubMeasurement
from palpate.experiments.friction.estimate import found_by
from palpate.experiments.friction.strokes import RubbedPair
from palpate.experiments.friction.summary import SIGMAS, friction_file
from palpate.friction.rubbing.estimate import SensorErrors
from palpate.friction.rubbing.stroke import RubbingStroke, TwoWay
from palpate.sim.friction.law import FrictionLaw

RATE, PAUSE = 500.0, 0.2
LOADS, SPEED, SPEEDS = (1.0, 2.0, 4.0), 0.01, (0.0025, 0.005, 0.02, 0.04)


def same(place: np.ndarray) -> np.ndarray:
    return np.ones(len(place))


@dataclass(frozen=True)
class Rubbed:
    """What is not as assumed.

    Attributes:
        place: mu over its mean, at places along the surface, shape (n, 2) [m].
        axes: mu along the surface's own x over that along y.
        static: mu at rest over that in fast slip.
        outliers: Share of samples with 3 N and 30 mN m of error.
        drift: Drift of the zero [N/s], a hundredth of it in moments.
        origin: Error of the sensor's origin along the surface [m].
        tip: Excess of the tip's size over the assumed one [m].
        quick: Whether loads and speeds are those of --quick.
    """

    place: Callable[[np.ndarray], np.ndarray] = same
    axes: float = 1.0
    static: float = 1.0
    outliers: float = 0.0
    drift: float = 0.0
    origin: float = 0.0
    tip: float = 0.0
    quick: bool = False


def step(p: np.ndarray) -> np.ndarray:
    return np.where(p[:, 0] > 0.004, 1.3, 1.0)


def grating(p: np.ndarray) -> np.ndarray:
    return 1.0 + 0.1 * np.sin(2.0 * math.pi * p[:, 0] / 0.008)


@dataclass
class Rubber:
    """A finger that rubs in closed form."""

    case: Rubbed
    law: FrictionLaw
    rng: np.random.Generator
    clock: float = 0.0
    errors: SensorErrors = field(default_factory=SensorErrors)

    def __post_init__(self):
        q, r = np.linalg.qr(self.rng.normal(size=(3, 3)))
        self.rotation = q * np.sign(np.diag(r))
        self.rotation[:, 2] *= np.sign(np.linalg.det(self.rotation))
        self.zero = self.rng.normal(size=6) * self.zero_sd
        self.gain = 1.0 + self.errors.calibration * self.rng.normal(size=6) / math.sqrt(2.0)
        self.axis, self.where = self.rng.uniform(0.0, math.pi), self.rng.uniform(0.0, 0.008, 2)
        self.side = self.rng.uniform(0.0, 2.0 * math.pi)

    @property
    def zero_sd(self):
        return np.repeat([self.errors.force_zero, self.errors.moment_zero], 3)

    def wandered(self, seconds):
        """Return the zero so much later: it moves by `force_drift` at first, and keeps its spread."""
        kept = math.exp(-0.5 * (seconds * self.errors.force_drift / self.errors.force_zero) ** 2)
        return kept * self.zero + math.sqrt(1.0 - kept**2) * self.zero_sd * self.rng.normal(size=6)

    def stroke(self, rub, sense, begin):
        n = round((rub.duration + 2.0 * PAUSE / 4.0) * RATE)
        t = np.arange(n) / RATE
        share = np.clip(np.minimum((t - 0.05) / rub.ramp, (rub.duration + 0.05 - t) / rub.ramp), 0.0, 1.0)
        way = np.concatenate([[0.0], np.cumsum(share[:-1]) / RATE])
        along = np.array([math.cos(rub.heading), math.sin(rub.heading)])
        place = begin + sense * np.outer(way * rub.speed, along)
        slide = sense * np.outer(share * rub.speed, along)
        spin = sense * share * rub.spin
        friction = self.law.kinetic_friction
        lever = self.case.origin + friction * self.case.tip
        beside = lever * np.array([-math.sin(self.side), math.cos(self.side)])
        slip = slide + spin[:, None] * beside
        # pressed in, it lets go after 50 um
        travel = way * max(rub.speed, self.law.spin_length * abs(rub.spin))
        letting = np.clip(-1.0 + travel / 25e-6, -1.0, 1.0)
        axes = np.array([[math.cos(self.axis), math.sin(self.axis)], [-math.sin(self.axis), math.cos(self.axis)]])
        sizes = np.array([self.case.axes, 1.0]) * 2.0 / (1.0 + self.case.axes)
        turned = slip @ axes.T * sizes
        steady = share > 0.5
        speed = float(np.median(np.linalg.norm(turned[steady], axis=1)))
        force, torque = self.law.slipping_load(rub.normal_force, speed, float(np.median(np.abs(spin[steady]))))
        unit = np.median(turned[steady], axis=0)
        unit = unit / max(float(np.linalg.norm(unit)), 1e-15)
        part = self.case.place(place + self.where) * letting
        f = np.column_stack([-(part * force)[:, None] * (unit * sizes) @ axes, np.full(n, -rub.normal_force)])
        q = -part * torque * np.sign(sense * rub.spin)
        f[:, :2] = np.where(part[:, None] != 0.0, f[:, :2], 0.0)
        arm = np.array([0.004, -0.003, 0.02])
        m = np.cross(arm, f) + np.outer(q, [0.0, 0.0, 1.0])
        before, self.zero = self.zero, self.wandered(t[-1] + PAUSE)
        wrench = np.hstack([f, m]) * self.gain + before + np.outer(t / (t[-1] + PAUSE), self.zero - before)
        e, self.clock = self.errors, self.clock
        wrench += self.rng.normal(size=wrench.shape) * np.repeat([e.force_noise, e.moment_noise], 3)
        drift = self.case.drift * (self.clock + t)
        wrench += np.outer(drift, [0.5, 0.5, 0.7, 0.005, 0.005, 0.007])
        wild = self.rng.random(n) < self.case.outliers
        wrench[wild] += self.rng.normal(size=(int(wild.sum()), 6)) * np.repeat([3.0, 0.03], 3)
        R = self.rotation
        origin = np.column_stack([place, np.zeros(n)])
        turning = np.outer(spin, [0.0, 0.0, 1.0])
        velocity = np.column_stack([slide, np.zeros(n)]) - np.cross(turning, arm)
        stroke = RubbingStroke(
            t + self.clock,
            wrench,
            np.broadcast_to(R, (n, 3, 3)),
            (origin - arm) @ R.T,
            velocity @ R.T,
            turning @ R.T,
            np.broadcast_to(arm, (n, 3)),
        )
        self.clock += n / RATE + PAUSE
        return stroke, place[-1]


def run(case: Rubbed, seed: int, *, exponents: bool = False) -> Run:
    """Rub a surface once."""
    rng = np.random.default_rng((seed, 7))
    mu, c = rng.uniform(0.2, 1.0), rng.uniform(2e-3, 5e-3)
    gamma, p = (rng.uniform(0.03, 0.3), rng.uniform(1.2, 1.9)) if exponents else (rng.uniform(0.03, 0.3), 1.7)
    law = FrictionLaw(case.static * mu, mu, rng.uniform(3e-3, 2e-2), 0.0, c, gamma, p)
    finger = Rubber(case, law, rng)
    loads = (LOADS[0], LOADS[-1]) if case.quick else LOADS
    wanted = SurveyWanted(
        loads,
        SPEED,
        () if case.quick else SPEEDS,
        most_travel=0.025,
        most_spin=2.4,
        exponent_slips=18 if exponents else 0,
        angular_acceleration=40.0,
    )
    survey, pairs = Survey(wanted), []
    rub = survey.next(None)
    while rub is not None:
        there, end = finger.stroke(rub, 1.0, np.zeros(2))
        back, _ = finger.stroke(rub, -1.0, end)
        pairs.append(RubbedPair(rub, TwoWay(there, back)))
        at = law.friction_at(max(rub.speed, law.spin_length * abs(rub.spin)))
        e = law.spin_length_at(rub.normal_force)
        rub = survey.next(RubMeasurement(rub, at, at * e, 0.0))
    errors = SensorErrors()
    found = found_by(pairs, SPEED, errors)
    file = friction_file(found, SPEED, "benchmark", errors)
    true = {"mu": law.friction_at(file.speed), "e": c, "gamma": gamma, "p": p}
    if case.place is step:
        true["mu"] *= 1.15
    estimates = {"mu": file.friction, "e": file.spin_length, "gamma": file.load_exponent, "p": file.norm_exponent}
    z = {}
    for name, each in estimates.items():
        if each is None or not each.measured:
            continue
        ends = each.upper - each.value if true[name] > each.value else each.value - each.lower
        z[name] = SIGMAS * abs(true[name] - each.value) / max(ends, 1e-12)
        z[name] = 0.0 if each.lower <= true[name] <= each.upper and z[name] > SIGMAS else z[name]
    inside = {name: float(each <= SIGMAS * 1.0001) for name, each in z.items()}
    return Run(found.verdict.ok, max(z.values()), inside, first_finding(found.verdict))


def case(name: str, *, exponents: bool = False, **changes: Any) -> Case:
    """Return a kind of surface, by what is not as assumed."""
    rubbed = Rubbed(**changes)
    holds = name.startswith("as assumed")
    return Case(name, lambda seed: run(rubbed, seed, exponents=exponents), holds, 0.2 if exponents else 1.0)


STUDY = Study(
    "friction",
    (
        case("as assumed"),
        case("as assumed, --quick", quick=True),
        case("anisotropy 10 %", axes=1.1),
        case("anisotropy 30 %", axes=1.3),
        case("step of 30 %", place=step),
        case("gradient 1 % per mm", place=lambda p: 1.0 + 10.0 * p[:, 0]),
        case("gradient across, 1 % per mm", place=lambda p: 1.0 + 10.0 * p[:, 1]),
        case("grating of 8 mm, 10 %", place=grating),
        case("Stribeck, 40 % at rest", static=1.4),
        case("Stribeck, 40 %, --quick", static=1.4, quick=True),
        case("outliers, 0.1 % of samples", outliers=0.001),
        case("zero drifts by 5 mN/s", drift=5e-3),
        case("zero drifts by 5 mN/s, --quick", drift=5e-3, quick=True),
        case("zero drifts by 50 mN/s", drift=5e-2),
        case("origin off by 0.5 mm", origin=0.5e-3),
        case("tip larger by 0.1 mm", tip=0.1e-3),
        case("as assumed, exponents", exponents=True),
    ),
)
