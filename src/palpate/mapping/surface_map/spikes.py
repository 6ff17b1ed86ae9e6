"""Contacts, single or a few in a row, far off the surface that their neighbours along the path agree on.

A mean over a stretch of path believes every contact, and a contact a stretch away from its neighbours even makes a
stretch of its own. So contacts are compared, before they are averaged, with two neighbours on either side, each
taken as a piece of plane. Edges and steps pass: there, neighbours on one side agree with the contact.

Contacts that are off together agree with one another, but the path jumps where they begin and where they end: all
of them between two jumps are compared with the neighbours of the whole run.
"""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from palpate.errors import FloatArray
from palpate.estimation import Assumption, BrokenAssumption
from palpate.mapping.surface_map.stretches import PathContacts

BoolArray = npt.NDArray[np.bool_]
IndexArray = npt.NDArray[np.intp]

NEIGHBOURS = (-2, -1, 1, 2)
"""Along the path: with fewer a pair of outliers would hide one another."""

AGREE = 0.75
"""Share of the neighbours that must have the contact on the same side of the surface, far off it."""

FAR = 3.0
"""In standard deviations of the model's noise. Noise keeps along the path, so neighbours differ by a third of it
or less (0.28 at a step of 0.04 mm and a length of 1 mm)."""

LONGEST_RUN = 10
"""Contacts that may be off together. A tip rolls over what is as narrow, without a jump."""

NAMED = 3
"""Outliers whose places are written out."""


def spikes(contacts: PathContacts, noise: float, longest_step: float, longest_pause: float) -> BoolArray:
    """Return which contacts are far off what their neighbours say, shape (n,).

    Args:
        contacts: In path order.
        noise: Standard deviation of positions of a contact with noise 1 [m].
        longest_step: Neighbours farther along the surface say nothing [m].
        longest_pause: Nor do those felt longer before or after [s].
    """
    limit = FAR * noise * contacts.noise

    def far(each: IndexArray, neighbours: Sequence[IndexArray], least: int, within: float) -> BoolArray:
        """Return which of `each` are far off at least so many `neighbours`, one of each array."""
        above, below, asked = np.zeros(len(each)), np.zeros(len(each)), np.zeros(len(each))
        for other in neighbours:
            near, height = _height(contacts, each, other, within, longest_pause)
            asked += near
            above += near & (height > limit[each])
            below += near & (height < -limit[each])
        return np.asarray((asked >= least) & (np.maximum(above, below) >= AGREE * asked))

    index = np.arange(len(contacts))
    found = far(index, [index + offset for offset in NEIGHBOURS], 2, longest_step)
    jumps = index[1:][far(index[1:], [index[:-1]], 1, longest_step)]
    for further in range(1, LONGEST_RUN):  # singles are found already
        begin, end = jumps[:-further], jumps[further:]
        short = (end - begin >= 2) & (end - begin <= LONGEST_RUN)
        begin, end = begin[short], end[short]
        length = end - begin
        starts = np.cumsum(length) - length
        run = np.arange(length.sum()) + np.repeat(begin - starts, length)
        around = [np.repeat(each, length) for each in (begin - 2, begin - 1, end, end + 1)]
        off = far(run, around, 3, 2.0 * longest_step)  # some on either side: else it may be a step
        if len(run):
            found[run[np.repeat(np.logical_and.reduceat(off, starts), length)]] = True
    return found


def _height(
    contacts: PathContacts, each: IndexArray, other: IndexArray, within: float, longest_pause: float
) -> tuple[BoolArray, FloatArray]:
    """Return whether contacts are near others, and how far above the planes of these they are [m]."""
    exists = (other >= 0) & (other < len(contacts))
    other = np.where(exists, other, each)
    apart = contacts.position[each] - contacts.position[other]
    height = (apart * contacts.normal[other]).sum(axis=1)
    aside = np.sqrt(np.maximum((apart * apart).sum(axis=1) - height * height, 0.0))
    near = exists & (aside <= within) & (np.abs(contacts.time[each] - contacts.time[other]) <= longest_pause)
    return near, height


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
