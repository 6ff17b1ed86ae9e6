"""Print the worst error of every category: `python tests/reference/worst.py [cases per category]`."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))


def main() -> None:
    """One row per category: how many are right, the worst error of every field, the largest kappa."""
    from reference import cases
    from reference.compare import FIELDS, measure, sample

    count = int(sys.argv[1]) if len(sys.argv) > 1 else 300
    out = sys.stdout.write
    out(f"| category | solved | kappa | {' | '.join(FIELDS)} | centroid / (u condition) |\n")
    out("|" + "---|" * (len(FIELDS) + 4) + "\n")
    for name, make in cases.ALL.items():
        results = [measure(c) for c in sample(name, make, count)]
        solved = [r for r in results if r.wanted_status == "OK"]
        wrong = sum(r.status != r.wanted_status for r in results)
        kappa = max((r.kappa for r in solved), default=0.0)
        worst = [max((r.errors[f] for r in results), default=0.0) for f in FIELDS]
        promised = max((r.errors["centroid"] / (2.0**-53 * r.condition) for r in solved), default=0.0)
        status = f"{len(solved)}" + (f" ({wrong} wrong)" if wrong else "")
        numbers = " | ".join(f"{w:.1e}" for w in worst)
        out(f"| {name} | {status} | {kappa:.1e} | {numbers} | {promised:.1f} |\n")


if __name__ == "__main__":
    main()
