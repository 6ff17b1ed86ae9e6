"""Keep the golden runs, or compare them with those of another commit.

python tests/golden write                 make golden.json anew; the commit has to explain each change
python tests/golden compare BASE          carry all runs out in this tree and in that of the commit BASE, on this
                                          machine, and compare every command bit for bit
python tests/golden record FILE           write all commands of this tree to a file (used by `compare`)
"""

import argparse
import os
import pickle
import subprocess
import sys
import tempfile
from pathlib import Path

TESTS = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(TESTS)]

from palpate.one_thread import LINEAR_ALGEBRA  # noqa: E402

os.environ |= LINEAR_ALGEBRA  # before numpy is imported

import joblib  # noqa: E402
from rich.console import Console  # noqa: E402
from rich.progress import track  # noqa: E402
from rich.table import Table  # noqa: E402

from golden.runs import FILE, GOLDEN_RUNS, GoldenRun, Row, carried_out, written  # noqa: E402


def main() -> int:
    """Run the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = parser.add_subparsers(dest="command", required=True)
    commands.add_parser("write", help="make golden.json anew")
    commands.add_parser("record", help="write all commands to a file").add_argument("file", type=Path)
    commands.add_parser("compare", help="compare with a commit").add_argument("base")
    asked = parser.parse_args()
    if asked.command == "compare":
        return compare(asked.base)
    jobs = 1 if asked.command == "record" else -1
    kept = joblib.Parallel(n_jobs=jobs, return_as="generator")(
        joblib.delayed(_carried_out)(run) for run in GOLDEN_RUNS
    )
    results = list(track(kept, "golden runs", total=len(GOLDEN_RUNS), console=Console(stderr=True)))
    if asked.command == "write":
        FILE.write_text(written({run.name: entry for run, (entry, _) in zip(GOLDEN_RUNS, results, strict=True)}))
        Console().print(
            f"{FILE.name}: {len(results)} runs; `git diff {FILE.relative_to(TESTS.parent)}` shows what changed"
        )
    else:
        asked.file.write_bytes(
            pickle.dumps({run.name: rows for run, (_, rows) in zip(GOLDEN_RUNS, results, strict=True)})
        )
    return 0


def _carried_out(run: GoldenRun) -> tuple[dict[str, object], list[Row]]:
    entry, recorder = carried_out(run)
    return entry, recorder.rows


def compare(base: str) -> int:
    """Carry the runs out in two trees and print a table; return 1 if any command differs."""
    root = TESTS.parent
    with tempfile.TemporaryDirectory() as folder:
        tree = Path(folder) / "base"
        subprocess.run(["git", "worktree", "add", "--quiet", "--detach", tree, base], cwd=root, check=True)
        try:
            own = Path(__file__).parent
            # a commit from before the golden runs is driven by the definitions of this tree
            driver = tree / "tests" / "golden" if (tree / "tests" / "golden").is_dir() else own
            started = [_record(root, own, Path(folder) / "now"), _record(tree, driver, Path(folder) / "then")]
            if any(process.wait() for process in started):
                Console().print("the runs of one tree ended with an error: see above")
                return 1
        finally:
            subprocess.run(["git", "worktree", "remove", "--force", tree], cwd=root, check=True)
        now, then = (pickle.loads((Path(folder) / name).read_bytes()) for name in ("now", "then"))
    return _print_differences(base, now, then)


def _record(tree: Path, driver: Path, file: Path) -> "subprocess.Popen[bytes]":
    environment = {**os.environ, "PYTHONPATH": str(tree / "src")}
    return subprocess.Popen([sys.executable, driver, "record", file], cwd=tree, env=environment)


def _print_differences(base: str, now: dict[str, list[Row]], then: dict[str, list[Row]]) -> int:
    table = Table("run", "periods", f"commands against {base}")
    different = 0
    for name in sorted({*now, *then}):
        if name not in now or name not in then:
            verdict = "only in this tree" if name in now else f"only in {base}"
        elif now[name] == then[name]:
            verdict = "equal, bit for bit"
        else:
            pairs = list(zip(now[name], then[name], strict=False))
            first = next((k for k, (a, b) in enumerate(pairs) if a != b), len(pairs))
            verdict, different = f"differ from period {first} on; largest {_largest(pairs):.3g}", different + 1
        table.add_row(name, str(len(now.get(name, then.get(name, [])))), verdict)
    Console().print(table)
    return int(different > 0)


def _largest(pairs: list[tuple[Row, Row]]) -> float:
    return max((abs(x - y) for a, b in pairs for x, y in zip(a[2:], b[2:], strict=False)), default=0.0)


if __name__ == "__main__":
    sys.exit(main())
