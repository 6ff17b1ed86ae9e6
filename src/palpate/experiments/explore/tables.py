"""Tables of a report on an explored map: its error budget, its layers and its shape."""

import math

import numpy as np

from palpate.estimation import Assumption
from palpate.experiments.explore.explored_map import ExploredMap
from palpate.experiments.explore.named_shape import NamedShape
from palpate.experiments.explore.surface_figure import LAYER_LOOKS, MILLI
from palpate.mapping import PrimitiveFit, PrimitiveKind
from palpate.mapping.primitives.shape import TURNS, PrimitiveShape

_MIN_SHOWN_OFFSET = 1e-8
"""Least offset by contradicted assumptions that is shown [m]."""

_NEGLIGIBLE_DEVIATION = 1e-3
"""Relative standard deviation below which only its bound is shown."""

_Row = tuple[str, str, str, str]
"""Name, value, unit, note."""


def map_rows(found: ExploredMap) -> tuple[_Row, ...]:
    """Return the error budget of a map, and the noise of its contacts."""
    budget, mesh, model, claimed = found.budget, found.mesh, found.surface.model, found.claimed
    known = budget.calibration > 0.0
    rows = [
        ("may be off everywhere", _mm(budget.total), "mm", "the budget, the sum of the next rows"),
        ("- calibration of the sensor", _mm(budget.calibration), "mm",
         "1 % of full load per axis, and its zero" if known else "assumed perfect except for noise"),
        ("- noise", _mm(budget.noise), "mm", "lateral errors of contacts shift them outwards"),
        ("- changing force", _mm(budget.compression), "mm", "tip and object are compressed with a delay"),
        ("- fingertip", _mm(budget.tip), "mm",
         "of another size, place or stiffness" if budget.tip else "assumed to be as described"),
        ("noise of contacts", _mm(model.noise), "mm",
         f"learned; correlated over {MILLI * model.noise_length:.2g} mm"),
        ("noise of normals", f"{math.degrees(model.tilt):.2g}", "degrees", "learned"),
        ("grid of the mesh", f"{MILLI * mesh.voxel:.3g}", "mm", ""),
    ]  # fmt: skip
    if budget.shown >= _MIN_SHOWN_OFFSET:
        shown = ("- as the run showed", _mm(budget.shown), "mm", "the zero moved, or another stiffness was felt")
        rows.insert(5, shown)
    if claimed.any():
        sd = _mm(float(np.median(mesh.sd[claimed])))
        rows.insert(0, ("standard deviation, median", sd, "mm", "of random errors alone"))
    return tuple(rows)


def layer_rows(found: ExploredMap) -> tuple[_Row, ...]:
    """Return the median of each layer, the part of the map where it is known, and its variation."""
    rows = []
    for layer, look in LAYER_LOOKS.items():
        summary = found.layer(layer)
        if summary is None:
            continue
        middle, low, high = (f"{look.scale * each:.3g}" for each in (summary.median, summary.low, summary.high))
        deviation, bound = look.scale * summary.sd, _NEGLIGIBLE_DEVIATION * abs(float(middle))
        spread = f"{deviation:.2g}" if deviation >= bound else f"less than {_NEGLIGIBLE_DEVIATION:.1%}"
        notes = [
            f"{look.deviation} {spread}",
            f"known on {100.0 * summary.share:.0f} % of the map",
            f"{low} all over" if low == high else f"{low} to {high} over nine tenths of that",
            look.note,
        ]
        known = notes if math.isfinite(summary.sd) else notes[1:]
        rows.append((look.quantity, middle, look.unit, "; ".join(each for each in known if each)))
    return tuple(rows)


def shape_sentence(found: ExploredMap, shape: NamedShape) -> str:
    """Return the shape of a map as a sentence or two."""
    little = (
        "Too little was felt to decide which shape it is. " if found.felt_little and shape.kind is None else ""
    )
    limits = f"{_mm(shape.limit)} mm and {math.degrees(shape.limit_tilt):.2g} degrees"
    if shape.kind is None and shape.possible:
        possible, broken = " or ".join(kind.value for kind in shape.possible), shape.verdict.broken[0]
        return f"{little}It is unclear: {possible}: {broken.finding}; {broken.remedy}."
    if shape.kind is None:
        return f"{little}None of these shapes comes within {limits} (RMS) of the contacts."
    fits = shape.choice.fits
    others = [kind.value for kind in fits if kind is not shape.kind and _is_within(shape, fits[kind])]
    also = f" Shapes with more parameters fit as well: {', '.join(others)}." if others else ""
    article = "an" if shape.kind.value[0] in "aeiou" else "a"
    return (
        f"It is {article} {shape.kind.value}: the simplest shape within {limits} (RMS) of the contacts, the error "
        f"that this finger allows.{also}"
    )


def shape_rows(shape: NamedShape) -> tuple[_Row, ...]:
    """Return the numbers of the shape, each with a half-width that holds it with 95 %."""
    fit = shape.fit
    if fit is None:
        return ()
    rows = [
        (name.replace("_", " "), _mm(value), "mm", _plus_minus(band))
        for name, value, band in zip(fit.shape.SIZES, fit.shape.sizes, shape.sizes_band, strict=True)
    ]
    rows += [
        (f"center, {axis}", f"{MILLI * value:z.3f}", "mm", _plus_minus(band))
        for axis, value, band in zip("xyz", fit.shape.center.tolist(), shape.center_band.tolist(), strict=True)
    ]
    if set(TURNS) & set(fit.shape.MOTIONS):
        x, y, z = fit.shape.rotation[:, 2].tolist()
        turned = fit.turn_sd[:2][np.isfinite(fit.turn_sd[:2])]
        note = f"± {math.degrees(1.96 * float(turned.max())):.2g} degrees" if len(turned) else ""
        rows.append(("its own z axis", f"{x:z.4f}, {y:z.4f}, {z:z.4f}", "", note))
    rows += [("not to be used", "", "", str(each)) for each in shape.verdict.broken]
    return tuple(rows)


def candidate_rows(shape: NamedShape) -> tuple[_Row, ...]:
    """Return each shape with its distance from the contacts."""
    return tuple(_candidate(shape, kind, fit) for kind, fit in shape.choice.fits.items())


def _candidate(shape: NamedShape, kind: PrimitiveKind, fit: PrimitiveFit[PrimitiveShape]) -> _Row:
    if fit.verdict.breaks(Assumption.ENOUGH_DATA):
        return (kind.value, "-", "", "not seen: no two faces were felt")
    tilt = f"normals miss by {math.degrees(fit.normal_sd):.2g} degrees"
    if kind is shape.kind:
        verdict = "chosen"
    elif _is_within(shape, fit):
        verdict = "possible, but not the simplest"
    elif not fit.exists or fit.verdict.breaks(Assumption.CONVERGED):
        verdict = "no good fit"
    else:
        verdict = "too far off"
    return (kind.value, _mm(fit.position_sd), "mm", f"{verdict}; {tilt}")


def _is_within(shape: NamedShape, fit: PrimitiveFit[PrimitiveShape]) -> bool:
    return fit.exists and fit.position_sd <= shape.limit and fit.normal_sd <= shape.limit_tilt


def _plus_minus(band: float) -> str:
    return f"± {_mm(band)} mm" if math.isfinite(band) else "not determined"


def _mm(length: float) -> str:
    """Return a length [m] in mm, to a micrometre if it is large, to a hundredth of one if it is small."""
    value = MILLI * length
    return f"{value:.3f}" if abs(value) >= 1.0 else f"{value:.5f}" if abs(value) < 0.01 else f"{value:.3g}"
