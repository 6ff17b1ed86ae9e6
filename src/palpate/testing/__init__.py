"""Checks for your own back ends, sensors, arms, hands, controllers and fingertips: `check_...(make)` in any test.

Each check examines one piece against the protocol by which palpate uses it. It raises one `ConformanceError` that
lists observations, expectations and remedies. No test framework is needed.
"""

from palpate.testing.arm import check_arm
from palpate.testing.backend import check_backend
from palpate.testing.controller import check_controller, on_plane
from palpate.testing.hand import check_hand
from palpate.testing.nonconformity import ConformanceError, Nonconformity
from palpate.testing.sensor import check_sensor
from palpate.testing.spring_plane import SpringPlane
from palpate.testing.surface import check_surface

__all__ = [
    "ConformanceError",
    "Nonconformity",
    "SpringPlane",
    "check_arm",
    "check_backend",
    "check_controller",
    "check_hand",
    "check_sensor",
    "check_surface",
    "on_plane",
]
