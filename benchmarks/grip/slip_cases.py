"""Loads of a held object: holds, ramps, steps and shaking, with and without slip."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np

from grip.slip_model import PERIOD, TIME_STEP, Held, hold
from palpate.errors import FloatArray
from palpate.friction.contact_load import ContactLoad
from palpate.friction.limit_surface import LimitSurface
from palpate.friction.slip.grip_dither import GripDither
from palpate.friction.slip.load_noise import LoadNoise
from palpate.sim.friction.law import FrictionLaw

QUIET = 0.1
"""[s] until the load begins to change."""
MOST_SAFE = 0.8
"""Of the capacity, that the no-slip set reaches."""
GYRATION = 0.025
"""Of the object [m]."""
SENSOR = (0.010, 0.1e-3)
"""Noise of one sample at 1 kHz [N, N m]: Nano17 class, 500 Hz of bandwidth."""
TIP = 0.008
"""Radius of the fingertip, whose normal follows the noise of the moment [m]."""
NOISE = LoadNoise.of_touch(*SENSOR, TIP)
DRIFT = (1e-3, 1e-5)
"""Per second [N/s, N m/s]."""
AGE = 1
"""Of a sample, in periods."""
TILT = math.radians(0.5)
"""Of the normal that touch takes for the true one, at most."""


class Shape(StrEnum):
    HOLD = "hold"
    RAMP = "ramp"
    STEP = "step"
    SHAKE = "shake"


@dataclass(frozen=True, slots=True)
class Case:
    """One object, one grip.

    Attributes:
        surface: True static limit surface of a finger.
        laws: Of both fingers: up to 3 % apart.
        mass: [kg].
        grip: Mean normal force [N].
        angle: Of the load: 0 pulls only, pi/2 twists only, in the plane of f_t/mu f_n and tau/mu e f_n.
    """

    surface: LimitSurface
    laws: tuple[FrictionLaw, FrictionLaw]
    mass: float
    grip: float
    angle: float

    @property
    def inertia(self) -> float:
        return self.mass * GYRATION**2

    def capacity(self) -> tuple[float, float]:
        """Pull and twist at which both fingers slip, in the direction of the load [N, N m]."""
        e, p = self.surface.spin_length_at(self.grip), self.surface.norm_exponent
        x, y = math.cos(self.angle), math.sin(self.angle)
        most = 2.0 * self.surface.friction * self.grip / (x**p + y**p) ** (1.0 / p)
        return most * x, most * e * y


def draw_case(rng: np.random.Generator) -> Case:
    mu, e = rng.uniform(0.3, 0.9), rng.uniform(2e-3, 6e-3)
    p, gamma = rng.uniform(1.5, 2.0), rng.uniform(0.0, 0.25)
    kinetic, stiffness = rng.uniform(0.85, 1.0), rng.uniform(5e3, 20e3)
    mass, grip = rng.uniform(0.1, 0.3), rng.uniform(2.0, 6.0)
    surface = LimitSurface(mu, e / grip**gamma, gamma, p)
    laws = tuple(
        FrictionLaw(
            static_friction=mu * factor,
            kinetic_friction=mu * factor * kinetic,
            stribeck_speed=0.01,
            spin_length=surface.spin_length,
            load_exponent=gamma,
            norm_exponent=p,
            stiffness=stiffness,
        )
        for factor in (1.0, rng.uniform(1.0, 1.03))
    )
    return Case(surface, (laws[0], laws[1]), mass, grip, rng.uniform(0.0, 0.5 * math.pi))


def load_over_time(rng: np.random.Generator, shape: Shape, slips: bool, seconds: float) -> FloatArray:
    """Share of the capacity every TIME_STEP; where nothing shall slip, its scale is set later."""
    t: FloatArray = TIME_STEP * np.arange(round(seconds / TIME_STEP), dtype=np.float64)
    # taken up gently: nothing rings at the start
    taken_up: FloatArray = np.sin(0.5 * math.pi * np.minimum(t / (0.5 * QUIET), 1.0)) ** 2
    return taken_up * _shaped(rng, shape, slips, t)


def _shaped(rng: np.random.Generator, shape: Shape, slips: bool, t: FloatArray) -> FloatArray:
    seconds = float(t[-1])
    since: FloatArray = np.maximum(t - QUIET, 0.0)
    base = rng.uniform(0.2, 0.6)
    if shape is Shape.HOLD:
        return np.full_like(t, base)
    if shape is Shape.RAMP:
        # 0.5 to 10 times the capacity per second; without slip up and down
        if slips:
            return base + rng.uniform(0.5, 10.0) * since
        phase = since / rng.uniform(0.2, 2.0)
        return base + np.abs((phase + 1.0) % 2.0 - 1.0) * 0.6
    if shape is Shape.STEP:
        rise, height = rng.uniform(1e-3, 20e-3), rng.uniform(1.1, 1.6) - base
        if slips:
            return base + height * np.minimum(since / rise, 1.0)
        # a step every 0.2 to 0.6 s, up or down
        times = np.cumsum(rng.uniform(0.2, 0.6, size=math.ceil(seconds / 0.2)))
        levels = np.concatenate([[base], rng.uniform(0.0, 1.0, size=len(times))])
        corners = np.stack([times, times + rise], axis=1).ravel()
        steps: FloatArray = np.interp(t, corners, np.repeat(levels, 2)[1:-1])
        return steps
    rate = rng.uniform(3.0, 40.0)
    wave: FloatArray = np.sin(2.0 * math.pi * rate * since)
    if slips:
        # grows by a tenth to a half of the capacity per cycle
        grown: FloatArray = base + wave * since * rate * rng.uniform(0.05, 0.5)
        return grown
    shaken: FloatArray = base + rng.uniform(0.2, 0.6) * wave * np.minimum(since / 0.1, 1.0)
    return shaken


@dataclass(frozen=True, slots=True, eq=False)
class Felt:
    """A case, what happened, and what two sensors made of it."""

    case: Case
    shape: Shape
    held: Held
    loads: tuple[tuple[ContactLoad, ...], tuple[ContactLoad, ...]]

    @property
    def seconds(self) -> float:
        return PERIOD * len(self.loads[0])


def felt(
    rng: np.random.Generator, shape: Shape, *, slips: bool, seconds: float, dither: GripDither | None = None
) -> Felt:
    case = draw_case(rng)
    share = load_over_time(rng, shape, slips, seconds)
    n = len(share)
    t = np.arange(n) * TIME_STEP
    grip = np.full((n, 2), case.grip)
    if dither is not None:
        ripple = dither.amplitude_at(case.grip) * np.sin(
            2.0 * math.pi * dither.frequency * t + rng.uniform(0.0, 6.3)
        )
        grip += ripple[:, None]
    pull, twist = case.capacity()
    if not slips:
        share = share * _safe_scale(case, share, pull, twist)
    held = hold(case.mass, case.inertia, pull * share, twist * share, grip, case.laws)
    return Felt(case, shape, held, (_sensed(rng, held, 0), _sensed(rng, held, 1)))


def _safe_scale(case: Case, share: FloatArray, pull: float, twist: float) -> float:
    """By what to multiply a load so that no contact ever bears more than 80 %, ringing included."""
    sticky = tuple(replace(law, static_friction=100.0, kinetic_friction=100.0) for law in case.laws)
    grip = np.full((len(share), 2), case.grip)
    held = hold(case.mass, case.inertia, pull * share, twist * share, grip, (sticky[0], sticky[1]))
    worst = max(
        case.surface.load_ratio(case.grip, f, q)
        for f, q in zip(held.force[:, 0].tolist(), held.torque[:, 0].tolist(), strict=True)
    )
    return MOST_SAFE / worst


def _sensed(rng: np.random.Generator, held: Held, i: int) -> tuple[ContactLoad, ...]:
    n = len(held.force)
    time = np.arange(n) * PERIOD
    tilt = rng.uniform(-TILT, TILT, size=2)
    true = np.zeros((n, 4))
    true[:, 0] = held.normal_force[:, i] - tilt[1] * held.force[:, i]
    true[:, 1] = tilt[0] * held.normal_force[:, i]
    true[:, 2] = held.force[:, i] + tilt[1] * held.normal_force[:, i]
    true[:, 3] = held.torque[:, i]
    late = np.concatenate([np.repeat(true[:1], AGE, axis=0), true[:-AGE]])
    noise = np.array([SENSOR[0], NOISE.force, NOISE.force, NOISE.torque])
    # drift of the moment shifts the normal as well
    sideways = math.hypot(DRIFT[0], DRIFT[1] / TIP)
    drift = np.array([DRIFT[0], sideways, sideways, DRIFT[1]]) * rng.choice([-1.0, 1.0], size=4)
    read = late + noise * rng.standard_normal((n, 4)) + time[:, None] * drift
    return tuple(ContactLoad(f, (x, 0.0, z), q) for f, x, z, q in read.tolist())


def seeds(first: int, count: int) -> Iterator[np.random.Generator]:
    for seed in range(first, first + count):
        yield np.random.default_rng(seed)
