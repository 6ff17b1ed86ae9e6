"""The code and the commands in the documents run as they stand, and what they name exists."""

import contextlib
import io
import re
import subprocess
import sys
from pathlib import Path

import pytest

from palpate.cli import CommandGroup, main, typed_commands
from palpate.robots.robot import shipped_robots
from support.cli_samples import leaves
from support.document_blocks import DOCS, MARK, ROOT, Kind, blocks, documents, name_of, pages, words_of

DOCUMENTS = documents()
BY_NAME = {name_of(document): document for document in DOCUMENTS}

UNMARKED = {
    "README.md": (
        "palpate view",
        "palpate doctor",
        "palpate recover",
        "palpate explore --robot emulated-ur5e",
        "palpate grasp --robot emulated-hand",
    ),
    "docs/robots.md": ("palpate",),
}
"""Commands that are not run, of documents whose blocks have no marks: README shows the best of all in one block,
docs/robots.md is about robots. `tests/wire` runs both emulated robots, which keep real time, and a cell like that
of docs/robots.md."""

NOTED: list[object] = []
"""What `note` was asked for."""


def note(*asked: object) -> int:
    """Stand in for what carries a command out."""
    NOTED.append(asked)
    return 0


def carry_out(command: str) -> None:
    words, output = words_of(command)
    if output is None:
        assert main(words) == 0, command
        return
    with contextlib.redirect_stdout(io.StringIO()) as printed:
        assert main(words) == 0, command
    output.write_text(printed.getvalue(), encoding="utf-8")


def is_run(document, block, command: str) -> bool:
    return not block.reason and not command.startswith(UNMARKED.get(name_of(document), ("-",)))


def run_in_order(document) -> None:
    names: dict[str, object] = {}
    for block in blocks(document):
        if block.kind is Kind.PYTHON and not block.reason:
            exec(compile(block.text, str(document), "exec"), names)
        for command in block.commands:
            if is_run(document, block, command):
                carry_out(command)


