"""Every kind of fault: tests, campaign and `docs/faults.md` have this table."""

from collections.abc import Sequence

from faults import input as inputs
from faults import network, on_the_wire, orphans, process, resource_faults, slow_starts, supervision
from faults.kind import Domain, Kind

_MODULES = (supervision, process, orphans, resource_faults, network, slow_starts, on_the_wire, inputs)

_BY_DOMAIN = list(Domain)

KINDS: Sequence[Kind] = sorted(
    (kind for module in _MODULES for kind in module.KINDS), key=lambda kind: _BY_DOMAIN.index(kind.domain)
)
"""By domain."""
