"""Touches of materials drawn at random, for trials of recognition."""

from collections.abc import Sequence

import numpy as np

from palpate.errors import FloatArray
from palpate.friction.materials.material import PARAMETERS, Material
from palpate.friction.materials.next_touch import touch_error
from palpate.friction.materials.touch_evidence import STROKE_ROW, TouchEvidence, twist_row
from palpate.friction.materials.trials import drawn_specimen
from palpate.friction.rubbing.estimate import SensorErrors
from palpate.friction.rubbing.stroke_plan import PlannedSlip


def drawn_touches(
    material: Material,
    slips: Sequence[PlannedSlip],
    rng: np.random.Generator,
    specimen: FloatArray | None = None,
) -> list[TouchEvidence]:
    """Return touches of one specimen drawn at random, as the material scatters and a Nano17 class sensor errs.

    Args:
        material: That is touched.
        slips: Strokes and twists to make.
        rng: Source of chance.
        specimen: ln mu_k, ln c, gamma and p of it, shape (4,); drawn if not given.
    """
    errors = SensorErrors()
    if specimen is None:
        specimen = drawn_specimen(material, rng)
    touches = []
    for slip in slips:
        h = np.array(STROKE_ROW if slip.spin == 0.0 else twist_row(slip.normal_force))
        here = specimen + np.sqrt(material.scatter.variances) * rng.normal(size=PARAMETERS)
        speed = float(np.hypot(slip.speed, material.spin_length_at(slip.normal_force) * slip.spin))
        log_ratio = float(h @ here) + float(np.log(material.friction_at(speed) / material.kinetic_friction))
        error = float(touch_error(slip, np.exp(log_ratio), errors))
        ratio = float(np.exp(log_ratio + error * rng.normal()))
        if slip.spin == 0.0:
            touches.append(TouchEvidence.stroke(ratio, error, slip.speed))
        else:
            touches.append(TouchEvidence.twist(ratio, error, slip.normal_force, slip.spin))
    return touches
