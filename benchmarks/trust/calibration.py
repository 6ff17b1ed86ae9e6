"""Calibrations, as `palpate calibrate matrix` finds them from known loads: whichever model is proposed.

A sensor of six channels with the ranges of a Nano17 (condition number 3, a zero of its own, noise of 0.1 % of the
range) under 48 weights on levers, of five sizes and in random order, unless a row says otherwise. Compared are the
entries of the matrix, and a wrench drawn within the range, of a sensor that is not linear a load of the same kind
that was not among them, each by Student's t of its printed standard error.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.special import ndtri, stdtr
from trust.study import Case, Run, Study, first_finding

from palpate.errors import InvalidValueError
from palpate.sensing.ft import choose_calibration

RANGES = np.array([12.0, 12.0, 17.0, 0.12, 0.12, 0.12])
WEIGHTS = np.array([0.1, 0.25, 0.4, 0.6, 0.8]) * 12.0
LOADS, CHANNELS, NOISE = 48, 6, 1e-3
COVERED = 0.95

Rng = np.random.Generator
Rows = np.ndarray


def straight(raw: Rows) -> Rows:
    """Return what a linear sensor shows."""
    return raw


@dataclass
class Bench:
    """A sensor under loads.

    Attributes:
        rng: Source of chance.
        loads: As they are, shape (n, 6).
        sensitivity: Shape (k, 6) [raw unit per N or N m].
        known: Loads as they are noted.
        raw: Readings, shape (n, k).
        bend: What a sensor that is not linear shows for what a linear one would.
    """

    rng: Rng
    loads: Rows
    sensitivity: Rows
    known: Rows
    raw: Rows
    bend: Callable[[Rows], Rows] = straight


Change = Callable[[Bench], None]


def levers(rng: Rng, n: int) -> Rows:
    """Return weights on levers: force and moment at right angles."""
    direction = rng.normal(size=(n, 3))
    force = rng.choice(WEIGHTS, n)[:, None] * direction / np.linalg.norm(direction, axis=1, keepdims=True)
    return np.hstack([force, np.cross(rng.uniform(-0.01, 0.01, (n, 3)), force)])


def anything(rng: Rng, n: int) -> Rows:
    """Return wrenches of any direction."""
    return RANGES * rng.uniform(-0.8, 0.8, (n, 6))


def growing(rng: Rng, n: int) -> Rows:
    """Return loads of every axis that grow in time."""
    return RANGES * (0.6 * np.linspace(-1.0, 1.0, n)[:, None] + rng.uniform(-0.2, 0.2, (n, 6)))


def few_twists(rng: Rng, n: int) -> Rows:
    """Return loads of which three alone twist about z."""
    loads = anything(rng, n)
    loads[3:, 5] *= 0.01
    return loads


def small(rng: Rng, n: int) -> Rows:
    """Return loads of 2 % of the range."""
    return 0.025 * anything(rng, n)


def nothing(bench: Bench) -> None:
    """Leave all as assumed."""


def one_wrong(factor: float) -> Change:
    """Return one load that is noted wrongly."""

    def change(bench: Bench) -> None:
        bench.known[bench.rng.integers(len(bench.known))] *= factor

    return change


def heaviest_wrong(bench: Bench) -> None:
    """The load that counts most is off by 5 %."""
    q = np.linalg.qr(np.column_stack([bench.loads, np.ones(len(bench.loads))]))[0]
    bench.known[int(np.argmax((q**2).sum(axis=1)))] *= 1.05


def some_wrong(bench: Bench) -> None:
    some = bench.rng.choice(len(bench.known), 3, replace=False)
    bench.known[some] *= bench.rng.uniform(0.7, 1.3, (3, 1))


def wrong_weight(bench: Bench) -> None:
    """One of the weights is 2 % less than is written on it."""
    force = np.linalg.norm(bench.loads[:, :3], axis=1)
    bench.known[np.isclose(force, WEIGHTS[bench.rng.integers(2, 5)])] *= 1.02


def saturated(bench: Bench) -> None:
    bound = np.quantile(np.abs(bench.raw), 0.97)
    bench.raw = np.clip(bench.raw, -bound, bound)


def clipped_one_channel(bench: Bench) -> None:
    j = bench.rng.integers(CHANNELS)
    bench.raw[:, j] = np.minimum(bench.raw[:, j], np.quantile(bench.raw[:, j], 0.9))


def forces_swapped(bench: Bench) -> None:
    bench.known[:, [0, 1]] = bench.known[:, [1, 0]]


def swapped_in_half(bench: Bench) -> None:
    half = len(bench.known) // 2
    bench.known[half:] = bench.known[half:][:, [1, 0, 2, 4, 3, 5]]


def moment_mirrored(bench: Bench) -> None:
    bench.known[:, 4] *= -1.0


def in_millis(bench: Bench) -> None:
    bench.known[:, 3:] *= 1e3


def in_kilos(bench: Bench) -> None:
    bench.known[:, 3:] *= 1e-3


def some_in_millis(bench: Bench) -> None:
    bench.known[:5, 3:] *= 1e3


def rows_shifted(bench: Bench) -> None:
    bench.known = np.roll(bench.known, 1, axis=0)


def drift(shape: Callable[[Rng, int], Rows], amount: float) -> Change:
    """Return a zero that moves, by `amount` of the range."""

    def change(bench: Bench) -> None:
        course = shape(bench.rng, len(bench.raw))[:, None]
        bench.raw += amount * course / np.ptp(course) * bench.rng.normal(size=bench.raw.shape[1])

    return change


def linear(rng: Rng, n: int) -> Rows:
    return np.linspace(0.0, 1.0, n)


def walk(rng: Rng, n: int) -> Rows:
    return np.cumsum(rng.normal(size=n))


def step(rng: Rng, n: int) -> Rows:
    return (np.arange(n) >= rng.integers(4, n - 4)).astype(float)


def temperature(rng: Rng, n: int) -> Rows:
    return np.sin(rng.uniform(1.0, 5.0) * np.linspace(0.0, 2.0 * np.pi, n) + rng.uniform(0.0, 6.0))


def curved(amount: float, power: int, *, alike: bool = True) -> Change:
    """Return channels that are not linear, by `amount` at the largest reading."""

    def change(bench: Bench) -> None:
        scale = np.abs(bench.raw).max()
        size = 1.0 if alike else bench.rng.normal(size=bench.raw.shape[1])
        bench.bend = lambda raw: raw + size * amount * scale * (raw / scale) ** power

    return change


def crossed(amount: float) -> Change:
    """Return two channels that show a product of two others, by `amount` at the largest reading."""

    def change(bench: Bench) -> None:
        scale = np.abs(bench.raw).max()
        a, b, c, d = bench.rng.permutation(bench.raw.shape[1])[:4]
        bench.bend = lambda raw: (
            raw
            + amount
            / scale
            * np.eye(raw.shape[-1])[[a, b]].T.dot(np.array([raw[..., b] * raw[..., c], raw[..., d] ** 2])).T
        )

    return change


def one_sided(bench: Bench) -> None:
    """Pull along z is felt 5 % more than push."""
    pull = np.maximum(bench.loads[:, 2], 0.0)
    bench.raw += 0.05 * np.outer(pull, bench.sensitivity[:, 2])


def hysteresis(bench: Bench) -> None:
    bench.raw[1:] += 0.01 * bench.loads[:-1] @ bench.sensitivity.T


def warming(bench: Bench) -> None:
    bench.raw += 0.03 * np.linspace(-1.0, 1.0, len(bench.raw))[:, None] * (bench.loads @ bench.sensitivity.T)


def heavy_tails(bench: Bench) -> None:
    bench.raw += NOISE * bench.rng.standard_t(2.0, bench.raw.shape)


def noise_by_load(bench: Bench) -> None:
    size = np.abs(bench.loads / RANGES).max(axis=1, keepdims=True)
    bench.raw += 5e-3 * size * bench.rng.normal(size=bench.raw.shape)


def loads_inexact(bench: Bench) -> None:
    """Known to 0.3 % each, moments by the length of the levers, too."""
    bench.known *= 1.0 + 3e-3 * bench.rng.normal(size=bench.known.shape)


def dead_channel(bench: Bench) -> None:
    bench.raw[:, bench.rng.integers(CHANNELS)] = NOISE * bench.rng.normal(size=len(bench.raw))


def calibrated(seed: int, change: Change, loads_of: Callable[[Rng, int], Rows], count: int, channels: int) -> Run:
    """Calibrate once."""
    rng = np.random.default_rng((seed, 5))
    left = np.linalg.qr(rng.normal(size=(channels, 6)))[0]
    right = np.linalg.qr(rng.normal(size=(6, 6)))[0]
    S, zero = (left * np.geomspace(1.0, 1.0 / 3.0, 6)) @ right / RANGES, rng.normal(size=channels)
    loads = loads_of(rng, count)
    bench = Bench(rng, loads, S, loads.copy(), loads @ S.T)
    change(bench)
    raw = bench.bend(bench.raw) + NOISE * rng.normal(size=bench.raw.shape) + zero
    try:
        fit = choose_calibration(raw, bench.known, ranges=RANGES).proposed
    except InvalidValueError:
        return Run(ok=False, furthest=0.0, finding="refused")
    C = np.array(fit.map.matrix)
    # a bend holds no further than its loads
    wrench = RANGES * rng.uniform(-1.0, 1.0, 6) if bench.bend is straight else loads_of(rng, 1)[0]
    missed = fit.apply(bench.bend(S @ wrench)[None] + zero)[0] - wrench
    t = {"wrench": missed / np.sqrt(np.diag(fit.calibration_covariance(wrench)))}
    if channels == CHANNELS and not fit.map.products:
        t["matrix"] = (C - np.linalg.inv(S)) / fit.matrix_sd
    chance = {name: stdtr(count - 7, -np.abs(each)) for name, each in t.items()}
    return Run(
        fit.verdict.ok,
        float(max(-ndtri(each.min()) for each in chance.values())),
        {name: float((each >= 0.5 * (1.0 - COVERED)).mean()) for name, each in chance.items()},
        first_finding(fit.verdict),
    )


def case(
    name: str,
    change: Change = nothing,
    *,
    loads: Callable[[Rng, int], Rows] = levers,
    count: int = LOADS,
    channels: int = CHANNELS,
    holds: bool = False,
) -> Case:
    """Return a kind of data: what is not as assumed, and which loads there are."""
    return Case(name, lambda seed: calibrated(seed, change, loads, count, channels), holds, 5.0 if holds else 1.0)


STUDY = Study(
    "calibration",
    (
        case("as assumed", holds=True),
        case("wrenches of any direction", loads=anything, holds=True),
        case("eight channels", channels=8, holds=True),
        case("24 loads", count=24),
        case("16 loads", count=16),
        case("10 loads", count=10),
        case("three loads alone twist", loads=few_twists),
        case("loads of 2 % of the range", loads=small),
        case("loads that grow in time", loads=growing),
        case("loads that grow in time, drift of 1 %", drift(linear, 0.01), loads=growing),
        case("one load 10 % off", one_wrong(1.1)),
        case("one load 3 % off", one_wrong(1.03)),
        case("one load of the other sign", one_wrong(-1.0)),
        case("one load 10 % off, 16 loads", one_wrong(1.1), count=16),
        case("the load that counts most is off", heaviest_wrong),
        case("the load that counts most is off, 24 loads", heaviest_wrong, count=24),
        case("the load that counts most is off, 16 loads", heaviest_wrong, count=16),
        case("three alone twist, one is off", heaviest_wrong, loads=few_twists),
        case("three loads off", some_wrong),
        case("a weight 2 % off", wrong_weight),
        case("all channels saturate", saturated),
        case("one channel saturates", clipped_one_channel),
        case("x and y of forces swapped", forces_swapped),
        case("x and y swapped in half", swapped_in_half),
        case("sign of My", moment_mirrored),
        case("moments in mN m", in_millis),
        case("moments in kN m", in_kilos),
        case("some moments in mN m", some_in_millis),
        case("loads one line off", rows_shifted),
        case("drift of 0.5 %", drift(linear, 0.005)),
        case("drift of 2 %", drift(linear, 0.02)),
        case("walk of 1 %", drift(walk, 0.01)),
        case("step of 1 %", drift(step, 0.01)),
        case("temperature, 1 %", drift(temperature, 0.01)),
        case("sensitivity drifts by 6 %", warming),
        case("1 % of the load before", hysteresis),
        case("cubic, 1 %", curved(0.01, 3)),
        case("cubic, 1 %, channels differ", curved(0.01, 3, alike=False)),
        case("cubic, 3 %, channels differ", curved(0.03, 3, alike=False)),
        case("cubic, 5 %", curved(0.05, 3)),
        case("square, 2 %", curved(0.02, 2)),
        case("square, 2 %, channels differ", curved(0.02, 2, alike=False)),
        case("products of channels, 1 %", crossed(0.01)),
        case("products of channels, 5 %", crossed(0.05)),
        case("products of channels, 5 %, eight channels", crossed(0.05), channels=8),
        case("pull 5 % more than push", one_sided),
        case("heavy tails", heavy_tails),
        case("noise grows with the load", noise_by_load),
        case("loads known to 0.3 %", loads_inexact),
        case("a dead channel", dead_channel),
    ),
)
