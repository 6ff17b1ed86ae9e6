"""Is the map as good as it should be, and does it know how good it is?"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from rich.table import Table

from mapping_surface.shapes import SHAPES, Errors, Shape, felt
from palpate.mapping import MapSettings, SurfaceMap, SurfaceModel
from palpate.mapping.surface_map import Parameter

SAMPLES = 1500

Tell = Callable[[str], None]
"""Takes what has been done, for progress."""


@dataclass(frozen=True)
class Asked:
    """What a case must show, each seed of each shape: errors in mm, shares of 1; nothing asked where None."""

    rms: float | None = None
    largest: float | None = None
    inside: tuple[float, float] | None = None
    band_to_error: float | None = None
    covered: float | None = 0.95


HONEST = Asked(inside=(0.90, 0.99))


@dataclass(frozen=True)
class Case:
    """What errs, what is believed, and what is asked."""

    name: str
    errors: Errors
    settings: MapSettings
    held: tuple[Parameter, ...] = ()
    asked: Asked = Asked()


def believing(length: float) -> MapSettings:
    return MapSettings(model=SurfaceModel(noise_length=length))


LENGTH = (Parameter.NOISE_LENGTH,)
ALL = tuple(Parameter)  # nothing is learned

CASES = (
    Case("no noise", Errors(noise=0.0, tilt=0.0), MapSettings(), asked=Asked(rms=0.010)),
    Case("path-correlated noise", Errors(), MapSettings(), asked=Asked(0.012, 0.05, (0.90, 0.99))),
    Case("length believed 0.5 x", Errors(), believing(0.5e-3), asked=HONEST),
    Case("length believed 2 x", Errors(), believing(2e-3), asked=HONEST),
    Case("length held at 0.5 x", Errors(), believing(0.5e-3), LENGTH, HONEST),
    Case("length held at 2 x", Errors(), believing(2e-3), LENGTH, HONEST),
    Case("nothing learned, length 0.5 x", Errors(), believing(0.5e-3), ALL),
    Case("nothing learned, length 2 x", Errors(), believing(2e-3), ALL),
    Case("normals err anew each time", Errors(white_tilt=True), MapSettings()),
    Case(
        "bias 0.03 mm, budget 0.03 mm",
        Errors(bias=0.03e-3),
        MapSettings(bias=0.03e-3),
        asked=Asked(band_to_error=1.5),
    ),
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


def missed(asked: Asked, found: Sequence[Outcome]) -> tuple[str, ...]:
    """Return which figures a shape's seeds miss."""
    inside = asked.inside or (0.0, 1.0)
    tests = {
        "RMS": asked.rms is None or max(each.rms for each in found) <= asked.rms,
        "max": asked.largest is None or max(each.largest for each in found) <= asked.largest,
        "inside": all(inside[0] <= each.inside <= inside[1] for each in found),
        "band": asked.band_to_error is None or max(each.band_to_error for each in found) <= asked.band_to_error,
        "observed": asked.covered is None or min(each.covered for each in found) >= asked.covered,
    }
    return tuple(name for name, held in tests.items() if not held)


def honesty(seeds: range, tell: Tell, rows: float = 1e-3, cases: tuple[Case, ...] = CASES) -> tuple[Table, int]:
    """Every shape, case and seed; worst of the seeds, and how many lines miss a figure."""
    table = Table(
        title=f"Rows {1e3 * rows:g} mm apart, seeds {seeds.start} to {seeds.stop - 1}, worst of them; "
        "noise 0.03 mm and 0.5 degrees"
    )
    for heading in (
        "case",
        "shape",
        "RMS mm",
        "max mm",
        "inside the 95 % band",
        "median band / error",
        "observed",
        "missed",
    ):
        table.add_column(heading, justify="left" if heading in ("case", "shape", "missed") else "right")
    misses = 0
    for case in cases:
        for shape in SHAPES:
            found = [outcome(shape, case, seed, rows) for seed in seeds]
            inside = [each.inside for each in found]
            wrong = missed(case.asked, found)
            misses += bool(wrong)
            row = (
                case.name,
                shape.name,
                f"{max(each.rms for each in found):.4f}",
                f"{max(each.largest for each in found):.3f}",
                f"{min(inside):.3f} - {max(inside):.3f}",
                f"{max(each.band_to_error for each in found):.2f}",
                f"{min(each.covered for each in found):.3f}",
                ", ".join(wrong),
            )
            table.add_row(*row)
            tell(f"rows {1e3 * rows:g} mm: " + "  ".join(row))
    return table, misses


def wide_rows(case: Case) -> Case:
    """Return the case with the reach that rows of 2 mm ask for."""
    return replace(case, settings=MapSettings.for_rows(2e-3, model=case.settings.model, bias=case.settings.bias))
