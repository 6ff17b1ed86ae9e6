"""Every kind of fault, for tests, campaign and `docs/faults.md`."""

from collections.abc import Mapping, Sequence

from faults import input as inputs
from faults import network, on_the_wire, orphans, process, resource_faults, slow_starts, supervision
from faults.kind import Domain, Kind

_MODULES = (supervision, process, orphans, resource_faults, network, slow_starts, on_the_wire, inputs)

_BY_DOMAIN = list(Domain)

KINDS: Sequence[Kind] = sorted(
    (kind for module in _MODULES for kind in module.KINDS), key=lambda kind: _BY_DOMAIN.index(kind.domain)
)
"""By domain."""

STARVED = "now and then at a load of 8 to 16: the emulated servos are silent for longer than the 0.6 s allowed"
PACED = "at a load of 8 to 16: it is about the timing of our own threads"

KNOWN: Mapping[str, str] = {
    **dict.fromkeys(
        (
            "wire: no. 1: RTDE closed (FIN)",
            "wire: Bota silent",
            "wire: Bota out of range",
            "wire: Bota unplugged",
            "wire: gap of 5 records",
            "wire: records swapped",
            "wire: counters begin anew",
        ),
        STARVED,
    ),
    **dict.fromkeys(("wire: no. 13: other threads stopped", "wire: no. 14: periods of whole milliseconds"), PACED),
}
"""Kinds that are not always right yet, and the cause; the short form in the tests omits them."""
