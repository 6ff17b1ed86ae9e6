"""Recognition of the rubbed surface in a library, and the most informative next touch."""

import importlib.resources
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import msgspec
import numpy as np

from palpate.errors import InvalidValueError
from palpate.estimation import Verdict
from palpate.experiments.friction.config import LIBRARY_TEXT, FrictionConfig
from palpate.experiments.friction.found import FrictionFound
from palpate.experiments.friction.pooled import pooled
from palpate.friction.materials.library import MaterialLibrary, read_materials
from palpate.friction.materials.next_touch import Advice, TouchAdvice, candidate_touches, next_touch
from palpate.friction.materials.recognition import Recognition, RecognitionOutcome, recognise
from palpate.friction.materials.recognition_checks import recognition_verdict
from palpate.friction.materials.touch_evidence import STROKE_ROW, NeverSlipped, TouchEvidence, twist_row
from palpate.friction.materials.trials import Confusion, confusion_of_touches
from palpate.friction.rubbing.sliding import FrictionBound, FrictionMeasured
from palpate.friction.rubbing.twisting import SpinBound, SpinMeasured
from palpate.strict_decode import load

DRAWN = 500
"""Objects for the confusion matrix, of all materials together: of ten, a share of 5 % is known to 3 %."""

MOST_CONFUSED = 20
"""Materials in it: more are illegible."""

SHIPPED = Path("simulated")
"""Stands for the library that comes with palpate."""


@dataclass(frozen=True, slots=True, eq=False)
class Recognised:
    """Recognition of the rubbed surface in a library.

    Attributes:
        recognition: Of its materials.
        advice: What to touch next.
        verdict: Whether the material is beyond doubt.
        confusion: How often the likeliest materials are taken for each other after touches like these; None if
            nothing slipped.
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
        """All of it, in sentences."""
        found, advice = self.recognition, self.advice
        order = np.argsort(found.posterior)[::-1][:3]
        likely = ", ".join(
            f"{found.library.names[i]} {100.0 * found.posterior[i]:.3g} %"
            for i in order.tolist()
            if found.posterior[i] > 0.005
        )
        if found.outcome is RecognitionOutcome.UNKNOWN:
            verdict = f"No material of the library fits it; {found.best} comes nearest."
        elif found.outcome is RecognitionOutcome.RECOGNISED:
            verdict = f"It is {found.best}, as far as the library goes ({likely}). No further touch is needed."
        else:
            verdict = f"It may be one of several: {likely}."
        if advice.advice is Advice.TOUCH and advice.slip is not None:
            slip = advice.slip
            how = (
                f"a stroke at {1e3 * slip.speed:g} mm/s" if slip.spin == 0.0 else f"a twist at {slip.spin:g} rad/s"
            )
            return f"{verdict} Most informative next touch, at another place: {how}, with {slip.normal_force:g} N."
        if advice.advice is Advice.NOTHING_TELLS:
            return f"{verdict} No stroke or twist with these loads distinguishes them."
        return verdict


def library_text(config: FrictionConfig, texts: Mapping[str, str]) -> str:
    """Return the text of the library that a configuration names; "" if it names none.

    Args:
        config: That names it.
        texts: Of a log, which has kept what was read then.

    Raises:
        InvalidValueError: It cannot be read, or something in it is wrong.
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
    """Return the file of the library that a configuration names; None if it names none."""
    if config.library is not None and config.library == SHIPPED and not config.library.exists():
        return Path(str(importlib.resources.files("palpate").joinpath("materials/simulated.yaml")))
    return config.library


def recognised(
    library: MaterialLibrary, found: FrictionFound, config: FrictionConfig, most_spin: float
) -> Recognised | None:
    """Return the material recognised in a library; None if nothing was rubbed.

    Args:
        library: Of materials.
        found: By one run.
        config: Of it: loads and speed of the touch that would be next.
        most_spin: How fast the tip can turn [rad/s]; 0: it cannot.
    """
    touches = _touches(found)
    if not touches:
        return None
    recognition = recognise(library, touches, calibration=config.usual_calibration)
    spins = (most_spin,) if most_spin > 0.0 else ()
    advice = next_touch(recognition, candidate_touches(config.rubbed_loads, (config.speed,), spins))
    verdict = recognition_verdict(recognition, touches, calibration=config.usual_calibration)
    return Recognised(recognition, advice, verdict, _confused(recognition, touches, config))


def _confused(
    found: Recognition, touches: Sequence[TouchEvidence | NeverSlipped], config: FrictionConfig
) -> Confusion | None:
    slipped = [touch for touch in touches if isinstance(touch, TouchEvidence)]
    if not slipped:
        return None
    likeliest = np.argsort(found.known.log_likelihood[:-1])[::-1][:MOST_CONFUSED]
    materials = tuple(found.library.materials[i] for i in sorted(likeliest.tolist()))
    return confusion_of_touches(
        msgspec.structs.replace(found.library, materials=materials),
        slipped,
        DRAWN // len(materials),
        np.random.default_rng(config.seed),
        config.usual_calibration,
    )


def _touches(found: FrictionFound) -> list[TouchEvidence | NeverSlipped]:
    """One touch: all was rubbed at one place, and every load shares the deviation of that place."""
    touches: list[TouchEvidence | NeverSlipped] = []
    for at in found.loads:
        if isinstance(at.friction, FrictionBound):
            touches.append(NeverSlipped.of_stroke(at.friction))
        if isinstance(at.spin, SpinBound):
            touches.append(NeverSlipped.of_twist(at.spin))
    slipped = [at.friction for at in found.loads if isinstance(at.friction, FrictionMeasured)]
    if not slipped:
        return touches
    speed = sum(each.speed for each in slipped) / len(slipped)
    if found.fitted is not None:
        return [*touches, TouchEvidence.of_fit(found.fitted, speed)]
    mu = pooled([each.friction for each in slipped])
    values, rows = [math.log(mu.value)], [STROKE_ROW]
    errors = [mu.standard_deviation / mu.value]
    for at in found.loads:
        if isinstance(at.spin, SpinMeasured):
            ratio = at.spin.torque_ratio
            values.append(math.log(ratio.value))
            rows.append(twist_row(at.spin.normal_force))
            errors.append(ratio.standard_deviation / ratio.value)
    touches.append(TouchEvidence(np.array(values), np.array(rows), np.diag(np.square(errors)), speed))
    return touches
