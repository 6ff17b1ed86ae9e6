"""The strict reader and the exact writer, on types made for these tests."""

import re
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


def some(values, text=""):
    return decode_some(values, Plain, text)


def plain(values):
    return decode(values, Plain)


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


START = "test_file: 1\n"
SHAPES = START + "shapes:\n  - {kind: round, radius_m: 1}\n  - kind: round\n    radius_m: %s\n"
WORDS = r" \(`key: value` lines\) with kind: and one of "

REFUSALS = [
    (part, SHAPES % "-1", r"shapes\[1\].radius_m = -1.0 m: must be.*\(line 5, column 5\)$"),
    (part, SHAPES % "x", r"shapes\[1\].radius_m = 'x': must be a number \(line 5"),
    (part, (SHAPES % "2").replace("    radius_m", "    radius_mm"),
     r"shapes\[1\].radius_mm: unknown key; the unit .* the key: write radius_m, in m \(line 5, column 5\)$"),
    (part, START + "spare: 0.5", r"spare = 0.5: must be a mapping" + WORDS + r"flat \(line 2, column 1\)$"),
    (part, START + "shapes: 3", "shapes = 3: must be a list of mappings with kind: and one of"),
    (part, START + "shapes: [true]", r".*shapes\[0\] = true: must be a mapping"),
    (part, START + "spare: {kind: flat, size_m: [1]}", "spare.size_m: must be a list of length 2, got 1"),
    (plain, {"size": 2.5}, r"size = 2.5: must be a list, as in \[2.5\]$"),
    (plain, {"count": 1.5}, "count = 1.5: must be a whole number$"),
    (plain, {"count": "3"}, "count = '3': must be a whole number; write a plain number"),
    (plain, {"count": None}, "count: no value: must be a whole number; write one"),
    (plain, {"count": -1}, "count = -1: must be 0 or above$"),
    (plain, {"name": 1}, "name = 1: known: one, two$"),
    (plain, {"name": "tow"}, "name = 'tow': did you mean two\\? known: one, two$"),
    (plain, {"name": "x - at `$.spare.size_m`"}, r"name = 'x - at `\$.spare.size_m`'"),
    (plain, {"limit": "far"}, "limit = 'far': must be a number$"),
    (plain, {"file": 3}, "file = 3: must be the path of a file$"),
    (plain, {"naem": "two"}, "naem: unknown key; did you mean name\\?$"),
    (plain, {"count_s": 2}, "count_s: unknown key; write count, in SI units"),
    (part, "palpate_robot: 1", ".*no part file"),
    (part, "test_fiel: 1", ".*'test_fiel' misspelt"),
    (part, "test_file: 2", ".*reads version 1"),
    (part, "test_file: true", ".*reads version 1"),
    (part, "- test_file", ".*no part file"),
    (lambda text: read_mapping(text, "an experiment file"), "[1]", ".*`key: value`"),
    (yaml_text, {"out": "\ud83d"}, ".*half a character"),
]  # fmt: skip
"""Reader, input, and the begin of the message: whole path, value, what it must be, line."""


@pytest.mark.parametrize(("reader", "given_", "message"), REFUSALS)
def test_a_refusal_names_path_value_remedy_and_line_in_plain_english(reader, given_, message):
    assert re.match(message, told(reader, given_), re.DOTALL)


def test_a_refusal_shows_no_type_of_the_library():
    assert part(SHAPES % "2").shapes == (Round(1.0), Round(2.0))
    for text in ("{kind: flat, size_m: 2}", "[]", "x", "{kind: flat}", "{kind: flat, size_m: [x, 1]}"):
        assert not re.search("`float`|got `", told(part, f"{START}spare: {text}"))


def test_a_path_holds_no_invisible_text():
    """msgspec reports the place in text that the input can imitate."""
    hidden = told(part, "test_file: 1\nspare: {\ufeffkind: flat, size_m: [1, 2]}")
    assert hidden.isprintable()
    assert "spare.kind: missing" in hidden
    assert "`" not in told(some, {"a\u2028b": 1}).split(":")[0]


def test_a_dataclass_is_read_whole_or_field_by_field():
    found = plain({"name": "two", "count": 3, "size": [1, 2.5], "file": "b/c"})
    assert found == Plain("two", 3, (1.0, 2.5), Path("b/c"))
    assert some({"count": -1}) == {"count": -1}, "checked together with the other values, not here"
    assert some({"limit": None, "size": []}) == {"limit": None, "size": ()}
    assert told(some, {"size": [1, "x"]}, "size: [1, x]").endswith("(line 1, column 11)")


def test_a_file_is_named(tmp_path):
    file = tmp_path / "p.yaml"
    for content, message in ((b"test_file: \xff", "not text (byte 11"), (b"test_file: 3", "test_file = 3")):
        file.write_bytes(content)
        assert told(load, file, part, "a part file").startswith(f"{file}: {message}")
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
