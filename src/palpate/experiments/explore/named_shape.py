"""Which geometric primitive an object is, within the error budget of the finger."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from palpate.errors import FloatArray, InvalidValueError
from palpate.estimation import HELD, Assumption, BrokenAssumption, Verdict
from palpate.experiments.explore.error_budget import MapBudget
from palpate.mapping import (
    PrimitiveChoice,
    PrimitiveFit,
    PrimitiveKind,
    SurfaceModel,
    TouchCloud,
    choose_primitive,
)
from palpate.mapping.primitives.choose import CLEAR, alternatives, unclear
from palpate.mapping.primitives.shape import PrimitiveShape

_DEVIATIONS = 1.96
"""Standard deviations that hold 95 %."""

_MIN_BUDGET = 1e-9
"""Smallest error budget [m]."""

_OF_RESIDUALS = frozenset(
    {
        Assumption.WHITE_IN_TIME,
        Assumption.WHITE_IN_PLACE,
        Assumption.WHITE_IN_DIRECTION,
        Assumption.CONSISTENT,
        Assumption.NO_OUTLIERS,
    }
)
"""Assumptions that may break where residuals are within the budget, which every band includes."""

_MAX_NOISE_RATIO = 2.0
"""Largest RMS distance of a shape from the contacts in standard deviations of their noise. The noise is known to a
factor of two (see `palpate.mapping.surface_map.learn`)."""


@dataclass(frozen=True, slots=True, eq=False)
class NamedShape:
    """Shape of the contacts.

    Statistics alone (`choice`) take every error that neighbours share for another shape, even an error of the
    sensor's calibration. An artefact of a tenth of a micrometre would become an ellipsoid's third axis.
    So the finger's error budget decides: shapes within it cannot be distinguished. The simplest of them is chosen
    if it is a special case of the others; else the shape is unclear.

    Attributes:
        kind: Kind of the shape; None if no kind fits, or if it is unclear.
        possible: Possible kinds, the simplest first.
        choice: Every fit, and the choice by statistics alone.
        limit: Largest root mean square distance of the contacts [m].
        limit_tilt: Largest root mean square tilt of their normals [rad].
        budget: Systematic errors of the map.
        verdict: Whether shape and sizes can be used.
    """

    kind: PrimitiveKind | None
    possible: tuple[PrimitiveKind, ...]
    choice: PrimitiveChoice = field(repr=False)  # every contact of every fit: a screen full
    limit: float
    limit_tilt: float
    budget: MapBudget = field(repr=False)
    verdict: Verdict = HELD

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
        """Half-widths that hold the center with 95 % along each base axis, shape (3,) [m]; NaN without a shape."""
        return np.full(3, np.nan) if self.fit is None else self._band(self.fit.center_sd)

    def _band(self, sd: FloatArray) -> FloatArray:
        """Infinite where the fit has not converged: its deviations are those of some place in a valley."""
        if self.fit is not None and self.fit.verdict.breaks(Assumption.CONVERGED):
            return np.full(len(sd), np.inf)
        return _DEVIATIONS * sd + self.budget.felt


def named_shape(
    cloud: TouchCloud,
    apart: float,
    contacts_per_row: float,
    budget: MapBudget,
    model: SurfaceModel,
    *,
    offset_sd: float = 0.0,
) -> NamedShape | None:
    """Return the shape of contacts; None if they are too few, or all in one place.

    Args:
        cloud: Contacts, in the order of the scan.
        apart: Distance between the few hundred contacts that are fitted [m].
        contacts_per_row: Number of contacts that share one error: each row counts as one observation.
        budget: Systematic errors of the map.
        model: Noise of contacts, as learned by a map.
        offset_sd: Standard deviation of a common offset along the normals [m], as by the size of the tip.
    """
    try:
        choice = choose_primitive(
            cloud.thinned(apart), correlation_points=max(1.0, contacts_per_row), offset_sd=offset_sd
        )
    except InvalidValueError:
        return None
    limit = math.hypot(budget.felt, _MAX_NOISE_RATIO * model.noise)
    # the map's is of means over stretches; here each contact counts by itself
    limit_tilt = math.hypot(budget.tilt, _MAX_NOISE_RATIO * max(model.tilt, white_tilt(cloud)))
    simplest = sorted(choice.fits, key=lambda kind: choice.fits[kind].unknowns)
    # a fit that has not converged counts: along a valley that is flat within a micrometre nothing converges
    near = tuple(kind for kind in simplest if choice.fits[kind].exists and choice.fits[kind].position_sd <= limit)
    within = [kind for kind in near if choice.fits[kind].normal_sd <= limit_tilt]
    if not within:
        return NamedShape(None, near, choice, limit, limit_tilt, budget, Verdict(tuple(_leaning(near))))
    first = within[0]
    worse = {kind: _excess(choice.fits[kind], choice.fits[first], budget) for kind in within}
    likely = {kind: choice.criterion[kind] for kind in within}
    others = {*alternatives(first, worse, 1.0), *alternatives(first, likely, CLEAR)}
    possible = (first, *(kind for kind in within if kind in others))
    if others:
        return NamedShape(None, possible, choice, limit, limit_tilt, budget, Verdict(tuple(unclear(possible))))
    fit = choice.fits[first]
    covered = fit.position_sd <= budget.felt and fit.normal_sd <= budget.tilt
    broken = (each for each in fit.verdict.broken if not (covered and each.assumption in _OF_RESIDUALS))
    return NamedShape(first, possible, choice, limit, limit_tilt, budget, Verdict(tuple(broken)))


def _excess(fit: PrimitiveFit[PrimitiveShape], over: PrimitiveFit[PrimitiveShape], budget: MapBudget) -> float:
    """Return the misfit of a fit beyond that of another, over the budget."""
    off = math.sqrt(max(fit.position_sd**2 - over.position_sd**2, 0.0))
    turned = math.sqrt(max(fit.normal_sd**2 - over.normal_sd**2, 0.0))
    return max(off / max(budget.felt, _MIN_BUDGET), turned / budget.tilt)


def _leaning(near: tuple[PrimitiveKind, ...]) -> Iterator[BrokenAssumption]:
    if near:
        found = f"points are those of {' or '.join(kind.value for kind in near)}, normals are not"
        remedy = "check the sensor's calibration, or feel more of the object"
        yield BrokenAssumption(Assumption.CONSISTENT, found, remedy)


def white_tilt(cloud: TouchCloud) -> float:
    """Return the noise of single normals [rad]: by what successive ones differ, the object's shape aside.

    The median of |n - n'|^2 is 2 ln 2 times twice the variance of either tilt.
    """
    steps = np.sum(np.diff(cloud.normal, axis=0) ** 2, axis=1)
    return math.sqrt(float(np.median(steps)) / (4.0 * math.log(2.0))) if len(steps) else 0.0
