"""Payload and tare, as `palpate calibrate` finds them.

A tip of 1.2 kg on a wrist sensor with white noise of 0.028 N and 0.6 mN m, in 48 random poses unless a row says
otherwise; drifts of 1 to 2 N and 0.03 to 0.06 N m over the poses. Of a zero that drifts the bias is its mean over
the poses that were used. A mass under drift must be within 1 % or not OK: one that is off by more counts as
silently wrong, too.
"""

import math
from collections.abc import Callable
from functools import partial

import numpy as np
from scipy.spatial.transform import Rotation
from trust.study import Case, Run, Study, first_finding

from palpate.errors import InvalidValueError
from palpate.sensing.compensation import SensorPayload
from palpate.sensing.ft import (
    PayloadEntry,
    SensorFile,
    average_bias,
    bias_covariance,
    identify_payload,
    specific_force_from_rotations,
    with_bias,
)
from palpate.sensing.ft.payload import TWO_SIDED
from palpate.sensing.ft.sensor_file import ContactEntry

PAYLOAD = SensorPayload(1.2, (0.005, -0.012, 0.045))
NOISE = np.repeat([0.028, 6e-4], 3)
SCALE = np.repeat([1.0, 0.03], 3)
MASS = 0.01
"""Relative error of an OK mass that is too large however wide its interval."""

POSES = 48
Rng = np.random.Generator
Shown = np.ndarray
Change = Callable[[Rng, Shown, Rotation], Shown]
"""Change of the readings, shape (n, 6), given the poses (sensor to base)."""


def axis(rng: Rng) -> np.ndarray:
    """Return the amount of a drift: 1 to 2 N at its largest axis."""
    drawn = rng.normal(size=6)
    return drawn / np.repeat([np.abs(drawn[:3]).max(), np.abs(drawn[3:]).max()], 3) * rng.uniform(1.0, 2.0) * SCALE


def walk(rng: Rng, n: int) -> np.ndarray:
    """Return a random walk."""
    path = np.cumsum(rng.normal(size=(n, 6)), axis=0)
    span = np.repeat([np.ptp(path[:, :3], axis=0).max(), np.ptp(path[:, 3:], axis=0).max()], 3)
    return path / span * rng.uniform(1.0, 2.0) * SCALE


def step(rng: Rng, n: int, at: int | None = None) -> np.ndarray:
    """Return a jump."""
    place = int(rng.integers(2, n - 2)) if at is None else at
    return np.outer(np.arange(n) >= place, axis(rng))


def exponential(rng: Rng, n: int) -> np.ndarray:
    """Return a warm-up."""
    return np.outer(1.0 - np.exp(-np.linspace(0.0, 1.0, n) / rng.uniform(0.1, 0.8)), axis(rng))


def temperature(rng: Rng, n: int) -> np.ndarray:
    """Return half a period to three of a sine."""
    turns = rng.uniform(0.5, 3.0) * np.linspace(0.0, 1.0, n) + rng.uniform()
    return np.outer(0.5 * np.sin(2.0 * math.pi * turns), axis(rng))


