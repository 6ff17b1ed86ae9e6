"""`palpate compare MAP REFERENCE`: a map against a reference mesh, as a table, a file and a report."""

import json
import math
import shlex
from dataclasses import fields, replace
from typing import Any

import numpy as np
from rich.console import Console

from palpate.atomic_file import replacing
from palpate.commands.command_result import CommandResult, ExitCode
from palpate.commands.compare.config import CompareConfig
from palpate.errors import FloatArray, InvalidValueError
from palpate.experiments.kit.checks import check_folder, make_folder
from palpate.mapping.compare import Comparison, DistanceSpread, compare
from palpate.mapping.compare_files import read_map, read_reference
from palpate.mapping.compare_surface import TriangleSurface
from palpate.reporting.data import Quantity
from palpate.reporting.figure import Axis, Figure, Panel, Space
from palpate.reporting.marks import Bars, Colouring, ColourScale, Rule
from palpate.reporting.page import write_report
from palpate.reporting.report import Figures, Report, Section, quantity_table
from palpate.reporting.solids import Spots
from palpate.runtime.progress import doing, say

METRES = {"m": 1.0, "mm": 1e-3}
"""Length of each unit of the files [m]."""

MILLI, MICRO = 1e3, 1e6

WELL_COVERED = 0.95
"""Share of the reference at which a map counts as whole."""

MAX_DRAWN_POINTS = 12_000
"""Number of points in a figure; more would cover each other."""

COLOURED_PERCENT = 99.0
"""Share of the errors that the colours span, so that outliers do not hide the rest."""


def compare_map(config: CompareConfig) -> CommandResult:
    """Compare a map with a reference, print the metrics, and write report and result.

    Raises:
        InvalidValueError: If a file is missing, cannot be read, or does not fit the other.
        OSError: If the report cannot be written.
    """
    for name, path in (("map", config.map), ("reference", config.reference)):
        if not path.is_file():
            raise InvalidValueError(f"{name} = {path}: there is no such file")
    folder = config.map.resolve().parent if config.out is None else config.out
    check_folder(folder)
    console = Console()
    with doing(console, "comparing"):
        reference = read_reference(config.reference, METRES[config.reference_unit])
        touched = read_map(config.map, METRES[config.map_unit], config.samples)
        region = None if config.region is None else (config.region[:3], config.region[3:])
        found = compare(
            touched, reference, within=config.within, region=region, aligned=config.align, samples=config.samples
        )
    report, values = map_comparison_report(found, reference, config), json_values(found, reference, config)
    console.print(quantity_table(report.metrics, report.title, report.outcome))
    for sentence in report.advice:
        say(console, sentence)
    make_folder(folder)
    with doing(console, "drawing the report"):
        written = write_report(report, folder / "compare.html", config.figures)
        page, *figures = written.files
        with replacing(folder / "compare.json") as file:
            file.write(json.dumps(values, indent=2, allow_nan=False).encode("ascii"))
        written = replace(written, files=(page, folder / "compare.json", *figures))
    for line in written.lines:
        say(console, line)
    code = ExitCode.UNFINISHED if written.failures else ExitCode.DONE
    warnings = (*(report.advice if found.coverage == 0.0 else ()), *written.warnings)
    return CommandResult(code, metrics=values, files=written.files, warnings=warnings)


def json_values(found: Comparison, reference: TriangleSurface, config: CompareConfig) -> dict[str, Any]:
    """Return the result as it goes into compare.json: SI units, null where there is no value."""
    normal, moved = found.normal_error, found.alignment
    return {
        "palpate_compare": 1,
        "map": str(config.map),
        "reference": str(config.reference),
        "map_unit": config.map_unit,
        "reference_unit": config.reference_unit,
        "points": len(found.points),
        "reference_triangles": len(reference.triangles),
        "reference_watertight": reference.is_watertight,
        "reference_samples": len(found.reference_points),
        "sample_spacing_m": found.sample_spacing,
        "map_to_reference_m": _spread(found.map_to_reference),
        "bias_m": found.bias if math.isfinite(found.bias) else None,
        "reference_to_map_m": _spread(found.reference_to_map),
        "hausdorff_m": found.hausdorff,
        "within_m": found.within,
        "region_m": config.region,
        "coverage": found.coverage,
        "normal_error_rad": None
        if normal is None
        else {"rms": float(np.sqrt((normal**2).mean())), "p95": float(np.percentile(normal, 95.0))},
        "alignment": None
        if moved is None
        else {
            "rotation": moved.rotation.tolist(),
            "shift_m": moved.shift.tolist(),
            "angle_rad": moved.angle,
            "distance_m": moved.distance,
            "converged": moved.converged,
        },
    }


def _spread(spread: DistanceSpread) -> dict[str, float]:
    return {name: float(getattr(spread, name)) for name in ("mean", "rms", "p50", "p95", "p99", "largest")}


def map_comparison_report(found: Comparison, reference: TriangleSurface, config: CompareConfig) -> Report:
    """Return the report on a map beside its reference."""
    closed = "watertight" if reference.is_watertight else "open: distances have no sign"
    within = f"within {MILLI * config.within:g} mm of the map"
    moved = (
        "The map was compared where it is."
        if found.alignment is None
        else "The map was first moved onto the reference, which hides errors of position."
    )
    return Report(
        title=f"{config.map.name} against {config.reference.name}",
        asked=f"how far {config.map.name} is from {config.reference.name}, which is taken for the truth",
        outcome=f"RMS error {MILLI * found.map_to_reference.rms:.3g} mm; {100.0 * found.coverage:.1f} % of the "
        f"reference is {within}. {moved}",
        metrics=_quantities(found),
        sections=(Section("Errors", (Figures(lambda: _figures(found, reference)),)),),
        advice=_advice(found, config),
        settings=(
            ("map", f"{config.map}, in {config.map_unit}"),
            (
                "reference",
                f"{config.reference}, in {config.reference_unit}; {len(reference.triangles)} triangles, {closed}",
            ),
            ("reachable region", "all of it" if config.region is None else f"{config.region} m"),
            ("covered means", within),
            ("aligned", "yes" if config.align else "no"),
        ),
        repeat=(("The same again:", _command(config)),),
        footer="Distances to the reference's surface.",
    )


