"""Recipes: which variables a data package has, in which order."""

import struct
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import chain

from palpate.errors import InvalidValueError
from palpate.hw.emulators.ur.variables import Values, VariableType

MOST_BYTES_OF_NAMES = 2048
"""In one request, by the maker's guide."""

NOT_FOUND = "NOT_FOUND"
IN_USE = "IN_USE"


@dataclass(frozen=True, slots=True, eq=False)
class Recipe:
    """What is in a data package after its recipe id.

    Attributes:
        id: 1 for a connection's first.
        names: Of the variables.
        types: Of each.
        layout: Of the whole payload, the id included.
    """

    id: int
    names: tuple[str, ...]
    types: tuple[VariableType, ...]
    layout: struct.Struct

    def pack(self, values: Mapping[str, Values]) -> bytes:
        """Return the payload that says how things are."""
        return self.layout.pack(self.id, *chain.from_iterable([values[name] for name in self.names]))

    def unpack(self, payload: bytes) -> dict[str, Values]:
        """Return what a payload says.

        Raises:
            InvalidValueError: Its length is not that of the recipe.
        """
        if len(payload) != self.layout.size:
            raise InvalidValueError(
                f"data package of {len(payload)} bytes for recipe {self.id}: must be {self.layout.size}"
            )
        numbers = self.layout.unpack(payload)
        values: dict[str, Values] = {}
        at = 1
        for name, kind in zip(self.names, self.types, strict=True):
            values[name] = numbers[at : at + kind.count]
            at += kind.count
        return values


def recipe(number: int, names: Sequence[str], types: Mapping[str, VariableType]) -> Recipe:
    """Return a recipe of variables that are all there."""
    kinds = tuple(types[name] for name in names)
    return Recipe(number, tuple(names), kinds, struct.Struct(">B" + "".join(kind.code for kind in kinds)))


def requested_names(payload: bytes) -> tuple[str, ...]:
    """Return the names of a request, without the empty last one that ur_rtde's trailing comma makes.

    Raises:
        InvalidValueError: Not ASCII, too long, or no names.
    """
    if len(payload) > MOST_BYTES_OF_NAMES:
        raise InvalidValueError(f"{len(payload)} bytes of names: must be at most {MOST_BYTES_OF_NAMES}")
    try:
        names = payload.decode("ascii").split(",")
    except UnicodeDecodeError:
        raise InvalidValueError("names of variables that are not ASCII") from None
    if not names[-1]:
        names.pop()
    if not names:
        raise InvalidValueError("a recipe without a variable: name one at least")
    return tuple(names)
