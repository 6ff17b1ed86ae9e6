"""Where palpate's dependencies install from wheels alone, as a table in docs/install.md: `make platforms`.

    python tests/install/platforms.py docs/install.md

uv resolves them for every pair of platform and CPython, as pip would on that machine. It asks a package registry,
so this is no test; that what resolves also works is known only of the pairs in TRIED.
"""

import os
import re
import subprocess
import sys
import tomllib
from dataclasses import dataclass
from datetime import UTC, datetime
from itertools import product
from pathlib import Path

ROOT = Path(__file__).parents[2]
PROJECT = ROOT / "pyproject.toml"

PYTHONS = ("3.11", "3.12", "3.13", "3.14")
PLATFORMS = {
    "Linux x86-64": "x86_64-manylinux_2_28",
    "Linux aarch64": "aarch64-manylinux_2_28",
    "macOS arm64": "aarch64-apple-darwin",
    "macOS Intel": "x86_64-apple-darwin",
    "Windows x86-64": "x86_64-pc-windows-msvc",
}
"""uv's names, by ours."""

TRIED = {("Linux x86-64", "3.11"), ("Linux x86-64", "3.12"), ("Linux x86-64", "3.13")}
"""What continuous integration installs and runs: see .ci/run."""

DRIVES_UR = {"Linux x86-64"}
"""Where ur_rtde, if it is installed, also drives an arm: palpate's client process needs Linux."""

MACOS = "13.0"
"""Oldest version of macOS that is asked for; of Linux, glibc 2.28: its name above says so."""

EXTRAS = ("parquet", "hdf5", "cluster", "learn", "foxglove", "rerun")

BEGIN = "<!-- platforms: written by `make platforms` -->"
END = "<!-- platforms: end -->"


class ResolverError(Exception):
    """uv did not come to an answer: no registry, or a message that is not known here."""


@dataclass(frozen=True, slots=True)
class Outcome:
    """What uv made of one platform and Python.

    Attributes:
        packages: Names of all packages of the resolution; empty if there is none.
        missing: What has no wheel there.
        extras: Names of palpate's extras that do not resolve there, each with what has no wheel.
    """

    packages: frozenset[str]
    missing: tuple[str, ...] = ()
    extras: tuple[tuple[str, tuple[str, ...]], ...] = ()


def names_of(resolution: str) -> frozenset[str]:
    """Return the names of the packages of uv's output, one requirement a line."""
    lines = resolution.splitlines()
    return frozenset(line.partition("==")[0].strip().lower() for line in lines if "==" in line)


def missing_from(message: str) -> tuple[str, ...]:
    """Return which packages have no wheel, from uv's message that there is no solution.

    Raises:
        ResolverError: It is another message.
    """
    text = " ".join(message.split())
    if not text.startswith("error: No solution found"):
        raise ResolverError(message)
    named = re.findall(r"([\w.-]+?)[=<>!~][^ ]* (?:has|have) no (?:usable )?wheels", text)
    named += re.findall(r"all versions of ([\w.-]+) have no (?:usable )?wheels", text)
    named += re.findall(r"Wheels are required for `([\w.-]+)`", text)
    if not named:
        raise ResolverError(message)
    return tuple(sorted(set(named)))


def cell(platform: str, python: str, outcome: Outcome) -> str:
    """Return the words of the table for one platform and Python."""
    if not outcome.packages:
        return f"does not: no wheel of {', '.join(outcome.missing)}"
    words = ["tried" if (platform, python) in TRIED else "resolves"]
    if platform not in DRIVES_UR or "ur-rtde" not in outcome.packages:
        words.append("without a UR")
    words += [f"without `{extra}` ({', '.join(missing)})" for extra, missing in outcome.extras]
    return ", ".join(words)


def table(cells: dict[tuple[str, str], str], day: str) -> str:
    """Return the table in Markdown, a row per platform, with what it was made by and when."""
    lines = [
        f"| {day} | {' | '.join(f'CPython {python}' for python in PYTHONS)} |",
        f"|---|{'---|' * len(PYTHONS)}",
        *(f"| {name} | {' | '.join(cells[name, python] for python in PYTHONS)} |" for name in PLATFORMS),
    ]
    return "\n".join(lines)


def written_into(document: str, made: str) -> str:
    """Return a document with what stands between its two marks replaced.

    Raises:
        ValueError: It does not have both marks once, in their order.
    """
    before, begin, rest = document.partition(BEGIN)
    old, end, after = rest.partition(END)
    if not begin or not end or BEGIN in old + after or END in before + after:
        raise ValueError(f"the document needs {BEGIN} and {END}, once each")
    return f"{before}{BEGIN}\n\n{made}\n\n{END}{after}"


def resolved(platform: str, python: str, extras: tuple[str, ...] = ()) -> tuple[frozenset[str], tuple[str, ...]]:
    """Return the names of what uv finds, and what has no wheel: one of both is empty."""
    command = [sys.executable, "-m", "uv", "pip", "compile", "--quiet", "--no-header", "--no-annotate"]
    command += ["--only-binary", ":all:", "--python-platform", PLATFORMS[platform], "--python-version", python]
    command += [word for extra in extras for word in ("--extra", extra)]
    environment = {**os.environ, "MACOSX_DEPLOYMENT_TARGET": MACOS}
    done = subprocess.run([*command, str(PROJECT)], capture_output=True, text=True, env=environment)
    if done.returncode == 0:
        return names_of(done.stdout), ()
    return frozenset(), missing_from(done.stderr)


def outcome_of(platform: str, python: str) -> Outcome:
    """Resolve the base dependencies, then with the extras: all at once, and each by itself if that fails."""
    packages, missing = resolved(platform, python)
    if not packages or resolved(platform, python, EXTRAS)[0]:
        return Outcome(packages, missing)
    lacking = [(extra, resolved(platform, python, (extra,))[1]) for extra in EXTRAS]
    return Outcome(packages, extras=tuple((extra, names) for extra, names in lacking if names))


def main(document: Path) -> None:
    """Resolve for every pair, with progress on standard error, and write the table into a document."""
    known = set(tomllib.loads(PROJECT.read_text(encoding="utf-8"))["project"]["optional-dependencies"])
    if unknown := set(EXTRAS) - known:
        sys.exit(f"pyproject.toml has no extra {', '.join(sorted(unknown))}")
    written_into(document.read_text(encoding="utf-8"), "")  # refused before the work, not after it
    cells = {}
    pairs = list(product(PLATFORMS, PYTHONS))
    for at, (platform, python) in enumerate(pairs, start=1):
        print(f"{at:2}/{len(pairs)} {platform}, CPython {python}: ", end="", file=sys.stderr, flush=True)
        try:
            cells[platform, python] = cell(platform, python, outcome_of(platform, python))
        except ResolverError as error:
            sys.exit(f"uv came to no answer; {document.name} is left as it was:\n{error}")
        print(cells[platform, python], file=sys.stderr)
    made = table(cells, datetime.now(UTC).date().isoformat())
    document.write_text(written_into(document.read_text(encoding="utf-8"), made), encoding="utf-8")
    print(f"{document}: table written", file=sys.stderr)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
