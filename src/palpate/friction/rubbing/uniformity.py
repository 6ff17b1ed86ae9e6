"""Whether mu is the same all along strokes, and in all directions.

The forces there and back at one place enclose 2 atan(mu) at that place, whatever the normal there (see
`palpate.friction.rubbing.sliding`): what yields, a bend and the sensor's origin cancel, what remains is mu over
the place. A finger that rubbed one stretch in one direction knows nothing of the rest of the surface.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from palpate.errors import FloatArray
from palpate.estimation import Assumption, BrokenAssumption, Verdict, white_in_direction, white_in_place
from palpate.estimation.whiteness import FEWEST

LARGEST_VARIATION = 0.03
"""Of mu, largest less least, over its mean, that passes for the same: half of what grasps allow for, and ten times
what servo and landing leave along a smooth plate."""

NOISES = 4.0
"""By how many standard deviations the largest must lie above the least: of two of eight that is chance in 1 of 100
strokes, which the test of neighbours beside it makes rare."""

CHANCE = 0.01
"""p-value of a test of residuals below which they depend on place or direction."""

STRETCHES = 12
"""Of a stroke, over which mu is averaged: two of a waviness of 8 mm come to 20 mm."""


@dataclass(frozen=True, slots=True, eq=False)
class FrictionProfile:
    """mu along a stroke there and back, averaged over k stretches.

    Attributes:
        along: Direction of the stroke, unit vector, base coordinates, shape (3,).
        places: Middle of each stretch along it, shape (k,) [m].
        friction: mu in each, shape (k,).
        noise: Its standard deviation, shape (k,).
    """

    along: FloatArray
    places: FloatArray
    friction: FloatArray
    noise: FloatArray

    @property
    def mean(self) -> float:
        """Mu over the whole stroke."""
        return float(self.friction.mean())

    @property
    def mean_noise(self) -> float:
        """Its standard deviation."""
        return float(np.sqrt((self.noise**2).sum())) / len(self.noise)


def profile_of(
    places: tuple[FloatArray, FloatArray], forces: tuple[FloatArray, FloatArray], along: FloatArray
) -> FrictionProfile:
    """Return mu along a stroke.

    Args:
        places: There and back, along the stroke, shape (n,) each [m].
        forces: On the finger there and back, shape (n, 3) each [N].
        along: Direction of the stroke, shape (3,).
    """
    low, high = (f(each(p) for p in places) for f, each in ((max, np.min), (min, np.max)))
    edges = np.linspace(low, high, STRETCHES + 1)
    rows = []
    for a, b in pairwise(edges.tolist()):
        parts = [f[(p >= a) & (p <= b)] for p, f in zip(places, forces, strict=True)]
        if min(len(part) for part in parts) < 2:
            continue
        u, v = (part.mean(axis=0) / np.linalg.norm(part.mean(axis=0)) for part in parts)
        half = math.atan2(float(np.linalg.norm(u - v)), float(np.linalg.norm(u + v)))
        # across one force, in the plane of both: what turns it
        turning = (u - v) / max(float(np.linalg.norm(u - v)), 1e-12)
        angles = [(part @ turning) / np.linalg.norm(part, axis=1) for part in parts]
        off = 0.5 * math.sqrt(sum(float(angle.var(ddof=1)) / len(angle) for angle in angles))
        rows.append((0.5 * (a + b), math.tan(half), off / math.cos(half) ** 2))
    columns = np.array(rows).reshape(-1, 3).T
    return FrictionProfile(along, columns[0], columns[1], columns[2])


@dataclass(frozen=True, slots=True)
class Uniformity:
    """How far mu is the same in all places and directions that were rubbed.

    Attributes:
        variation: Standard deviation to count for what differs, relative; 0 where nothing was seen to.
        verdict: What differs by more than `LARGEST_VARIATION`.
    """

    variation: float
    verdict: Verdict


def uniformity_of(profiles: Sequence[FrictionProfile], anywhere: Sequence[FrictionProfile] = ()) -> Uniformity:
    """Return how far mu is the same.

    Args:
        profiles: Of strokes at one load and speed, in several directions.
        anywhere: Of other strokes, at any speed: mu is compared along each of these, and not between them.
    """
    found = [*_in_place((*profiles, *anywhere)), *_in_direction(profiles)]
    broken = tuple(each for _, each in sorted(found, key=lambda one: -one[0]))
    # any place or direction may be met: with half the range a 95 % interval holds them all
    return Uniformity(0.5 * max((size for size, _ in found), default=0.0), Verdict(broken))


_Found = tuple[float, BrokenAssumption]


def _in_place(profiles: Sequence[FrictionProfile]) -> Iterator[_Found]:
    worst: _Found | None = None
    for profile in profiles:
        mu = profile.friction
        if len(mu) < FEWEST:
            continue
        # neighbours together: one stretch alone is noise
        smooth = 0.5 * (mu[1:] + mu[:-1])
        size = float(smooth.max() - smooth.min()) / profile.mean
        noise = float(np.median(profile.noise)) / profile.mean
        if size < LARGEST_VARIATION or size < NOISES * noise:
            continue
        if white_in_place(profile.places, mu) > CHANCE:
            continue
        if worst is None or size > worst[0]:
            first, last = profile.places[int(smooth.argmin())], profile.places[int(smooth.argmax())]
            finding = (
                f"mu differs by {100.0 * size:.0f} % along {1e3 * float(np.ptp(profile.places)):.1f} mm, at most "
                f"{100.0 * LARGEST_VARIATION:g} % for one surface; least and largest "
                f"{1e3 * abs(first - last):.1f} mm apart"
            )
            remedy = "rub where the finger will hold, or take the lower end of mu's interval, which counts this"
            worst = size, BrokenAssumption(Assumption.WHITE_IN_PLACE, finding, remedy)
    if worst is not None:
        yield worst


def _in_direction(profiles: Sequence[FrictionProfile]) -> Iterator[_Found]:
    rubbed = [profile for profile in profiles if len(profile.friction)]
    if len(rubbed) < 2 or sum(len(profile.friction) for profile in rubbed) < FEWEST:
        return
    means = np.array([profile.mean for profile in rubbed])
    least, most = int(means.argmin()), int(means.argmax())
    size = float(means[most] - means[least]) / float(means.mean())
    noise = math.hypot(rubbed[least].mean_noise, rubbed[most].mean_noise) / float(means.mean())
    if size < LARGEST_VARIATION or size < NOISES * noise:
        return
    directions = np.concatenate([np.tile(profile.along, (len(profile.friction), 1)) for profile in rubbed])
    if white_in_direction(directions, np.concatenate([profile.friction for profile in rubbed])) > CHANCE:
        return
    angle = math.degrees(math.acos(min(1.0, abs(float(rubbed[least].along @ rubbed[most].along)))))
    yield (
        size,
        BrokenAssumption(
            Assumption.WHITE_IN_DIRECTION,
            f"mu is {means[most]:.3g} in one direction, {means[least]:.3g} at {angle:.0f} degrees from it, at "
            f"most {100.0 * LARGEST_VARIATION:g} % apart for one surface",
            "take mu along both, or the lower end of its interval, which counts this",
        ),
    )
