"""Hyperparameters of noise and surface, learned from the contacts."""

import math
from collections.abc import Collection, Sequence
from dataclasses import replace
from enum import IntEnum

import numpy as np
from scipy.linalg.lapack import dpotri
from scipy.optimize import minimize

from palpate.errors import FloatArray
from palpate.estimation import Assumption, BrokenAssumption
from palpate.mapping.surface_map.covariance import process_scales
from palpate.mapping.surface_map.kernel import evidence_slopes
from palpate.mapping.surface_map.model import BENDS, PatchCurvature, SurfaceModel
from palpate.mapping.surface_map.patch import CREASE, JITTER, Factored, PatchData, likeliest_bend


def evidence_gradient(data: PatchData, model: SurfaceModel, bend: PatchCurvature) -> tuple[float, FloatArray]:
    """Return the log evidence and its derivatives by the logarithms of the model's numbers, shape (6,).

    With K the covariance of the felt heights and slopes y, and a = K^-1 y, the derivative of the log evidence by
    any number t is 1/2 tr((a a' - K^-1) dK/dt) (Rasmussen & Williams 2006, eq. 5.9). All numbers share the one
    inverse, so a gradient costs some two evaluations, where differences cost six.

    Minus infinity and zeros where the covariance is singular to rounding.
    """
    noise = data.noise(model)
    bent = model.bent(bend)
    factored = Factored.of(data, bent, noise)
    if not math.isfinite(factored.log_evidence):
        return -math.inf, np.zeros(6)
    weights = factored.weights
    inverse, _ = dpotri(factored.lower, lower=1, overwrite_c=1)
    half = 0.5 * data.extent
    slopes = evidence_slopes(
        inverse,
        weights,
        data.xy,
        *factored.apart,
        process_scales(bent, JITTER),
        noise.heights,
        noise.slopes,
        data.path,
        (*noise.of_heights, half, model.noise_length),
        (*noise.of_slopes, half, model.tilt_length),
    )
    return factored.log_evidence, 0.5 * slopes


PATCHES = 10
"""Patches that are asked, evenly over all; their evidence is pooled. Some 200 values each: 20 or 40 move the
noise of a box by 5 %, and cost twice and four times as much."""

ASKED_SCALE = 50
"""Patches that say how large residuals are: one number, so each is asked once. Some 5000 values: known to 2 %."""


class Parameter(IntEnum):
    """The numbers of a `SurfaceModel`, in its order."""

    LENGTH = 0
    CURVATURE = 1
    NOISE = 2
    NOISE_LENGTH = 3
    TILT = 4
    TILT_LENGTH = 5


SURFACE = (Parameter.LENGTH, Parameter.CURVATURE)
NOISE = (Parameter.NOISE, Parameter.NOISE_LENGTH, Parameter.TILT, Parameter.TILT_LENGTH)

PRIOR_SPREAD = np.log([4.0, 10.0, 4.0, 2.0, 4.0, 10.0])
"""How far off the starting model may well be: one standard deviation of each logarithm. How far the noise of
positions keeps is known to a factor of two (a property of finger and path), the rest hardly: normals may err anew
at every sample."""

REACH = np.log([1e3, 1e4, 1e5, 1e3, 1e5, 1e6])
"""Limits of numbers about those of the start, logarithms: so wide that the evidence is flat there, and the prior
leads back, even without any noise (rounding then counts as 3 nm of it)."""

AT_LIMIT = math.log(1.1)
"""What lies within a tenth of a limit of the search is at it."""

DOUBTFUL = 2.0
"""Noise that seems to keep for so many times the path that was believed may be facets: the search then begins once
more. Smooth shapes show 0.8 to 1.1 times the true length, facets 2.5 times and more."""

CLEARLY = 10.0
"""Log evidence by which the second search must be better. Facets show 40 to 400."""

LENGTHS = (1.0, 0.2)
"""Lengths of the surface over that of the start where searches begin: its evidence may have several peaks."""

STEPS = 40
"""Most steps of the search; it takes 10 to 25."""

TRIAL_STEPS = 2
"""Steps from each start, after which the search goes on from the best."""

FLAT = 0.5
"""The search ends where the log probability changes by less than this per deviation of the prior."""

