"""Checks of readings of a force/torque sensor: force before moment, SI units, time stamps of the sampling."""

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from palpate.errors import shown
from palpate.sensing.ft.poses import STANDARD_GRAVITY
from palpate.testing.nonconformity import Inspection

MAX_FORCE, MAX_MOMENT = 1e4, 1e3
"""Largest force [N] and moment [N m]: beyond the ranges of sensors that fit on an arm."""

MAX_LEVER = 0.5
"""Largest distance of a load from the sensor [m]: beyond, it acts on no fingertip."""

MIN_FORCE = 1e-2
"""Smallest force [N], and moment per metre, by which units are judged: below, it is noise."""


MAX_RESTAMPED_SHARE = 0.25
"""Largest share of repeated readings with a later stamp: a device that is read three times as often as it samples
shows 0.33, an emulator whose plant is sometimes late 0.1."""


def examine_wrenches(inspection: Inspection, wrenches: Sequence[tuple[float, ...]]) -> bool:
    """Examine the readings of one sensor [N, N m]; return whether they are six finite numbers each."""
    six = all(
        isinstance(wrench, tuple)
        and len(wrench) == 6
        and all(isinstance(v, float) and math.isfinite(v) for v in wrench)
        for wrench in wrenches
    )
    if not inspection.require(
        six,
        "numbers of the wrench",
        shown(wrenches[-1], 120),
        "a plain tuple of six finite floats",
        "return tuple(array.tolist()), and raise where there is no reading: never a silent NaN",
    ):
        return False
    mean = np.mean(np.array(wrenches), axis=0)
    force, moment = float(np.linalg.norm(mean[:3])), float(np.linalg.norm(mean[3:]))
    inspection.require(
        force <= MAX_FORCE and moment <= MAX_MOMENT,
        "units of the wrench",
        f"{force:.3g} N and {moment:.3g} N m",
        f"at most {MAX_FORCE:g} N and {MAX_MOMENT:g} N m",
        "give newtons and newton metres, not counts, mN or N mm",
    )
    inspection.require(
        moment <= MAX_LEVER * max(force, MIN_FORCE),
        "order and units of the wrench",
        f"a moment of {moment:.3g} N m beside a force of {force:.3g} N, {moment / max(force, 1e-9):.2g} m aside",
        f"a lever below {MAX_LEVER:g} m",
        "force comes before moment, and moments are in N m, not in N mm",
    )
    return True


def restamped_runs(readings: Sequence[tuple[float, object]]) -> int:
    """Count the readings that are repeated, once or more, with later stamps, before a different reading comes.

    A sensor at rest without noise repeats its reading, too, but for long.
    """
    count, restamped = 0, False
    for before, after in pairwise(readings):
        if before[1] == after[1]:
            restamped = restamped or after[0] > before[0]
        else:
            count, restamped = count + restamped, False
    return count


def examine_stamps(inspection: Inspection, what: str, readings: Sequence[tuple[float, tuple[float, ...]]]) -> None:
    """Examine pairs of time [s] and wrench of successive readings."""
    pairs = list(pairwise(readings))
    inspection.require(
        all(b[0] >= a[0] for a, b in pairs),
        f"time stamps of {what}",
        "one goes back",
        "stamps that never go back",
        "stamp each reading when it was sampled, on one monotonic clock",
    )
    restamped = restamped_runs(readings)
    inspection.require(
        restamped <= MAX_RESTAMPED_SHARE * len(pairs),
        f"time stamps of {what}",
        f"{restamped} times in {len(pairs)} readings one is repeated with a later stamp, before the next comes",
        "the stamp of the moment at which a reading was sampled, also when it is reported again",
        "stamp it where it arrives from the device, not where it is logged or returned",
    )
    kept = sum(a[1] != b[1] and b[0] == a[0] for a, b in pairs)
    inspection.require(
        not kept,
        f"time stamps of {what}",
        f"{kept} of {len(pairs)} readings are new, with the stamp of the one before",
        "a stamp that advances with every new reading",
        "stamp every reading when it was sampled, not once at the start",
    )


def examine_gravity(
    inspection: Inspection, acceleration: Sequence[float], up_sensor: Sequence[float] | None
) -> None:
    """Examine the specific force of a sensor at rest [m/s^2]; `up_sensor` points up in its frame, if known."""
    size = math.hypot(*acceleration)
    upwards = up_sensor is None or float(np.dot(acceleration, up_sensor)) > 0.9 * size
    inspection.require(
        abs(size - STANDARD_GRAVITY) <= 0.02 * STANDARD_GRAVITY and upwards,
        "acceleration",
        f"{shown(tuple(acceleration), 80)} m/s^2 at rest",
        f"a vector of length {STANDARD_GRAVITY:.3f} m/s^2 that points up, in the sensor frame",
        "give the specific force, as an accelerometer shows it: sensor frame, m/s^2, not g, gravity not taken off",
    )
