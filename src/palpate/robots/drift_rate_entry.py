"""How fast the zero of a finger's sensor may wander: what `fingers[].drift` may be."""

import msgspec

from palpate.errors import not_negative
from palpate.runtime.robot_ranges import at_most

FASTEST_FORCE, FASTEST_MOMENT = 1.0, 0.1
"""[N/s, N m/s] Faster is no zero."""


class DriftRateEntry(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Largest drift of a zero after its tare, each axis up or down; `palpate calibrate` measures it at rest.

    Attributes:
        force: [N/s]
        moment: [N m/s]
    """

    force: float = msgspec.field(name="force_N_per_s", default=0.0)
    moment: float = msgspec.field(name="moment_Nm_per_s", default=0.0)

    def __post_init__(self) -> None:
        for key, value, most, unit in (
            ("force_N_per_s", self.force, FASTEST_FORCE, "N/s"),
            ("moment_Nm_per_s", self.moment, FASTEST_MOMENT, "N m/s"),
        ):
            not_negative(key, value, unit)
            at_most(key, value, most, unit)
