"""What a library says of a surface, for the report: every material, how far the nearest is, what to touch next."""

import math
from dataclasses import dataclass

import numpy as np

from palpate.experiments.friction.library import Recognised
from palpate.experiments.friction.report_data import MaterialMatch, RecognitionReport
from palpate.experiments.friction.run import RubbingRun, listed
from palpate.experiments.friction.summary import SIGMAS
from palpate.friction.friction_file import Finding, FrictionFile, How
from palpate.friction.materials.material import Material
from palpate.friction.materials.recognition import Answer

APART = 2.58
"""Standard deviations from which on a number counts as one that does not fit: so far off is 1 of 100."""

ALIKE = 0.005
"""Relative: less apart is told without a percentage."""


def recognition_report(rubbing: RubbingRun) -> RecognitionReport | None:
    """Return it; None without a library."""
    known = rubbing.recognised
    if known is None:
        return None
    found = known.recognition
    likelihood = found.known.log_likelihood[:-1]
    order = np.lexsort((-likelihood, -found.posterior)).tolist()
    matches = tuple(
        MaterialMatch(
            found.library.names[i],
            float(likelihood[i] - likelihood.max()),
            float(found.posterior[i]),
            float(found.fit[i]),
        )
        for i in order
    )
    setting = ""
    if known.confusion is not None:
        count, shown = len(found.library.materials), len(known.confusion.truths)
        drawn = int(known.confusion.counts[0].sum())
        of = "each material" if shown == count else f"each of the {shown} likeliest of {count} materials"
        setting = (
            f"The rubs of this run, drawn {drawn} times for {of} as the library says that it scatters: "
            f"{100.0 * known.confusion.right:.3g} % of the answers are right."
        )
    words = f"{known.words} {_how_far(rubbing, known)}".strip()
    fits = found.answer is not Answer.UNKNOWN
    return RecognitionReport(words, matches, known.confusion, setting, fits)


def _how_far(rubbing: RubbingRun, known: Recognised) -> str:
    """What does not fit the nearest material, if none fits, and which rub tells whether it is so elsewhere."""
    found, file, config = known.recognition, rubbing.file, rubbing.planned.config
    if found.answer is not Answer.UNKNOWN or file is None or file.friction.how is not How.MEASURED:
        return ""
    nearest = found.library.materials[found.library.names.index(found.best)]
    told = _told_apart(file, nearest, config.calibration)
    off = [each.name for each in told if each.deviations > APART]
    which = f"What does not fit: {listed(off)}" if off else "None of these is too far off alone, all together are"
    fit = found.fit[found.library.names.index(found.best)]
    rarely = "in less than 1 of 1000 cases" if fit < 1e-3 else f"in {100.0 * fit:.2g} % of cases"
    return (
        f"Against {nearest.name}, {listed([each.words for each in told])}. {which}; touches of {nearest.name} "
        f"itself are as far off {rarely}. To see whether the surface is alike elsewhere, rub another place with "
        f"{config.rubbed_loads[-1]:g} N at {1e3 * config.speed:g} mm/s."
    )


@dataclass(frozen=True, slots=True)
class _Apart:
    """How far one number that was found is from a material's.

    Attributes:
        name: Of the number.
        words: Both, as they are told.
        deviations: Apart, over the standard deviation of that: of the measurement, from touch to touch and from
            specimen to specimen.
    """

    name: str
    words: str
    deviations: float


def _told_apart(file: FrictionFile, nearest: Material, calibration: float) -> list[_Apart]:
    """Everything that was measured and that recognition goes by."""
    touch, specimen = nearest.scatter.variances, nearest.specimen.variances
    mu, c, gamma, p = np.sqrt(touch + specimen).tolist()
    told = [_relative("mu", file.friction, nearest.friction_at(file.speed), math.hypot(mu, calibration))]
    spun = [at for at in file.loads if at.spin_length is not None and at.spin_length.how is How.MEASURED]
    for at in dict.fromkeys((0, len(spun) - 1)) if spun else ():
        length, force = spun[at].spin_length, spun[at].normal_force
        assert length is not None
        own = math.hypot(c, math.log(force) * gamma)
        there = nearest.spin_length_at(force)
        told.append(_relative(f"e at {force:.3g} N", length, there, own, " mm", 1e3))
    for name, what, here, there, own in (
        ("gamma", " (how e grows with the load)", file.load_exponent, nearest.load_exponent, gamma),
        ("p", "", file.norm_exponent, nearest.norm_exponent, p),
    ):
        if here.how is How.MEASURED:
            words = f"{name}{what} is {here.value:.2f} for {there:.2f}"
            told.append(_Apart(name, words, abs(here.value - there) / math.hypot(_sd(here), own)))
    return told


def _relative(name: str, here: Finding, there: float, own: float, unit: str = "", factor: float = 1.0) -> _Apart:
    apart = here.value / there - 1.0
    words = f"{name} is {factor * here.value:.3g}{unit} for {factor * there:.3g}{unit}"
    if abs(apart) >= ALIKE:
        words += f" ({100.0 * apart:+.0f} %)"
    return _Apart(name, words, abs(apart) / math.hypot(_sd(here) / here.value, own))


def _sd(found: Finding) -> float:
    return 0.5 * (found.upper - found.lower) / SIGMAS
