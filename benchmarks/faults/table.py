"""Every kind of fault: tests, campaign and `docs/faults.md` have this table."""

from faults import network, process, resource_faults, supervision

KINDS = (*supervision.KINDS, *process.KINDS, *resource_faults.KINDS, *network.KINDS)
"""By domain."""
