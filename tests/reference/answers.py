"""Stored true contacts of the hard cases; as a script, a table of the worst errors and the stored file anew.

python tests/reference/answers.py [--cases 300] [--store]
"""

import argparse
import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from reference.cases import ALL, sample
from reference.compare import FIELDS, Answer, measure

FILE = Path(__file__).with_name("answers.npz")
STORED = 50
"""Cases of each category in the file."""


def stored() -> dict[str, list[Answer]]:
    """Return the true contacts of the first cases of every category."""
    with np.load(FILE) as file:
        status, numbers, rest = (file[name] for name in ("status", "numbers", "rest"))
    return {name: [Answer(str(status[i, k]), numbers[i, k], rest[i, k]) for k in range(STORED)]
            for i, name in enumerate(ALL)}  # fmt: skip


def store() -> None:
    """Solve the first cases of every category and write them."""
    rows = [[Answer.rounded(case.wanted()) for case in sample(name, STORED)] for name in ALL]
    fields = {
        name: np.array([[getattr(each, name) for each in row] for row in rows])
        for name in ("status", "numbers", "rest")
    }
    np.savez_compressed(FILE, **fields)


def main() -> None:
    """Print one row per category: how many are right, the worst error of every field, the largest kappa."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", type=int, default=300, help="of each category")
    parser.add_argument("--store", action="store_true", help=f"write {FILE.name} instead")
    asked = parser.parse_args()
    if asked.store:
        store()
        return
    out = sys.stdout.write
    out(f"| category | solved | kappa | {' | '.join(FIELDS)} | centroid / (u condition) |\n")
    out("|" + "---|" * (len(FIELDS) + 4) + "\n")
    for name in ALL:
        results = [measure(case, Answer.rounded(case.wanted())) for case in sample(name, asked.cases)]
        solved = [r for r in results if r.wanted_status == "OK"]
        wrong = sum(r.status != r.wanted_status for r in results)
        kappa = max((r.kappa for r in solved), default=0.0)
        worst = [max(r.errors[f] for r in results) for f in FIELDS]
        promised = max((r.errors["centroid"] / (2.0**-53 * r.condition) for r in solved), default=0.0)
        status = f"{len(solved)}" + (f" ({wrong} wrong)" if wrong else "")
        numbers = " | ".join(f"{w:.1e}" for w in worst)
        out(f"| {name} | {status} | {kappa:.1e} | {numbers} | {promised:.1f} |\n")


if __name__ == "__main__":
    main()
