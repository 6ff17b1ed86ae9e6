"""Recognition of the rubbed surface in a library, the most informative next touch, and their report section."""

import importlib.resources
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import msgspec
import numpy as np

from palpate.errors import InvalidValueError
from palpate.estimation import Verdict
from palpate.experiments.friction.config import LIBRARY_TEXT, FrictionConfig
from palpate.experiments.friction.estimate import FrictionFound, listed, slipped, spun
from palpate.experiments.friction.summary import SIGMAS, pooled
from palpate.friction.friction_file import FrictionEstimate, FrictionFile
from palpate.friction.materials.library import MaterialLibrary, read_materials
from palpate.friction.materials.material import Material
from palpate.friction.materials.next_touch import Advice, TouchAdvice, candidate_touches, next_touch
from palpate.friction.materials.recognition import Recognition, RecognitionOutcome, recognise
from palpate.friction.materials.recognition_checks import recognition_verdict
from palpate.friction.materials.touch_evidence import STROKE_ROW, NeverSlipped, TouchEvidence, twist_row
from palpate.friction.materials.trials import Confusion, confusion_of_touches
from palpate.friction.rubbing.sliding import FrictionBound
from palpate.friction.rubbing.twisting import SpinBound
from palpate.reporting.figure import Axis, Figure, Panel
from palpate.reporting.marks import Cells, Colouring, ColourScale, shortened
from palpate.reporting.report import COLUMNS, Figures, Paragraph, Section, TextTable
from palpate.strict_decode import load

if TYPE_CHECKING:
    from palpate.experiments.friction.result import FrictionResult

_SIMULATED_TOUCHES = 500
"""Touches for the confusion matrix, of all materials together: of ten, a share of 5 % is known to 3 %."""

_MAX_CONFUSED = 20
"""Largest number of materials in the confusion matrix; more are illegible."""

_SHIPPED = Path("simulated")
"""Name of the library that comes with palpate."""

MAX_NAME_LENGTH = 18
"""Largest number of letters of a name beside the matrix."""

MAX_NUMBERED_ROWS = 20
"""Largest number of rows or columns whose shares are written into the cells."""

_FRAME_HEIGHT, _ROW_HEIGHT = 190, 26
"""Height of the figure without its rows, and of a row [px]."""

_MAX_DEVIATIONS = 2.58
"""Standard deviations beyond which a number does not fit: 1 of 100 is so far off."""

_MIN_SHOWN_DIFFERENCE = 0.005
"""Relative difference below which no percentage is shown."""

_MAX_MATCHES = 20
"""Largest number of materials whose posterior is listed."""


@dataclass(frozen=True, slots=True, eq=False)
class Recognised:
    """Recognition of the rubbed surface in a library.

    Attributes:
        recognition: Posterior of the library's materials.
        advice: Most informative next touch.
        verdict: Verdict on the recognition.
        confusion: Confusion matrix of the likeliest materials after touches like these; None if nothing slipped.
    """

    recognition: Recognition
    advice: TouchAdvice
    verdict: Verdict
    confusion: Confusion | None = None

    @property
    def material(self) -> str:
        """Name of the material; without one, the outcome of the recognition."""
        found = self.recognition
        return found.best if found.outcome is RecognitionOutcome.RECOGNISED else found.outcome.value

    @property
    def words(self) -> str:
        """Outcome and next touch in sentences."""
        found, advice = self.recognition, self.advice
        order = np.argsort(found.posterior)[::-1][:3]
        likely = ", ".join(
            f"{found.library.names[i]} {100.0 * found.posterior[i]:.3g} %"
            for i in order.tolist()
            if found.posterior[i] > 0.005
        )
        outcome = {
            RecognitionOutcome.UNKNOWN: f"No material of the library fits it; {found.best} comes nearest.",
            RecognitionOutcome.RECOGNISED: (
                f"It is {found.best}, as far as the library goes ({likely}). No further touch is needed."
            ),
        }.get(found.outcome, f"It may be one of several: {likely}.")
        slip = advice.slip
        if advice.advice is Advice.TOUCH and slip is not None:
            twist = slip.spin != 0.0
            how = f"a twist at {slip.spin:g} rad/s" if twist else f"a stroke at {1e3 * slip.speed:g} mm/s"
            return f"{outcome} Most informative next touch, at another place: {how}, with {slip.normal_force:g} N."
        if advice.advice is Advice.NOTHING_TELLS:
            return f"{outcome} No stroke or twist with these loads distinguishes them."
        return outcome


def library_text(config: FrictionConfig, texts: Mapping[str, str]) -> str:
    """Return the text of the configuration's library; "" without one.

    Args:
        config: Configuration of the run.
        texts: Texts of a log, which keep the library of the run.

    Raises:
        InvalidValueError: If the library cannot be read or is invalid.
    """
    path = library_path(config)
    if path is None or LIBRARY_TEXT in texts:
        return texts.get(LIBRARY_TEXT, "")
    try:
        return load(path, _checked, "a materials file")
    except OSError as error:
        raise InvalidValueError(
            f"library = {path}: cannot be read: {error.strerror}; `--library simulated` takes the one that comes "
            "with palpate"
        ) from None


