"""Blocks of code in the documents: what is to be run in them, and what is marked as not to be."""

import importlib.util
import re
import shlex
from collections.abc import Iterator
from dataclasses import dataclass
from enum import Enum, auto
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"

MARK = re.compile(r"<!-- not run: (.+) -->")
"""In the line before a block, in every document alike."""


class Kind(Enum):
    """What a block holds."""

    PYTHON = auto()
    SHELL = auto()
    OTHER = auto()


@dataclass(frozen=True, slots=True)
class Block:
    """One block of code.

    Attributes:
        kind: What it holds; a block without a language, or set in, is SHELL if a line of it is a command.
        text: Without fences and indentation.
        line: Of the document, where it begins, from 1.
        reason: Why it is not run; empty if it is.
    """

    kind: Kind
    text: str
    line: int
    reason: str

    @property
    def commands(self) -> list[str]:
        """Lines that begin with `palpate`, continued ones joined."""
        if self.kind is not Kind.SHELL:
            return []
        lines = self.text.replace("\\\n", " ").splitlines()
        return [line.strip() for line in lines if line.strip().startswith("palpate ")]


def documents() -> list[Path]:
    """All documents: README, how to contribute, and the pages of docs."""
    return [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *pages()]


def pages() -> list[Path]:
    """Pages of docs in version control; those of examples and of the API are made by the build."""
    return sorted(page for page in DOCS.rglob("*.md") if page.parent not in (DOCS / "examples", DOCS / "api"))


def name_of(document: Path) -> str:
    """A document's path from the root, for the names of tests."""
    return document.relative_to(ROOT).as_posix()


def blocks(document: Path) -> Iterator[Block]:
    """Yield the blocks of a document in their order."""
    lines = document.read_text(encoding="utf-8").splitlines()
    at, reason = 0, ""
    while at < len(lines):
        line, begin = lines[at], at
        at += 1
        fence = re.match(r"( *)(`{3,})(.*)", line)
        if fence:
            while at < len(lines) and lines[at].strip() != fence[2]:
                at += 1
            text = _unindented(lines[begin + 1 : at])
            at += 1
            yield Block(_kind(fence[3].strip(), text), text, begin + 1, reason)
        elif line.startswith("    ") and begin and not lines[begin - 1].strip():
            while at < len(lines) and (not lines[at].strip() or lines[at].startswith("    ")):
                at += 1
            text = _unindented(lines[begin:at])
            yield Block(_kind("", text), text, begin + 1, reason)
        mark = MARK.fullmatch(line.strip())
        if mark or line.strip():
            reason = mark[1] if mark else ""


def words_of(command: str) -> tuple[list[str], Path | None]:
    """Return what is typed after `palpate`, without a comment, and the file that its output goes to."""
    words = shlex.split(command, comments=True)[1:]
    if ">" in words:
        return words[: words.index(">")], Path(words[words.index(">") + 1])
    return words, None


def _kind(language: str, text: str) -> Kind:
    if language == "python":
        return Kind.PYTHON
    if language in {"sh", "console"} or (not language and re.search(r"^palpate ", text, flags=re.MULTILINE)):
        return Kind.SHELL
    return Kind.OTHER


def _unindented(lines: list[str]) -> str:
    filled = [line for line in lines if line.strip()]
    margin = min((len(line) - len(line.lstrip()) for line in filled), default=0)
    return "\n".join(line[margin:] for line in lines).rstrip() + "\n"


def load_module(path: Path) -> Any:
    """Import a script from its file."""
    specification = importlib.util.spec_from_file_location(path.stem, path)
    assert specification is not None
    assert specification.loader is not None
    module = importlib.util.module_from_spec(specification)
    specification.loader.exec_module(module)
    return module
