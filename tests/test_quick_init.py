"""Classes with the quicker constructor behave as `dataclasses` made them."""

import copy
import inspect
import pickle
from dataclasses import FrozenInstanceError, dataclass, field, replace

import pytest

from palpate.quick_init import quick_init


@dataclass(frozen=True, slots=True)
class Plain:
    a: float
    b: tuple[float, ...] = ()
    c: float | None = None


@quick_init
@dataclass(frozen=True, slots=True)
class Quick:
    a: float
    b: tuple[float, ...] = ()
    c: float | None = None


def test_is_what_dataclasses_make_of_it() -> None:
    one = Quick(1.0, c=2.0)
    assert str(inspect.signature(Quick)) == str(inspect.signature(Plain))
    assert repr(one) == repr(Plain(1.0, c=2.0)).replace("Plain", "Quick")
    assert one == Quick(1.0, (), 2.0) == replace(Quick(3.0, c=2.0), a=1.0)
    assert hash(one) == hash(Plain(1.0, c=2.0))
    assert pickle.loads(pickle.dumps(one)) == copy.deepcopy(one) == one
    with pytest.raises(FrozenInstanceError):
        one.a = 3.0  # type: ignore[misc]
    with pytest.raises(FrozenInstanceError):
        del one.a  # type: ignore[misc]
    with pytest.raises(TypeError, match="a"):
        Quick()  # type: ignore[call-arg]


def test_refuses_what_it_cannot_make() -> None:
    class Bare:
        a: float

    @dataclass(frozen=True)
    class WithoutSlots:
        a: float

    @dataclass(frozen=True, slots=True)
    class WithFactory:
        a: list[float] = field(default_factory=list)

    for cls in (Bare, WithoutSlots, WithFactory):
        with pytest.raises(TypeError, match=cls.__name__):
            quick_init(cls)
