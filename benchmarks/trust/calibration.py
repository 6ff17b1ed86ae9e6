"""Calibrations, as `palpate calibrate matrix` finds them from known loads: whichever model is proposed.

A sensor of six channels with the ranges of a Nano17 (condition number 3, a zero of its own, noise of 0.1 % of the
range) under 48 weights on levers, of five sizes and in random order, unless a row says otherwise. Compared are the
entries of the matrix, and a wrench drawn within the range, of a sensor that is not linear a load of the same kind
that was not among them, each by Student's t of its printed standard error.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
from scipy.special import ndtri, stdtr
from trust.study import Case, Run, Study, first_finding

from palpate.errors import InvalidValueError
from palpate.sensing.ft import choose_calibration

RANGES = np.array([12.0, 12.0, 17.0, 0.12, 0.12, 0.12])
WEIGHTS = np.array([0.1, 0.25, 0.4, 0.6, 0.8]) * 12.0
LOADS, CHANNELS, NOISE = 48, 6, 1e-3
COVERED = 0.95
SWAPPED = [1, 0, 2, 4, 3, 5]
MILLI = np.repeat([1.0, 1e3], 3)

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
        loads: True loads, shape (n, 6).
        sensitivity: Readings per load, shape (k, 6) [raw unit per N or N m].
        known: Loads as they are noted.
        raw: Readings, shape (n, k).
        bend: From readings of a linear sensor to those of this one.
    """

    rng: Rng
    loads: Rows
    sensitivity: Rows
    known: Rows
    raw: Rows
    bend: Callable[[Rows], Rows] = straight

    @property
    def response(self) -> Rows:
        """Readings of the loads by a linear sensor."""
        return self.loads @ self.sensitivity.T

    @property
    def size(self) -> Rows:
        """Largest load of an axis relative to its range, shape (n, 1)."""
        return np.abs(self.loads / RANGES).max(axis=1, keepdims=True)


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


def noted(change: Callable[[Bench], Rows], bench: Bench) -> None:
    """Return a change of the loads as they are noted."""
    bench.known = change(bench)


def read(change: Callable[[Bench], Rows], bench: Bench) -> None:
    """Return a change of the readings."""
    bench.raw = change(bench)


def one_wrong(factor: float, bench: Bench) -> None:
    """Return one load that is noted wrongly."""
    bench.known[bench.rng.integers(len(bench.known))] *= factor


def heaviest_wrong(bench: Bench) -> None:
    """Make the load that counts most wrong by 5 %."""
    q = np.linalg.qr(np.column_stack([bench.loads, np.ones(len(bench.loads))]))[0]
    bench.known[int(np.argmax((q**2).sum(axis=1)))] *= 1.05


def some_wrong(bench: Bench) -> None:
    """Make three loads wrong by up to 30 %."""
    some = bench.rng.choice(len(bench.known), 3, replace=False)
    bench.known[some] *= bench.rng.uniform(0.7, 1.3, (3, 1))


def wrong_weight(bench: Bench) -> None:
    """Make one of the weights 2 % less than is written on it."""
    force = np.linalg.norm(bench.loads[:, :3], axis=1)
    bench.known[np.isclose(force, WEIGHTS[bench.rng.integers(2, 5)])] *= 1.02


def swapped_in_half(bench: Bench) -> None:
    """Swap x and y in the second half of the loads."""
    half = len(bench.known) // 2
    bench.known[half:] = bench.known[half:][:, SWAPPED]


def some_in_millis(bench: Bench) -> None:
    """Note the first five moments in mN m."""
    bench.known[:5, 3:] *= 1e3


def saturated(bench: Bench) -> Rows:
    """Return readings clipped at their 97 % quantile."""
    bound = np.quantile(np.abs(bench.raw), 0.97)
    return np.clip(bench.raw, -bound, bound)


def one_saturated(bench: Bench) -> Rows:
    """Return readings of which one channel is clipped from above."""
    bound = np.full(CHANNELS, np.inf)
    j = bench.rng.integers(CHANNELS)
    bound[j] = np.quantile(bench.raw[:, j], 0.9)
    return np.minimum(bench.raw, bound)


def with_hysteresis(bench: Bench) -> Rows:
    """Return readings that contain 1 % of the load before."""
    before = np.vstack([np.zeros(6), bench.loads[:-1]])
    return bench.raw + 0.01 * before @ bench.sensitivity.T


def pull_stronger(bench: Bench) -> Rows:
    """Return readings in which pull along z counts 5 % more than push."""
    return bench.raw + 0.05 * np.outer(np.maximum(bench.loads[:, 2], 0.0), bench.sensitivity[:, 2])


def one_dead(bench: Bench) -> Rows:
    """Return readings of which one channel shows noise alone."""
    noise = NOISE * bench.rng.normal(size=(len(bench.raw), 1))
    return np.where(np.arange(CHANNELS) == bench.rng.integers(CHANNELS), noise, bench.raw)


def drift(shape: Callable[[Rng, int], Rows], amount: float, bench: Bench) -> None:
    """Return a zero that moves, by `amount` of the range."""
    course = shape(bench.rng, len(bench.raw))[:, None]
    bench.raw += amount * course / np.ptp(course) * bench.rng.normal(size=bench.raw.shape[1])


