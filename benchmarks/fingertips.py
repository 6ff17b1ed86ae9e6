"""Explorations with every kind of fingertip against the sphere's: error of the map, in simulation and on a rig.

    python benchmarks/fingertips.py [--robot stage] [--time-scale 1]

Each explores the same ellipsoid on the same robot; `--robot emulated-ur5e` goes through the maker's client library
and an ATI client to emulated devices, in real time or slower (`--time-scale 0.25`). Reports the errors of map and
points and of the force, and the map's over the sphere's; exit code 1 if one is above 1.3 times.
"""

import argparse
import tempfile
from pathlib import Path

from rich.console import Console
from rich.table import Table

from palpate.experiments.explore import explore
from palpate.experiments.explore.config import ExploreConfig
from palpate.robots.robot import ROBOT_TEXT
from palpate.robots.values import load_named_robot

LIMIT = 1.3
SUPERELLIPSOID = "{kind: superellipsoid, semi_axes_m: [0.009, 0.009, 0.008], exponent: 2.5}"
TIPS = {
    "sphere": "{kind: sphere, radius_m: 0.008}",
    "capsule": "{kind: capsule, radius_m: 0.008, length_m: 0.02, rotvec_rad: [3.141592653589793, 0, 0]}",
    "superellipsoid": SUPERELLIPSOID,
    "compliant superellipsoid": f"{{kind: compliant, tip: {SUPERELLIPSOID}, stiffness_N_per_m: 40000}}",
    "rounded box": "{kind: rounded_box, half_lengths_m: [0.009, 0.009, 0.008], radius_m: 0.006}",
}


def with_tip(text: str, surface: str, time_scale: float) -> str:
    """Return a robot file with another fingertip."""
    before, rest = text.split("  - surface:", 1)
    after = rest[rest.index("    payload:") :]
    before = before.replace("time_scale: 1.0", f"time_scale: {time_scale}")
    return f"{before}  - surface: {surface}\n{after}"


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--robot", default="stage", help="shipped robot file (default: stage)")
    parser.add_argument("--time-scale", type=float, default=1.0, help="of an emulated robot (default: 1)")
    given = parser.parse_args()
    text = load_named_robot(given.robot).texts[ROBOT_TEXT]
    table = Table("tip", "map [um]", "over the sphere's", "points [um]", "force [mN]", title=given.robot)
    reference, worst = 0.0, 0.0
    with tempfile.TemporaryDirectory() as folder:
        for name, surface in TIPS.items():
            file = Path(folder) / "robot.yaml"
            file.write_text(with_tip(text, surface, given.time_scale))
            found = explore(ExploreConfig(robot=str(file), object="ellipsoid", width=0.012, depth=0.006))
            rest = (f"{1e6 * found.point_rms:.3g}", f"{1e3 * found.force_rms:.3g}")
            if found.claimed_map is None:  # too little was felt for a map, or too uncertainly
                table.add_row(name, "none", "", *rest)
                continue
            error = found.claimed_map.rms
            reference = reference or error
            worst = max(worst, error / reference)
            table.add_row(name, f"{1e6 * error:.3g}", f"{error / reference:.3g}", *rest)
    Console().print(table)
    raise SystemExit(0 if worst <= LIMIT else 1)


if __name__ == "__main__":
    main()
