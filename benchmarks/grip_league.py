"""Ours and three published grips in the same scenarios.

    python benchmarks/grip_league.py [--seeds 40] [--plant] [--write]

Two fingers, friction touched; seeds from 2000 on, which nothing was tuned on. `--plant`: the friction plant's
bristles instead of MuJoCo's friction. `--write` puts the table into docs/slip-safe-grasps.md.
"""

import argparse
import itertools
import sys
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

from grip.league import HEADS, SCENARIOS, SCHEMES, Row, of_seed
from rich.console import Console
from rich.progress import track
from rich.table import Table

FIRST_SEED = 2000
PAGE = Path(__file__).resolve().parents[1] / "docs" / "slip-safe-grasps.md"
BEGINS, ENDS = "<!-- grip_league{} begins -->\n", "<!-- grip_league{} ends -->\n"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=40)
    parser.add_argument("--plant", action="store_true", help="bristles")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--write", action="store_true", help="into the page")
    asked = parser.parse_args()
    jobs = [(scheme, FIRST_SEED + i) for scheme in SCHEMES for i in range(asked.seeds)]
    with ProcessPoolExecutor(asked.jobs) as pool:
        found = [pool.submit(of_seed, *job, plant=asked.plant) for job in jobs]
        runs = [each.result() for each in track(found, "runs", transient=True)]
    by_scheme = [runs[k * asked.seeds : (k + 1) * asked.seeds] for k in range(len(SCHEMES))]
    rows = [Row.of([seed[i] for seed in its]) for i in range(len(SCENARIOS)) for its in by_scheme]
    cases = list(itertools.product(SCENARIOS, SCHEMES))
    heads = ("scenario", "grip", *HEADS)
    cells = [(scenario.name, scheme, *row.cells) for (scenario, scheme), row in zip(cases, rows, strict=True)]
    table = Table(*heads)
    for each in cells:
        table.add_row(*each)
    Console(width=160).print(table)
    if asked.write:
        kind = " bristles" if asked.plant else ""
        begins, ends = BEGINS.format(kind), ENDS.format(kind)
        text = PAGE.read_text("utf-8")
        before, rest = text.split(begins)
        _, after = rest.split(ends)
        lines = [f"| {' | '.join(each)} |" for each in (heads, ["---"] * len(heads), *cells)]
        PAGE.write_text(f"{before}{begins}\n{chr(10).join(lines)}\n\n{ends}{after}", "utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
