"""Which geometric primitive an object is, within the error budget of the finger."""

import math
from dataclasses import dataclass, field

import numpy as np

from palpate.errors import FloatArray, InvalidValueError
from palpate.experiments.explore.map_budget import MapBudget
from palpate.mapping import (
    FitStatus,
    PrimitiveChoice,
    PrimitiveFit,
    PrimitiveKind,
    SurfaceModel,
    TouchCloud,
    choose_primitive,
)
from palpate.mapping.primitives.shape import PrimitiveShape

DEVIATIONS = 1.96
"""Standard deviations that hold 95 %."""

NOISY = 2.0
"""A shape may miss the contacts by so many standard deviations of their noise, root mean square: it is known to no
better than a factor of two (see `palpate.mapping.surface_map.learn`)."""

_NO_SHAPE = (FitStatus.NO_SUCH_SHAPE, FitStatus.AT_LIMIT)
"""A fit that has not converged counts: along a valley that is flat within a micrometre nothing converges."""


@dataclass(frozen=True, slots=True, eq=False)
class NamedShape:
    """Which shape the contacts have.

    Statistics alone (`choice`) take every error that neighbours share for a shape that was missed, also if
    the sensor's calibration explains it, and an artefact of a tenth of a micrometre for an ellipsoid's third axis.
    So a finger's budget decides: shapes within it cannot be distinguished, and the simplest of them is chosen.

    Attributes:
        kind: The simplest shape that misses the contacts by no more than the limits; None: none of these.
        choice: Every fit, and the choice by statistics alone.
        limit: Largest root mean square distance of the contacts [m].
        limit_tilt: Likewise of their normals [rad].
        common: What may be off in every length besides [m]: the budget of the map.
    """

    kind: PrimitiveKind | None
    choice: PrimitiveChoice = field(repr=False)  # every contact of every fit: a screen full
    limit: float
    limit_tilt: float
    common: float

    @property
    def fit(self) -> PrimitiveFit[PrimitiveShape] | None:
        """The fit of that shape."""
        return None if self.kind is None else self.choice.fits[self.kind]

    @property
    def sizes_band(self) -> FloatArray:
        """Half-widths that hold each size with 95 % [m]; empty without a shape, or for a plane."""
        return np.zeros(0) if self.fit is None else self._band(self.fit.sizes_sd)

    @property
    def center_band(self) -> FloatArray:
        """Likewise of the center along each axis of the base frame, shape (3,) [m]; NaN without a shape."""
        return np.full(3, np.nan) if self.fit is None else self._band(self.fit.center_sd)

    def _band(self, sd: FloatArray) -> FloatArray:
        """Infinite where the fit has not converged: its deviations are those of some place in a valley."""
        if self.fit is not None and self.fit.status is FitStatus.NOT_CONVERGED:
            return np.full(len(sd), np.inf)
        return DEVIATIONS * sd + self.common

    def is_within(self, kind: PrimitiveKind) -> bool:
        """Whether the contacts may be of such a shape."""
        fit = self.choice.fits[kind]
        return self.is_near(kind) and fit.normal_sd <= self.limit_tilt

    def is_near(self, kind: PrimitiveKind) -> bool:
        """Whether the points may be of such a shape, whatever their normals."""
        fit = self.choice.fits[kind]
        return fit.status not in _NO_SHAPE and fit.position_sd <= self.limit


def named_shape(
    cloud: TouchCloud, apart: float, contacts_per_row: float, budget: MapBudget, model: SurfaceModel
) -> NamedShape | None:
    """Return which shape contacts have, or None where they are too few, or all in one place.

    Args:
        cloud: What was felt, in the order it was felt.
        apart: Of a few hundred contacts that stand for all [m].
        contacts_per_row: They share one error: each row counts as one observation.
        budget: What all may be off.
        model: Noise of contacts, as learned by a map.
    """
    try:
        choice = choose_primitive(cloud.thinned(apart), correlation_points=max(1.0, contacts_per_row))
    except InvalidValueError:
        return None
    limit = math.hypot(budget.total, NOISY * model.noise)
    # the map's is of means over stretches; here each contact counts by itself
    tilt = math.hypot(budget.tilt, NOISY * max(model.tilt, white_tilt(cloud)))
    found = NamedShape(None, choice, limit, tilt, budget.total)
    simplest = sorted(choice.fits, key=lambda kind: choice.fits[kind].unknowns)
    kind = next((each for each in simplest if found.is_within(each)), None)
    return NamedShape(kind, choice, limit, found.limit_tilt, found.common)


def white_tilt(cloud: TouchCloud) -> float:
    """Return the noise of single normals [rad]: by what successive ones differ, the object's shape aside.

    The median of |n - n'|^2 is 2 ln 2 times twice the variance of either tilt.
    """
    steps = np.sum(np.diff(cloud.normal, axis=0) ** 2, axis=1)
    return math.sqrt(float(np.median(steps)) / (4.0 * math.log(2.0))) if len(steps) else 0.0
