"""Is the map as good as it should be, and does it know how good it is?"""

from dataclasses import dataclass, replace

import numpy as np
from rich.progress import track
from rich.table import Table

from mapping_surface.shapes import SHAPES, Errors, Shape, felt
from palpate.mapping import MapSettings, SurfaceMap, SurfaceModel
from palpate.mapping.surface_map import Parameter

SAMPLES = 1500


@dataclass(frozen=True)
class Case:
    """What errs and what is believed."""

    name: str
    errors: Errors
    settings: MapSettings
    held: tuple[Parameter, ...] = ()


def believing(length: float) -> MapSettings:
    return MapSettings(model=SurfaceModel(noise_length=length))


CASES = (
    Case("no noise", Errors(noise=0.0, tilt=0.0), MapSettings()),
    Case("path-correlated noise", Errors(), MapSettings()),
    Case("normals err anew each time", Errors(white_tilt=True), MapSettings()),
    Case("length believed 0.5 x", Errors(), believing(0.5e-3)),
    Case("length believed 2 x", Errors(), believing(2e-3)),
    Case("length held at 0.5 x", Errors(), believing(0.5e-3), (Parameter.NOISE_LENGTH,)),
    Case("length held at 2 x", Errors(), believing(2e-3), (Parameter.NOISE_LENGTH,)),
    Case("bias 0.03 mm, budget 0.03 mm", Errors(bias=0.03e-3), MapSettings(bias=0.03e-3)),
)


@dataclass(frozen=True)
class Outcome:
    """Of one shape and seed: errors in mm, shares of 1."""

    rms: float
    largest: float
    inside: float
    band_to_error: float
    covered: float


def outcome(shape: Shape, case: Case, seed: int, rows: float) -> Outcome:
    """Map one shape and ask at points spread evenly over it, where the true distance is zero."""
    rng = np.random.default_rng(seed)
    cloud = felt(*shape.surface(*shape.rows(rows)), case.errors, rng)
    made = SurfaceMap(case.settings)
    made.add(cloud)
    made.relearn(case.held)
    answer = made.query(shape.samples(SAMPLES, rng)[0])
    error, band = np.abs(answer.distance[answer.observed]), answer.band()[answer.observed]
    return Outcome(
        rms=1e3 * float(np.sqrt((error**2).mean())),
        largest=1e3 * float(error.max()),
        inside=float((error <= band).mean()),
        band_to_error=float(np.median(band) / np.median(error)),
        covered=float(answer.observed.mean()),
    )


def honesty(seeds: int, rows: float = 1e-3, cases: tuple[Case, ...] = CASES) -> Table:
    """Every shape, case and seed; worst of the seeds."""
    table = Table(
        title=f"Rows {1e3 * rows:g} mm apart, {seeds} seeds, worst of them; noise 0.03 mm and 0.5 degrees"
    )
    for heading in (
        "case",
        "shape",
        "RMS mm",
        "max mm",
        "inside the 95 % band",
        "median band / error",
        "observed",
    ):
        table.add_column(heading, justify="left" if heading in ("case", "shape") else "right")
    pairs = [(case, shape) for case in cases for shape in SHAPES]
    for case, shape in track(pairs, "touching", transient=True):
        found = [outcome(shape, case, seed, rows) for seed in range(seeds)]
        inside = [each.inside for each in found]
        table.add_row(
            case.name,
            shape.name,
            f"{max(each.rms for each in found):.4f}",
            f"{max(each.largest for each in found):.3f}",
            f"{min(inside):.3f} - {max(inside):.3f}",
            f"{max(each.band_to_error for each in found):.2f}",
            f"{min(each.covered for each in found):.3f}",
        )
    return table


def wide_rows(case: Case) -> Case:
    """Return the case with the reach that rows of 2 mm ask for."""
    return replace(case, settings=MapSettings.for_rows(2e-3, model=case.settings.model, bias=case.settings.bias))
