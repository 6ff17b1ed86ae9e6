"""The report on a comparison, as one HTML file."""

import math
from html import escape

import numpy as np

from palpate.experiments.compare_config import CompareConfig
from palpate.mapping.compare import Comparison
from palpate.mapping.compare_surface import TriangleSurface
from palpate.reporting import KeyFigure

_MILLI = 1e3


def key_figures(found: Comparison) -> tuple[KeyFigure, ...]:
    """Return the figures that matter, most important first."""
    out, back = found.map_to_reference, found.reference_to_map
    spacing = f"samples {_MILLI * found.sample_spacing:.2g} mm apart"
    figures = [
        KeyFigure("map to reference, RMS", _MILLI * out.rms, "mm", f"{len(found.points)} points"),
        KeyFigure("map to reference, mean", _MILLI * out.mean, "mm", "of absolute distances"),
        KeyFigure("map to reference, 95 %", _MILLI * out.p95, "mm"),
        KeyFigure("map to reference, largest", _MILLI * out.largest, "mm", "Hausdorff, one-sided"),
    ]
    if math.isfinite(found.bias):
        figures.append(KeyFigure("map outside reference, mean", _MILLI * found.bias, "mm", "negative: inside"))
    figures += [
        KeyFigure("reference covered", 100.0 * found.coverage, "%", f"within {_MILLI * found.within:g} mm"),
        KeyFigure("reference to map, largest", _MILLI * back.largest, "mm", f"Hausdorff, one-sided; {spacing}"),
        KeyFigure("Hausdorff distance", _MILLI * found.hausdorff, "mm", "the larger of both"),
    ]
    if found.normal_error is not None:
        degrees = np.degrees(found.normal_error)
        figures.append(KeyFigure("normals, RMS error", float(np.sqrt((degrees**2).mean())), "degrees"))
        figures.append(KeyFigure("normals, 95 %", float(np.percentile(degrees, 95.0)), "degrees"))
    if found.alignment is not None:
        moved = found.alignment
        note = "" if moved.converged else "did not settle"
        figures.append(KeyFigure("map was moved by", _MILLI * moved.distance, "mm", note))
        figures.append(KeyFigure("and turned by", math.degrees(moved.angle), "degrees"))
    return tuple(figures)


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


def comparison_html(found: Comparison, reference: TriangleSurface, config: CompareConfig) -> str:
    """Return the report as the text of an HTML document."""
    # matplotlib takes a third of a second to import: only those who write a report wait for it.
    from palpate.experiments.compare_pictures import error_histogram, error_on_map, gaps_on_reference
    from palpate.reporting.page import page, picture_cards, section, table

    title = f"{config.map.name} against {config.reference.name}"
    closed = "watertight" if reference.is_watertight else "open: distances have no sign"
    facets = f"{len(reference.triangles)} triangles, {closed}"
    settings = (
        ("map", f"{config.map}, in {config.map_unit}"),
        (
            "reference",
            f"{config.reference}, in {config.reference_unit}; {facets}",
        ),
        ("reachable region", "all of it" if config.region is None else f"{config.region} m"),
        ("covered means", f"within {_MILLI * config.within:g} mm of the map"),
        ("aligned", "yes" if config.align else "no"),
    )
    figures = [(k.name, k.text, k.unit, k.note) for k in key_figures(found)]
    pictures = [error_on_map(found, reference.is_watertight), error_histogram(found), gaps_on_reference(found)]
    return page(
        title,
        [
            f'<h1>{escape(title)}</h1>\n<p class="outcome">{escape(outcome(found))}</p>',
            table(figures, ("name", "value", "unit", "note")),
            section("Errors", [picture_cards(pictures)]),
            section("Settings", [table(settings, ("name", "value"))]),
            "<footer>Distances to the reference's surface. Written by palpate.</footer>",
        ],
    )
