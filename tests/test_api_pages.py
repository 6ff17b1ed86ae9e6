"""Public names: each is explained once on the pages of the API, and stands in the list that is kept."""

import pkgutil
import re
from collections import Counter
from importlib import import_module
from pathlib import Path

import pytest

import palpate
from support.document_blocks import DOCS, ROOT, load_module

LEFT_OUT = {
    "palpate.hw.ft_stream",  # only other packages are made of it
    "palpate.learning",  # needs an extra, by which the documents are not to be made; docs/learning.md explains it
}


@pytest.fixture(scope="module")
def maker():
    return load_module(DOCS / "make_api.py")


@pytest.fixture(scope="module")
def texts(maker):
    return maker.pages()


def packages_with_public_names():
    """Without importing them: some need an extra."""
    for each in pkgutil.walk_packages(palpate.__path__, "palpate.", onerror=lambda name: None):
        found = each.module_finder.find_spec(each.name)
        if each.ispkg and "__all__ = " in Path(found.origin).read_text(encoding="utf-8"):
            yield each.name


def sections(text, level):
    """The parts of a page below each heading of a level."""
    parts = re.split(rf"^{'#' * level} (.+)$", text, flags=re.MULTILINE)
    return list(zip(parts[1::2], parts[2::2], strict=True))


def test_every_package_that_says_what_is_public_has_its_place_in_the_api(maker):
    found = set(packages_with_public_names())
    assert len(found) > 15
    assert found - LEFT_OUT <= {module for page in maker.PAGES.values() for module in page.modules}


@pytest.mark.slow
def test_every_public_name_is_on_its_page(maker, texts):
    """With a heading of its own, or a link to where it has one."""
    for page, (_, _, modules) in maker.PAGES.items():
        found = dict(sections(texts[f"{page}.md"], 2))
        assert list(found) == list(modules)
        for module in modules:
            listed = getattr(import_module(module), "__all__", None) or maker.names_of(module)
            linked = re.findall(
                r"^Explained in \[(\S+)\]\((\S+)\.md#\S+\): (.*)\.$", found[module], flags=re.MULTILINE
            )
            there = {name: (home, page) for home, page, names in linked for name in re.findall(r"`(\w+)`", names)}
            here = {name for name, _ in sections(found[module], 3)}
            assert here | set(there) == set(listed), module
            for name, (home, other) in there.items():
                assert name in dict(sections(dict(sections(texts[f"{other}.md"], 2))[home], 3)), f"{home}.{name}"


@pytest.mark.slow
def test_a_name_is_explained_once(maker):
    homes = Counter(
        maker.origin(module, name)
        for page in maker.PAGES.values()
        for module in page.modules
        for name in maker.names_of(module)
        if maker.explained_in(module, name) == module
    )
    assert len(homes) > 300
    assert [home for home, times in homes.items() if times > 1] == []


def test_a_signature_is_that_of_the_source(texts):
    """Types by the names that people write, and no value that was made on this machine."""
    assert "def contact_from_wrench(" in texts["contact.md"]
    assert "def white_noise(force_noise: float, moment_noise: float) -> FloatArray" in texts["uncertainty.md"]
    assert "class DHRow(a: float, d: float, alpha: float, offset: float = 0.0)" in texts["kinematics.md"]
    for name, text in texts.items():
        assert not re.search(r"numpy\.ndarray|<factory>| at 0x|<class", text), name
        assert str(ROOT) not in text, name


def test_a_docstring_becomes_lists_and_formulas(maker):
    said = """Return the *least* force, for a<b.

    f_n = stiffness * delta^1.5

It is so:
    x < y

- One item, that
    goes on.

Args:
    force, moment: What it feels,
        in its frame.
    **rest: Others.

Returns:
    The least: [N],
    or NaN.
And this."""
    assert maker.as_markdown(said).splitlines() == [
        "Return the *least* force, for a\\<b.", "",
        "```text", "f_n = stiffness * delta^1.5", "```", "",
        "It is so:", "",
        "```text", "x < y", "```", "",
        "- One item, that", "    goes on.", "",
        "Args:", "", "- `force, moment`: What it feels,", "  in its frame.", "- `**rest`: Others.", "",
        "Returns:", "", "- The least: [N],", "  or NaN.", "",
        "And this.",
    ]  # fmt: skip


def test_the_list_of_names_is_fresh_and_a_stale_one_is_reported_and_renewed(maker, tmp_path, monkeypatch, capsys):
    assert maker.main(["--check"]) == 0, capsys.readouterr().err
    text = maker.LIST.read_text(encoding="utf-8")
    for name in dir(palpate):
        assert f"- `{name}`" in text
    monkeypatch.setattr(maker, "LIST", tmp_path / "public-names.md")
    assert maker.main(["--check"]) == 1
    assert "make api" in capsys.readouterr().err
    assert maker.main([]) == maker.main(["--check"]) == 0
    assert maker.LIST.read_text(encoding="utf-8") == text


def test_pages_of_the_api_are_written_and_superfluous_ones_removed(maker, texts, tmp_path):
    (tmp_path / "gone.md").write_text("# Gone\n", encoding="utf-8")
    maker.write_pages(tmp_path)
    assert {path.name: path.read_text(encoding="utf-8") for path in tmp_path.iterdir()} == texts