def _quantities(found: Comparison) -> tuple[Quantity, ...]:
    out, back = found.map_to_reference, found.reference_to_map
    spacing = f"samples {MILLI * found.sample_spacing:.2g} mm apart"
    rows = [
        Quantity("map to reference, RMS", MILLI * out.rms, "mm", f"{len(found.points)} points"),
        Quantity("map to reference, mean", MILLI * out.mean, "mm", "of absolute distances"),
        Quantity("map to reference, 95 %", MILLI * out.p95, "mm"),
        Quantity("map to reference, largest", MILLI * out.largest, "mm", "Hausdorff, one-sided"),
    ]
    if math.isfinite(found.bias):
        rows.append(Quantity("map outside reference, mean", MILLI * found.bias, "mm", "negative: inside"))
    rows += [
        Quantity("reference covered", 100.0 * found.coverage, "%", f"within {MILLI * found.within:g} mm"),
        Quantity("reference to map, largest", MILLI * back.largest, "mm", f"Hausdorff, one-sided; {spacing}"),
        Quantity("Hausdorff distance", MILLI * found.hausdorff, "mm", "the larger of both"),
    ]
    if found.normal_error is not None:
        degrees = np.degrees(found.normal_error)
        rows += [
            Quantity("normals, RMS error", float(np.sqrt((degrees**2).mean())), "degrees"),
            Quantity("normals, 95 %", float(np.percentile(degrees, 95.0)), "degrees"),
        ]
    if found.alignment is not None:
        note = "" if found.alignment.converged else "did not settle"
        rows += [
            Quantity("map was moved by", MILLI * found.alignment.distance, "mm", note),
            Quantity("and turned by", math.degrees(found.alignment.angle), "degrees"),
        ]
    return tuple(rows)


def _advice(found: Comparison, config: CompareConfig) -> tuple[str, ...]:
    if found.coverage == 0.0 and not config.align:
        return (
            "Nothing of the reference is near the map: check --map-unit and --reference-unit. `palpate explore` "
            "sets a mesh on z = 0, its middle over the origin: move the reference, or give --align.",
        )
    if found.coverage < WELL_COVERED:
        missing = 100.0 * (1.0 - found.coverage)
        return (
            f"{missing:.0f} % of the reference was not touched: explore there too, or give the reachable part by "
            "--region.",
        )
    return ()


def _command(config: CompareConfig) -> str:
    """Return the command with every option that differs from its default."""
    words = ["palpate", "compare", str(config.map), str(config.reference)]
    for field in fields(config):
        value = getattr(config, field.name)
        if field.name in ("map", "reference", "others", "figures") or value == field.default:
            continue
        words.append(f"--{field.name.replace('_', '-')}")
        if not isinstance(value, bool):
            words += [f"{each}" for each in (value if isinstance(value, tuple) else (value,))]
    return shlex.join(words)


def _figures(found: Comparison, reference: TriangleSurface) -> list[Figure]:
    limit = max(float(np.percentile(np.abs(found.distance), COLOURED_PERCENT)) * MICRO, 1e-3)
    signed, error = reference.is_watertight, MICRO * found.distance
    quantity = "distance" + (", + is outside the reference" if signed else "")
    low, scale = (-limit, ColourScale.ERROR) if signed else (0.0, ColourScale.HEIGHT)
    gaps = MILLI * found.reference_distance
    within, spread = MILLI * found.within, found.map_to_reference
    histogram = Panel(
        (Bars.histogram(error), Rule(0.0)), Axis("distance from the reference", "µm"), Axis("number of points")
    )
    return [
        Figure(
            "Where the errors are",
            f"Points of the map, coloured by their distance from the reference; the colours span "
            f"{COLOURED_PERCENT:.0f} % of them, the largest is {MICRO * spread.largest:.3g} µm. An even colour "
            "of no distance is good.",
            (_space(found.points, Colouring(quantity, error, "µm", low, limit, scale)),),
        ),
        Figure(
            "How large the errors are",
            f"Distances of {len(error)} points: root mean square {MICRO * spread.rms:.3g} µm, mean of their size "
            f"{MICRO * spread.mean:.3g} µm, 95 % are below {MICRO * spread.p95:.3g} µm. Narrow and about zero is "
            "good.",
            (histogram,),
        ),
        Figure(
            "Coverage of the reference",
            f"The reference, coloured by its distance from the map: {100.0 * found.coverage:.1f} % is within "
            f"{within:g} mm, half the colour scale. Dark all over is good.",
            (_space(found.reference_points, Colouring("distance from the map", gaps, "mm", 0.0, 2.0 * within)),),
        ),
    ]


def _space(points: FloatArray, colouring: Colouring) -> Space:
    every = max(1, -(-len(points) // MAX_DRAWN_POINTS))
    shown = replace(colouring, values=colouring.values[::every])
    return Space((Spots(points[::every], size=3.0, colourings=(shown,)),))