def _checked(text: str) -> str:
    read_materials(text)
    return text


def library_path(config: FrictionConfig) -> Path | None:
    """Return the file of the configuration's library; None without one."""
    if config.library is not None and config.library == _SHIPPED and not config.library.exists():
        return Path(str(importlib.resources.files("palpate").joinpath("materials/simulated.yaml")))
    return config.library


def recognised(
    library: MaterialLibrary, found: FrictionFound, config: FrictionConfig, most_spin: float
) -> Recognised | None:
    """Return the recognition in a library; None if nothing was rubbed.

    Args:
        library: Library of materials.
        found: Estimates of the run.
        config: Configuration of the run: loads and speed of the next touch.
        most_spin: Largest angular speed of the tip [rad/s]; 0 if it cannot turn.
    """
    touches = _touches(found)
    if not touches:
        return None
    calibration = config.usual_calibration
    recognition = recognise(library, touches, calibration=calibration)
    spins = (most_spin,) if most_spin > 0.0 else ()
    advice = next_touch(recognition, candidate_touches(config.rubbed_loads, (config.speed,), spins))
    verdict = recognition_verdict(recognition, touches, calibration=calibration)
    slips = [touch for touch in touches if isinstance(touch, TouchEvidence)]
    if not slips:
        return Recognised(recognition, advice, verdict)
    likeliest = np.argsort(recognition.known.log_likelihood[:-1])[::-1][:_MAX_CONFUSED]
    materials = tuple(library.materials[i] for i in sorted(likeliest.tolist()))
    confusion = confusion_of_touches(
        msgspec.structs.replace(library, materials=materials),
        slips,
        _SIMULATED_TOUCHES // len(materials),
        np.random.default_rng(config.seed),
        calibration,
    )
    return Recognised(recognition, advice, verdict, confusion)


def _touches(found: FrictionFound) -> list[TouchEvidence | NeverSlipped]:
    """Return one touch: all rubs are at one place, and all loads share the deviation of that place."""
    touches: list[TouchEvidence | NeverSlipped] = []
    for at in found.loads:
        if isinstance(at.friction, FrictionBound):
            touches.append(NeverSlipped.of_stroke(at.friction))
        if isinstance(at.spin, SpinBound):
            touches.append(NeverSlipped.of_twist(at.spin))
    frictions = slipped(found.loads)
    if not frictions:
        return touches
    speed = sum(each.speed for each in frictions) / len(frictions)
    if found.fitted is not None:
        return [*touches, TouchEvidence.of_fit(found.fitted, speed)]
    spins = spun(found.loads)
    estimates = [pooled([each.friction for each in frictions]), *(each.torque_ratio for each in spins)]
    touches.append(
        TouchEvidence(
            np.array([math.log(each.value) for each in estimates]),
            np.array([STROKE_ROW, *(twist_row(each.normal_force) for each in spins)]),
            np.diag(np.square([each.standard_deviation / each.value for each in estimates])),
            speed,
        )
    )
    return touches


# --- report ---


def recognition_section(result: "FrictionResult", known: Recognised) -> Section:
    """Return the section on the likeliest materials."""

    def draw() -> Iterator[Figure | None]:
        yield None if known.confusion is None else confusion_figure(known.confusion)

    fits = known.recognition.outcome is not RecognitionOutcome.UNKNOWN
    likely = f"probability, {'if it is' if fits else 'were it'} one of these"
    heads = ("material", likely, "", "likelihood of the rubs; share of its own touches that are as far off")
    return Section(
        "Which surface it may be",
        (
            Paragraph(f"{known.words} {_misfit(result, known)}".strip()),
            TextTable(
                _match_rows(known),
                # without a fit, no share is a result
                COLUMNS if fits else ("name", "unit", "unit", "note"),
                heads,
            ),
            Paragraph(_confusion_words(known)),
            Figures(draw),
        ),
    )


def confusion_figure(confusion: Confusion) -> Figure:
    """Return the figure of a confusion matrix: rows are touched materials, columns the recognised ones."""
    shares = confusion.shares
    # empty cells where the share is 0, so that wrong results stand out
    seen = np.where(shares > 0.0, 100.0 * shares, np.nan).ravel()
    numbered = max(shares.shape) <= MAX_NUMBERED_ROWS
    cells = Cells(
        Colouring("share", seen, "%", 0.0, 100.0, ColourScale.SHARE),
        _names(confusion.predictions),
        _names(confusion.truths),
        tuple(map(_cell_text, shares.ravel().tolist())) if numbered else (),
    )
    height = _FRAME_HEIGHT + _ROW_HEIGHT * len(shares)
    return Figure(
        title="Materials recognised by touch",
        caption=(
            "Share of touched objects of each material (row) that were taken for another (column), in per cent; "
            "correct results lie on the diagonal; for objects of no material of the library, in the last column. "
            "Empty cells elsewhere are good."
        ),
        panels=(Panel((cells,), Axis("taken for"), Axis("touched"), height=height),),
        wide=True,
    )


