"""Options of `palpate compare`; imports nothing heavy, so that `palpate --help` is quick."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import tyro

from palpate.experiments.kit.options import check_options, option
from palpate.reporting.data import FigureKind

Unit = Literal["m", "mm"]

MOST_SAMPLES = 1_000_000
"""Points on a surface; they take a minute and 200 MB."""


@dataclass(frozen=True, slots=True)
class CompareConfig:
    """Compare a map with a reference mesh: errors, coverage, Hausdorff distance, normals. Or compare runs.

    Distances are to the reference's surface, exactly, not to its vertices; positive outside where it is
    watertight.
    The map is left where it is unless --align is given: errors of position count.

    Writes compare.html and compare.json (SI units) into the folder.

    Given runs instead, two or more of the same experiment (folders, or their .mcap logs): the
    options that differ, metrics side by side, force and grip over time and errors of the surface over one another.
    Writes comparison.html. Of the options, runs take --out and --figures alone.

    Example: palpate compare runs/explore/contacts.ply part.stl --reference-unit mm --within 0.002

    Example: palpate compare runs/slow runs/fast
    """

    map: Annotated[Path, tyro.conf.Positional, tyro.conf.arg(metavar="MAP|RUN")]
    """Measured map: a cloud (contacts.ply, contacts.csv, height_map.csv) or a mesh (PLY, OBJ, STL). Or a run."""
    reference: Annotated[Path, tyro.conf.Positional, tyro.conf.arg(metavar="REFERENCE|RUN")]
    """The true surface: a mesh (STL, PLY, OBJ or OFF). Or another run."""
    others: Annotated[tuple[Path, ...], tyro.conf.Positional, tyro.conf.arg(metavar="[RUN ...]")] = ()
    """Further runs."""
    map_unit: Unit = "m"
    """Unit of the map's file."""
    reference_unit: Unit = "m"
    """Unit of the reference's file: CAD often means mm."""
    within: float = option(1e-3, "m", bound="positive")
    """Up to this distance from the map the reference counts as covered [m]."""
    region: Annotated[
        tuple[float, float, float, float, float, float] | None, tyro.conf.arg(metavar="X Y Z X Y Z")
    ] = option(None, "m")
    """Lower and upper corner of the part that can be reached [m]: only there the reference counts for coverage."""
    align: bool = False
    """Move the map onto the reference first (rigid, from where it is); the report states by how much."""
    samples: int = option(20_000, within=(100, MOST_SAMPLES), remark="; 20000 take a second")
    """Points spread over the reference, and over a map that is a mesh."""
    out: Annotated[Path | None, tyro.conf.arg(metavar="FOLDER")] = None
    """Folder for the report, made if need be. Left out: that of the map, or of the first run."""
    figures: FigureKind | None = None
    """Write each figure of the report as a file, too, in the style of a paper, into the folder figures."""

    def __post_init__(self) -> None:
        check_options(self)
