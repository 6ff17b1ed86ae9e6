"""Which shape it is: the simplest that explains the contacts, or none of them."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from palpate.errors import InvalidValueError
from palpate.mapping.cloud import TouchCloud
from palpate.mapping.primitives.fit import FitStatus, PrimitiveFit, fit_primitive
from palpate.mapping.primitives.shape import PrimitiveKind, PrimitiveShape
from palpate.mapping.primitives.structure import Structure, residual_structure

MIN_POINTS = 20
"""Contacts below which no choice is made: twice the unknowns of the largest shape."""

ROUGHEST = 0.03
"""Errors of distances over the extent of the points above which a shape describes nothing."""

ROUGHEST_TILT = math.radians(4.0)
"""Errors of normals above which a shape describes nothing: eight times those of a usual sensor."""

_USABLE = (FitStatus.OK, FitStatus.WEAK, FitStatus.UNDETERMINED)


@dataclass(frozen=True, slots=True, eq=False)
class PrimitiveChoice:
    """Which shape explains the contacts.

    What contacts can tell apart is limited. A box touched on one face is a plane. A shallow cap is a plane while
    it rises by no more than the noise; then a sphere or cylinder, whichever needs fewer unknowns; and a cap of
    anything smooth is an ellipsoid as long as only its two curvatures show. `runner_up` and `margin` tell how
    clear it was.

    Attributes:
        kind: The shape, or None: none of them.
        fits: Every fit that was made, by kind.
        criterion: By kind: -2 log likelihood + unknowns x log(independent data); least is best, infinite for a fit
            that is not usable.
        margin: Criterion of the runner-up less that of the best.
        structure: Of the best fit's residuals.
        best_kind: The shape with the least criterion, also where it was refused.
    """

    kind: PrimitiveKind | None
    fits: Mapping[PrimitiveKind, PrimitiveFit[PrimitiveShape]]
    criterion: Mapping[PrimitiveKind, float]
    margin: float
    structure: Structure
    best_kind: PrimitiveKind

    @property
    def fit(self) -> PrimitiveFit[PrimitiveShape] | None:
        """The fit of the chosen shape; None if it is none of them."""
        return None if self.kind is None else self.fits[self.kind]

    @property
    def runner_up(self) -> PrimitiveKind:
        """The shape with the second criterion."""
        return sorted(self.criterion, key=self.criterion.__getitem__)[1]


def choose_primitive(cloud: TouchCloud, *, correlation_points: float = 1.0) -> PrimitiveChoice:
    """Fit plane, sphere, cylinder, ellipsoid and box, and say which of them it is, if any.

    The size of the errors is not assumed: each shape is judged at the most likely size of its own residuals
    (n log(chi^2 / n)), with a penalty for every unknown (Schwarz, "Estimating the dimension of a model", 1978).
    The best is refused, and the result is none of them, if its residuals are not noise: if they are alike at
    neighbours, or too large to speak of a shape.

    Args:
        cloud: What was felt, in the order it was felt; a few hundred contacts do.
        correlation_points: Over how many neighbouring points errors are alike, as in `fit_sphere`.

    Raises:
        InvalidValueError: Fewer than `MIN_POINTS` contacts, all in one place, or `correlation_points` below 1.
    """
    if len(cloud) < MIN_POINTS:
        raise InvalidValueError(
            f"{len(cloud)} contacts cannot tell shapes apart: give {MIN_POINTS} or more, or fit one shape"
        )
    fits = {kind: fit_primitive(cloud, kind, correlation_points=correlation_points) for kind in PrimitiveKind}
    criterion = {kind: _criterion(fit, correlation_points) for kind, fit in fits.items()}
    best, second = sorted(criterion, key=criterion.__getitem__)[:2]
    fit = fits[best]
    structure = residual_structure(cloud.position, fit.distance, fit.tilt, correlation_points)
    extent = 2.0 * float(np.linalg.norm(cloud.position - cloud.position.mean(axis=0), axis=1).max())
    too_rough = fit.position_sd > ROUGHEST * extent or fit.normal_sd > ROUGHEST_TILT
    refused = too_rough or structure.is_shape
    return PrimitiveChoice(
        kind=None if refused else best,
        fits=MappingProxyType(fits),
        criterion=MappingProxyType(criterion),
        margin=criterion[second] - criterion[best],
        structure=structure,
        best_kind=best,
    )


def _criterion(fit: PrimitiveFit[PrimitiveShape], correlation_points: float) -> float:
    if fit.status not in _USABLE:
        return float("inf")
    data = max(3.0 * fit.point_count / correlation_points, math.e)
    return -2.0 * fit.log_likelihood / correlation_points + fit.unknowns * math.log(data)
