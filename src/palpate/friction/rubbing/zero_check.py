"""Whether the sensor's zero stays as good as assumed: the same surface has the same normal all the time.

The normal bisects the forces there and back. A zero that is off by z across it tilts it by z over the load, and
one that is off as much along it makes mu wrong by that share. Along the normal nothing shows it; but what moved,
moved on all axes.
"""

import math
from collections.abc import Iterator, Sequence

import numpy as np

from palpate.estimation import Assumption, BrokenAssumption
from palpate.friction.rubbing.estimate import SensorErrors
from palpate.friction.rubbing.sliding import FrictionMeasured

APART = 2e-4
"""[m] that places may be apart which are taken for one: on a sphere of 40 mm their normals differ by 5 mrad."""

TILT = 1e-3
"""[rad] that normals of one place differ by otherwise, besides noise: creep and lag of a contact that slides."""

SEEN = 4.0
"""Standard deviations by which a drift differs from none: chance alone does that 3 times in 10 000."""

MATTERS = 3.0
"""Over the standard deviation of the zero that is assumed, from which on a drift is told: a zero that wanders as
assumed turns normals by twice that in 1 run of 12."""


def zero_check(frictions: Sequence[FrictionMeasured], errors: SensorErrors) -> Iterator[BrokenAssumption]:
    """Name the drift that normals show, if it is more than was assumed.

    Args:
        frictions: From strokes that begin at one place; several loads tell a drift from a zero that is off.
        errors: Of the sensor, as assumed.
    """
    if len(frictions) < 2:
        return
    lines = [each.bend for each in frictions]
    begins = [line.place - line.reach * line.direction for line in lines]
    normals = np.array([each.normal_at(place) for each, place in zip(frictions, begins, strict=True)])
    turns = np.cross(normals.mean(axis=0), normals)
    time = np.array([each.time for each in frictions])
    since = time - time.min()
    load = np.array([each.normal_force for each in frictions])
    # turn = a + zero / load + drift time / load, with what is assumed of the zero as one more observation
    bend = max(float(np.linalg.norm(line.rate)) for line in lines)
    sds = np.array([math.hypot(TILT, APART * bend, each.friction.noise) for each in frictions])
    A = np.column_stack([np.ones(len(load)), 1.0 / load, since / load]) / sds[:, None]
    A = np.vstack([A, [0.0, 1.0 / max(errors.force_zero, 1e-9), 0.0]])
    inverse = np.linalg.pinv(A)
    drift = float(np.linalg.norm(inverse[2, :-1] @ (turns / sds[:, None])))
    sd = float(np.linalg.norm(inverse[2]))
    moved = drift * float(since.max())
    if drift > SEEN * sd and moved > MATTERS * errors.force_zero:
        yield BrokenAssumption(
            Assumption.WHITE_IN_TIME,
            f"the normal turns as by a zero that moved by {moved:.2g} ± {sd * since.max():.1g} N in "
            f"{since.max():.0f} s; {errors.force_zero:.2g} N was assumed",
            "let the sensor warm up, tare it in free air before and after, and rub again",
        )
