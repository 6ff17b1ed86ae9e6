"""Options of an experiment, as metadata of its `Config`'s fields: unit, symbol, bounds, replay, owner.

Imports nothing heavy. Checks, replays, reports, sweeps and comparisons all read it from here.
"""

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import Field, dataclass, field, fields, replace
from numbers import Real
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, TypeVar, get_args, get_origin, get_type_hints

from palpate.errors import InvalidValueError, not_negative, positive, shown
from palpate.experiments.kit.checks import check_seed, check_within
from palpate.unit_ranges import check_unit_range

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

_Kind = TypeVar("_Kind")

KEY = "palpate"
"""Key of the `OptionSpec` in the metadata of a field."""

TOUCHED = "the samples are as recorded, on what was touched then"
NOISY = "the samples are as recorded, with the noise that they have"
WRITTEN = "a replay writes no files of the run again; --out says where its report goes"
PERIODIC = "the samples are as recorded, one per period"
CHANGED = "live parameters are changed as recorded"
"""Why a replay cannot change an option: for `option(fixed=...)`."""

_NUMBERS, _PATHS = (float, float | None), (Path, Path | None)
"""Types of fields, as they are declared."""


@dataclass(frozen=True, slots=True)
class OptionSpec:
    """Metadata of an option besides its type, default and docstring.

    Attributes:
        unit: SI unit; empty for a ratio, a count, a text.
        fixed: Why a replay cannot change it; empty if it can.
        choice: The option that decides whether this one counts, as "strategy" for a radius; empty: it always does.
        choices: For which values of that one it does.
        hint: End of the error for an option of another choice, with what else may have been meant.
        above: Whether the value must be larger than 0.
        least: Whether the value must not be below 0.
        kept: Name of the text by which a log keeps the content of this option's file; empty if it keeps none.
        once: Whether it is of the run that was recorded alone: a replay sets it back to its default.
        symbol: Symbol in the literature, as mu; --set and --vary take it, too.
        infinite: Whether it may be infinity.
        within: Smallest and largest number that it may be.
        remark: End of the error for a number outside `within`.
        check: Function of the option's name and value that raises InvalidValueError for an invalid value; it is
            not called for None.
    """

    unit: str = ""
    fixed: str = ""
    choice: str = ""
    choices: tuple[str, ...] = ()
    hint: str = ""
    above: bool = False
    least: bool = False
    kept: str = ""
    once: bool = False
    symbol: str = ""
    infinite: bool = False
    within: tuple[float, float] = (-math.inf, math.inf)
    remark: str = ""
    check: Callable[[str, Any], object] | None = None


_UNSPECIFIED = OptionSpec()
_STANDARD = {"seed": OptionSpec(fixed=NOISY, check=check_seed), "out": OptionSpec(fixed=WRITTEN)}
"""Metadata of the options that every experiment has, unless their fields specify otherwise."""


def option(
    default: Any,
    unit: str = "",
    *,
    fixed: str = "",
    of: tuple[str, tuple[str, ...]] = ("", ()),
    hint: str = "",
    bound: Literal["", "positive", "not negative"] = "",
    kept: str = "",
    once: bool = False,
    symbol: str = "",
    infinite: bool = False,
    within: tuple[float, float] = (-math.inf, math.inf),
    remark: str = "",
    check: Callable[[str, Any], object] | None = None,
) -> Any:
    """Return the field of an option; see `OptionSpec`.

    For example `force: float = option(2.0, "N", bound="positive")`, or
    `radius: float | None = option(None, "m", of=("strategy", ("spiral",)))`.

    Args:
        default: Default value.
        unit: SI unit.
        fixed: Why a replay cannot change it.
        of: The option that decides whether this one counts, and for which of its values.
        hint: End of the error for an option of another choice.
        bound: Bound on numbers.
        kept: Name of the text by which a log keeps its file.
        once: Whether a replay sets it back to its default.
        symbol: Symbol in the literature.
        infinite: Whether it may be infinity; other numbers keep to the range of their unit (`unit_ranges`).
        within: Smallest and largest number that it may be.
        remark: End of the error for a number outside `within`.
        check: Function of the option's name and value that raises InvalidValueError for an invalid value.
    """
    if bound not in ("", "positive", "not negative"):
        raise InvalidValueError(f"bound = {shown(bound)}: must be 'positive' or 'not negative', or left out")
    above, least = bound == "positive", bound == "not negative"
    spec = OptionSpec(
        unit, fixed, of[0], of[1], hint, above, least, kept, once, symbol, infinite, within, remark, check
    )
    return field(default=default, metadata={KEY: spec})


def with_default(kind: type, name: str, default: Any) -> Any:
    """Return the field of an inherited option with another default.

    Args:
        kind: Class that defines the option.
        name: Name of the option.
        default: Default in the `Config` that inherits it.
    """
    (inherited,) = (each for each in fields(kind) if each.name == name)
    return field(default=default, metadata=inherited.metadata)


def own_first(config: type[_Kind]) -> type[_Kind]:
    """Put the options that a `Config` declares itself before those that it inherits, for help and files."""
    put_first(config, config.__annotations__)
    return config


