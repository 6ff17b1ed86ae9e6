"""Every number of every configuration keeps to what its unit can be."""

import dataclasses
import importlib
import math
import pkgutil
import typing

import pytest

import palpate
from palpate.errors import InvalidValueError
from palpate.experiments.kit.options import spec_of
from palpate.unit_ranges import RANGES, check_unit_range

IMPOSSIBLE = (1e308, -1e308, 5e-324, math.nan, -math.inf, 10**400)
REQUIRED = {"sensor": "a.yaml", "loads": "a.csv", "poses": "a.csv", "live": "stage", "file": "a.yaml"}
REQUIRED |= {"preset": "wrist", "map": "a.ply", "reference": "b.stl", "robot": "stage", "experiment": "explore"}
REQUIRED |= {"log": "a.mcap", "what": "a.mcap", "port": 5000, "device": "arm", "fault": "none", "shell": "bash"}


def configs():
    """Every dataclass that is called a Config, wherever it stands."""
    names = [each.name for each in pkgutil.walk_packages(palpate.__path__, "palpate.") if "config" in each.name]
    found = [kind for name in names for kind in vars(importlib.import_module(name)).values()]
    kinds = {kind.__name__: kind for kind in found if isinstance(kind, type) and dataclasses.is_dataclass(kind)}
    return [kinds[name] for name in sorted(kinds) if name.endswith("Config")]


def with_value(kind, value):
    """A value of a type in which a number stands wherever one can; None if none can."""
    if kind is float:
        return value
    parts = [each for each in typing.get_args(kind) if each is not Ellipsis]
    if typing.get_origin(kind) is tuple:
        filled = [with_value(each, value) for each in parts]
        if any(each is not None for each in filled):
            return tuple("force" if each is None else each for each in filled)
        return None
    return next((found for found in (with_value(each, value) for each in parts) if found is not None), None)


def cases():
    for kind in configs():
        hints = typing.get_type_hints(kind)
        for field in dataclasses.fields(kind):
            if with_value(hints[field.name], 1.0) is not None:
                yield pytest.param(kind, field, hints[field.name], id=f"{kind.__name__}.{field.name}")


@pytest.mark.parametrize(("kind", "field", "hint"), list(cases()))
def test_a_number_that_no_quantity_has_is_refused_by_name(kind, field, hint):
    for number in IMPOSSIBLE:
        wanted = [each.name for each in dataclasses.fields(kind) if each.default is dataclasses.MISSING]
        given = {name: REQUIRED[name] for name in (*wanted, *(["live"] if kind.__name__ == "TareConfig" else []))}
        own, its = given | {field.name: with_value(hint, number)}, spec_of(field)
        if its.choice:
            own[its.choice] = its.choices[0]
        with pytest.raises(InvalidValueError, match=rf"^{field.name}\b") as refused:
            kind(**own)
        assert len(str(refused.value)) < 400


def test_the_walk_sees_every_configuration():
    assert {"ExploreConfig", "RegulateConfig", "FrictionConfig", "GraspConfig", "TareConfig"} <= {
        kind.__name__ for kind in configs()
    }
    assert len(list(cases())) > 80


@pytest.mark.parametrize("unit", RANGES)
def test_a_range_takes_its_ends_and_zero_with_either_sign(unit):
    for size in (RANGES[unit].least, RANGES[unit].most):
        for number in (size, -size):
            assert check_unit_range("x", number, unit) == number
        with pytest.raises(InvalidValueError, match="another unit"):
            check_unit_range("x", size * (2.0 if size > 1.0 else 0.5), unit)
    assert check_unit_range("x", -0.0, unit) == 0.0
