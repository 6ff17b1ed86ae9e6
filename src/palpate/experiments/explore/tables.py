"""Tables on an explored map: how well it is known, and which shape it is."""

import math

import numpy as np

from palpate.estimation import Assumption
from palpate.experiments.explore.explored_map import ExploredMap
from palpate.experiments.explore.named_shape import NamedShape
from palpate.mapping import PrimitiveFit, PrimitiveKind
from palpate.mapping.layers import VertexLayer
from palpate.mapping.primitives.shape import TURNS, PrimitiveShape
from palpate.robots.known_truth import NOT_KNOWN

MILLI, CM2 = 1e3, 1e4
"""Per metre and per square metre."""

STIFFNESS_NOTE = "the object alone: of the compression, half is taken for the tip's"

FRICTION_NOTE = "measured where it slid steadily, not near turns, landings and accelerations"

TOO_LITTLE = "too little was felt"

SHOWN = 1e-8
"""Least length that is shown in a table [m]."""

NEGLIGIBLE = 1e-3
"""Relative standard deviation below which only its bound is shown."""

Row = tuple[str, str, str, str]
"""Name, value, unit, note."""

LINE: Row = ("map", "a line", "", "the ribbon beside it is extrapolated, not claimed")
"""The only row where no surface is claimed."""


def map_rows(found: ExploredMap) -> tuple[Row, ...]:
    """Return how well a map is known."""
    budget, mesh, model = found.budget, found.mesh, found.surface.model
    rows: list[Row] = []
    claimed = found.claimed
    if found.is_line:
        rows.append(LINE)
    if claimed.any() and not found.truth_known:
        rows.append(("error against the true surface", NOT_KNOWN, "", f"{int(claimed.sum())} vertices"))
    elif claimed.any():
        rows += [
            ("error against the true surface, RMS", _mm(found.rms), "mm", f"{int(claimed.sum())} vertices"),
            ("largest error", _mm(float(np.abs(found.error[claimed]).max())), "mm", ""),
            (
                "95 % band, median",
                f"±{_mm(found.band)}",
                "mm",
                "of random errors and of the budget",
            ),
            ("true errors inside it", f"{100.0 * found.covered:.1f}", "%", "95 is promised"),
            (
                "standard deviation, median",
                _mm(float(np.median(mesh.sd[claimed]))),
                "mm",
                "of random errors alone",
            ),
        ]
    if not found.is_line and found.truth_known:
        note = f"of {CM2 * found.reachable.area.sum():.3g} cm² that the tip could feel along its path"
        rows.append(("observed", f"{100.0 * found.observed_share:.1f}", "%", note))
    rows += [
        ("may be off everywhere", _mm(budget.total), "mm", "the budget, the sum of what follows"),
        ("- calibration of the sensor", _mm(budget.calibration), "mm", _calibration_note(budget.calibration)),
        ("- noise", _mm(budget.noise), "mm", "lateral errors of contacts shift them outwards"),
        ("- changing force", _mm(budget.compression), "mm", "tip and object are compressed with a delay"),
        ("- fingertip", _mm(budget.tip), "mm", _tip_note(budget.tip)),
        *(
            [("- as the run showed", _mm(budget.shown), "mm", "the zero moved, or another stiffness was felt")]
            if budget.shown >= SHOWN
            else []
        ),
        (
            "noise of contacts",
            _mm(model.noise),
            "mm",
            f"learned; it keeps over {MILLI * model.noise_length:.2g} mm",
        ),
        ("noise of normals", f"{math.degrees(model.tilt):.2g}", "degrees", "learned"),
        ("grid of the mesh", f"{MILLI * mesh.voxel:.3g}", "mm", ""),
    ]
    return tuple(rows)


def layer_rows(found: ExploredMap) -> tuple[Row, ...]:
    """Return what else is known of the surface: each layer's median, where it is known, and how it varies."""
    curvature = {layer.name: layer for layer in found.curvature if isinstance(layer, VertexLayer)}
    layers = (
        ("friction", found.friction, 1.0, "", "scatters by", FRICTION_NOTE),
        ("stiffness of the object", found.stiffness, 1e-3, "kN/m", "±", STIFFNESS_NOTE),
        ("largest curvature", curvature.get("curvature_max"), 1.0, "1/m", "±", "convex is positive"),
        ("smallest curvature", curvature.get("curvature_min"), 1.0, "1/m", "±", ""),
        ("mean curvature of the map", curvature.get("curvature_mean"), 1.0, "1/m", "±", ""),
        ("mean curvature by normals", curvature.get("curvature_rolled"), 1.0, "1/m", "±", "from how they turned"),
    )
    return tuple(
        _layer(name, layer, scale, unit, sign, note)
        for name, layer, scale, unit, sign, note in layers
        if layer is not None and np.isfinite(layer.mean).any()
    )


