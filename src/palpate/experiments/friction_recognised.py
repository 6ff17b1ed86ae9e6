"""What a library says of a surface, for the report: every material, how far the nearest is, what to touch next."""

import numpy as np

from palpate.experiments.friction_file import How
from palpate.experiments.friction_library import Recognised
from palpate.experiments.friction_run import RubbingRun
from palpate.friction.materials.recognition import Answer
from palpate.reporting.friction_data import MaterialMatch, RecognitionReport


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
    return RecognitionReport(words, matches, known.confusion, setting)


def _how_far(rubbing: RubbingRun, known: Recognised) -> str:
    """How far the nearest material is, if none fits, and which rub elsewhere tells whether that is so all over."""
    found, file, config = known.recognition, rubbing.file, rubbing.planned.config
    if found.answer is not Answer.UNKNOWN or file is None or file.friction.how is not How.MEASURED:
        return ""
    nearest = found.library.materials[found.library.names.index(found.best)]
    parts = [_apart("mu", file.friction.value, nearest.friction_at(file.speed), "", 1.0)]
    if file.spin_length is not None and file.spin_length.how is How.MEASURED:
        parts.append(_apart("e at 1 N", file.spin_length.value, nearest.spin_length, " mm", 1e3))
    fit = found.fit[found.library.names.index(found.best)]
    rarely = "in less than 1 of 1000 cases" if fit < 1e-3 else f"in {100.0 * fit:.2g} % of cases"
    return (
        f"Against {nearest.name}, {' and '.join(parts)}; its own touches are as far off {rarely}. "
        f"To see whether the surface is alike elsewhere, rub another place with {config.rubbed_loads[-1]:g} N at "
        f"{1e3 * config.speed:g} mm/s."
    )


def _apart(name: str, here: float, there: float, unit: str, factor: float) -> str:
    apart = 100.0 * (here / there - 1.0)
    return f"{name} is {factor * here:.3g}{unit} for {factor * there:.3g}{unit} ({apart:+.0f} %)"
