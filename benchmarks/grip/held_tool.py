"""Contacts through a held pin of 80 mm: place, force, number of places, slip in the hand.

Sensors have the noise of a Nano17 (3.1 mN, 16 uN m at 1 kHz), matrices that are 0.1 % wrong, zeros that drift by
10 mN and 0.1 mN m in a minute. Poses of the fingers are 0.1 mm and 0.2 degrees wrong, the mass of the pin 5 %. The
wrench in the air just before is subtracted.
"""

import argparse
from collections.abc import Callable, Iterator
from functools import partial

import numpy as np
from harness.campaign import Listing

from grip.held_pin import (
    END,
    HAND,
    IN_HAND,
    MATRIX,
    NOISE,
    PIN,
    RADIUS,
    REST,
    SIDE,
    WEIGHT,
    ZERO,
    measured_by_fingers,
    pressed,
    touching,
)
from palpate.friction.slip.tool_slip import SlipSign, ToolSlip
from palpate.sensing import ContactStatus
from palpate.sensing.held import (
    ContactBounds,
    ContactCount,
    ExternalWrenches,
    FingersFelt,
    HeldBody,
    HeldTool,
    PlaceFelt,
    count_contacts,
    external_wrenches,
    felt_on_tool,
)

AIR, WINDOW = 200, 50
"""Samples at 1 kHz: in the air, and of a contact."""

REACHES, ALONG = (0.015, 0.03, 0.045, 0.058), (0.01, 0.06)
"""[m] from where the fingers hold the pin."""

WITHIN, SURE = 0.5e-3, 0.95
SEPARATION = 0.01
RATE = 1000.0
SLIP_SECONDS, BEFORE = 0.2, 1.0
BOUNDS = ContactBounds(friction=1.0, spin_length=2e-3, separation=SEPARATION)


def contact(seeds: int) -> Listing:
    """Touch the pin with 1 N along it, friction up to 0.4, a spin of 0.2 mN m; judged over places all along it."""
    heads = ("held by", "from the grip [mm]", "along: rms, 95 % [mm]", "force: rms [%]", "in 95 % interval [%]")
    rows, good = [], True
    for name, measure in (("one sensor", by_sensor), ("two fingers", by_fingers)):
        for reach in (*REACHES, None):
            rngs = [np.random.default_rng(seed) for seed in range(seeds)]
            errors = [touched(rng, measure, rng.uniform(*ALONG) if reach is None else reach) for rng in rngs]
            along, force, covered = map(np.array, zip(*errors, strict=True))
            rms, relative = (float(np.sqrt(np.mean(np.square(each)))) for each in (along, force))
            if reach is None:
                good = good and rms < WITHIN and relative < 0.01
            rows.append(
                (
                    name,
                    "any" if reach is None else f"{1e3 * reach:g}",
                    f"{1e3 * rms:.2f}, {1e3 * np.quantile(np.abs(along), SURE):.2f}",
                    f"{100 * relative:.2f}",
                    f"{100 * np.mean(covered):.0f}",
                )
            )
    return Listing("contact, 1 N", heads, rows, good)


def touched(
    rng: np.random.Generator, measure: Callable[[np.random.Generator, np.ndarray], ExternalWrenches], reach: float
) -> tuple[float, float, bool]:
    """Return by how much the place is off [m], the force, relative, and whether the place's interval holds."""
    f = np.array([rng.uniform(-0.28, 0.28), -1.0, rng.uniform(-0.28, 0.28)])
    height = HAND.position[2] + reach
    spin = np.array([0.0, rng.uniform(-2e-4, 2e-4), 0.0])
    wrench = np.concatenate((f, np.cross([0.0, RADIUS, height], f) + spin))
    told = measure(rng, np.repeat([np.zeros(6), wrench], [AIR, WINDOW], axis=0))
    felt = felt_on_tool(HeldTool(PIN), told.part(slice(AIR, None)).less(told.part(slice(AIR))).mean())
    if felt.contacts.status[0] != ContactStatus.OK:
        return np.inf, np.inf, False
    off = float(felt.contacts.centroid[0, 2] - height)
    wrong = float(np.linalg.norm(felt.contacts.force[0] - f) / np.linalg.norm(f))
    return off, wrong, abs(off) < 1.96 * np.sqrt(felt.uncertainty.centroid[0, 2, 2])


def by_fingers(rng: np.random.Generator, external: np.ndarray) -> ExternalWrenches:
    """Return what two fingers make of wrenches on the pin."""
    return external_wrenches(measured_by_fingers(rng, external), WEIGHT, REST)