GAIN = 3e-5
"""It ends, too, where a step gains less than this fraction of what was gained since the start, some hundreds."""

IMPOSSIBLE = 1e12
"""Stands for a loss that is not finite: the search turns back."""


def learn(data: Sequence[PatchData], start: SurfaceModel, held: Collection[Parameter] = ()) -> SurfaceModel:
    """Return the model that makes what was felt most probable, with `start` as a weak opinion.

    Maximum a posteriori over the pooled evidence of patches. Noise that keeps along a row, but not from one row to
    the next, is distinguished from surface by what neighbouring rows agree on and by the normals. It is learned
    where the surface is calm, since a finger errs alike everywhere and an edge would pass for noise; length and
    curvature of the surface then are learned from all of it.

    On facets the evidence has two peaks: heights err from row to row while normals are believed, or normals err
    alike along whole rows while heights are believed. The second halves the map's error there; which one a search
    ends in depends on where it begins.

    Args:
        data: Patches with what was felt there; `PATCHES` of them are used. Without any, `start` is returned.
        start: Where to start, and centre of a log-normal prior.
        held: Numbers known better than contacts can tell: they stay as in `start`.
    """
    noise = [each for each in NOISE if each not in held]
    surface = [each for each in SURFACE if each not in held]
    if not data:
        return start
    among = _evenly(data)
    found = _from(start, data, among, start, noise, surface)
    if not held and found.noise_length > DOUBTFUL * start.noise_length:
        other = _from(_faceted(start), data, among, start, noise, surface)
        if _evidence(among, other) > _evidence(among, found) + CLEARLY:
            found = other
    return found if held else _scaled(_evenly(data, ASKED_SCALE), found)


def at_bounds(model: SurfaceModel, start: SurfaceModel) -> tuple[BrokenAssumption, ...]:
    """Return which numbers of a model that was learned from `start` lie at their limits.

    A surface may be as flat as it likes.
    """
    off = model.logarithms - start.logarithms
    return tuple(
        BrokenAssumption(
            Assumption.WITHIN_BOUNDS,
            f"{each.name.lower()} was learned as {math.exp(off[each]):.2g} times what was believed, at most "
            f"{math.exp(REACH[each]):.3g} times or one part in as many",
            "give MapSettings a model nearer to surface and sensor, or explore more of the surface",
        )
        for each in Parameter
        if abs(off[each]) > REACH[each] - AT_LIMIT and not (each is Parameter.CURVATURE and off[each] < 0.0)
    )


def _from(
    first: SurfaceModel,
    data: Sequence[PatchData],
    among: Sequence[PatchData],
    centre: SurfaceModel,
    noise: Sequence[Parameter],
    surface: Sequence[Parameter],
) -> SurfaceModel:
    """Return what a search that begins at `first` finds, with `centre` as a weak opinion."""
    calm = [replace(first, length=first.length * each) for each in LENGTHS]
    found = _most_probable(_evenly(_calmest(data)), centre, calm, [*surface, *noise])
    # what stays now is the noise: the surface starts anew, since calm places bend less than the rest
    anew = [replace(found, length=centre.length * each, curvature=centre.curvature) for each in LENGTHS]
    return _most_probable(_evenly(_smooth(data)), anew[0], anew, surface)


def _faceted(model: SurfaceModel) -> SurfaceModel:
    """Return where to look for a surface of facets: heights that hold, normals that err alike for a whole row."""
    return replace(
        model,
        noise=0.2 * model.noise,
        noise_length=4.0 * model.noise_length,
        tilt=2.0 * model.tilt,
        tilt_length=20.0 * model.tilt_length,
    )


def _evidence(data: Sequence[PatchData], model: SurfaceModel) -> float:
    """Return the log evidence of all of `data`, each bent as suits it."""
    likeliest = (likeliest_bend(each, model, each.noise(model)) for each in data)
    return sum(bend.odds + factored.log_evidence for bend, factored in likeliest)


