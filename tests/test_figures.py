"""README and documents say what `make figures` has measured."""

import sys
from pathlib import Path

import pytest

sys.path.append(str(Path(__file__).resolve().parents[1] / "benchmarks"))

from figures import pages
from figures.figure import Figure, Measured, by_name, history, read, write_history
from palpate.version import __version__


@pytest.mark.parametrize("path", pages.PAGES, ids=lambda path: path.name)
def test_a_page_says_what_was_measured(path):
    page = path.read_text(encoding="utf-8")
    assert pages.BLOCK.search(page), "no table is marked"
    assert page == pages.made(page, read()), f"{path.name} is not what figures.csv says: run `make figures`"


def test_every_figure_is_quoted_and_every_table_stands_on_a_page():
    figures = read().figures
    quoted = set()
    for table in pages.BLOCKS.values():
        table(lambda name: quoted.add(name) or pages.shown(figures[name]))
    assert quoted == set(figures)
    marked = {found[2] for path in pages.PAGES for found in pages.BLOCK.finditer(path.read_text(encoding="utf-8"))}
    assert marked == set(pages.BLOCKS)


def test_the_history_ends_with_this_version_as_it_was_measured():
    measured, last = read(), history()[-1]
    assert last["version"] == measured.version == __version__
    assert {name: figure.row[1] for name, figure in measured.figures.items()}.items() <= last.items()


def test_a_release_has_one_row_however_often_it_is_measured(tmp_path):
    def measured(version: str, value: float) -> Measured:
        return Measured("2026-01-02", "a machine", version, by_name([Figure("x", value, "us", "", "what")]))

    path = tmp_path / "history.csv"
    for version, value in (("1.0", 1.0), ("1.1", 2.0), ("1.1", 3.0)):
        write_history(measured(version, value), path)
    assert [(row["version"], row["x"]) for row in history(path)] == [("1.0", "1"), ("1.1", "3")]
    measured("1.1", 0.12345).write(path)
    assert read(path) == measured("1.1", 0.123)