def by_sensor(rng: np.random.Generator, external: np.ndarray) -> ExternalWrenches:
    """Return what one sensor makes of them that carries the pin."""
    felt = ExternalWrenches.measured(external, NOISE).seen_from(HAND).wrench
    wrong = felt + felt @ (MATRIX * rng.normal(size=(6, 6))).T + rng.normal(size=felt.shape) @ np.sqrt(NOISE)
    wrong += rng.normal(size=6) @ np.sqrt(ZERO)
    exact = np.eye(3)[None], np.zeros((1, 3)), NOISE[None], ZERO[None], np.zeros((1, 6, 6)), MATRIX[None]
    told = external_wrenches(FingersFelt(wrong[:, None], *exact), HeldBody(), REST)
    return told.seen_from(HAND.inverse())


def count(seeds: int) -> Listing:
    """One or two contacts, 1 N, loads that change each by itself; windows of 0.2 s."""
    heads = ("contacts", "each load changes by [%]", "one [%]", "several [%]", "untold [%]")
    rows, good = [], True
    for heights in ((-0.02,), (-0.02, -0.015), (-0.02, -0.01)):
        apart = f"{len(heights)}" + (f", {1e3 * (heights[1] - heights[0]):g} mm apart" if len(heights) > 1 else "")
        right = ContactCount.ONE if len(heights) == 1 else ContactCount.SEVERAL
        for swing in (0.0, 0.01, 0.02, 0.05, 0.1, 0.2):
            windows = (pressed(np.random.default_rng(seed), heights, swing, swing) for seed in range(seeds))
            counts = [count_contacts(PIN, window, BOUNDS).count for window in windows]
            shares = {each: float(np.mean([c is each for c in counts])) for each in ContactCount}
            if swing >= ENOUGH and (len(heights) == 1 or heights[1] - heights[0] >= SEPARATION):
                good = good and shares[right] >= SURE
            rows.append((apart, f"{100 * swing:g}", *(f"{100 * shares[each]:.0f}" for each in ContactCount)))
    return Listing("count", heads, rows, good)


ENOUGH = 0.05
"""Change of each load, in size and direction, root mean square, relative, from which on one and two that are
`SEPARATION` apart must be told."""


def slip(seeds: int) -> Listing:
    """The pin presses with 1 N on a point, and slips by 1 mm in 0.2 s, along the contact's normal."""
    heads = ("touches with", "detected [%]", "median [ms]", "latest [ms]", "before it slips [%]")
    rows, good = [], True
    for name, (normal, place) in (("its side", SIDE), ("its end", END)):
        delays, early = [], 0
        for seed in range(seeds):
            n = int((BEFORE + SLIP_SECONDS) * RATE)
            ramp = np.clip((np.arange(n) / RATE - BEFORE) / SLIP_SECONDS, 0.0, 1.0)
            by = np.concatenate((-1e-3 * normal, np.zeros(3)))
            told = first_sign(seed, np.outer(ramp, by), normal, place)
            early += told is not None and told < BEFORE
            delays.append(np.inf if told is None else told - BEFORE)
        late = np.array(delays)
        good = good and early <= seeds // 100 and float(np.mean(late < SLIP_SECONDS)) >= 0.99
        rows.append(
            (
                name,
                f"{100 * np.mean(np.isfinite(late)):.0f}",
                f"{1e3 * np.median(late):.0f}",
                f"{1e3 * late.max():.0f}",
                f"{100 * early / seeds:.1f}",
            )
        )
    return Listing("slip of 1 mm", heads, rows, good)


def alarms(seeds: int) -> Listing:
    """As in `slip`, without slip: ten seconds of each seed."""
    seconds, rows, good = 10.0, [], True
    for name, (normal, place) in (("its side", SIDE), ("its end", END)):
        found = [first_sign(seed, np.zeros((int(seconds * RATE), 6)), normal, place) for seed in range(seeds)]
        false = sum(each is not None for each in found)
        hours = seeds * seconds / 3600.0
        good = good and false <= 1 + 2.0 * hours
        rows.append((name, f"{hours:.2f}", f"{false}"))
    return Listing("no slip", ("touches with", "hours", "false alarms"), rows, good)


def first_sign(seed: int, slips: np.ndarray, normal: np.ndarray, place: np.ndarray) -> float | None:
    """Return when slip is told first [s]."""
    felt, listens = PlaceFelt(IN_HAND, NOISE, ZERO / 60.0), ToolSlip(1.0 / RATE, fingers=2)
    for i, (wrench, pose) in enumerate(touching(np.random.default_rng(seed), slips, normal, place, RATE)):
        if listens.step(felt.step(wrench, pose)) is SlipSign.PLACE:
            return i / RATE
    return None


def part(study: Callable[[int], Listing], options: argparse.Namespace) -> Iterator[Listing]:
    """Carry out a study with the number of seeds given."""
    yield study(options.seeds or 200)


PARTS = {f"pin-{study.__name__}": partial(part, study) for study in (contact, count, slip, alarms)}
