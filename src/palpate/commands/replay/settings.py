"""What a replay may change of a run: what sensing, control and supervision go by."""

from collections.abc import Mapping
from dataclasses import fields, replace
from typing import Any

from palpate.errors import InvalidValueError
from palpate.experiments.kit.options import foreign_options, specs_of
from palpate.nearest_name import nearest, without_unit
from palpate.strict_decode import decode_some


def changeable(kind: type) -> tuple[str, ...]:
    """Return the options of a `Config` that a replay can change."""
    return tuple(name for name, spec in specs_of(kind).items() if not spec.fixed)


def unchangeable(kind: type) -> dict[str, str]:
    """Return why a replay cannot change the others, by name."""
    return {
        name: f"a replay cannot change it: {spec.fixed}" for name, spec in specs_of(kind).items() if spec.fixed
    }


def changed_config(config: Any, settings: Mapping[str, object]) -> Any:
    """Return a configuration with other values for what a replay can change.

    What was given for a choice that is changed, as the time of steps for another profile, is left out.

    Raises:
        InvalidValueError: A name is not known or cannot be changed, or a value is impossible.
    """
    kind = type(config)
    specs, refused = specs_of(kind), unchangeable(kind)
    for name in settings:
        if name not in specs:
            near = nearest(name, tuple(specs)) or nearest(without_unit(name), tuple(specs))
            advice = f"did you mean {near}?" if near else f"a replay can change {', '.join(changeable(kind))}"
            raise InvalidValueError(f"{name}: there is no such option; {advice}")
        if name in refused:
            raise InvalidValueError(f"{name}: {refused[name]}")
    changed = decode_some(settings, kind)
    recorded = {each.name: getattr(config, each.name) for each in fields(kind)}
    foreign = foreign_options(kind, recorded | changed) - changed.keys()
    default = {each.name: each.default for each in fields(kind) if each.name in foreign}
    return replace(config, **default, **changed)
