"""Telling materials apart by touch: asked for, and found.

    python benchmarks/materials.py [--quick] [--seed N] [--picture FILE.png]

Ten materials whose mu lies 8 % apart and whose e is the same, so that only strokes tell; 2 % scatter of mu from
stroke to stroke, and a sensor of the Nano17 class at 2 N. The answer is the likeliest material, or unknown: a
right material that is said to be unknown counts as wrong. Outsiders lie 8 % beyond either end. One half-way
between two materials cannot be told from them by few touches; how often it is, is shown.

Then the materials that come with palpate, which differ in other things too, and three strangers in MuJoCo, on the
friction plant: each touch rubs or turns a finger on a plate whose friction is the specimen's with a touch's own
scatter, with noise and drift; the next touch is the most telling one, until it says enough. Last, how many touches
that takes against touches in random order, without MuJoCo. Shares come with their 95 % interval (Clopper & Pearson
1934). Ends with 1 if a figure that was asked for is missed.
"""

import argparse
import math
import sys
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.progress import track
from rich.table import Table
from scipy.stats import beta

sys.path.append(str(Path(__file__).resolve().parents[1] / "tests"))

from material_touches import drawn_touches

from palpate.experiments.friction.confusion_picture import confusion_picture
from palpate.friction.materials.library import MaterialLibrary, simulated_materials
from palpate.friction.materials.material import Deviations, Material
from palpate.friction.materials.next_touch import candidate_touches, next_touch
from palpate.friction.materials.recognition import RecognitionOutcome, recognise
from palpate.friction.materials.touch_evidence import NeverSlipped, TouchEvidence
from palpate.friction.materials.trials import confusion, drawn_specimen
from palpate.friction.rubbing.sliding import FrictionMeasured, measure_friction
from palpate.friction.rubbing.stroke_plan import PlannedSlip
from palpate.friction.rubbing.twisting import SpinMeasured, measure_spin
from palpate.reporting.paper import write_picture
from palpate.sim.friction.law import FrictionLaw
from support.rubbing_runs import Motion, Place, Rubber

APART, COUNT, LEAST_MU = 1.08, 10, 0.3
STROKE = PlannedSlip(2.0, 0.02, 0.0)
ASKED = {1: 0.93, 3: 0.99, 5: 0.99}
CANDIDATES = candidate_touches((1.5, 5.0), (0.005, 0.02, 0.1), (2.0,))
MOST_TOUCHES = 12
STRANGERS = ((0.27, 2.6e-3, 0.2), (0.8, 2.6e-3, 0.2), (0.33, 5.5e-3, 0.15))
"""mu, c [m] and gamma: in two gaps between the library's materials, and as steel in mu but not in e."""


def material(name, mu, e, scatter, gamma=0.0, specimen=None):
    return Material(
        name=name,
        kinetic_friction=mu,
        spin_length=e,
        load_exponent=gamma,
        scatter=Deviations(friction=scatter, spin_length=scatter),
        specimen=specimen or Deviations(friction=0.0, spin_length=0.0),
        provenance="assumed for the benchmark",
    )


def row_of_materials(scatter):
    each = (material(f"material {i}", LEAST_MU * APART**i, 3e-3, scatter) for i in range(COUNT))
    return MaterialLibrary(fingertip="assumed", materials=tuple(each))


def share(held, of):
    if of == 0:
        return "none"
    low = 0.0 if held == 0 else float(beta.ppf(0.025, held, of - held + 1))
    high = 1.0 if held == of else float(beta.ppf(0.975, held + 1, of - held))
    return f"{100 * held / of:.1f} % ({100 * low:.1f} to {100 * high:.1f})"


class Figures:
    """A table of what was asked and got, and whether all of it was kept."""

    def __init__(self):
        self.table, self.kept = Table("figure", "asked", "got", "kept", box=None), True

    def add(self, name, got, asked="", kept=True):
        self.kept = self.kept and kept
        self.table.add_row(name, asked, got, ("yes" if kept else "NO") if asked else "")


def apart_figures(figures, trials, seed):
    for scatter in (0.02, 0.01, 0.03, 0.05):
        library = row_of_materials(scatter)
        for strokes, least in ASKED.items():
            rng = np.random.default_rng((seed, round(1000 * scatter), strokes))
            right = refused = given = given_right = 0
            for each in library.materials:
                for _ in range(trials):
                    found = recognise(library, drawn_touches(each, [STROKE] * strokes, rng))
                    unknown = found.outcome is RecognitionOutcome.UNKNOWN
                    good = found.best == each.name and not unknown
                    right, refused = right + good, refused + unknown
                    given += found.outcome is RecognitionOutcome.RECOGNISED
                    given_right += found.outcome is RecognitionOutcome.RECOGNISED and good
            of = trials * COUNT
            wanted = scatter == 0.02
            name = f"{100 * scatter:g} % scatter, right after {strokes}"
            asked = f">= {100 * least:g} %" if wanted else ""
            figures.add(name, share(right, of), asked, not wanted or right >= least * of)
            if wanted:
                figures.add("  said to be unknown", share(refused, of), "<= 1 %", refused <= 0.01 * of)
                figures.add("  where it was sure, right", f"{share(given_right, given)} of {given}")