def _scaled(data: Sequence[PatchData], model: SurfaceModel) -> SurfaceModel:
    """Return the model with all its variances in the size that the data have.

    Means stay as they are. A median, since an edge is no reason to doubt the rest.
    """
    square = [likeliest_bend(each, model, each.noise(model))[1].mean_square for each in data]
    size = min(max(math.sqrt(float(np.median(square))), 0.5), 2.0)  # contacts without noise have no size
    return replace(model, curvature=size * model.curvature, noise=size * model.noise, tilt=size * model.tilt)


def _calmest(data: Sequence[PatchData]) -> list[PatchData]:
    """Return the quarter of well-filled patches whose normals differ least."""
    fullest = max(len(each.xy) for each in data)
    filled = [each for each in data if 2 * len(each.xy) >= fullest]
    spread = [float(each.values[len(each.xy) :].reshape(2, -1).var(axis=1).sum()) for each in filled]
    order = np.argsort(spread, kind="stable")[: max(PATCHES, len(filled) // 4)]
    return [filled[i] for i in np.sort(order)]


def _smooth(data: Sequence[PatchData]) -> Sequence[PatchData]:
    """Return patches without a crease, or all where each has one."""
    return [each for each in data if each.sharpest_turn < CREASE] or data


def _evenly(data: Sequence[PatchData], most: int = PATCHES) -> list[PatchData]:
    return [data[i] for i in np.unique(np.linspace(0, len(data) - 1, most).round().astype(int))]


def _most_probable(
    data: Sequence[PatchData],
    centre: SurfaceModel,
    starts: Sequence[SurfaceModel],
    parameters: Sequence[Parameter],
) -> SurfaceModel:
    """Go a few steps from each start, on from the best, and once more with patches bent as they turned out.

    Every other patch tells which start is the best: they differ by hundreds.
    """
    ordinary = [BENDS[0]] * len(data)
    tried = (_search(data[::2], ordinary[::2], centre, start, parameters, TRIAL_STEPS) for start in starts)
    _, best = min(tried, key=lambda end: end[0])
    _, found = _search(data, ordinary, centre, best, parameters)
    bends = [likeliest_bend(each, found, each.noise(found))[0] for each in data]
    return found if bends == ordinary else _search(data, bends, centre, found, parameters)[1]


def _search(
    data: Sequence[PatchData],
    bends: Sequence[PatchCurvature],
    centre: SurfaceModel,
    start: SurfaceModel,
    parameters: Sequence[Parameter],
    steps: int = STEPS,
) -> tuple[float, SurfaceModel]:
    """Return the least loss, minus the logarithm of the posterior, and where it is."""
    if not parameters:
        return 0.0, start
    free = np.array(parameters, dtype=np.intp)
    middle, spread = centre.logarithms[free], PRIOR_SPREAD[free]
    farthest = REACH[free] / spread

    def model_at(trial: FloatArray) -> SurfaceModel:
        moved = np.exp(middle + spread * np.clip(trial, -farthest, farthest)).tolist()
        return replace(start, **{each.name.lower(): value for each, value in zip(parameters, moved, strict=True)})

    def loss(trial: FloatArray) -> tuple[float, FloatArray]:
        model = model_at(trial)
        parts = [evidence_gradient(each, model, bend) for each, bend in zip(data, bends, strict=True)]
        evidence = sum(part[0] for part in parts)
        if not math.isfinite(evidence):
            return IMPOSSIBLE, np.zeros(len(free))
        slope = np.sum([part[1] for part in parts], axis=0)[free] * spread
        return 0.5 * float(trial @ trial) - evidence, trial - np.where(np.abs(trial) < farthest, slope, 0.0)

    first = (start.logarithms[free] - middle) / spread
    # a start far from what was felt has a loss of any size, and in other units any offset: only differences count
    offset, slope = loss(first)

    def above_first(trial: FloatArray) -> tuple[float, FloatArray]:
        if np.array_equal(trial, first):  # where the search begins
            return 0.0, slope
        value, by_trial = loss(trial)
        return value - offset, by_trial

    # limits are no bounds of the search: its first step would go all the way to them
    found = minimize(
        above_first,
        first,
        jac=True,
        method="L-BFGS-B",
        options={"maxiter": steps, "ftol": GAIN, "gtol": FLAT},
    )
    return float(found.fun) + offset, model_at(found.x)