def put_first(config: type, names: Iterable[str]) -> None:
    """Put some options of a `Config` before the others; arguments by position keep their order."""
    known: dict[str, Any] = getattr(config, "__dataclass_fields__")  # noqa: B009
    ordered = {name: known[name] for name in (*names, *known)}
    known.clear()
    known.update(ordered)


def spec_of(option: "Field[Any]") -> OptionSpec:
    """Return the metadata of a field."""
    spec = option.metadata.get(KEY) or _STANDARD.get(option.name, _UNSPECIFIED)
    assert isinstance(spec, OptionSpec)
    return spec


def specs_of(kind: type) -> dict[str, OptionSpec]:
    """Return the metadata of each option of a `Config`, by name."""
    return {each.name: spec_of(each) for each in fields(kind)}


def option_of_symbol(kind: type, symbol: str) -> str | None:
    """Return the name of the option of a `Config` that the literature calls so; None if there is none."""
    return next((name for name, spec in specs_of(kind).items() if symbol and spec.symbol == symbol), None)


def lasting(config: Any) -> Any:
    """Return a configuration without the options of a single run: live changes, a companion run."""
    return replace(config, **{each.name: each.default for each in fields(config) if spec_of(each).once})


def check_options(config: "DataclassInstance") -> None:
    """Convert strings to paths; refuse wrong types, numbers out of bounds, and options of other choices.

    Meant for the beginning of a `Config`'s `__post_init__`; it may be frozen.

    Raises:
        InvalidValueError: A value is refused; the message names value, limit and what to do.
    """
    for each in fields(config):
        value, spec = getattr(config, each.name), spec_of(each)
        if each.type in _PATHS and isinstance(value, str):
            object.__setattr__(config, each.name, Path(value))
        elif each.type in _NUMBERS and not isinstance(value, Real) and (value is not None or each.type is float):
            raise InvalidValueError(f"{each.name} = {shown(value)}: must be a number")
        for number in _numbers_in(value):
            if spec.above:
                positive(each.name, number, spec.unit)
            elif spec.least:
                not_negative(each.name, number, spec.unit)
            if each.type is not int and not (spec.infinite and number == math.inf):
                check_unit_range(each.name, number, spec.unit)
    for choice in _choices_of(type(config)):
        _check_choice(config, choice)
    for name, spec in specs_of(type(config)).items():
        value = getattr(config, name)
        for number in _numbers_in(value):
            check_within(name, number, spec.within, spec.unit, spec.remark)
        if spec.check is not None and value is not None:
            spec.check(name, value)


def _numbers_in(value: object) -> Iterator[Any]:
    """Every number in an option's value, however deep; words and truths are none."""
    if isinstance(value, tuple | list):
        for each in value:
            yield from _numbers_in(each)
    elif not isinstance(value, bool) and isinstance(value, Real):
        yield value


def _choices_of(kind: type) -> dict[str, tuple[str, ...]]:
    """Return the options that decide which others count, with the values that each can have."""
    names = dict.fromkeys(spec.choice for spec in specs_of(kind).values() if spec.choice)
    hints = get_type_hints(kind)
    return {name: tuple(value for value in _literals(hints[name])) for name in names}


def foreign_options(kind: type, values: Mapping[str, object]) -> frozenset[str]:
    """Return the options that belong to other choices than those that are made.

    Args:
        kind: The `Config`.
        values: Values of the options, by name.
    """
    return frozenset(
        name
        for name, spec in specs_of(kind).items()
        if spec.choice and values.get(spec.choice) not in spec.choices
    )


def _check_choice(config: "DataclassInstance", choice: str) -> None:
    chosen, known = getattr(config, choice), _choices_of(type(config))[choice]
    if chosen not in known:
        raise InvalidValueError(f"{choice} = {chosen!r}: must be one of {', '.join(known)}")
    own = {each.name: (each, spec_of(each)) for each in fields(config) if spec_of(each).choice == choice}
    for name, (each, spec) in own.items():
        value = getattr(config, name)
        if chosen in spec.choices or value == each.default:
            continue
        takes = [f"--{name.replace('_', '-')}" for name, (_, its) in own.items() if chosen in its.choices]
        raise InvalidValueError(
            f"{name} = {_typed(value)}: is for --{choice} {' or '.join(spec.choices)}; {chosen} takes "
            f"{', '.join(takes) or 'no such options'}{spec.hint}"
        )


def _literals(kind: Any) -> tuple[str, ...]:
    """The values of a Literal, be it in a union."""
    if get_origin(kind) is Literal:
        return get_args(kind)
    return tuple(value for part in get_args(kind) for value in _literals(part))


def _typed(value: object) -> str:
    if isinstance(value, tuple):
        return " ".join(_typed(each) for each in value)
    return f"{value:g}" if isinstance(value, float) else str(value)


def option_words(value: object) -> str:
    """Return a value of an option without its unit."""
    if _is_left_out(value):
        return "left out"
    if isinstance(value, bool):
        return "yes" if value else "no"
    each = value if isinstance(value, Sequence) and not isinstance(value, str) else (value,)
    return " x ".join(f"{one:g}" if isinstance(one, float) else str(one) for one in each)


def has_unit(value: object) -> bool:
    """Return whether a value of an option is one or several numbers, which may have a unit."""
    return not (_is_left_out(value) or isinstance(value, str | bool))


def _is_left_out(value: object) -> bool:
    return value is None or value == ()
