"""Named parts of one long vector."""

from __future__ import annotations

from typing import Any

import casadi

__all__ = ["RecordLayout"]


class RecordLayout:
    """Where each part of a vector lies.

    Attributes:
        size: Length of the vector.
        where: Slice of each part.
    """

    def __init__(self, **sizes: int) -> None:
        """Take the parts' names and lengths, in order."""
        self.where: dict[str, slice] = {}
        start = 0
        for name, size in sizes.items():
            self.where[name] = slice(start, start + size)
            start += size
        self.size = start

    def parts(self, vector: Any) -> dict[str, Any]:
        """Return the parts of a CasADi vector."""
        return {name: vector[where] for name, where in self.where.items()}

    def pack(self, **parts: Any) -> Any:
        """Return the vector of all parts."""
        if parts.keys() != self.where.keys():
            raise TypeError(f"parts {sorted(parts)} given, {sorted(self.where)} wanted")
        ordered = [casadi.densify(parts[name]) for name in self.where]
        for name, value in zip(self.where, ordered, strict=True):
            where = self.where[name]
            if value.numel() != where.stop - where.start:
                raise TypeError(f"{name} has {value.numel()} entries, {where.stop - where.start} wanted")
        return casadi.vertcat(*ordered)
