"""How far the maps of several runs are apart, where they show the same region."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from palpate.errors import FloatArray
from palpate.experiments.kit.comparable import FeltMap
from palpate.mapping import Knowledge
from palpate.reporting.marks import Colouring, ColourScale
from palpate.reporting.picture import Picture, Space
from palpate.reporting.solids import Surface

SHOWN_PERCENT = 99.0
"""Colours span this share of the differences, so that a few outliers do not hide the rest."""

LEAST_SHOWN = 0.1
"""Colours span this share of both bands at least: what is less is nothing."""

LEAST_COMMON = 0.02
"""Share of the first map from which on two are of the same region: below, it is a rim that they share."""

MICRO = 1e6


@dataclass(frozen=True, slots=True, eq=False)
class MapDifference:
    """Another map less the first one, at the vertices of the first.

    Attributes:
        height: Along the normal, positive where the other lies further out; NaN where not both claim the surface,
            shape (n,) [m].
        band: Both half-widths of 95 % bands together, shape (n,) [m].
    """

    height: FloatArray
    band: FloatArray

    @classmethod
    def of(cls, first: FeltMap, other: FeltMap) -> "MapDifference":
        """Return the difference; what the other says between its own vertices is exact, not interpolated."""
        there = other.surface.query(first.mesh.vertices)
        both = there.observed & (first.mesh.knowledge == Knowledge.OBSERVED)
        return cls(np.where(both, -there.distance, np.nan), first.mesh.band() + there.band())

    @property
    def common(self) -> FloatArray:
        """The heights that are known, shape (k,) [m]."""
        return self.height[np.isfinite(self.height)]

    @property
    def words(self) -> str:
        """How large it is, and on which share of what is common both bands allow it."""
        rms = MICRO * float(np.sqrt(np.mean(self.common**2)))
        within = 100.0 * float(np.mean(np.abs(self.height) <= self.band, where=np.isfinite(self.height)))
        return f"{rms:.3g} µm RMS, {within:.0f} % within both bands"


def difference_picture(maps: Sequence[FeltMap | None], names: Sequence[str]) -> Picture | None:
    """Return every later map less the first run's; None where no two are of the same region."""
    first = maps[0]
    if first is None:
        return None
    others = zip(names[1:], maps[1:], strict=True)
    each = [(name, MapDifference.of(first, other)) for name, other in others if other is not None]
    found = [(name, one) for name, one in each if len(one.common) > LEAST_COMMON * len(one.height)]
    if not found:
        return None
    told = "; ".join(f"{name}: {one.words}" for name, one in found)
    return Picture(
        title="Difference of the maps",
        caption=f"The map of {names[0]}, coloured by how much further out the other one lies; grey where not both "
        f"know the surface. {told}. Where it is more than both 95 % bands together, one of the maps is wrong.",
        panels=tuple(
            Space((_coloured(first, one),), title=f"{name} less {names[0]}", height=400) for name, one in found
        ),
        columns=min(2, len(found)),
        wide=len(found) > 1,
    )


def _coloured(first: FeltMap, found: MapDifference) -> Surface:
    shown = float(np.percentile(np.abs(found.common), SHOWN_PERCENT))
    largest = MICRO * max(shown, LEAST_SHOWN * float(np.nanmedian(found.band)))
    height = Colouring("difference", MICRO * found.height, "µm", -largest, largest, ColourScale.ERROR)
    share = Colouring("difference over both bands", np.abs(found.height) / found.band, low=0.0, high=2.0)
    return Surface(first.mesh.vertices, first.mesh.triangles, colourings=(height, share))
