"""Report section on recognition: every material, the distance of the nearest one, and the next touch."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from palpate.experiments.friction.library import Recognised
from palpate.experiments.friction.result import FrictionResult, listed
from palpate.experiments.friction.summary import SIGMAS
from palpate.friction.friction_file import FrictionEstimate, FrictionFile
from palpate.friction.materials.material import Material
from palpate.friction.materials.recognition import RecognitionOutcome
from palpate.friction.materials.trials import Confusion
from palpate.reporting.figure import Axis, Figure, Panel
from palpate.reporting.marks import Cells, Colouring, ColourScale, shortened
from palpate.reporting.report import COLUMNS, Figures, Paragraph, Section, TextTable

LONGEST_NAME = 18
"""Letters of a name beside the matrix; the rest is left out."""

MOST_FIGURES = 20
"""Rows or columns above which the shares are no longer written into the cells."""

FRAME, ROW = 190, 26
"""Height of the figure without its rows, and of a row [px]."""


def confusion_figure(confusion: Confusion) -> Figure:
    """Return the figure of a confusion matrix: rows are what was touched, columns what it was taken for."""
    shares = confusion.shares
    # nothing where the share is 0, so that wrong results stand out
    seen = np.where(shares > 0.0, 100.0 * shares, np.nan).ravel()
    texts = tuple(map(_per_cent, shares.ravel().tolist())) if max(shares.shape) <= MOST_FIGURES else ()
    cells = Cells(
        Colouring("share", seen, "%", 0.0, 100.0, ColourScale.SHARE),
        _names(confusion.predictions),
        _names(confusion.truths),
        texts,
    )
    return Figure(
        title="Materials recognised by touch",
        caption=(
            "Share of touched objects of each material (row) that were taken for another (column), in per cent; "
            "correct results lie on the diagonal; for objects of no material of the library, in the last column. "
            "Empty cells elsewhere are good."
        ),
        panels=(Panel((cells,), Axis("taken for"), Axis("touched"), height=FRAME + ROW * len(shares)),),
        wide=True,
    )


def _names(typed: Sequence[str]) -> tuple[str, ...]:
    """Short names; those that become alike are numbered."""
    short = [shortened(name, LONGEST_NAME) for name in typed]
    return tuple(name if short.count(name) == 1 else f"{i + 1}: {name}" for i, name in enumerate(short))


def _per_cent(share: float) -> str:
    """Whole per cent; what is hardly ever or nearly always is not rounded to never or always."""
    if not share > 0.0:
        return ""
    if share < 0.005:
        return "<1"
    return ">99" if 0.995 < share < 1.0 else f"{100.0 * share:.0f}"


APART = 2.58
"""Standard deviations from which on a number counts as one that does not fit: so far off is 1 of 100."""

ALIKE = 0.005
"""Relative difference below which no percentage is shown."""

MOST_MATCHES = 20
"""Materials whose posterior is written down."""


def recognition_section(result: FrictionResult, known: Recognised) -> Section:
    """Return the section on which surface of the library it may be, the likeliest first."""

    def draw() -> Iterator[Figure | None]:
        yield None if known.confusion is None else confusion_figure(known.confusion)

    fits = known.recognition.outcome is not RecognitionOutcome.UNKNOWN
    likely = f"probability, {'if it is' if fits else 'were it'} one of these"
    heads = ("material", likely, "", "how likely the rubs are of it; how seldom it would be as far off itself")
    return Section(
        "Which surface it may be",
        (
            Paragraph(f"{known.words} {_how_far(result, known)}".strip()),
            TextTable(
                _match_rows(known),
                # of what none fits, no share is a result
                COLUMNS if fits else ("name", "unit", "unit", "note"),
                heads,
            ),
            Paragraph(_setting(known)),
            Figures(draw),
        ),
    )


def _match_rows(known: Recognised) -> list[tuple[str, ...]]:
    found = known.recognition
    likelihood = found.known.log_likelihood[:-1]
    below = (likelihood.max() - likelihood).tolist()
    order = np.lexsort((-likelihood, -found.posterior)).tolist()
    return [
        (
            found.library.names[i],
            _percent(float(found.posterior[i])),
            "",
            f"ln likelihood {'the largest' if below[i] == 0.0 else f'{below[i]:.1f} below the largest'}; "
            f"{_percent(float(found.fit[i]))} of its own touches fit no better",
        )
        for i in order[:MOST_MATCHES]
    ]


def _percent(share: float) -> str:
    if 0.0 < share < 1e-3:
        return "below 0.1 %"
    return "above 99.9 %" if 0.999 < share < 1.0 else f"{100.0 * share:.3g} %"


def _setting(known: Recognised) -> str:
    """Which touches the figure is of, and how many of each material."""
    if known.confusion is None:
        return ""
    count, shown = len(known.recognition.library.materials), len(known.confusion.truths)
    drawn = int(known.confusion.counts[0].sum())
    of = "each material" if shown == count else f"each of the {shown} likeliest of {count} materials"
    return (
        f"The rubs of this run, drawn {drawn} times for {of} with the scatter of the library: "
        f"{100.0 * known.confusion.right:.3g} % are recognised correctly."
    )


def _how_far(result: FrictionResult, known: Recognised) -> str:
    """Text on what does not fit the nearest material, if none fits, and a rub that checks another place."""
    found, file, config = known.recognition, result.file, result.plan.config
    if found.outcome is not RecognitionOutcome.UNKNOWN or file is None or not file.friction.measured:
        return ""
    nearest = found.library.materials[found.library.names.index(found.best)]
    differences = _differences(file, nearest, config.usual_calibration)
    off = [each.name for each in differences if each.deviations > APART]
    which = f"What does not fit: {listed(off)}" if off else "None of these is too far off alone, all together are"
    fit = found.fit[found.library.names.index(found.best)]
    rarely = "in less than 1 of 1000 cases" if fit < 1e-3 else f"in {100.0 * fit:.2g} % of cases"
    return (
        f"Against {nearest.name}, {listed([each.words for each in differences])}. {which}; touches of "
        f"{nearest.name} itself are as far off {rarely}. To see whether the surface is alike "
        f"elsewhere, rub another place with {config.rubbed_loads[-1]:g} N at {1e3 * config.speed:g} mm/s."
    )


@dataclass(frozen=True, slots=True)
class _Apart:
    """How far one number that was found is from a material's.

    Attributes:
        name: Of the number.
        words: Both, as text.
        deviations: Apart, over the standard deviation of that: of the measurement, from touch to touch and from
            specimen to specimen.
    """

    name: str
    words: str
    deviations: float


def _differences(file: FrictionFile, nearest: Material, calibration: float) -> list[_Apart]:
    """Everything that was measured and that recognition goes by."""
    touch, specimen = nearest.scatter.variances, nearest.specimen.variances
    mu, c, gamma, p = np.sqrt(touch + specimen).tolist()
    differences = [_relative("mu", file.friction, nearest.friction_at(file.speed), math.hypot(mu, calibration))]
    spun = [at for at in file.loads if at.spin_length is not None and at.spin_length.measured]
    for at in dict.fromkeys((0, len(spun) - 1)) if spun else ():
        length, force = spun[at].spin_length, spun[at].normal_force
        assert length is not None
        own = math.hypot(c, math.log(force) * gamma)
        there = nearest.spin_length_at(force)
        differences.append(_relative(f"e at {force:.3g} N", length, there, own, " mm", 1e3))
    for name, what, here, there, own in (
        ("gamma", " (how e grows with the load)", file.load_exponent, nearest.load_exponent, gamma),
        ("p", "", file.norm_exponent, nearest.norm_exponent, p),
    ):
        if here.measured:
            words = f"{name}{what} is {here.value:.2f} for {there:.2f}"
            differences.append(_Apart(name, words, abs(here.value - there) / math.hypot(_sd(here), own)))
    return differences


def _relative(
    name: str, here: FrictionEstimate, there: float, own: float, unit: str = "", factor: float = 1.0
) -> _Apart:
    apart = here.value / there - 1.0
    words = f"{name} is {factor * here.value:.3g}{unit} for {factor * there:.3g}{unit}"
    if abs(apart) >= ALIKE:
        words += f" ({100.0 * apart:+.0f} %)"
    return _Apart(name, words, abs(apart) / math.hypot(_sd(here) / here.value, own))


def _sd(found: FrictionEstimate) -> float:
    return 0.5 * (found.upper - found.lower) / SIGMAS