def _layer(name: str, layer: VertexLayer, scale: float, unit: str, sign: str, note: str) -> Row:
    known = np.isfinite(layer.mean)
    value, sd = scale * layer.mean[known], median_sd(layer, scale)
    middle, low, high = (f"{as_known(each, sd):.3g}" for each in np.percentile(value, [50.0, 5.0, 95.0]).tolist())
    share = f"known on {100.0 * float(known.mean()):.0f} % of the map"
    over = f"{low} all over" if low == high else f"{low} to {high} over nine tenths of that"
    notes = [*_deviation(float(middle), sd, sign), share, over, *([note] if note else [])]
    return (name, middle, unit, "; ".join(notes))


def _deviation(value: float, sd: float, sign: str) -> list[str]:
    if not math.isfinite(sd):
        return []
    return [f"{sign} {sd:.2g}" if sd >= NEGLIGIBLE * abs(value) else f"{sign} less than {NEGLIGIBLE:.1%}"]


def as_known(value: float, sd: float) -> float:
    """Return a value rounded to the second digit of its deviation: 8e-6 that are known to 0.1 are 0."""
    return round(value, 1 - math.floor(math.log10(sd))) + 0.0 if 0.0 < sd < math.inf else value


def median_sd(layer: VertexLayer, scale: float) -> float:
    """Return the median standard deviation of a layer, in a unit of 1 / `scale`; NaN if there is none."""
    sd = scale * layer.sd[np.isfinite(layer.sd)]
    return float(np.median(sd)) if len(sd) else math.nan


def shape_name(shape: NamedShape, felt_little: bool = False) -> str:
    """Return the shape in a word or three; `felt_little` is `ExploredMap.felt_little`."""
    if shape.kind is not None:
        return shape.kind.value
    if shape.possible and not felt_little:
        return f"unclear: {' or '.join(kind.value for kind in shape.possible)}"
    return "unclear" if felt_little else "none of these"


def shape_sentence(shape: NamedShape, felt_little: bool = False) -> str:
    """Return the result as a sentence; `felt_little` likewise."""
    if felt_little and shape.kind is None:
        return f"Too little was felt to decide which shape it is. {shape_sentence(shape)}"
    limits = f"{_mm(shape.limit)} mm and {math.degrees(shape.limit_tilt):.2g} degrees"
    if shape.kind is None and shape.possible:
        return f"It is {shape_name(shape)}: {shape.verdict.broken[0].finding}; {shape.verdict.broken[0].remedy}."
    if shape.fit is None:
        return f"None of these shapes comes within {limits} (RMS) of what was felt."
    fits = shape.choice.fits
    others = [kind.value for kind in fits if kind is not shape.kind and _is_within(shape, fits[kind])]
    also = f" Shapes with more parameters fit as well: {', '.join(others)}." if others else ""
    article = "an" if shape_name(shape)[0] in "aeiou" else "a"
    return (
        f"It is {article} {shape_name(shape)}: the simplest shape within {limits} (RMS) of what was felt, as "
        f"much as this finger may be off.{also}"
    )


def shape_rows(shape: NamedShape) -> tuple[Row, ...]:
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


def candidate_rows(shape: NamedShape) -> tuple[Row, ...]:
    """Return each shape with how far it misses what was felt."""
    return tuple(_candidate(shape, kind, fit) for kind, fit in shape.choice.fits.items())


def _candidate(shape: NamedShape, kind: PrimitiveKind, fit: PrimitiveFit[PrimitiveShape]) -> Row:
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


def _calibration_note(calibration: float) -> str:
    return "1 % of full load per axis, and its zero" if calibration else "taken for perfect but for noise"


def _tip_note(tip: float) -> str:
    return "of another size, place or stiffness" if tip else "taken for exactly known"


def _mm(length: float) -> str:
    """A length [m] in mm, to a micrometre if it is large, to a hundredth of one if it is small."""
    value = MILLI * length
    return f"{value:.3f}" if abs(value) >= 1.0 else f"{value:.5f}" if abs(value) < 0.01 else f"{value:.3g}"
