"""Tables on an explored map: how well it is known, and which shape it is."""

import math

import numpy as np

from palpate.experiments.explored_map import ExploredMap
from palpate.experiments.named_shape import NamedShape
from palpate.mapping import FitStatus, PrimitiveFit, PrimitiveKind
from palpate.mapping.primitives.shape import TURNS, PrimitiveShape
from palpate.reporting import MapReport, ShapeReport

MILLI = 1e3

Row = tuple[str, str, str, str]
"""Name, value, unit, note."""


def map_report(found: ExploredMap) -> MapReport:
    """Return what a report says of a map."""
    return MapReport(found.mesh, map_rows(found), found.error, found.missed, (found.friction,))


def map_rows(found: ExploredMap) -> tuple[Row, ...]:
    """Return how well a map is known."""
    budget, mesh, model = found.budget, found.mesh, found.surface.model
    rows: list[Row] = []
    if len(mesh.vertices):
        rows = [
            ("error against the true surface, RMS", _mm(found.rms), "mm", f"{len(mesh.vertices)} vertices"),
            ("largest error", _mm(float(np.abs(found.error).max())), "mm", ""),
            (
                "95 % band, median",
                f"±{_mm(float(np.median(mesh.band())))}",
                "mm",
                "of random errors and of the budget",
            ),
            ("true errors inside it", f"{100.0 * found.covered:.1f}", "%", "95 is promised"),
            ("standard deviation, median", _mm(float(np.median(mesh.sd))), "mm", "of random errors alone"),
        ]
    rows += [
        (
            "observed",
            f"{100.0 * found.observed_share:.1f}",
            "%",
            f"of {1e6 * found.reachable.area.sum():.0f} mm² that the tip could feel on its way",
        ),
        ("may be off everywhere", _mm(budget.total), "mm", "the budget, the sum of what follows"),
        ("- calibration of the sensor", _mm(budget.calibration), "mm", _calibration_note(budget.calibration)),
        ("- noise", _mm(budget.noise), "mm", "contacts that are off sideways are off outwards"),
        ("- changing force", _mm(budget.compression), "mm", "tip and object do not give way at once"),
        (
            "noise of contacts",
            _mm(model.noise),
            "mm",
            f"learned; it keeps over {MILLI * model.noise_length:.2g} mm",
        ),
        ("noise of normals", f"{math.degrees(model.tilt):.2g}", "degrees", "learned"),
        ("grid of the mesh", f"{MILLI * mesh.voxel:.3g}", "mm", "tip size and stiffness are taken as known"),
    ]
    return tuple(rows)


def shape_report(shape: NamedShape) -> ShapeReport:
    """Return what a report says of the shape."""
    return ShapeReport(shape_sentence(shape), shape_rows(shape), candidate_rows(shape))


def shape_name(shape: NamedShape) -> str:
    """Return the shape in a word or three."""
    return "none of these" if shape.kind is None else shape.kind.value


def shape_sentence(shape: NamedShape) -> str:
    """Return the answer as a sentence."""
    limits = f"{_mm(shape.limit)} mm and {math.degrees(shape.limit_tilt):.2g} degrees"
    if shape.fit is None:
        return f"None of these shapes comes within {limits} (RMS) of what was felt."
    others = [kind.value for kind in shape.choice.fits if kind is not shape.kind and shape.is_within(kind)]
    also = f" More unknowns would do, too, and touch cannot tell: {', '.join(others)}." if others else ""
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
    if fit.status is not FitStatus.OK:
        rows.append(("known", "weakly", "", f"too little of it was felt ({fit.status.name})"))
    return tuple(rows)


def candidate_rows(shape: NamedShape) -> tuple[Row, ...]:
    """Return each shape with how far it misses what was felt."""
    return tuple(_candidate(shape, kind, fit) for kind, fit in shape.choice.fits.items())


def _candidate(shape: NamedShape, kind: PrimitiveKind, fit: PrimitiveFit[PrimitiveShape]) -> Row:
    if fit.status is FitStatus.NO_SUCH_SHAPE:
        return (kind.value, "-", "", "not seen: no two faces were felt")
    tilt = f"normals miss by {math.degrees(fit.normal_sd):.2g} degrees"
    if kind is shape.kind:
        verdict = "chosen"
    elif shape.is_within(kind):
        verdict = "possible, but not the simplest"
    elif fit.status in (FitStatus.AT_LIMIT, FitStatus.NOT_CONVERGED):
        verdict = "no good fit"
    else:
        verdict = "too far off"
    return (kind.value, _mm(fit.position_sd), "mm", f"{verdict}; {tilt}")


def _plus_minus(band: float) -> str:
    return f"± {_mm(band)} mm" if math.isfinite(band) else "not determined"


def _calibration_note(calibration: float) -> str:
    return "1 % of full load per axis, and its zero" if calibration else "taken for perfect but for noise"


def _mm(length: float) -> str:
    """A length [m] in mm, to a micrometre if it is large, to a hundredth of one if it is small."""
    value = MILLI * length
    return f"{value:.3f}" if abs(value) >= 1.0 else f"{value:.5f}" if abs(value) < 0.01 else f"{value:.3g}"