def curved(amount: float, power: int, bench: Bench, alike: bool = True) -> None:
    """Return channels that are not linear, by `amount` at the largest reading."""
    scale = np.abs(bench.raw).max()
    size = 1.0 if alike else bench.rng.normal(size=bench.raw.shape[1])
    bench.bend = lambda raw: raw + size * amount * scale * (raw / scale) ** power


def crossed(amount: float, bench: Bench) -> None:
    """Return two channels that show a product of two others, by `amount` at the largest reading."""
    scale = np.abs(bench.raw).max()
    a, b, c, d = bench.rng.permutation(bench.raw.shape[1])[:4]
    bench.bend = lambda raw: (
        raw
        + amount
        / scale
        * np.eye(raw.shape[-1])[[a, b]].T.dot(np.array([raw[..., b] * raw[..., c], raw[..., d] ** 2])).T
    )


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


COURSES: dict[str, Callable[[Rng, int], Rows]] = {
    "linear": lambda rng, n: np.linspace(0.0, 1.0, n),
    "walk": lambda rng, n: np.cumsum(rng.normal(size=n)),
    "step": lambda rng, n: (np.arange(n) >= rng.integers(4, n - 4)).astype(float),
    "temperature": lambda rng, n: np.sin(
        rng.uniform(1.0, 5.0) * np.linspace(0.0, 2.0 * np.pi, n) + rng.uniform(0.0, 6.0)
    ),
}
"""Courses of a zero that moves."""

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
        case("loads that grow in time, drift of 1 %", partial(drift, COURSES["linear"], 0.01), loads=growing),
        case("one load 10 % off", partial(one_wrong, 1.1)),
        case("one load 3 % off", partial(one_wrong, 1.03)),
        case("one load of the other sign", partial(one_wrong, -1.0)),
        case("one load 10 % off, 16 loads", partial(one_wrong, 1.1), count=16),
        case("the load that counts most is off", heaviest_wrong),
        case("the load that counts most is off, 24 loads", heaviest_wrong, count=24),
        case("the load that counts most is off, 16 loads", heaviest_wrong, count=16),
        case("three alone twist, one is off", heaviest_wrong, loads=few_twists),
        case("three loads off", some_wrong),
        case("a weight 2 % off", wrong_weight),
        case("all channels saturate", partial(read, saturated)),
        case("one channel saturates", partial(read, one_saturated)),
        case("x and y of forces swapped", partial(noted, lambda b: b.known[:, [1, 0, 2, 3, 4, 5]])),
        case("x and y swapped in half", swapped_in_half),
        case("sign of My", partial(noted, lambda b: b.known * [1.0, 1.0, 1.0, 1.0, -1.0, 1.0])),
        case("moments in mN m", partial(noted, lambda b: b.known * MILLI)),
        case("moments in kN m", partial(noted, lambda b: b.known / MILLI)),
        case("some moments in mN m", some_in_millis),
        case("loads one line off", partial(noted, lambda b: np.roll(b.known, 1, axis=0))),
        case("drift of 0.5 %", partial(drift, COURSES["linear"], 0.005)),
        case("drift of 2 %", partial(drift, COURSES["linear"], 0.02)),
        case("walk of 1 %", partial(drift, COURSES["walk"], 0.01)),
        case("step of 1 %", partial(drift, COURSES["step"], 0.01)),
        case("temperature, 1 %", partial(drift, COURSES["temperature"], 0.01)),
        case(
            "sensitivity drifts by 6 %",
            partial(read, lambda b: b.raw + 0.03 * np.linspace(-1.0, 1.0, len(b.raw))[:, None] * b.response),
        ),
        case("1 % of the load before", partial(read, with_hysteresis)),
        case("cubic, 1 %", partial(curved, 0.01, 3)),
        case("cubic, 1 %, channels differ", partial(curved, 0.01, 3, alike=False)),
        case("cubic, 3 %, channels differ", partial(curved, 0.03, 3, alike=False)),
        case("cubic, 5 %", partial(curved, 0.05, 3)),
        case("square, 2 %", partial(curved, 0.02, 2)),
        case("square, 2 %, channels differ", partial(curved, 0.02, 2, alike=False)),
        case("products of channels, 2 %", partial(crossed, 0.02)),
        case("products of channels, 5 %", partial(crossed, 0.05)),
        case("products of channels, 5 %, eight channels", partial(crossed, 0.05), channels=8),
        case(
            "pull 5 % more than push",
            partial(read, pull_stronger),
        ),
        case("heavy tails", partial(read, lambda b: b.raw + NOISE * b.rng.standard_t(2.0, b.raw.shape))),
        case(
            "noise grows with the load",
            partial(read, lambda b: b.raw + 5e-3 * b.size * b.rng.normal(size=b.raw.shape)),
        ),
        case(
            "loads known to 0.3 %",
            partial(noted, lambda b: b.known * (1.0 + 3e-3 * b.rng.normal(size=b.known.shape))),
        ),
        case("a dead channel", partial(read, one_dead)),
    ),
)
