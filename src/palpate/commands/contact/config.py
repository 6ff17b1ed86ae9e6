"""What `palpate contact` is to do; imports nothing heavy, so that `palpate --help` is quick."""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import tyro

from palpate.errors import InvalidValueError, check_not_negative, positive, vector
from palpate.experiments.kit.checks import check_length
from palpate.experiments.kit.options import check_options, option

STANDARD_STREAM = Path("-")
"""Standard input or standard output, as many tools write it."""


FINGERTIPS = {
    "sphere": "R",
    "ellipsoid": "A B C",
    "cylinder": "R",
    "plane": "D",
    "paraboloid": "R1 R2",
    "capsule": "R L",
    "box": "A B C R",
    "superellipsoid": "A B C P",
    "mesh": "MESH",
}
"""Options that describe a fingertip, and the sizes that they take."""

DEVIATIONS = {"force_noise": "N", "moment_noise": "N m", "size_sd": "m", "position_sd": "m", "rotation_sd": "rad"}
"""Options that give standard deviations, and their units."""


@dataclass(frozen=True, slots=True)
class ContactConfig:
    """Turn wrenches of a force/torque sensor behind a fingertip into contacts.

    Reads CSV, writes CSV or JSON lines, row by row as they come.

    Input: a header line, then one wrench per line, comma-separated, UTF-8. Columns are found by name: fx, fy, fz
    and mx, my, mz (or tx, ty, tz), in any order and any case, optionally with their unit as in fx_N, mx_mNm,
    "fy [N]" or mz(Nmm); without a unit N and N m. A wrench is what the object exerts on the finger, about the
    sensor's origin. Other columns that have a name (time, for example) are copied to the output as they are. Blank
    lines and lines that start with # are skipped.

    Output, in SI units and the sensor frame: the copied columns, centroid, outward normal, force, normal force,
    tangential force, spin torque, condition number and status; where noise or an uncertain fingertip is given,
    standard deviations too. Where the status is not OK there is no contact and its numbers are left empty (null
    in JSON).

    Moments whose arm is far longer than the fingertip are in another unit, and are refused.

    Wrong input ends with exit code 2 and one line that names the line at fault. A file given with --out then does
    not appear. From a file to standard output nothing appears either; from standard input, which may be live, rows
    before the fault may be out already. Ctrl-C ends a live source: what has come by then is kept.

    Example: palpate contact wrenches.csv --sphere 0.01 --force-noise 0.01 --moment-noise 1e-4 --out contacts.csv
    """

    source: Annotated[Path, tyro.conf.Positional, tyro.conf.arg(metavar="FILE")] = STANDARD_STREAM
    """CSV file with wrenches; - or nothing is standard input."""
    sphere: Annotated[float | None, tyro.conf.arg(metavar="R")] = option(None, "m")
    """Fingertip: a sphere of this radius [m]."""
    ellipsoid: Annotated[tuple[float, float, float] | None, tyro.conf.arg(metavar="A B C")] = option(
        None, "m", infinite=True
    )
    """Fingertip: an ellipsoid with these semi-axes along x, y, z [m]."""
    cylinder: Annotated[float | None, tyro.conf.arg(metavar="R")] = option(None, "m")
    """Fingertip: an endless cylinder about z of this radius [m]."""
    plane: Annotated[float | None, tyro.conf.arg(metavar="D")] = option(None, "m")
    """Fingertip: a pair of planes, at plus and minus this z [m]; the direction of the force decides which one is
    touched."""
    paraboloid: Annotated[tuple[float, float] | None, tyro.conf.arg(metavar="R1 R2")] = option(None, "m")
    """Fingertip: a paraboloid that opens along -z, with these radii of curvature at its apex [m]."""
    capsule: Annotated[tuple[float, float] | None, tyro.conf.arg(metavar="R L")] = option(None, "m")
    """Fingertip: a thimble, a hemisphere of this radius on a cylinder down to z = -L [m]."""
    box: Annotated[tuple[float, float, float, float] | None, tyro.conf.arg(metavar="A B C R")] = option(None, "m")
    """Fingertip: a box of these half lengths with edges rounded by R [m]."""
    superellipsoid: Annotated[tuple[float, float, float, float] | None, tyro.conf.arg(metavar="A B C P")] = option(
        None, "m"
    )
    """Fingertip: |x/A|^P + |y/B|^P + |z/C|^P = 1 [m, m, m, -]."""
    mesh: Annotated[Path | None, tyro.conf.arg(metavar="MESH")] = None
    """Fingertip: a closed convex mesh file (STL, PLY, OBJ) in metres."""
    center: tuple[float, float, float] = option((0.0, 0.0, 0.0), "m")
    """Centre of the fingertip's surface in the sensor frame [m]."""
    rotvec: tuple[float, float, float] = option((0.0, 0.0, 0.0), "rad")
    """How the surface's axes are turned against the sensor's: axis times angle [rad]."""
    model: Literal["soft", "hard"] = "soft"
    """soft: with spin torque, exact. hard: without, the wrench-axis method."""
    force_noise: float = option(0.0, "N")
    """Standard deviation of the sensor's force noise [N], each axis."""
    moment_noise: float = option(0.0, "N m")
    """Standard deviation of the sensor's moment noise [N m], each axis."""
    size_sd: float = option(0.0, "m")
    """Standard deviation of the fingertip's size: how far its surface may lie further out [m]."""
    position_sd: float = option(0.0, "m")
    """Standard deviation of the fingertip's center in the sensor frame [m], each axis."""
    rotation_sd: float = option(0.0, "rad")
    """Standard deviation of the fingertip's rotation in the sensor frame [rad], about each axis."""
    not_finite: Literal["refuse", "mark"] = "refuse"
    """A row with nan or inf in its wrench: refuse the input, naming the line; or mark the row INVALID, go on."""
    format: Literal["csv", "jsonl"] = "csv"
    """Output: CSV, or one JSON object per line."""
    out: Path = STANDARD_STREAM
    """Output file, which appears whole or not at all; - is standard output."""

    def __post_init__(self) -> None:
        check_options(self)
        given = [name for name in FINGERTIPS if getattr(self, name) is not None]
        if len(given) != 1:
            found = " and ".join(f"--{name}" for name in given) or "none"
            options = ", ".join(f"--{name} {sizes}" for name, sizes in FINGERTIPS.items())
            raise InvalidValueError(f"fingertip: {found} given; give one of {options} [m]")
        for name in given:
            value = getattr(self, name)
            if not isinstance(value, Path):
                self._check_sizes(name, value if isinstance(value, tuple) else (value,))
        vector("center", self.center, 3, "m")
        vector("rotvec", self.rotvec, 3, "rad")
        check_not_negative(self, **DEVIATIONS)
        if self.has_deviations and self.model == "hard":
            raise InvalidValueError(
                f"{', '.join(DEVIATIONS)} give standard deviations of the soft model only: leave them out, or "
                "--model soft"
            )

    @staticmethod
    def _check_sizes(name: str, sizes: tuple[float, ...]) -> None:
        if name == "superellipsoid":
            *sizes, exponent = sizes  # type: ignore[assignment]
            positive(name, exponent, "as its exponent")
        for length in sizes:
            if not (name == "ellipsoid" and length == math.inf):  # endless along that axis
                check_length(name, length)

    @property
    def endless(self) -> bool:
        """Whether the fingertip is modelled without an end in some direction."""
        open_kind = self.plane is not None or self.cylinder is not None or self.paraboloid is not None
        return open_kind or (self.ellipsoid is not None and math.inf in self.ellipsoid)

    @property
    def has_deviations(self) -> bool:
        """Whether standard deviations are requested."""
        return any(getattr(self, name) > 0.0 for name in DEVIATIONS)
