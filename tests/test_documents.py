"""The code in README and docs runs as it stands, and what they name exists."""

import re
from pathlib import Path

import pytest

from palpate.cli import COMMANDS, Group

ROOT = Path(__file__).parent.parent
DOCUMENTS = [
    ROOT / "README.md",
    *(ROOT / "docs" / name for name in ("running.md", "simulation.md", "grasp.md", "robots.md")),
]


def blocks(document):
    """The document's Python, in order: later blocks may use names of earlier ones."""
    return re.findall(r"```python\n(.*?)```", document.read_text(encoding="utf-8"), flags=re.DOTALL)


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: path.stem)
def test_the_code_runs(document, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    names = {}
    for block in blocks(document):
        exec(compile(block, str(document), "exec"), names)
    assert len(blocks(document)) >= 2
    assert capsys.readouterr().out.strip()


@pytest.mark.parametrize(
    "document", [ROOT / "README.md", *(ROOT / "docs").glob("*.md")], ids=lambda path: path.stem
)
def test_every_path_that_it_links_to_exists(document):
    text = document.read_text(encoding="utf-8")
    for path in re.findall(r"\]\((?!http)([^)#]+)\)", text):
        assert (document.parent / path).exists(), path


def test_the_guide_names_every_limit():
    """A limit that is not in the table of docs/running.md is one that nobody knows of."""
    text = (ROOT / "docs" / "running.md").read_text(encoding="utf-8")
    for words in ("age of each device", "contact force", "spin torque", "grip force", "speed of the tip",
                  "commanded acceleration", "workspace", "joint ranges"):  # fmt: skip
        assert words in text


@pytest.mark.parametrize(
    "document", [ROOT / "README.md", *(ROOT / "docs").glob("*.md")], ids=lambda path: path.stem
)
def test_every_command_that_it_names_exists(document):
    """In lines to be typed, and where one stands in a sentence."""
    text = document.read_text(encoding="utf-8")
    typed = re.findall(r"(?:^ {4,}|`)palpate ([a-z]+)(?: ([a-z]+))?", text, flags=re.MULTILINE)
    for name, second in typed:
        assert name in COMMANDS, name
        command = COMMANDS[name]
        if isinstance(command, Group):
            assert not second or second in command.commands, f"{name} {second}"
