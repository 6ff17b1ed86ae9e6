"""The share of small faults in the package that the tests detect.

    python tests/mutants draw             draw mutants from this tree into drawn.jsonl (once: they are kept)
    python tests/mutants reach [TREE]     record which tests reach which lines: the tests that are not slow, under
                                          coverage; some 25 minutes of processor time
    python tests/mutants run [TREE]       make the first 300 mutants that still exist, run for each the tests that
                                          reach its line, and print the share of mutants that a test detects

A mutant is killed if a test fails or runs for far longer than it should. Of the tests that reach its line the
quickest are run, up to TESTS of them and SECONDS of recorded time. A mutant whose statement no longer exists is
gone; one that no test reaches survives. Files with compiled kernels are left out: a changed kernel would have to
be compiled again for every mutant, and they are compared with answers of 180 digits.
"""

import argparse
import dataclasses
import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import xml.etree.ElementTree as ElementTree
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import suppress
from multiprocessing import get_context
from pathlib import Path

TESTS_FOLDER = Path(__file__).resolve().parents[1]
ROOT = TESTS_FOLDER.parent
sys.path[:0] = [str(TESTS_FOLDER)]

from rich.console import Console  # noqa: E402
from rich.progress import Progress  # noqa: E402
from rich.table import Table  # noqa: E402

from mutants.mutation import AREAS, Change, Mutant, changed, drawn, every_mutant  # noqa: E402

DRAWN = Path(__file__).with_name("drawn.jsonl")
SEED, SPARE, COUNT = 2026, 450, 300
"""Seed of the draw; mutants drawn, and mutants made: code that is deleted takes some away."""

JOBS = 2
"""Mutants made at a time, each in a copy of the tree."""

TESTS, SECONDS = 25, 8.0
"""Most tests for one mutant, and most of their recorded time [s]."""

COVERAGE = "[run]\nsource_pkgs = palpate\ndata_file = {data}\n"


def main() -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("command", choices=("draw", "reach", "run"))
    parser.add_argument("tree", nargs="?", type=Path, default=ROOT, help="checkout; default: this one")
    parser.add_argument("--count", type=int, default=COUNT, help="mutants to make (%(default)s)")
    asked = parser.parse_args()
    tree = asked.tree.resolve()
    build = tree / "build" / "mutants"
    if asked.command == "draw":
        lines = (json.dumps(dataclasses.asdict(mutant)) for mutant in drawn(tree, SPARE, SEED))
        DRAWN.write_text("\n".join(lines) + "\n")
    elif asked.command == "reach":
        record_reach(tree, build)
    else:
        if not (build / "coverage").exists():
            record_reach(tree, build)
        run(tree, build, asked.count)


def record_reach(tree: Path, build: Path) -> None:
    """Run the tests that are not slow with coverage, a context for each."""
    build.mkdir(parents=True, exist_ok=True)
    settings = build / "settings.ini"  # coverage deletes coverage.*
    settings.write_text(COVERAGE.format(data=build / "coverage"))
    command = [sys.executable, "-m", "pytest", "-m", "not slow", "-n", "auto", "--dist", "loadgroup", "-q",
               "--cov", f"--cov-config={settings}", "--cov-context=test", "--cov-report=",
               f"--junitxml={build / 'durations.xml'}"]  # fmt: skip
    subprocess.run(command, cwd=tree, env=_environment(tree), check=False)


def _environment(tree: Path) -> dict[str, str]:
    return {**os.environ, "PYTHONPATH": str(tree / "src"), "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}


class Reach:
    """Which tests reach a line, the quickest first."""

    def __init__(self, tree: Path, build: Path) -> None:
        from coverage import CoverageData

        self._tree = tree
        self._data = CoverageData(str(build / "coverage"))
        self._data.read()
        self._files = {Path(name).resolve(): name for name in self._data.measured_files()}
        self._seconds: dict[str, float] = {}
        for case in ElementTree.parse(build / "durations.xml").iter("testcase"):
            if case.find("failure") is None and case.find("error") is None:
                name = f"{case.get('classname', '').replace('.', '/')}.py::{case.get('name', '').split('@')[0]}"
                self._seconds[name] = float(case.get("time", "0"))

    def tests(self, path: str, line: int) -> list[str]:
        """Return the tests that a mutant of this line is given to."""
        contexts = self._data.contexts_by_lineno(self._files.get((self._tree / path).resolve(), "")).get(line, [])
        names = {context.split("|")[0].split("@tests/")[0].removesuffix("@wire") for context in contexts}
        found, spent = [], 0.0
        for name in sorted(names & set(self._seconds), key=self._seconds.__getitem__)[:TESTS]:
            spent += self._seconds[name]
            if found and spent > SECONDS:
                break
            found.append(name)
        return found


def run(tree: Path, build: Path, count: int) -> None:
    """Make mutants in a copy of the tree and print how many are killed."""
    import_libraries()
    reach, there = Reach(tree, build), every_mutant(tree)
    chosen = [Mutant(**json.loads(line)) for line in DRAWN.read_text().splitlines()]
    present = [mutant for mutant in chosen if mutant in there][:count]
    results = build / "results.jsonl"
    # looked up here: in a forked process coverage would empty its file
    left = [
        (mutant, there[mutant], reach.tests(mutant.path, there[mutant].line))
        for mutant in present
        if _name(mutant) not in _known(results)
    ]
    fork = get_context("fork")
    workers = [fork.Process(target=judge, args=(tree, results, left[start::JOBS])) for start in range(JOBS)]
    for worker in workers:
        worker.start()
    with Progress(console=Console(stderr=True)) as progress:
        task = progress.add_task("mutants", total=len(present))
        while any(worker.is_alive() for worker in workers):
            progress.update(task, completed=len(_known(results)))
            workers[0].join(1.0)
    verdicts = [_known(results)[_name(mutant)] for mutant in present]
    print_table(present, verdicts, len(chosen))


def judge(tree: Path, results: Path, mutants: Sequence[tuple[Mutant, Change, list[str]]]) -> None:
    """Make mutants in a copy of the tree and append their verdicts to a file."""
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder) / "tree"
        shutil.copytree(
            tree, copy, symlinks=True, ignore=shutil.ignore_patterns(".git", "build", "runs", ".venv*")
        )
        for mutant, change, tests in mutants:
            found = verdict(copy, mutant, change, tests) if tests else "not reached"
            with results.open("a") as file:
                file.write(json.dumps({"mutant": _name(mutant), "verdict": found, "tests": tests}) + "\n")


