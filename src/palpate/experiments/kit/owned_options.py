"""Options that belong to some choices of another, as a radius to a spiral: refused with the rest."""

from collections.abc import Mapping
from dataclasses import fields
from typing import TYPE_CHECKING, Any

from palpate.errors import InvalidValueError

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

Owners = Mapping[Any, tuple[str, ...]]  # a mapping by Literal names is none by str
"""By each choice, the names of the options that belong to it."""


def owned_names(owners: Owners) -> tuple[str, ...]:
    """Return every option that belongs to some choice."""
    return tuple(dict.fromkeys(name for names in owners.values() for name in names))


def given_owned(config: "DataclassInstance", owners: Owners) -> dict[str, object]:
    """Return those of these options that were given, by name: they are not as they are by default."""
    default = {field.name: field.default for field in fields(config)}
    values = {name: getattr(config, name) for name in owned_names(owners)}
    return {name: value for name, value in values.items() if value != default[name]}


def foreign_names(chosen: str, owners: Owners) -> tuple[str, ...]:
    """Return the options that belong to other choices alone; none where there is no such choice."""
    own = owners.get(chosen)
    return () if own is None else tuple(name for name in owned_names(owners) if name not in own)


def foreign_options(values: Mapping[str, object], choices: Mapping[str, Owners]) -> frozenset[str]:
    """Return the options that belong to other choices than those that are made.

    Args:
        values: Of a configuration, by name; those of `choices` say what is chosen.
        choices: By the option that makes a choice, the owners of those that go with it.
    """
    made = {option: str(values.get(option)) for option in choices}
    return frozenset(name for option, owners in choices.items() for name in foreign_names(made[option], owners))


def check_owned(
    option: str, chosen: str, owners: Owners, given: Mapping[str, object], hints: Mapping[str, str] | None = None
) -> None:
    """Refuse a choice that there is not, and options that belong to other choices.

    Args:
        option: By which the choice is made, as strategy.
        chosen: What was chosen.
        owners: Of the options.
        given: Options that were given, and their values.
        hints: By option, what else may have been meant.

    Raises:
        InvalidValueError: It is such a choice, or there is such an option.
    """
    if chosen not in owners:
        raise InvalidValueError(f"{option} = {chosen!r}: must be one of {', '.join(owners)}")
    foreign = foreign_names(chosen, owners)
    for name, value in given.items():
        if name in foreign:
            others = " or ".join(other for other, names in owners.items() if name in names)
            takes = ", ".join(f"--{each.replace('_', '-')}" for each in owners[chosen]) or "no such options"
            hint = (hints or {}).get(name, "")
            raise InvalidValueError(
                f"{name} = {_shown(value)}: is for --{option} {others}; {chosen} takes {takes}{hint}"
            )


def _shown(value: object) -> str:
    if isinstance(value, tuple):
        return " ".join(_shown(each) for each in value)
    return f"{value:g}" if isinstance(value, float) else str(value)
