"""How often the band of a surface map holds, where its assumptions hold and where they do not.

    python benchmarks/trust/maps.py [--seeds 10] [--contacts 1000 10000] [--violations]

Twenty smooth height fields are felt in rows 1 mm apart, with noise of 0.03 mm and 0.5 degrees that keeps over 1 mm
of path, as maps assume it; of each the share of errors inside the 95 % band (asked: 0.93 to 0.98), the
RMS error, the processor's time, and the verdict. Violations: contacts 1 mm off, single or up to ten together
(0: none), and detail finer than the rows, which lie 2 mm apart then.

To compare with another version, run it with that version's sources: PYTHONPATH=../other/src. Set
OPENBLAS_NUM_THREADS=1.
"""

import argparse
import dataclasses
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

sys.path.append(str(Path(__file__).resolve().parents[1]))

from mapping_surface.shapes import STEP, Errors, Shape, felt

from palpate.errors import FloatArray
from palpate.mapping import MapSettings, SurfaceMap, TouchCloud

Height = Callable[[FloatArray, FloatArray], FloatArray]
"""Of coordinates in millimetres, in millimetres; analytic, for slopes are taken along the imaginary axis."""

SMOOTH: dict[str, Height] = {
    "plane": lambda x, y: 0.0 * x,
    "ramp": lambda x, y: 0.1 * x - 0.2 * y,
    "wave 20 30": lambda x, y: np.sin(x / 20) * np.cos(y / 30),
    "wave 10 15": lambda x, y: np.sin(x / 10) * np.cos(y / 15),
    "wave 8 8": lambda x, y: 0.5 * np.sin(x / 8 + 1) * np.sin(y / 8),
    "wave along": lambda x, y: np.sin(x / 6),
    "wave across": lambda x, y: np.sin(y / 6),
    "wave askew": lambda x, y: np.sin((x + 2 * y) / 14),
    "bowl": lambda x, y: (x * x + y * y) / 160,
    "dome": lambda x, y: -(x * x + y * y) / 80,
    "saddle": lambda x, y: x * y / 60,
    "trough": lambda x, y: x * x / 80,
    "ridge": lambda x, y: -y * y / 50,
    "cubic": lambda x, y: (x**3 - 3 * x * y * y) / 4e3,
    "hill": lambda x, y: 2 * np.exp(-(x * x + y * y) / 128),
    "two hills": lambda x, y: np.exp(-((x - 8) ** 2 + y * y) / 72) + np.exp(-((x + 8) ** 2 + y * y) / 50),
    "dent": lambda x, y: x * x / 100 - np.exp(-((x - 3) ** 2 + (y - 2) ** 2) / 32),
    "sphere": lambda x, y: np.sqrt(90.0**2 - x * x - y * y),
    "beats": lambda x, y: 0.3 * np.sin(x / 4) * np.sin(x / 30) + y * y / 200,
    "chirp": lambda x, y: 0.5 * np.sin((x / 20 + 3) ** 2 / 2),
}

FINE: dict[str, Height] = {
    "sine of 6 mm, 0.1 mm": lambda x, y: 0.1 * np.sin(2 * np.pi * y / 6 + 0.3),
    "sine of 6 mm, 0.03 mm": lambda x, y: 0.03 * np.sin(2 * np.pi * y / 6 + 0.3),
    "ridge of 0.5 mm": lambda x, y: 0.2 * np.exp(-2.0 * (y - 0.7) ** 2),
    "texture of 2.5 mm, 0.03 mm": lambda x, y: 0.03 * np.sin(2 * np.pi * y / 2.5) * np.sin(2 * np.pi * x / 2.5),
    "texture of 2.5 mm, 0.01 mm": lambda x, y: 0.01 * np.sin(2 * np.pi * y / 2.5) * np.sin(2 * np.pi * x / 2.5),
}

QUIET = Errors(noise=1e-6, tilt=2e-3)
"""Of a simulated sensor."""

SAMPLES = 600
"""Places at which a map is asked."""


def shape_of(name: str, height: Height, contacts: int, rows: float) -> Shape:
    """Return a square that so many contacts cover."""
    half = 0.5 * float(np.sqrt(contacts * STEP * rows))
    tiny = 1e-20

    def surface(u: FloatArray, v: FloatArray) -> tuple[FloatArray, FloatArray]:
        x, y = 1e3 * u + 0j, 1e3 * v + 0j
        slopes = [np.imag(height(x + 1j * tiny, y)) / tiny, np.imag(height(x, y + 1j * tiny)) / tiny]
        normal = np.column_stack([-slopes[0], -slopes[1], np.ones_like(u)])
        z = 1e-3 * np.real(height(x, y))
        return np.column_stack([u, v, z]), normal / np.linalg.norm(normal, axis=1, keepdims=True)

    return Shape(name, surface, (-half, half), (-half, half))


