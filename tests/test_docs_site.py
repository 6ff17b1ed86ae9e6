"""The site of the documents: it builds without a warning or a fetch, and leaves nothing out."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

from palpate.cli import typed_commands
from support.cli_samples import leaves
from support.document_blocks import DOCS, ROOT, blocks, pages, words_of


def test_every_page_is_in_the_contents():
    listed = {"index"}
    for page in pages():
        for contents in re.findall(r"```\{toctree\}\n(.*?)```", page.read_text(encoding="utf-8"), flags=re.DOTALL):
            for entry in contents.splitlines():
                if entry and not entry.startswith((":", "examples/")):
                    listed.add((page.parent / entry).relative_to(DOCS).as_posix())
    assert listed == {page.relative_to(DOCS).with_suffix("").as_posix() for page in pages()}


def test_every_command_is_shown_on_some_page():
    """Where to read about it, besides its own help: a command that no page shows is one that nobody finds."""
    shown = {words_of(command)[0][0] for page in pages() for block in blocks(page) for command in block.commands}
    assert set(typed_commands()) - shown == set()


def test_pictures_are_white_or_say_their_ground():
    """On a dark page black letters on a clear ground cannot be read."""
    for drawing in DOCS.glob("*.svg"):
        text = drawing.read_text(encoding="utf-8")
        assert re.search(r'<rect width="\d+" height="\d+" fill="white"/>', text), drawing.name
        assert "<title>" in text
    assert "background: white" in (DOCS / "_static" / "palpate.css").read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """The site, built as `make docs` does."""
    pytest.importorskip("sphinx")
    out = tmp_path_factory.mktemp("site")
    command = [sys.executable, "-m", "sphinx", "-W", "--keep-going", "-n", "-q", "-d", str(out / "cache")]
    done = subprocess.run([*command, str(DOCS), str(out / "html")], capture_output=True, text=True, cwd=ROOT)
    assert done.returncode == 0, done.stderr
    assert not done.stderr
    return out / "html"


@pytest.mark.slow
def test_the_site_builds_without_warnings_and_holds_every_page(site):
    for page in pages():
        assert (site / page.relative_to(DOCS).with_suffix(".html")).exists(), page


@pytest.mark.slow
def test_every_command_has_its_help_on_the_site(site):
    text = (site / "commands.html").read_text(encoding="utf-8")
    for typed in leaves():
        assert f'id="palpate-{typed.replace(" ", "-")}"' in text, typed
        assert f"usage: palpate {typed}" in re.sub(r"<[^>]+>", "", text), typed


@pytest.mark.slow
def test_nothing_is_fetched_and_no_path_of_this_machine_is_told(site):
    for page in site.rglob("*.html"):
        text = page.read_text(encoding="utf-8")
        assert not re.findall(r'<(?:script|img|iframe)[^>]+src="(?:https?:)?//', text), page
        assert not re.findall(r'<link[^>]+rel="(?:stylesheet|preload|icon)"[^>]+href="(?:https?:)?//', text), page
        assert str(ROOT) not in text, page
        assert str(Path.home()) + "/" not in text, page
