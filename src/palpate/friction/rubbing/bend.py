"""How the normal turns along a stroke, so that it is known where a twist is done beside it.

Where both motions rubbed, the normal bisects the force there and the force back at that very place. A twist is
done at an end of a stroke: on a sphere of 40 mm radius 3 mm from its middle, where the normal is another by 0.07
rad; taken for the same, that passes for sliding.
"""

import math
from dataclasses import dataclass

import numpy as np

from palpate.errors import FloatArray
from palpate.friction.rubbing.stroke import batch_means

STRETCHES = 8
"""Of the place, over which forces are averaged."""

SEEN = 5.0
"""By how many of its standard deviations a bend must differ from none: chance alone does that 2.5 times in 1000,
with the 6 degrees of freedom left (Student)."""

_FARTHEST = 3.0
"""How far beside the line a bend is taken to go on, over its reach: both motions rub the middle third of a
stroke."""


@dataclass(frozen=True, slots=True, eq=False)
class NormalAlongLine:
    """The normal along a line on the surface.

    Attributes:
        place: In the middle of it, base coordinates, shape (3,) [m].
        direction: Unit vector along it, shape (3,).
        rate: By how much the normal changes per path length, shape (3,) [1/m]; 0 where nothing is seen to turn.
        reach: How far from the middle it is known by the line's own length [m].
    """

    place: FloatArray
    direction: FloatArray
    rate: FloatArray
    reach: float

    def normal_at(self, normal: FloatArray, place: FloatArray) -> FloatArray:
        """Return the normal at a place, given that in the middle; beyond three times its reach as there.

        Args:
            normal: In the middle, shape (3,).
            place: Base coordinates, shape (3,) [m].
        """
        along = float((place - self.place) @ self.direction)
        along = min(max(along, -_FARTHEST * self.reach), _FARTHEST * self.reach)
        turned = normal + along * self.rate
        return np.asarray(turned / np.linalg.norm(turned))


def bend_of(
    contacts: tuple[FloatArray, FloatArray], forces: tuple[FloatArray, FloatArray], direction: FloatArray
) -> NormalAlongLine:
    """Return how the normal turns along a stroke there and back.

    Args:
        contacts: Where it rubbed there and back, over the same stretch, base coordinates, shape (n, 3) each [m].
        forces: On the finger, shape (n, 3) each [N].
        direction: Unit vector of the first motion, shape (3,).
    """
    profiles = []
    for points, force in zip(contacts, forces, strict=True):
        order = np.argsort(points @ direction, kind="stable")
        length = np.linalg.norm(force, axis=1)[:, None]
        profiles.append(
            (batch_means(points[order] @ direction, STRETCHES), batch_means((force / length)[order], STRETCHES))
        )
    (x, there), (y, back) = profiles
    s = 0.5 * (x + y)
    normals = -(there + back)
    normals = normals / np.linalg.norm(normals, axis=1)[:, None]
    mid = s - s.mean()
    spread = float(mid @ mid)
    rate = mid @ normals / spread
    left = normals - normals.mean(axis=0) - np.outer(mid, rate)
    off = math.sqrt(float((left**2).sum()) / (len(s) - 2) / spread)
    place = 0.5 * (contacts[0].mean(axis=0) + contacts[1].mean(axis=0))
    seen = float(np.linalg.norm(rate)) > SEEN * off
    return NormalAlongLine(
        place, direction, np.asarray(rate if seen else np.zeros(3)), 0.5 * float(s.max() - s.min())
    )