def with_outliers(cloud: TouchCloud, rng: np.random.Generator, together: int) -> TouchCloud:
    """Return a cloud of which one contact in a hundred is 1 mm off, so many together."""
    first = rng.choice(len(cloud) - together, len(cloud) // (100 * together), replace=False)
    bad = np.unique(np.add.outer(first, np.arange(together)))
    position = cloud.position.copy()
    position[bad] += 1e-3 * rng.choice([-1.0, 1.0]) * cloud.normal[bad]
    return dataclasses.replace(cloud, position=position)


@dataclasses.dataclass
class Tally:
    """What the seeds of one case show."""

    inside: list[float] = dataclasses.field(default_factory=list)
    square: list[float] = dataclasses.field(default_factory=list)
    seconds: float = 0.0
    contacts: int = 0
    broken: list[str] = dataclasses.field(default_factory=list)

    def add(self, shape: Shape, rows: float, errors: Errors, seed: int, *, outliers: int = 0) -> None:
        """Map the shape once, and ask at places away from its rim."""
        rng = np.random.default_rng(seed)
        cloud = felt(*shape.surface(*shape.rows(rows)), errors, rng)
        if outliers:
            cloud = with_outliers(cloud, rng, outliers)
        began = time.process_time()
        made = SurfaceMap.learned(cloud, MapSettings.for_rows(rows))
        self.seconds += time.process_time() - began
        self.contacts += len(cloud)
        found = made.query(shape.samples(SAMPLES, rng)[0])
        error = found.distance[found.observed]
        self.inside.append(float((np.abs(error) <= found.band()[found.observed]).mean()))
        self.square.append(float((error**2).mean()))
        verdict = getattr(made, "verdict", None)  # versions before had none
        self.broken += [] if verdict is None else [each.assumption.name for each in verdict.broken]

    @property
    def row(self) -> str:
        """As a line of a table."""
        counts = " ".join(f"{name} {self.broken.count(name)}" for name in sorted(set(self.broken)))
        return (
            f"{np.mean(self.inside):6.3f} {min(self.inside):6.3f} {1e6 * np.mean(self.square) ** 0.5:8.2f} um "
            f"{1e6 * self.seconds / self.contacts:7.1f} us/contact  {counts}"
        )


def main() -> int:
    """Print a line per case: mean and least share inside, RMS, cost, verdicts; 1 if coverage is missed."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--contacts", type=float, nargs="+", default=[1e3, 1e4])
    parser.add_argument("--violations", action="store_true", help="outliers and fine detail instead")
    asked = parser.parse_args()
    missed = 0
    if asked.violations:
        for name, height in FINE.items():
            for label, errors in (("as assumed", Errors()), ("quiet", QUIET)):
                tally = Tally()
                for seed in range(asked.seeds):
                    tally.add(shape_of(name, height, 7200, 2e-3), 2e-3, errors, seed)
                missed += float(np.mean(tally.inside)) < 0.93
                print(f"{name + ', ' + label:44s} {tally.row}", flush=True)
        for outliers in (0, 1, 3, 10):
            tally = Tally()
            for seed in range(asked.seeds):
                tally.add(shape_of("dome", SMOOTH["dome"], 4400, 1e-3), 1e-3, Errors(), seed, outliers=outliers)
            print(f"{f'1 % of contacts 1 mm off, {outliers} together':44s} {tally.row}", flush=True)
        return int(missed > 0)
    for contacts in map(int, asked.contacts):
        together = []
        for name, height in SMOOTH.items():
            tally = Tally()
            for seed in range(asked.seeds):
                tally.add(shape_of(name, height, contacts, 1e-3), 1e-3, Errors(), seed)
            together += tally.inside
            print(f"{contacts:7d} {name:12s} {tally.row}", flush=True)
        missed += not 0.93 <= np.mean(together) <= 0.98
        print(f"{contacts:7d} all          {np.mean(together):6.3f}", flush=True)
    return int(missed > 0)


if __name__ == "__main__":
    sys.exit(main())
