"""Confusion matrices of material recognition, from touches drawn at random from the library."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from palpate.errors import FloatArray, InvalidValueError
from palpate.friction.materials.library import MaterialLibrary
from palpate.friction.materials.material import PARAMETERS, Material
from palpate.friction.materials.recognition import CALIBRATION, Recognition, RecognitionOutcome, recognise
from palpate.friction.materials.touch_evidence import TouchEvidence

IntArray = npt.NDArray[np.int64]

UNKNOWN = "unknown"
"""Name of the last column of a confusion matrix."""


@dataclass(frozen=True, slots=True, eq=False)
class Confusion:
    """How often which material was taken for which.

    Attributes:
        truths: What was touched, one for each row.
        predictions: What it was taken for, one for each column, the last of them `UNKNOWN`.
        counts: Shape (rows, columns).
    """

    truths: tuple[str, ...]
    predictions: tuple[str, ...]
    counts: IntArray

    def __post_init__(self) -> None:
        if self.counts.shape != (len(self.truths), len(self.predictions)) or (self.counts < 0).any():
            raise InvalidValueError(
                f"counts has shape {self.counts.shape}: must be ({len(self.truths)}, {len(self.predictions)}), "
                "nothing below 0"
            )

    @property
    def shares(self) -> FloatArray:
        """Of each row; NaN where it is empty. Shape (rows, columns)."""
        total = self.counts.sum(axis=1, keepdims=True)
        return np.asarray(np.where(total > 0, self.counts / np.maximum(total, 1), np.nan))

    @property
    def right(self) -> float:
        """Share of all predictions that name what it was, `UNKNOWN` for what is in no column; NaN without any."""
        total = int(self.counts.sum())
        columns = [
            self.predictions.index(truth if truth in self.predictions else UNKNOWN) for truth in self.truths
        ]
        good = int(self.counts[np.arange(len(self.truths)), columns].sum())
        return good / total if total else float("nan")


def confusion(library: MaterialLibrary, cases: Iterable[tuple[str, Recognition]]) -> Confusion:
    """Return the confusion matrix of some cases: what was touched, and what was made of it.

    The result is the likeliest material, also where more touches were asked for, or `UNKNOWN`. What is not in the
    library gets a row of its own, below the others.
    """
    predictions = (*library.names, UNKNOWN)
    rows: dict[str, list[int]] = {name: [0] * len(predictions) for name in library.names}
    for truth, found in cases:
        row = rows.setdefault(truth, [0] * len(predictions))
        row[predictions.index(UNKNOWN if found.outcome is RecognitionOutcome.UNKNOWN else found.best)] += 1
    return Confusion(tuple(rows), predictions, np.array(list(rows.values()), dtype=np.int64))


def drawn_again(
    material: Material,
    touches: Sequence[TouchEvidence],
    rng: np.random.Generator,
    calibration: float = CALIBRATION,
) -> list[TouchEvidence]:
    """Return the same touches of another object: one specimen of a material, drawn at random.

    Args:
        material: That is touched.
        touches: Whose rows, errors and speeds these have.
        rng: Source of chance.
        calibration: Standard deviation of the sensor's error that all touches share, relative.
    """
    specimen = drawn_specimen(material, rng)
    specimen[:2] += calibration * rng.normal(size=2)
    drawn = []
    for touch in touches:
        here = specimen + np.sqrt(material.scatter.variances) * rng.normal(size=PARAMETERS)
        slip = float(np.hypot(touch.speed, material.spin_length_at(touch.normal_force) * touch.spin))
        here[0] += np.log(material.friction_at(slip) / material.kinetic_friction)
        felt = rng.multivariate_normal(touch.rows @ here, touch.covariance, method="eigh")
        drawn.append(replace(touch, values=felt))
    return drawn


def confusion_of_touches(
    library: MaterialLibrary,
    touches: Sequence[TouchEvidence],
    trials: int,
    rng: np.random.Generator,
    calibration: float = CALIBRATION,
) -> Confusion:
    """Return how often each material of a library is taken for which after touches like those that were made.

    Args:
        library: Of materials.
        touches: Those that were made; their values do not matter.
        trials: Specimens of each material.
        rng: Source of chance.
        calibration: Standard deviation of the sensor's error that all touches share, relative.
    """
    return confusion(
        library,
        (
            (
                material.name,
                recognise(library, drawn_again(material, touches, rng, calibration), calibration=calibration),
            )
            for material in library.materials
            for _ in range(trials)
        ),
    )


def drawn_specimen(material: Material, rng: np.random.Generator) -> FloatArray:
    """Return ln mu_k, ln c, gamma and p of a specimen of a material drawn at random, shape (4,)."""
    return np.asarray(material.parameters + np.sqrt(material.specimen.variances) * rng.normal(size=PARAMETERS))
