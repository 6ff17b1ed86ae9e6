"""Contacts as rows of text: CSV or JSON lines, in SI units, every digit kept."""

import csv
import io
import json
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from palpate.errors import FloatArray
from palpate.sensing.contact import Contacts, ContactStatus
from palpate.sensing.uncertainty import ContactUncertainties, UncertaintyStatus

_JSON_NUMBER = re.compile(r"-?(?:0|[1-9][0-9]*)(?:\.[0-9]+)?(?:[eE][+-]?[0-9]+)?")


@dataclass(frozen=True, slots=True)
class Quantity:
    """One output quantity.

    Attributes:
        name: What it is.
        unit: Suffix with its unit, "" where it has none.
        is_vector: Whether it has components x, y, z.
    """

    name: str
    unit: str
    is_vector: bool

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of its CSV columns."""
        if self.is_vector:
            return tuple(f"{self.name}_{axis}{self.unit}" for axis in "xyz")
        return (self.name + self.unit,)


CONTACT_QUANTITIES = (
    Quantity("centroid", "_m", True),
    Quantity("normal", "", True),
    Quantity("force", "_N", True),
    Quantity("normal_force", "_N", False),
    Quantity("tangential_force", "_N", True),
    Quantity("spin_torque", "_Nm", False),
    Quantity("condition", "", False),
)

DEVIATION_QUANTITIES = (
    Quantity("centroid_sd", "_m", True),
    Quantity("normal_sd", "", True),
    Quantity("normal_force_sd", "_N", False),
    Quantity("tangential_force_sd", "_N", True),
    Quantity("spin_torque_sd", "_Nm", False),
)


class ContactTable:
    """One column per number; empty where there is none."""

    def __init__(self, copied: Sequence[str], has_deviations: bool) -> None:
        """Take the names of the copied columns, and whether standard deviations come along."""
        self._columns = (*copied, *self.own_names(has_deviations))

    @staticmethod
    def own_names(has_deviations: bool) -> tuple[str, ...]:
        """Return the names that no copied column may have."""
        columns = (column for quantity in _quantities(has_deviations) for column in quantity.columns)
        return (*columns, *_statuses(has_deviations))

    def header(self) -> str:
        """Return the line of column names."""
        return _csv_lines((self._columns,))

    def rows(
        self, copied: Sequence[tuple[str, ...]], contacts: Contacts, deviations: ContactUncertainties | None
    ) -> str:
        """Return a block of rows."""
        table = np.column_stack(_columns(contacts, deviations)).tolist()
        return _csv_lines(
            (*text, *(repr(value) if value - value == 0.0 else "" for value in numbers), *status)
            for text, numbers, status in zip(copied, table, _status_names(contacts, deviations), strict=True)
        )


class JsonLines:
    """One object per line, vectors as lists; null where there is no number."""

    def __init__(self, copied: Sequence[str], has_deviations: bool) -> None:
        """Take the names of the copied columns, and whether standard deviations come along."""
        self._keys = [json.dumps(key) for key in (*copied, *self.own_names(has_deviations))]

    @staticmethod
    def own_names(has_deviations: bool) -> tuple[str, ...]:
        """Return the names that no copied column may have."""
        keys = (quantity.name + quantity.unit for quantity in _quantities(has_deviations))
        return (*keys, *_statuses(has_deviations))

    def header(self) -> str:
        """Return nothing: every line names its values."""
        return ""

    def rows(
        self, copied: Sequence[tuple[str, ...]], contacts: Contacts, deviations: ContactUncertainties | None
    ) -> str:
        """Return a block of lines."""
        columns = _columns(contacts, deviations)
        lines = []
        for i, (text, status) in enumerate(zip(copied, _status_names(contacts, deviations), strict=True)):
            values = [_json_text(field) for field in text]
            values += [_json_numbers(column[i].tolist()) for column in columns]
            values += [json.dumps(name) for name in status]
            pairs = (f"{key}: {value}" for key, value in zip(self._keys, values, strict=True))
            lines.append("{" + ", ".join(pairs) + "}\n")
        return "".join(lines)


def _quantities(has_deviations: bool) -> tuple[Quantity, ...]:
    return CONTACT_QUANTITIES + (DEVIATION_QUANTITIES if has_deviations else ())


def _statuses(has_deviations: bool) -> tuple[str, ...]:
    return ("status", "uncertainty") if has_deviations else ("status",)


def _columns(contacts: Contacts, deviations: ContactUncertainties | None) -> list[FloatArray]:
    # + 0.0: minus zero, which means nothing here, reads as zero
    columns = [getattr(contacts, quantity.name) + 0.0 for quantity in CONTACT_QUANTITIES]
    if deviations is not None:
        for quantity in DEVIATION_QUANTITIES:
            spread: FloatArray = getattr(deviations, quantity.name.removesuffix("_sd"))
            variance = np.diagonal(spread, axis1=1, axis2=2) if quantity.is_vector else spread
            columns.append(np.sqrt(np.maximum(variance, 0.0)))
    return columns


def _status_names(contacts: Contacts, deviations: ContactUncertainties | None) -> Iterable[tuple[str, ...]]:
    names = [ContactStatus(value).name for value in contacts.status.tolist()]
    if deviations is None:
        return ((name,) for name in names)
    trust = [UncertaintyStatus(value).name for value in deviations.status.tolist()]
    return zip(names, trust, strict=True)


def _csv_lines(rows: Iterable[Iterable[str]]) -> str:
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows(rows)
    return text.getvalue()


def _json_text(field: str) -> str:
    """Return a copied field: what JSON calls a number stays one, digit by digit; anything else is a string."""
    stripped = field.strip()
    return stripped if _JSON_NUMBER.fullmatch(stripped) else json.dumps(field)


def _json_numbers(value: float | list[float]) -> str:
    if isinstance(value, list):
        return "[" + ", ".join(map(_json_numbers, value)) + "]"
    return repr(value) if value - value == 0.0 else "null"
