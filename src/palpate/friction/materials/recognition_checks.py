"""Whether a material found by touch can be relied on."""

from collections.abc import Iterable, Iterator, Mapping, Sequence

import numpy as np

from palpate.estimation import Assumption, BrokenAssumption, Verdict
from palpate.friction.materials.recognition import (
    CALIBRATION,
    CONFIDENCE,
    FALSE_REJECTION,
    Recognition,
    RecognitionOutcome,
    recognise,
)
from palpate.friction.materials.touch_evidence import NeverSlipped, TouchEvidence

NAMED = 0.01
"""Probability from which on a material is named among those that it may be."""

FEWEST = 3
"""Touches of which one may be left out."""


def recognition_verdict(
    found: Recognition,
    touches: Sequence[TouchEvidence | NeverSlipped],
    prior: Mapping[str, float] | None = None,
    *,
    calibration: float = CALIBRATION,
) -> Verdict:
    """Return why the likeliest material is not to be relied on; OK if it is beyond doubt.

    Args:
        found: From these touches, by `recognise` with its usual levels.
        touches: That it was found from.
        prior: As given to `recognise`.
        calibration: Likewise.
    """
    without = (
        recognise(found.library, [*touches[:i], *touches[i + 1 :]], prior, calibration=calibration)
        for i in range(len(touches) if len(touches) >= FEWEST else 0)
    )
    return Verdict((*_outcome(found, touches), *_influence(found, without)))


def _outcome(found: Recognition, touches: Sequence[TouchEvidence | NeverSlipped]) -> Iterator[BrokenAssumption]:
    if not any(isinstance(touch, TouchEvidence) for touch in touches):
        yield BrokenAssumption(
            Assumption.ENOUGH_DATA,
            f"none of {len(touches)} touches slipped",
            "rub further, or with less force, until it slips",
        )
    if found.outcome is RecognitionOutcome.UNKNOWN:
        yield BrokenAssumption(
            Assumption.NOISE_LEVEL,
            f"no material of the library fits: {found.fit.max():.1e} of the touches of {found.best} would be as "
            f"far off, at least {FALSE_REJECTION:g}",
            "touch another place, or add the material to the library",
        )
    elif found.outcome is RecognitionOutcome.UNDECIDED:
        order = np.argsort(-found.posterior).tolist()
        named = [
            f"{found.library.names[i]} ({found.posterior[i]:.0%})" for i in order if found.posterior[i] > NAMED
        ]
        if found.posterior.max() >= CONFIDENCE:
            named = [found.best, f"none of the library ({found.stranger:.0%})"]
        yield BrokenAssumption(
            Assumption.UNIQUE, f"unclear between {' and '.join(named[:3])}", "make the touch that tells most"
        )


def _influence(found: Recognition, without: Iterable[Recognition]) -> Iterator[BrokenAssumption]:
    """Without each touch it must be the same material, or none still."""
    if found.outcome is RecognitionOutcome.UNDECIDED:
        return
    for i, other in enumerate(without):
        if (name := _name(other)) != _name(found):
            yield BrokenAssumption(
                Assumption.EVEN_INFLUENCE,
                f"without touch {i} it would be {name}",
                "touch again, at the same place and at others",
            )
            return


def _name(found: Recognition) -> str:
    return "none of the library" if found.outcome is RecognitionOutcome.UNKNOWN else found.best