def outsider_figures(figures, trials, seed):
    library, rng = row_of_materials(0.02), np.random.default_rng((seed, 100))
    top = LEAST_MU * APART ** (COUNT - 1)
    half = LEAST_MU * APART**4.5
    for name, mus, counts, wanted in (
        ("8 % outside", (LEAST_MU / APART, top * APART), (1, 3, 5), 3),
        ("half-way between two", (half,), (1, 3, 5, 10), None),
    ):
        for strokes in counts:
            unknown = 0
            for mu in mus:
                other = material("outsider", mu, 3e-3, 0.02)
                for _ in range(trials):
                    found = recognise(library, drawn_touches(other, [STROKE] * strokes, rng))
                    unknown += found.outcome is RecognitionOutcome.UNKNOWN
            of = trials * len(mus)
            asked = ">= 95 %" if strokes == wanted else ""
            kept = strokes != wanted or unknown >= 0.95 * of
            figures.add(f"{name}, unknown after {strokes}", share(unknown, of), asked, kept)


def touched(specimen, scatter, source, slip, rng):
    """One touch in MuJoCo of a specimen (ln mu, ln c, gamma, p)."""
    mu, c, gamma, p = specimen + np.sqrt(scatter) * rng.normal(size=4)
    factor = math.exp(mu) / source.kinetic_friction
    rise = (source.static_friction or source.kinetic_friction) / source.kinetic_friction
    law = FrictionLaw(
        math.exp(mu) * max(rise, 1.0),
        math.exp(mu),
        source.stribeck_speed,
        source.viscous_friction * factor,
        math.exp(c),
        min(max(gamma, 0.0), 1.0 / 3.0),
        min(max(p, 1.05), 2.0),
    )
    force = slip.normal_force
    finger = Rubber(Place(math.exp(mu), math.exp(c), force, seed=int(rng.integers(2**31)), law=law))
    strokes = measure_friction([finger.two_way(Motion(speed=slip.speed or 0.02))])
    if not isinstance(strokes, FrictionMeasured):
        return NeverSlipped.of_stroke(strokes)
    if slip.spin == 0.0:
        return TouchEvidence.of_stroke(strokes)
    twists = measure_spin([finger.two_way(Motion(spin=sense * slip.spin)) for sense in (1.0, -1.0)], strokes)
    return TouchEvidence.of_twist(twists) if isinstance(twists, SpinMeasured) else NeverSlipped.of_twist(twists)


def mujoco_figures(figures, rounds, seed, picture):
    library, rng = simulated_materials(), np.random.default_rng((seed, 200))
    typical = library.materials[0]
    strangers = [
        material(f"stranger {i + 1}", mu, c, 0.02, gamma, typical.specimen)
        for i, (mu, c, gamma) in enumerate(STRANGERS)
    ]
    cases, counts, right = [], [], 0
    for source in track([*library.materials, *strangers], "in MuJoCo", console=Console(stderr=True)):
        for _ in range(rounds):
            specimen = drawn_specimen(source, rng)
            touches, found = [], recognise(library, [])
            while len(touches) < MOST_TOUCHES:
                slip = next_touch(found, CANDIDATES).slip
                if slip is None:
                    break
                touches.append(touched(specimen, typical.scatter.variances, source, slip, rng))
                found = recognise(library, touches)
            cases.append((source.name, found))
            if source in library.materials:
                counts.append(len(touches))
                right += found.best == source.name and found.outcome is not RecognitionOutcome.UNKNOWN
    unknown = sum(
        found.outcome is RecognitionOutcome.UNKNOWN for name, found in cases if name.startswith("stranger")
    )
    figures.add("library in MuJoCo, right", share(right, len(counts)))
    figures.add("  touches until enough: mean, most", f"{np.mean(counts):.1f}, {max(counts)}")
    figures.add("  strangers said to be unknown", share(unknown, rounds * len(strangers)))
    if picture is not None:
        picture.parent.mkdir(parents=True, exist_ok=True)
        write_picture(confusion_picture(confusion(library, cases)), picture)


def choice_figures(figures, trials, seed):
    library, rng = simulated_materials(), np.random.default_rng((seed, 300))
    for name, by_choice in (("the most telling first", True), ("in random order", False)):
        counts, right = [], 0
        for source in library.materials:
            for _ in range(trials):
                specimen = drawn_specimen(source, rng)
                touches, found = [], recognise(library, [])
                while found.outcome is RecognitionOutcome.UNDECIDED and len(touches) < MOST_TOUCHES:
                    slip = (
                        next_touch(found, CANDIDATES).slip
                        if by_choice
                        else CANDIDATES[rng.integers(len(CANDIDATES))]
                    )
                    if slip is None:
                        break
                    touches += drawn_touches(source, [slip], rng, specimen=specimen)
                    found = recognise(library, touches)
                counts.append(len(touches))
                right += found.best == source.name and found.outcome is not RecognitionOutcome.UNKNOWN
        shown = f"{np.mean(counts):.2f}, right {share(right, len(counts))}"
        figures.add(f"touches until enough, {name}: mean", shown)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="a tenth of it")
    parser.add_argument("--seed", type=int, default=1, help="other specimens, touches and noise")
    parser.add_argument("--picture", type=Path, help="where to keep the confusion matrix of the runs in MuJoCo")
    given = parser.parse_args()
    part = 0.1 if given.quick else 1.0
    figures = Figures()
    apart_figures(figures, round(400 * part), given.seed)
    outsider_figures(figures, round(1000 * part), given.seed)
    choice_figures(figures, round(100 * part), given.seed)
    mujoco_figures(figures, max(1, round(10 * part)), given.seed, given.picture)
    Console(width=120).print(figures.table)
    sys.exit(0 if figures.kept else 1)


if __name__ == "__main__":
    main()
