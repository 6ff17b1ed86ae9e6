"""What a fingertip needs compiled is compiled when touch is set up, never in a control period."""

from typing import Any

import numpy as np
import pytest

from palpate import CompliantTip, Sphere, Superellipsoid
from palpate.runtime import ArmSample, Finger, Sample, Touch, WrenchSample
from palpate.sensing.kernels.implicit import solver_for
from palpate.spatial import IDENTITY, ZERO


@pytest.mark.parametrize(
    "surface", [Superellipsoid((0.01, 0.01, 0.02), 4.0), CompliantTip(Sphere(0.01), 5e3)], ids=["implicit", "soft"]
)
def test_sensing_compiles_nothing(surface):
    touch = Touch(Finger(surface))
    solver: Any = solver_for(surface.evaluate, surface.level)  # compiled: it knows its signatures
    compiled = list(solver.signatures)
    assert compiled
    arm = ArmSample(0.0, ZERO, IDENTITY, ZERO)
    rng = np.random.default_rng(0)
    for _ in range(20):
        wrench = tuple((rng.normal(size=6) * [1, 1, 1, 0.01, 0.01, 0.01]).tolist())
        touch.sense(Sample(0.0, arm, (WrenchSample(0.0, wrench, ZERO),)))
    assert list(solver.signatures) == compiled