def _name(mutant: Mutant) -> str:
    return json.dumps(dataclasses.asdict(mutant))


def _known(results: Path) -> dict[str, str]:
    return {line["mutant"]: line["verdict"] for line in _lines(results)}


def _lines(file: Path) -> Iterator[dict[str, str]]:
    yield from map(json.loads, file.read_text().splitlines() if file.exists() else ())


def import_libraries() -> None:
    """Import what is slow to import, so that each mutant's process, a fork of this one, has it."""
    os.environ |= _environment(ROOT)
    for name in ("numpy", "scipy.optimize", "scipy.stats", "numba", "casadi", "mujoco", "pytest"):
        __import__(name)


def verdict(copy: Path, mutant: Mutant, change: Change, tests: Sequence[str]) -> str:
    """Return whether tests in the copy of the tree kill a mutant."""
    file = copy / mutant.path
    source, stat = file.read_text(encoding="utf-8"), file.stat()
    file.write_text(changed(source, change), encoding="utf-8")
    try:
        return _outcome(copy, tests)
    finally:
        file.write_text(source, encoding="utf-8")
        os.utime(file, ns=(stat.st_atime_ns, stat.st_mtime_ns))


def _outcome(copy: Path, tests: Sequence[str]) -> str:
    child = os.fork()
    if not child:
        try:
            os._exit(_run_tests(copy, tests))
        finally:
            os._exit(99)
    while True:
        pid, status = os.waitpid(child, os.WNOHANG)
        if pid:
            break
        time.sleep(0.02)
    with suppress(ProcessLookupError):
        os.killpg(child, signal.SIGKILL)  # processes that a test started and left behind
    return "survived" if os.WIFEXITED(status) and os.WEXITSTATUS(status) == 0 else "killed"


def _run_tests(copy: Path, tests: Sequence[str]) -> int:
    """Run tests in this process, silently, and return pytest's exit code."""
    os.setsid()
    signal.alarm(int(60 + 10 * SECONDS))
    os.chdir(copy)
    os.environ |= {"PYTHONPATH": str(copy / "src"), "PYTHONDONTWRITEBYTECODE": "1"}
    sys.dont_write_bytecode = True
    # another module of the name `mutants` or `palpate` than those of this process
    sys.path[:] = [str(copy / "src"), *(each for each in sys.path if Path(each) != TESTS_FOLDER)]
    nothing = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nothing, 1)
    os.dup2(nothing, 2)
    import pytest

    return int(pytest.main([*tests, "-x", "-q", "-p", "no:cacheprovider"]))


def print_table(mutants: Sequence[Mutant], verdicts: Sequence[str], chosen: int) -> None:
    """Print the counts by area, and the survivors."""
    console, table = Console(), Table("area", "made", "killed", "survived", "not reached", "share killed")
    counts = Counter(zip((mutant.area for mutant in mutants), verdicts, strict=True))
    for mutant, found in zip(mutants, verdicts, strict=True):
        if found != "killed":
            console.print(
                f"{found}: {mutant.path} {mutant.function}: {mutant.operator} in {mutant.statement[:90]}"
            )
    for area in [*AREAS, "all"]:
        row = [sum(n for (a, v), n in counts.items() if area in (a, "all") and v == each)
               for each in ("killed", "survived", "not reached")]  # fmt: skip
        table.add_row(area, str(sum(row)), *map(str, row), f"{row[0] / max(sum(row), 1):.0%}")
    console.print(table)
    console.print(f"{len(mutants)} mutants made, of {chosen} drawn with seed {SEED}")


if __name__ == "__main__":
    main()
