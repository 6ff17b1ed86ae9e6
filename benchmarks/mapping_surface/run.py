"""How well a surface map fits, how honestly it says so, and what it costs.

    python benchmarks/mapping_surface [--quick] [--picture FILE]

Contacts of surfaces in closed form along a raster at 20 mm/s and 500 Hz, with noise that keeps along the path.
Asked: RMS below 0.01 mm without noise, 0.012 mm and at most 0.05 mm with it, 90 to 99 % of errors inside the 95 %
band, a median band of at most 1.5 x the error under a bias; 100000 contacts built in 5 s, 100 more in 50 ms, a
mesh in 3 s, 400 MB.

Set OMP_NUM_THREADS=1: matrices of 200 rows gain nothing from threads and lose much where cores are shared.
"""

import argparse
from pathlib import Path

from rich.console import Console

from mapping_surface.cost import cost
from mapping_surface.honesty import CASES, honesty, wide_rows
from mapping_surface.picture import draw


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="one seed, noise only, up to 10000 contacts")
    parser.add_argument(
        "--picture", type=Path, help="draw error and uncertainty of bumps and a torus to this file"
    )
    arguments = parser.parse_args()
    console = Console(width=130)
    if arguments.quick:
        console.print(honesty(1, cases=CASES[1:2]))
        console.print(cost((1000, 10000)))
    else:
        console.print(honesty(5))
        console.print(honesty(5, rows=2e-3, cases=(wide_rows(CASES[1]),)))
        console.print(cost((1000, 3000, 10_000, 30_000, 100_000)))
    if arguments.picture:
        draw(arguments.picture)
