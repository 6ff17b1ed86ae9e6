"""Single contacts far off the surface that their neighbours along the path agree on.

A mean over a stretch of path believes every contact, and a contact a stretch away from its neighbours even makes a
stretch of its own. So contacts are compared, before they are averaged, with two neighbours on either side, each
taken as a piece of plane. Edges and steps pass: there, neighbours on one side agree with the contact.
"""

import numpy as np
import numpy.typing as npt

from palpate.errors import FloatArray
from palpate.estimation import Assumption, BrokenAssumption
from palpate.mapping.surface_map.stretches import PathContacts

NEIGHBOURS = (-2, -1, 1, 2)
"""Along the path: with fewer a pair of outliers would hide one another."""

AGREE = 0.75
"""Share of the neighbours that must have the contact on the same side of the surface, far off it."""

FAR = 3.0
"""In standard deviations of the model's noise. Noise keeps along the path, so neighbours differ by a third of it
or less (0.28 at a step of 0.04 mm and a length of 1 mm)."""

NAMED = 3
"""Outliers whose places are written out."""


def spikes(
    contacts: PathContacts, noise: float, longest_step: float, longest_pause: float
) -> npt.NDArray[np.bool_]:
    """Return which contacts are far off what their neighbours say, shape (n,).

    Args:
        contacts: In path order.
        noise: Standard deviation of positions of a contact with noise 1 [m].
        longest_step: Neighbours farther along the surface say nothing [m].
        longest_pause: Nor do those felt longer before or after [s].
    """
    n = len(contacts)
    above, below, asked = np.zeros(n), np.zeros(n), np.zeros(n)
    limit = FAR * noise * contacts.noise
    for offset in NEIGHBOURS:
        if abs(offset) >= n:
            continue
        i = slice(-offset, n) if offset < 0 else slice(0, n - offset)
        j = slice(0, n + offset) if offset < 0 else slice(offset, n)
        apart = contacts.position[i] - contacts.position[j]
        height = (apart * contacts.normal[j]).sum(axis=1)
        aside = np.sqrt(np.maximum((apart * apart).sum(axis=1) - height * height, 0.0))
        near = (aside <= longest_step) & (np.abs(contacts.time[i] - contacts.time[j]) <= longest_pause)
        asked[i] += near
        above[i] += near & (height > limit[i])
        below[i] += near & (height < -limit[i])
    return np.asarray((asked >= 2) & (np.maximum(above, below) >= AGREE * asked))


def left_out(outliers: FloatArray, felt: int) -> tuple[BrokenAssumption, ...]:
    """Return that there were outliers, if so: how many of the contacts `felt`, and where, shape (k, 3) [m]."""
    if not len(outliers):
        return ()
    places = ", ".join("({:.1f}, {:.1f}, {:.1f})".format(*(1e3 * each)) for each in outliers[:NAMED])
    more = ", ..." if len(outliers) > NAMED else ""
    broken = BrokenAssumption(
        Assumption.NO_OUTLIERS,
        f"{len(outliers)} of {felt} contacts are far off their neighbours along the path, at {places}{more} mm",
        "the map is made of the others; look at the sensor's signal there",
    )
    return (broken,)
