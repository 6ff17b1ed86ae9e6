"""Which shape it is: the simplest that explains the contacts, or none of them."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from palpate.errors import InvalidValueError
from palpate.estimation import Assumption, BrokenAssumption, Verdict
from palpate.mapping.cloud import TouchCloud
from palpate.mapping.primitives.fit import TIP_SIZE_SD, PrimitiveFit, fit_primitive
from palpate.mapping.primitives.shape import PrimitiveKind, PrimitiveShape
from palpate.mapping.primitives.structure import Structure, residual_structure

MIN_POINTS = 20
"""Contacts below which no choice is made: twice the unknowns of the largest shape."""

ROUGHEST = 0.03
"""Errors of distances over the extent of the points above which a shape describes nothing."""

ROUGHEST_TILT = math.radians(4.0)
"""Errors of normals above which a shape describes nothing: eight times those of a usual sensor."""

CLEAR = 10.0
"""Least difference of the criterion that tells two shapes apart: one is then 150 times as likely (Kass and
Raftery, "Bayes factors", 1995)."""

SPECIAL_CASES: Mapping[PrimitiveKind, frozenset[PrimitiveKind]] = {
    PrimitiveKind.PLANE: frozenset(PrimitiveKind),
    PrimitiveKind.SPHERE: frozenset({PrimitiveKind.ELLIPSOID, PrimitiveKind.BOX, PrimitiveKind.TORUS}),
    PrimitiveKind.CYLINDER: frozenset({PrimitiveKind.ELLIPSOID, PrimitiveKind.BOX, PrimitiveKind.TORUS}),
}
"""Each shape with those that it is a special case of, so that they fit as well wherever it does: a ball is an
ellipsoid, a torus without a hole, and a box that is all rounding."""


@dataclass(frozen=True, slots=True, eq=False)
class PrimitiveChoice:
    """Which shape explains the contacts.

    What contacts can tell apart is limited. A box touched on one face is a plane. A shallow cap is a plane while
    it rises by no more than the noise; then a sphere or cylinder, whichever needs fewer unknowns; and a cap of
    anything smooth is an ellipsoid as long as only its two curvatures show. `margin` tells how clear it was;
    the verdict says where two shapes that are no special cases of each other are about as likely.

    Attributes:
        kind: The shape, or None: none of them.
        fits: Every fit that was made, by kind.
        criterion: By kind: -2 log likelihood + unknowns x log(independent data); least is best, infinite for a fit
            that is not usable.
        margin: Criterion of the runner-up less that of the best.
        structure: Of the best fit's residuals.
        verdict: Whether shape and sizes can be used: that of its fit, and whether no other shape explains the
            contacts.
    """

    kind: PrimitiveKind | None
    fits: Mapping[PrimitiveKind, PrimitiveFit[PrimitiveShape]]
    criterion: Mapping[PrimitiveKind, float]
    margin: float
    structure: Structure
    verdict: Verdict

    @property
    def fit(self) -> PrimitiveFit[PrimitiveShape] | None:
        """The fit of the chosen shape; None if it is none of them."""
        return None if self.kind is None else self.fits[self.kind]


def choose_primitive(
    cloud: TouchCloud, *, correlation_points: float = 1.0, offset_sd: float = TIP_SIZE_SD
) -> PrimitiveChoice:
    """Fit plane, sphere, cylinder, ellipsoid, box and torus, and report which of them it is, if any.

    The size of the errors is not assumed: each shape is judged at the most likely size of its own residuals
    (n log(chi^2 / n)), with a penalty for every unknown (Schwarz, "Estimating the dimension of a model", 1978).
    The best is refused, and the result is none of them, if its residuals are not noise: if they are alike at
    neighbours, or too large to speak of a shape.

    Args:
        cloud: What was felt, in the order it was felt; a few hundred contacts do.
        correlation_points: Over how many neighbouring points errors are alike, as in `fit_primitive`.
        offset_sd: By how much all points may be off along their normals at once [m].

    Raises:
        InvalidValueError: Fewer than `MIN_POINTS` contacts, all in one place, or `correlation_points` below 1.
    """
    if len(cloud) < MIN_POINTS:
        raise InvalidValueError(
            f"{len(cloud)} contacts cannot tell shapes apart: give {MIN_POINTS} or more, or fit one shape"
        )
    fits = {
        kind: fit_primitive(cloud, kind, correlation_points=correlation_points, offset_sd=offset_sd)
        for kind in PrimitiveKind
    }
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
        verdict=Verdict(
            (
                *_misfit(structure, too_rough),
                *unclear((best, *alternatives(best, criterion, CLEAR))),
                *fit.verdict.broken,
            )
        ),
    )


def alternatives(
    kind: PrimitiveKind, worse: Mapping[PrimitiveKind, float], limit: float
) -> tuple[PrimitiveKind, ...]:
    """Return which other shapes the contacts may have: those of which the first is no special case.

    Args:
        kind: The shape.
        worse: How badly each explains the contacts.
        limit: A larger difference tells shapes apart.
    """
    known = {kind, *SPECIAL_CASES.get(kind, frozenset())}
    return tuple(other for other in worse if other not in known and worse[other] - worse[kind] <= limit)


def unclear(kinds: tuple[PrimitiveKind, ...]) -> Iterator[BrokenAssumption]:
    """Return what to say where contacts may have several shapes; nothing of one."""
    if len(kinds) > 1:
        names = " or ".join(kind.value for kind in kinds)
        yield BrokenAssumption(
            Assumption.UNIQUE, f"it may be {names}", "feel more of the object, where they differ"
        )


def _misfit(structure: Structure, too_rough: bool) -> Iterator[BrokenAssumption]:
    if structure.is_shape:
        share = max(structure.of_distance, structure.of_tilt)
        yield BrokenAssumption(
            Assumption.WHITE_IN_PLACE,
            f"neighbours share {100.0 * share:.0f} % of their residuals, at most {100.0 * structure.limit:.0f} %",
            "it is none of these shapes",
        )
    if too_rough:
        yield BrokenAssumption(
            Assumption.NOISE_LEVEL, "residuals are too large to speak of a shape", "it is none of these shapes"
        )


def _criterion(fit: PrimitiveFit[PrimitiveShape], correlation_points: float) -> float:
    if not fit.exists or fit.verdict.breaks(Assumption.CONVERGED):
        return float("inf")
    data = max(3.0 * fit.point_count / correlation_points, math.e)
    return -2.0 * fit.log_likelihood / correlation_points + fit.unknowns * math.log(data)
