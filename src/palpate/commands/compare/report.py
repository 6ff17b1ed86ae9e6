"""The report on a map beside a reference mesh."""

import math
import shlex
from dataclasses import replace

import numpy as np

from palpate.commands.compare.config import CompareConfig
from palpate.errors import FloatArray
from palpate.mapping.compare import Comparison
from palpate.mapping.compare_surface import TriangleSurface
from palpate.reporting.data import Quantity
from palpate.reporting.figure import Axis, Figure, Panel, Space
from palpate.reporting.marks import Bars, Colouring, ColourScale, Rule
from palpate.reporting.report import Figures, Report, Section
from palpate.reporting.solids import Spots

MILLI, MICRO = 1e3, 1e6

SHOWN = 12_000
"""Points drawn: more cover each other."""

SHOWN_PERCENT = 99.0
"""Colours span this share of the errors, so that a few outliers do not hide the rest."""


def error_on_map(found: Comparison, signed: bool) -> Figure:
    """Return the map's points in space, coloured by their distance from the reference."""
    limit = max(float(np.percentile(np.abs(found.distance), SHOWN_PERCENT)) * MICRO, 1e-3)
    quantity = "distance" + (", + is outside the reference" if signed else "")
    low, scale = (-limit, ColourScale.ERROR) if signed else (0.0, ColourScale.HEIGHT)
    largest = MICRO * found.map_to_reference.largest
    return Figure(
        title="Where the errors are",
        caption=(
            f"The map's points, coloured by their distance from the reference; the colours span "
            f"{SHOWN_PERCENT:.0f} % of them, the largest is {largest:.3g} µm. "
            "An even colour of no distance is good."
        ),
        panels=(_in_space(found.points, Colouring(quantity, MICRO * found.distance, "µm", low, limit, scale)),),
    )


def gaps_on_reference(found: Comparison) -> Figure:
    """Return samples of the reference in space, coloured by their distance from the map."""
    distance, most = MILLI * found.reference_distance, 2.0 * MILLI * found.within
    return Figure(
        title="What was felt of the reference",
        caption=(
            f"The reference, coloured by its distance from the map: {100.0 * found.coverage:.1f} % is within "
            f"{MILLI * found.within:g} mm, half the colour scale. "
            "Dark all over is good."
        ),
        panels=(_in_space(found.reference_points, Colouring("distance from the map", distance, "mm", 0.0, most)),),
    )


def error_histogram(found: Comparison) -> Figure:
    """Return the histogram of distances."""
    error = MICRO * found.distance
    spread = found.map_to_reference
    return Figure(
        title="How large the errors are",
        caption=(
            f"Distances of {len(error)} points: root mean square {MICRO * spread.rms:.3g} µm, mean of their size "
            f"{MICRO * spread.mean:.3g} µm, 95 % are below {MICRO * spread.p95:.3g} µm. Narrow and "
            "about zero is good."
        ),
        panels=(
            Panel(
                (Bars.histogram(error), Rule(0.0)),
                Axis("distance from the reference", "µm"),
                Axis("number of points"),
            ),
        ),
    )


