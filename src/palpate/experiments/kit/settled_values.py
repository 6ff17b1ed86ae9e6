"""Values of a configuration as its fields say them: a script may name a folder by a string, but no number."""

from dataclasses import fields
from numbers import Real
from pathlib import Path
from typing import TYPE_CHECKING

from palpate.errors import InvalidValueError, shown

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

NUMBERS = (float, float | None)
PATHS = (Path, Path | None)
"""Types of fields, as they are declared."""


def settle(config: "DataclassInstance") -> None:
    """Make paths of strings where a configuration has paths, before anything of it is compared or used.

    Args:
        config: May be frozen; meant for its `__post_init__`.

    Raises:
        InvalidValueError: A number is something else, as a string from a form or a file.
    """
    for field in fields(config):
        value = getattr(config, field.name)
        if field.type in PATHS and isinstance(value, str):
            object.__setattr__(config, field.name, Path(value))
        elif field.type in NUMBERS and not isinstance(value, Real):
            if value is None and field.type is not float:
                continue
            raise InvalidValueError(f"{field.name} = {shown(value)}: must be a number")