def _names(typed: Sequence[str]) -> tuple[str, ...]:
    """Return short names; equal ones are numbered."""
    short = [shortened(name, MAX_NAME_LENGTH) for name in typed]
    return tuple(name if short.count(name) == 1 else f"{i + 1}: {name}" for i, name in enumerate(short))


def _cell_text(share: float) -> str:
    """Return whole per cent; rare and almost certain outcomes are not rounded to never and always."""
    if not share > 0.0:
        return ""
    if share < 0.005:
        return "<1"
    return ">99" if 0.995 < share < 1.0 else f"{100.0 * share:.0f}"


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
        for i in order[:_MAX_MATCHES]
    ]


def _percent(share: float) -> str:
    if 0.0 < share < 1e-3:
        return "below 0.1 %"
    return "above 99.9 %" if 0.999 < share < 1.0 else f"{100.0 * share:.3g} %"


def _confusion_words(known: Recognised) -> str:
    """Return the basis of the confusion matrix and its share of correct results."""
    if known.confusion is None:
        return ""
    count, shown = len(known.recognition.library.materials), len(known.confusion.truths)
    drawn = int(known.confusion.counts[0].sum())
    of = "each material" if shown == count else f"each of the {shown} likeliest of {count} materials"
    return (
        f"The rubs of this run, drawn {drawn} times for {of} with the scatter of the library: "
        f"{100.0 * known.confusion.right:.3g} % are recognised correctly."
    )


def _misfit(result: "FrictionResult", known: Recognised) -> str:
    """Return the difference from the nearest material and a further rub, if no material fits; "" otherwise."""
    found, file, config = known.recognition, result.file, result.plan.config
    if found.outcome is not RecognitionOutcome.UNKNOWN or file is None or not file.friction.measured:
        return ""
    at = found.library.names.index(found.best)
    nearest, fit = found.library.materials[at], found.fit[at]
    differences = _differences(file, nearest, config.usual_calibration)
    off = [each.name for each in differences if each.deviations > _MAX_DEVIATIONS]
    which = f"What does not fit: {listed(off)}" if off else "None of these is too far off alone, all together are"
    rarely = "in less than 1 of 1000 cases" if fit < 1e-3 else f"in {100.0 * fit:.2g} % of cases"
    return (
        f"Against {nearest.name}, {listed([each.words for each in differences])}. {which}; touches of "
        f"{nearest.name} itself are as far off {rarely}. To see whether the surface is alike "
        f"elsewhere, rub another place with {config.rubbed_loads[-1]:g} N at {1e3 * config.speed:g} mm/s."
    )


@dataclass(frozen=True, slots=True)
class _Difference:
    """Difference of an estimate from a material's value.

    Attributes:
        name: Name of the quantity.
        words: Both values as text.
        deviations: Difference in standard deviations: of the measurement, between touches and between specimens.
    """

    name: str
    words: str
    deviations: float


def _differences(file: FrictionFile, nearest: Material, calibration: float) -> list[_Difference]:
    mu, c, gamma, p = np.sqrt(nearest.scatter.variances + nearest.specimen.variances).tolist()
    differences = [_relative("mu", file.friction, nearest.friction_at(file.speed), math.hypot(mu, calibration))]
    spins = [(at.spin_length, at.normal_force) for at in file.loads if at.spin_length is not None]
    spins = [(length, force) for length, force in spins if length.measured]
    for length, force in spins[:1] + spins[1:][-1:]:  # the lightest and the heaviest load
        own = math.hypot(c, math.log(force) * gamma)
        differences.append(
            _relative(f"e at {force:.3g} N", length, nearest.spin_length_at(force), own, " mm", 1e3)
        )
    for name, what, here, there, own in (
        ("gamma", " (how e grows with the load)", file.load_exponent, nearest.load_exponent, gamma),
        ("p", "", file.norm_exponent, nearest.norm_exponent, p),
    ):
        if here.measured:
            words = f"{name}{what} is {here.value:.2f} for {there:.2f}"
            differences.append(_Difference(name, words, abs(here.value - there) / math.hypot(_sd(here), own)))
    return differences


def _relative(
    name: str, here: FrictionEstimate, there: float, own: float, unit: str = "", factor: float = 1.0
) -> _Difference:
    difference = here.value / there - 1.0
    words = f"{name} is {factor * here.value:.3g}{unit} for {factor * there:.3g}{unit}"
    if abs(difference) >= _MIN_SHOWN_DIFFERENCE:
        words += f" ({100.0 * difference:+.0f} %)"
    return _Difference(name, words, abs(difference) / math.hypot(_sd(here) / here.value, own))


def _sd(found: FrictionEstimate) -> float:
    return 0.5 * (found.upper - found.lower) / SIGMAS
