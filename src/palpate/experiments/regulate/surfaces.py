"""What surfaces there are to press on, and which options belong to which; imports nothing heavy."""

from collections.abc import Mapping
from typing import Literal

SurfaceName = Literal["still", "sine", "soft", "yielding", "leaving", "missing"]

SURFACE_OPTIONS: Mapping[SurfaceName, tuple[str, ...]] = {
    "still": (),
    "sine": ("surface_amplitude", "surface_speed"),
    "soft": (),
    "yielding": ("mount_stiffness", "mount_damping_ratio", "mount_mass"),
    "leaving": ("surface_speed", "leave_time"),
    "missing": (),
}
"""Fields of `RegulateConfig` that say what a surface does. Any other is of no use to it, and refused."""

LARGEST_AMPLITUDE = 0.1
"""Half of the way that a sine surface may go [m]: an axis of a usual linear stage follows over 0.2 m at most."""

FASTEST_LEAVING = 1.0
"""Of a surface that leaves [m/s]: what falls is as fast after 5 cm."""