def runs(document) -> bool:
    """Whether anything of a document is run."""
    return any(
        (block.kind is Kind.PYTHON and not block.reason)
        or any(is_run(document, block, command) for command in block.commands)
        for block in blocks(document)
    )


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A folder to run in, with the files that the documents take for granted."""
    trimesh = pytest.importorskip("trimesh")
    monkeypatch.chdir(tmp_path)
    (tmp_path / "wrenches.csv").write_text("fx,fy,fz,mx,my,mz\n0.3,0.1,-2.0,0.004,0.008,0.001\n")
    (tmp_path / "examples").symlink_to(ROOT / "examples")
    trimesh.creation.icosphere(subdivisions=5, radius=40.0).export(tmp_path / "part.stl")
    return tmp_path


@pytest.mark.slow
@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=pytest.mark.xdist_group(f"page {name}"))  # pages run beside one another
        for name, document in BY_NAME.items()
        if runs(document)
    ],
)
def test_code_and_commands_run_from_top_to_bottom(name, folder):
    run_in_order(BY_NAME[name])


@pytest.mark.parametrize(
    "name", sorted(n for n, document in BY_NAME.items() if any(b.commands for b in blocks(document)))
)
def test_the_options_of_every_command_parse(name, folder, monkeypatch):
    """Also of those that are not run: the command line itself reads them."""
    monkeypatch.setattr("palpate.cli._runner", lambda command, json=False: note)
    monkeypatch.setattr("palpate.commands.run.run_experiment", note)
    monkeypatch.setattr("palpate.commands.run.dry_run_experiment", note)
    for robot in ("cell.yaml", "my_cell.yaml", "my_robot.yaml"):
        (folder / robot).write_text(shipped_robots()["stage"].read_text(encoding="utf-8"), encoding="utf-8")
    for block in blocks(BY_NAME[name]):
        for command in block.commands:
            NOTED.clear()
            assert main(words_of(command)[0]) == 0, command
            assert len(NOTED) == 1, command


def test_marks_have_a_block_and_a_reason():
    """Every mark is before a block that has something to run; and most blocks are run."""
    assert len(DOCUMENTS) > 30
    assert (ROOT / "docs" / "robots.md") in DOCUMENTS
    marks = found = run = 0
    for document in DOCUMENTS:
        text = document.read_text(encoding="utf-8")
        # CONTRIBUTING.md shows how a mark looks, set in
        marks += sum(bool(MARK.match(line)) for line in text.splitlines())
        for block in blocks(document):
            found += bool(block.reason)
            run += not block.reason and block.kind is not Kind.OTHER
    assert marks == found
    assert found < run / 2


@pytest.mark.parametrize("document", DOCUMENTS, ids=name_of)
def test_every_path_that_it_links_to_exists_and_no_line_is_a_comment(document):
    """A line of Markdown that begins with a per cent sign is a comment on the site."""
    text = re.sub(r"```.*?```", "", document.read_text(encoding="utf-8"), flags=re.DOTALL)
    assert not re.findall(r"^ {0,3}%.*", text, flags=re.MULTILINE)
    for path, _, anchor in re.findall(r"\]\((?!http)([^)#]*)(#([^)]+))?\)", text):
        target = document.parent / path if path else document
        assert target.exists(), path
        if anchor:
            assert anchor in anchors(target.read_text(encoding="utf-8")), f"{path}#{anchor}"


def anchors(text: str) -> set[str]:
    """What headings are linked by, on a code host and on the site."""
    headings = re.findall(r"^#+ (.+)$", text, flags=re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


def test_the_guide_names_every_limit():
    """A limit that is not in the table of docs/running.md is one that nobody knows of."""
    text = (DOCS / "running.md").read_text(encoding="utf-8")
    for words in ("age of each device", "contact force", "spin torque", "grip force", "speed of the tip",
                  "commanded acceleration", "workspace", "joint ranges"):  # fmt: skip
        assert words in text


@pytest.mark.parametrize("document", DOCUMENTS, ids=name_of)
def test_every_command_that_it_names_exists(document):
    """In lines to be typed, and where one stands in a sentence."""
    text = document.read_text(encoding="utf-8")
    typed = re.findall(r"(?:^ {4,}|^|`)palpate ([a-z]+)(?: ([a-z]+))?(?=[ `\n])", text, flags=re.MULTILINE)
    inside = "\n".join(re.findall(r"```.*?```|`[^`\n]+`|^ {4,}.*$", text, flags=re.MULTILINE | re.DOTALL))
    for name, second in typed:
        if f"palpate {name}" not in inside:
            continue  # a line of prose that happens to begin so
        command = typed_commands()[name]
        if isinstance(command, CommandGroup):
            assert not second or second in command.commands, f"{name} {second}"


# --- The site of the documents: it builds without a warning or a fetch, and leaves nothing out ---


def test_every_page_is_in_the_contents():
    listed = {"index"}
    for page in pages():
        for contents in re.findall(r"```\{toctree\}\n(.*?)```", page.read_text(encoding="utf-8"), flags=re.DOTALL):
            for entry in contents.splitlines():
                if entry and not entry.startswith((":", "examples/", "api/")):
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
def test_the_site_builds_without_warnings_and_holds_every_page_and_the_help_of_every_command(site):
    for page in pages():
        assert (site / page.relative_to(DOCS).with_suffix(".html")).exists(), page
    text = (site / "commands.html").read_text(encoding="utf-8")
    shown = re.sub(r"<[^>]+>", "", text)
    for typed in leaves():
        assert f'id="palpate-{typed.replace(" ", "-")}"' in text, typed
        assert f"usage: palpate {typed}" in shown, typed


@pytest.mark.slow
def test_nothing_is_fetched_and_no_path_of_this_machine_is_told(site):
    for page in site.rglob("*.html"):
        text = page.read_text(encoding="utf-8")
        assert not re.findall(r'<(?:script|img|iframe)[^>]+src="(?:https?:)?//', text), page
        assert not re.findall(r'<link[^>]+rel="(?:stylesheet|preload|icon)"[^>]+href="(?:https?:)?//', text), page
        assert str(ROOT) not in text, page
        assert str(Path.home()) + "/" not in text, page