def clusters(rng: Rng, n: int) -> Rotation:
    """Return two orientations, each with some spread, the one after the other."""
    two, spread = Rotation.random(2, rng=rng), rng.uniform(0.05, 0.5)
    return Rotation.from_rotvec(spread * rng.normal(size=(n, 3))) * two[(np.arange(n) >= n // 2).astype(int)]


def slow(rng: Rng, n: int) -> Rotation:
    """Return orientations in the order of their angle: a scan."""
    return Rotation.from_rotvec(np.cumsum(rng.normal(size=(n, 3)), axis=0) * 0.4)


def at_some(
    share: float, amount: Callable[[Rng, int], np.ndarray], rng: Rng, shown: Shown, poses: Rotation
) -> Shown:
    """Return wrenches of which some poses are changed."""
    some = rng.choice(len(shown), max(1, round(share * len(shown))), replace=False)
    shown[some] += amount(rng, len(some))
    return shown


def drifting(drift: Callable[[Rng, int], np.ndarray], rng: Rng, shown: Shown, poses: Rotation) -> Shown:
    """Return wrenches with a drift."""
    return shown + drift(rng, len(shown))


def in_base(rng: Rng, shown: Shown, poses: Rotation) -> Shown:
    """Return wrenches in the frame of the base."""
    return np.hstack([poses.apply(shown[:, :3]), poses.apply(shown[:, 3:])])


def turned(degrees: float, rng: Rng, shown: Shown, poses: Rotation) -> Shown:
    """Return a sensor that is mounted turned about a random axis."""
    about = rng.normal(size=3)
    turn = Rotation.from_rotvec(math.radians(degrees) * about / np.linalg.norm(about))
    return np.hstack([turn.apply(shown[:, :3]), turn.apply(shown[:, 3:])])


def hose(rng: Rng, shown: Shown, poses: Rotation) -> Shown:
    """Return what a cable that hangs from the base adds: a force along the sensor's x as it tilts."""
    shown[:, 0] += rng.uniform(0.3, 1.0) * poses.as_matrix()[:, 2, 1]
    return shown


def gain(rng: Rng, shown: Shown, poses: Rotation) -> Shown:
    """Return forces whose x axis is 2 % too large."""
    return shown * [1.02, 1.0, 1.0, 1.0, 1.0, 1.0]


BAD = partial(at_some, 0.05, lambda rng, k: 2.0 * rng.normal(size=(k, 6)) * SCALE)
same = partial(drifting, lambda rng, n: np.zeros((n, 6)))


def weighed(up: np.ndarray) -> np.ndarray:
    """Return what the payload shows in a pose, shape (n, 6)."""
    weight = -PAYLOAD.mass * up
    return np.hstack([weight, np.cross(PAYLOAD.center_of_mass, weight)])


def tried(seed: int, change: Change, poses_of: Callable[[Rng, int], Rotation], assumed_g: float) -> Run:
    """Identify once."""
    rng, n = np.random.default_rng(seed), POSES
    poses = poses_of(rng, n)
    R = poses.as_matrix().transpose(0, 2, 1)
    up = specific_force_from_rotations(R)
    bias = rng.normal(size=6) * np.repeat([5.0, 0.1], 3)
    exact = change(rng, weighed(up) + bias, poses)
    shown = exact + NOISE * rng.normal(size=(n, 6))
    assumed = up * assumed_g / 9.80665
    try:
        found = identify_payload(assumed, shown, force_sd=NOISE[0], moment_sd=NOISE[3])
    except InvalidValueError:
        return Run(ok=False, furthest=0.0, finding="refused")
    z_mass = (found.payload.mass - PAYLOAD.mass) / found.mass_sd
    z_center = np.subtract(found.payload.center_of_mass, PAYLOAD.center_of_mass) / found.center_sd
    zero = np.delete(exact - weighed(up), found.zero.bad, axis=0).mean(axis=0)
    z_bias = ([*found.bias_force, *found.bias_moment] - zero) / np.sqrt(np.diag(found.bias_covariance))
    largest = max(abs(z_mass), np.abs(z_center).max(), np.abs(z_bias).max())
    held = np.abs([z_mass, *z_center, *z_bias]) <= TWO_SIDED
    off = abs(found.payload.mass / PAYLOAD.mass - 1.0) > MASS
    inside = {"mass": float(held[0]), "centre": float(held[1:4].mean()), "bias": float(held[4:].mean())}
    return Run(found.verdict.ok, math.inf if off else float(largest), inside, first_finding(found.verdict))


def tared(seed: int) -> Run:
    """Tare in one pose, with an identified payload."""
    rng = np.random.default_rng(seed)
    up = specific_force_from_rotations(Rotation.random(12, rng=rng).as_matrix())
    bias = rng.normal(size=6) * np.repeat([5.0, 0.1], 3)
    found = identify_payload(
        up, weighed(up) + bias + NOISE * rng.normal(size=(12, 6)), force_sd=NOISE[0], moment_sd=NOISE[3]
    )
    x, y, z = found.center_sd.tolist()
    entry = PayloadEntry(
        mass=found.payload.mass,
        center_of_mass=found.payload.center_of_mass,
        mass_sd=found.mass_sd,
        center_of_mass_sd=(x, y, z),
    )
    f, m = (NOISE[0],) * 3, (NOISE[3],) * 3
    contact = ContactEntry(touch_force=2.0, release_force=1.0)
    sensor = SensorFile(
        model="m",
        serial_number="s",
        date="2026-01-01",
        provenance="p",
        sample_rate=500.0,
        force_range=(500.0,) * 3,
        moment_range=(20.0,) * 3,
        noise_force=f,
        noise_moment=m,
        payload=entry,
        contact=contact,
    )
    drifted = bias + rng.normal(size=6) * SCALE
    (pose,) = specific_force_from_rotations(Rotation.random(1, rng=rng).as_matrix())
    average = average_bias(weighed(pose[None]) + drifted + NOISE * rng.normal(size=(1000, 6)), noise=NOISE)
    a = (float(pose[0]), float(pose[1]), float(pose[2]))
    after = with_bias(sensor, average, a, date="2026-01-01", provenance="p").bias
    sd = np.sqrt(np.diag(bias_covariance(sensor, average, a)))
    z = np.abs(np.subtract(after, drifted)) / sd
    return Run(found.verdict.ok, float(z.max()), {"bias": float((z <= TWO_SIDED).mean())})


def case(
    name: str,
    change: Change,
    *,
    holds: bool = False,
    weight: float = 1.0,
    poses: Callable[[Rng, int], Rotation] = lambda rng, n: Rotation.random(n, rng=rng),
    assumed: float = 9.80665,
) -> Case:
    """Return a kind of data: how wrenches change, how poses are taken, and which g they are given with."""
    return Case(name, lambda seed: tried(seed, change, poses, assumed), holds, weight)


STUDY = Study(
    "payload",
    (
        case("as assumed", same, holds=True, weight=5.0),
        case("poses in a scan", same, holds=True, weight=5.0, poses=slow),
        case("two clusters of poses", same, poses=clusters),
        case("walk", partial(drifting, walk)),
        case("step", partial(drifting, step)),
        case("exponential", partial(drifting, exponential)),
        case("temperature", partial(drifting, temperature)),
        case("walk, scan", partial(drifting, walk), poses=slow),
        case("exponential, scan", partial(drifting, exponential), poses=slow),
        case("walk, clusters", partial(drifting, walk), poses=clusters),
        case("step between clusters", partial(drifting, lambda rng, n: step(rng, n, n // 2)), poses=clusters),
        case("exponential, clusters", partial(drifting, exponential), poses=clusters),
        case("5 % bad poses", BAD),
        case("5 % bad poses, walk", lambda r, w, p: BAD(r, w + walk(r, len(w)), p)),
        case("one contact force at 20 %", partial(at_some, 0.2, lambda rng, k: rng.normal(size=6) * SCALE)),
        case("one contact force at 50 %", partial(at_some, 0.5, lambda rng, k: rng.normal(size=6) * SCALE)),
        case("noise 3 times as large", lambda r, w, p: w + math.sqrt(8.0) * NOISE * r.normal(size=w.shape)),
        case("g of 9.9", same, assumed=9.9),
        case("g of 9.7", same, assumed=9.7),
        case("x and y swapped", lambda r, w, p: w[:, [1, 0, 2, 4, 3, 5]]),
        case("z mirrored", lambda r, w, p: w * [1, 1, -1, -1, -1, 1]),
        case("axes turned round", lambda r, w, p: w[:, [1, 2, 0, 4, 5, 3]]),
        case("mounted 1 degree off", partial(turned, 1.0)),
        case("mounted 30 degrees off", partial(turned, 30.0)),
        case("wrenches in base frame", in_base),
        case("moments in mN m", lambda r, w, p: w * np.repeat([1.0, 1e3], 3)),
        case("a hose", hose),
        case("gain of x 2 % off", gain),
        Case("tare after it, in another pose", tared, holds=True),
    ),
)
