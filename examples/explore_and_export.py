"""Explore an object by touch, and export what was found.

A simulated fingertip slides over an ellipsoid with a steady force. What it felt becomes points, a mesh and a
report: `contacts.ply` and `contacts.csv` hold every contact, `map.ply` and `map.stl` the surface,
`report.html` the pictures. The script then reads the mesh back as any other program would, and prints its
size and how true it is.

    python examples/explore_and_export.py --out runs/ellipsoid

It takes some seconds. A larger `--width` and `--depth` [m] show more of the object.
"""

from pathlib import Path

import numpy as np
import trimesh
import tyro

from palpate.experiments.explore import explore
from palpate.experiments.explore.config import ExploreConfig


def main(out: Path = Path("runs/example-explore"), width: float = 0.02, depth: float = 0.01) -> None:
    """Explore so much of an ellipsoid [m], and write what was found into a folder."""
    config = ExploreConfig(
        robot="stage",  # what carries the fingertip: `palpate robot list` names them all
        object="ellipsoid",
        size=(0.05, 0.04, 0.03),  # semi-axes [m]
        force=2.0,  # to press with [N]
        speed=0.05,  # along the surface [m/s]
        width=width,  # of the rectangle that is explored [m]
        depth=depth,  # [m]
    )
    found = explore(config, out)  # writes log, report and files
    print(f"{found.run}: {len(found.cloud)} contacts")
    print(f"force error {found.force_rms:.3f} N RMS, points {1e6 * found.point_rms:.2f} um RMS")
    if found.map is not None and (shape := found.map.shape) is not None:
        print(f"the shape is: {shape.kind.value if shape.kind else 'none of those known'}")

    mesh = trimesh.load_mesh(out / "map.stl")
    semi_axes = np.array(config.size)
    level = np.linalg.norm(mesh.vertices / semi_axes, axis=1)  # 1 on the true ellipsoid
    print(f"map.stl: {len(mesh.faces)} triangles, {1e4 * mesh.area:.2f} cm2, at most")
    print(f"{1e6 * np.abs(level - 1.0).max() * semi_axes.min():.1f} um from the true ellipsoid")
    print("written:", *sorted(out.iterdir()), sep="\n  ")


if __name__ == "__main__":
    tyro.cli(main)
