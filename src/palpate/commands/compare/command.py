"""`palpate compare`: a map against a reference mesh, as a table, a file and a report."""

import json
import math
from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.console import Console
from rich.table import Table
from rich.text import Text

from palpate.atomic_file import replacing
from palpate.commands.command_result import CommandResult
from palpate.commands.compare.config import CompareConfig
from palpate.commands.say import say
from palpate.errors import InvalidValueError
from palpate.experiments.kit.output_folder import check_folder, make_folder

if TYPE_CHECKING:
    from palpate.mapping.compare import Comparison, DistanceSpread
    from palpate.mapping.compare_surface import TriangleSurface

_METRES = {"m": 1.0, "mm": 1e-3}

OF_MAPS = ("map_unit", "reference_unit", "within", "region", "align", "samples")
"""Options that do not apply to runs."""

ELSEWHERE = (
    "Nothing of the reference is near the map: is it in another place? `palpate explore` sets a mesh on z = 0, "
    "its middle over the origin; move the reference, or give --align"
)


def run_compare(config: CompareConfig) -> CommandResult:
    """Compare, print the metrics, and write report and result.

    Returns:
        The metrics.

    Raises:
        InvalidValueError: A file is missing, cannot be read, or does not fit the other.
        OSError: The report cannot be written.
    """
    places = (config.map, config.reference, *config.others)
    if any(place.is_dir() or place.suffix == ".mcap" for place in places):
        _refuse_options_of_maps(config)
        from palpate.commands.compare.runs_compared_command import (
            compare_runs,  # logs and plans take a second to import
        )

        return compare_runs(places, config.out, config.figures)
    if config.others:
        raise InvalidValueError(f"{config.others[0]}: a map is compared with one mesh; leave it out, or name runs")
    _need_file("map", config.map)
    _need_file("reference", config.reference)
    folder = config.map.resolve().parent if config.out is None else config.out
    check_folder(folder)
    # compiled kernels, meshes and figures take seconds to import: a wrong name is reported before
    from palpate.commands.compare.report import map_comparison_report, quantities
    from palpate.commands.progress import doing
    from palpate.mapping.compare import compare
    from palpate.mapping.compare_files import read_map, read_reference
    from palpate.reporting.page import write_report

    console = Console()
    with doing(console, "comparing"):
        reference = read_reference(config.reference, _METRES[config.reference_unit])
        touched = read_map(config.map, _METRES[config.map_unit], config.samples)
        region = None if config.region is None else (config.region[:3], config.region[3:])
        found = compare(
            touched, reference, within=config.within, region=region, aligned=config.align, samples=config.samples
        )
    make_folder(folder)
    table = Table(title=Text(f"{config.map.name} against {config.reference.name}"), show_header=False)
    table.add_column("name")
    table.add_column("value", justify="right", style="bold")
    table.add_column("unit")
    table.add_column("note", style="dim")
    for metric in quantities(found):
        table.add_row(Text(metric.name), Text(metric.text), Text(metric.unit), Text(metric.note))
    console.print(table)
    warnings = (ELSEWHERE,) if found.coverage == 0.0 and not config.align else ()
    for warning in warnings:
        say(console, warning)
    with doing(console, "drawing the report"):
        report = map_comparison_report(found, reference, config)
        page, *figures = write_report(report, folder / "compare.html", config.figures).files
        with replacing(folder / "compare.json") as file:
            file.write(json.dumps(result(found, reference, config), indent=2, allow_nan=False).encode("ascii"))
    files = (page, folder / "compare.json", *figures)
    for path in files:
        say(console, f"Written: {path}")
    return CommandResult(metrics=result(found, reference, config), files=files, warnings=warnings)


def _refuse_options_of_maps(config: CompareConfig) -> None:
    given = [
        each.name for each in fields(config) if each.name in OF_MAPS and getattr(config, each.name) != each.default
    ]
    if given:
        typed = ", ".join(f"--{name.replace('_', '-')}" for name in given)
        raise InvalidValueError(f"{typed}: for a map and a mesh; runs take --out alone, leave the rest out")


def _need_file(name: str, path: Path) -> None:
    if not path.is_file():
        raise InvalidValueError(f"{name} = {path}: there is no such file")


def result(found: "Comparison", reference: "TriangleSurface", config: CompareConfig) -> dict[str, Any]:
    """Return the metrics as they go into compare.json: SI units, null where there is none."""
    import numpy as np  # as above

    normal = found.normal_error
    moved = found.alignment
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


def _spread(spread: "DistanceSpread") -> dict[str, float]:
    names = ("mean", "rms", "p50", "p95", "p99", "largest")
    return {name: float(getattr(spread, name)) for name in names}