def _in_space(points: FloatArray, colouring: Colouring) -> Space:
    every = max(1, -(-len(points) // SHOWN))
    shown = replace(colouring, values=colouring.values[::every])
    return Space((Spots(points[::every], size=3.0, colourings=(shown,)),))


_MILLI = 1e3

WELL_COVERED = 0.95
"""Share of the reference from which on a map counts as whole."""


def quantities(found: Comparison) -> tuple[Quantity, ...]:
    """Return the metrics that matter, most important first."""
    out, back = found.map_to_reference, found.reference_to_map
    spacing = f"samples {_MILLI * found.sample_spacing:.2g} mm apart"
    metrics = [
        Quantity("map to reference, RMS", _MILLI * out.rms, "mm", f"{len(found.points)} points"),
        Quantity("map to reference, mean", _MILLI * out.mean, "mm", "of absolute distances"),
        Quantity("map to reference, 95 %", _MILLI * out.p95, "mm"),
        Quantity("map to reference, largest", _MILLI * out.largest, "mm", "Hausdorff, one-sided"),
    ]
    if math.isfinite(found.bias):
        metrics.append(Quantity("map outside reference, mean", _MILLI * found.bias, "mm", "negative: inside"))
    metrics += [
        Quantity("reference covered", 100.0 * found.coverage, "%", f"within {_MILLI * found.within:g} mm"),
        Quantity("reference to map, largest", _MILLI * back.largest, "mm", f"Hausdorff, one-sided; {spacing}"),
        Quantity("Hausdorff distance", _MILLI * found.hausdorff, "mm", "the larger of both"),
    ]
    if found.normal_error is not None:
        degrees = np.degrees(found.normal_error)
        metrics.append(Quantity("normals, RMS error", float(np.sqrt((degrees**2).mean())), "degrees"))
        metrics.append(Quantity("normals, 95 %", float(np.percentile(degrees, 95.0)), "degrees"))
    if found.alignment is not None:
        moved = found.alignment
        note = "" if moved.converged else "did not settle"
        metrics.append(Quantity("map was moved by", _MILLI * moved.distance, "mm", note))
        metrics.append(Quantity("and turned by", math.degrees(moved.angle), "degrees"))
    return tuple(metrics)


def outcome(found: Comparison) -> str:
    """Return in one sentence what came out."""
    moved = (
        "The map was first moved onto the reference, which hides errors of position."
        if found.alignment is not None
        else "The map was compared where it is."
    )
    return (
        f"RMS error {_MILLI * found.map_to_reference.rms:.3g} mm; {100.0 * found.coverage:.1f} % of the reference "
        f"is within {_MILLI * found.within:g} mm of the map. {moved}"
    )


def map_comparison_report(found: Comparison, reference: TriangleSurface, config: CompareConfig) -> Report:
    """Return the report."""

    def draw() -> list[Figure | None]:
        return [error_on_map(found, reference.is_watertight), error_histogram(found), gaps_on_reference(found)]

    title = f"{config.map.name} against {config.reference.name}"
    closed = "watertight" if reference.is_watertight else "open: distances have no sign"
    facets = f"{len(reference.triangles)} triangles, {closed}"
    settings = (
        ("map", f"{config.map}, in {config.map_unit}"),
        ("reference", f"{config.reference}, in {config.reference_unit}; {facets}"),
        ("reachable region", "all of it" if config.region is None else f"{config.region} m"),
        ("covered means", f"within {_MILLI * config.within:g} mm of the map"),
        ("aligned", "yes" if config.align else "no"),
    )
    return Report(
        title=title,
        asked=f"how far {config.map.name} is from {config.reference.name}, which is taken for the truth",
        outcome=outcome(found),
        metrics=quantities(found),
        sections=(Section("Errors", (Figures(draw),)),),
        advice=_advice(found, config),
        settings=settings,
        repeat=(("The same again:", _command(config)),),
        footer="Distances to the reference's surface.",
    )


def _advice(found: Comparison, config: CompareConfig) -> tuple[str, ...]:
    if found.coverage == 0.0 and not config.align:
        return (
            "Nothing of the reference is near the map: check --map-unit and --reference-unit, or give --align.",
        )
    if found.coverage < WELL_COVERED:
        return (
            f"{100.0 * (1.0 - found.coverage):.0f} % of the reference was not felt: explore there too, or "
            f"say with "
            "--region what can be reached.",
        )
    return ()


def _command(config: CompareConfig) -> str:
    words = ["palpate", "compare", str(config.map), str(config.reference)]
    for option, unit in (("--map-unit", config.map_unit), ("--reference-unit", config.reference_unit)):
        words += [option, unit] if unit != "m" else []
    words += ["--within", f"{config.within:g}"]
    if config.region is not None:
        words += ["--region", *(f"{each:g}" for each in config.region)]
    words += ["--align"] if config.align else []
    words += ["--samples", str(config.samples)]
    return shlex.join([*words, *(["--out", str(config.out)] if config.out is not None else [])])
