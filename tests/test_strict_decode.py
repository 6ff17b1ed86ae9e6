"""The strict reader and the exact writer, on types made for these tests."""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.errors import InvalidValueError, positive
from palpate.experiments.explore.config import ExploreConfig
from palpate.nearest_name import OTHER_UNITS, UNITS, advice_on_key, nearest, unit_of, without_unit
from palpate.strict_decode import decode, decode_file, decode_some, load, read_mapping
from palpate.strict_types import known_keys
from palpate.strict_yaml import LARGEST_INTEGER, place_of, read_yaml
from palpate.yaml_text import yaml_text


class Round(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="kind", tag="round"):
    radius: float = msgspec.field(name="radius_m")

    def __post_init__(self):
        positive("radius_m", self.radius, "m")


class Flat(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="kind", tag="flat"):
    size: tuple[float, float] = msgspec.field(name="size_m")


class Part(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    test_file: int = 1
    shapes: tuple[Round | Flat, ...] = ()
    spare: Flat | None = None


@dataclass(frozen=True)
class Plain:
    name: Literal["one", "two"] = "one"
    count: int = 0
    size: tuple[float, ...] = ()
    file: Path = Path("a")
    limit: float | None = None

    def __post_init__(self):
        if self.count < 0:
            raise InvalidValueError(f"count = {self.count}: must be 0 or above")


def part(text):
    return decode_file(text, Part, "part file", "test_file", 1)


def told(function, *arguments):
    with pytest.raises(InvalidValueError) as found:
        function(*arguments)
    return str(found.value)


# --- the writer and the reader are inverse ---

texts = st.text(max_size=20).filter(lambda s: not any("\ud800" <= c <= "\udfff" for c in s))
scalars = st.one_of(
    st.none(), st.booleans(), texts, st.floats(allow_nan=False),
    st.integers(-LARGEST_INTEGER, LARGEST_INTEGER),
    st.sampled_from(["yes", "no", "null", "~", "1e3", "12:30", "0x1F", "- a", "a: b", "#", "a #b", " a", "true"]),
)  # fmt: skip
trees = st.recursive(
    scalars,
    lambda below: st.one_of(st.lists(below, max_size=3), st.dictionaries(texts, below, max_size=3)),
    max_leaves=8,
)


@given(st.dictionaries(texts, trees, max_size=4))
def test_what_is_written_reads_back_to_the_very_same(values):
    again = read_yaml(yaml_text(values))
    assert (again or {}) == values
    assert repr(again or {}) == repr(values), "types and signs too"


def test_comments_stand_behind_their_values():
    text = yaml_text({"force": 2.0, "tip": {"radius": 1.0}}, {"force": "[N]", "tip": "a sphere"})
    assert text == "force: 2.0  # [N]\ntip:  # a sphere\n  radius: 1.0\n"


@given(st.dictionaries(texts, trees, min_size=1, max_size=4))
def test_every_key_is_found_where_it_stands(values):
    text = yaml_text(values)
    lines = text.splitlines() if text.isascii() else text.split("\n")
    for key in values:
        place = place_of(text, [key])
        line, column = (int(word.strip("(),")) for word in place.split() if word.strip("(),").isdigit())
        written = lines[line - 1][column - 1 :]
        assert written.startswith((key, '"')), (key, place, text)


def test_the_place_of_what_is_missing_is_that_of_what_should_have_it():
    assert place_of("a:\n  b: 1\n", ["a", "c"]) == " (line 1, column 1)"
    assert place_of("a: [1, 2]\n", ["a", 1]) == " (line 1, column 8)"
    assert place_of("a: 1\n", ["b"]) == place_of("", ["a"]) == ""


# --- refusals ---


def test_every_refusal_names_the_whole_path_and_the_line():
    text = "test_file: 1\nshapes:\n  - {kind: round, radius_m: 1}\n  - kind: round\n    radius_m: %s\n"
    assert part(text % "2").shapes == (Round(1.0), Round(2.0))
    assert told(part, text % "-1").startswith("shapes[1].radius_m = -1.0 m: must be")
    assert told(part, text % "-1").endswith("(line 5, column 5)")
    assert told(part, text % "x").startswith("shapes[1].radius_m = 'x': must be a number (line 5")
    wrong = told(part, (text % "2").replace("    radius_m", "    radius_mm"))
    assert (
        wrong
        == "shapes[1].radius_mm: unknown key; the unit stands in the key: write radius_m, in m (line 5, column 5)"
    )


def test_a_value_of_another_type_is_refused_in_plain_english():
    """What it is, and what it must be: with the keys of a mapping, the words that are known, a list's brackets."""
    start = "test_file: 1\n"
    assert told(part, start + "spare: 0.5") == (
        "spare = 0.5: must be a mapping (`key: value` lines) with kind: and one of flat (line 2, column 1)"
    )
    assert told(part, start + "shapes: 3").startswith(
        "shapes = 3: must be a list of mappings with kind: and one of"
    )
    assert "shapes[0] = true: must be a mapping" in told(part, start + "shapes: [true]")
    assert told(decode, {"size": 2.5}, Plain) == "size = 2.5: must be a list, as in [2.5]"
    assert told(decode, {"count": 1.5}, Plain) == "count = 1.5: must be a whole number"
    assert told(decode, {"count": "3"}, Plain).startswith(
        "count = '3': must be a whole number; write a plain number"
    )
    assert told(decode, {"name": 1}, Plain) == "name = 1: known: one, two"
    assert told(decode, {"limit": "far"}, Plain) == "limit = 'far': must be a number"
    assert told(decode, {"count": None}, Plain).startswith("count: no value: must be a whole number; write one")
    assert told(decode, {"file": 3}, Plain) == "file = 3: must be the path of a file"
    flat = start + "spare: {kind: flat, size_m: %s}"
    assert told(part, flat % "[1]").startswith("spare.size_m: must be a list of length 2, got 1")
    for text in ("{kind: flat, size_m: 2}", "[]", "x", "{kind: flat}", "{kind: flat, size_m: [x, 1]}"):
        assert "`float`" not in told(part, f"{start}spare: {text}")
        assert "got `" not in told(part, f"{start}spare: {text}")


def test_a_path_is_never_spoilt_by_what_people_write():
    """msgspec's own place is told from text that looks like it."""
    evil = "x - at `$.spare.size_m`"
    message = told(decode, {"name": evil}, Plain)
    assert message.startswith(f"name = '{evil}'")
    hidden = told(part, "test_file: 1\nspare: {\ufeffkind: flat, size_m: [1, 2]}")
    assert hidden.isprintable()
    assert "spare.kind: missing" in hidden
    assert "`" not in told(decode_some, {"a\u2028b": 1}, Plain).split(":")[0]


def test_dataclasses_are_read_as_strictly():
    found = decode({"name": "two", "count": 3, "size": [1, 2.5], "file": "b/c"}, Plain)
    assert found == Plain("two", 3, (1.0, 2.5), Path("b/c"))
    assert told(decode, {"naem": "two"}, Plain) == "naem: unknown key; did you mean name?"
    assert told(decode, {"count_s": 2}, Plain).startswith("count_s: unknown key; write count, in SI units")
    assert told(decode, {"count": -1}, Plain) == "count = -1: must be 0 or above"
    assert told(decode, {"name": "tow"}, Plain) == "name = 'tow': did you mean two? known: one, two"


def test_some_fields_are_judged_one_by_one():
    assert decode_some({"count": -1}, Plain) == {"count": -1}, "together with what comes on top, not here"
    assert decode_some({"limit": None, "size": []}, Plain) == {"limit": None, "size": ()}
    assert told(decode_some, {"size": [1, "x"]}, Plain, "size: [1, x]").endswith("(line 1, column 11)")


def test_a_file_of_another_kind_is_told():
    assert "no part file" in told(part, "palpate_robot: 1")
    assert "'test_fiel' misspelt" in told(part, "test_fiel: 1")
    assert "reads version 1" in told(part, "test_file: 2")
    assert "reads version 1" in told(part, "test_file: true")
    assert "no part file" in told(part, "- test_file")
    assert "`key: value`" in told(read_mapping, "[1]", "an experiment file")


def test_a_file_is_named(tmp_path):
    file = tmp_path / "p.yaml"
    file.write_bytes(b"test_file: \xff")
    assert told(load, file, part, "a part file").startswith(f"{file}: not text (byte 11")
    file.write_text("test_file: 3")
    assert told(load, file, part, "a part file").startswith(f"{file}: test_file = 3")
    file.write_text("test_file: 1")
    assert load(file, part, "a part file") == Part()


# --- names ---


def test_known_keys_carry_our_units_and_only_those():
    assert not set(UNITS) & set(OTHER_UNITS)
    for key in known_keys(ExploreConfig):
        assert without_unit(key) == key, "a key that ends in a unit by chance would confuse the advice"
    assert without_unit("speed_m_per_s") == "speed"
    assert unit_of("acceleration_m_per_s2") == "m/s^2"
    assert unit_of("inertia_kg_m2") == "kg m^2"


@given(st.sampled_from(sorted(known_keys(ExploreConfig))), st.data())
def test_one_slip_of_the_finger_is_understood(key, data):
    i = data.draw(st.integers(0, len(key) - 1))
    slip = data.draw(
        st.sampled_from([key[:i] + key[i + 1 :], key[:i] + key[i] + key[i:], key.upper(), key.title()])
    )
    known = list(known_keys(ExploreConfig))
    assert slip in known or nearest(slip, known) == key


def test_advice_prefers_the_same_quantity_to_the_same_letters():
    assert "write mass_kg, in kg" in advice_on_key("mass_g", ["mass_kg", "mass_gain"])
    assert "write force_N, in N" in advice_on_key("force", ["force_N", "forces"])
    assert "did you mean force_N?" in advice_on_key("Force_N", ["force_N"])
    assert advice_on_key("zzzzz", ["force_N", "kind"]) == "unknown key; known are force_N, kind"


def test_half_a_character_cannot_be_written():
    assert "half a character" in told(yaml_text, {"out": "\ud83d"})
