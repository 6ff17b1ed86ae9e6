"""Which files an exploration writes besides report and log."""

from functools import partial
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from palpate.experiments.explore.exploration import ExplorationResult
    from palpate.experiments.kit.experiment import Writer

FILE_NAMES = ("contacts.ply", "contacts.csv", "marks.csv", "map.ply", "map.stl", "height_map.csv")
"""Of an exploration that feels enough for a map."""


def exploration_files(found: "ExplorationResult") -> "dict[str, Writer]":
    """Return what writes each file, by its name."""
    from palpate.experiments.explore.explored_marks import write_marks_csv
    from palpate.mapping import write_cloud_csv, write_cloud_ply, write_height_map_csv, write_mesh
    from palpate.mapping.layers import write_layered_mesh

    files: dict[str, Writer] = {
        "contacts.ply": partial(write_cloud_ply, found.cloud),
        "contacts.csv": partial(write_cloud_csv, found.cloud),
        "marks.csv": partial(write_marks_csv, found.marks),
    }
    if found.map is not None and len(found.map.mesh.triangles):
        files["map.ply"] = partial(write_layered_mesh, found.map.mesh, found.map.layers)
        files["map.stl"] = partial(write_mesh, found.map.mesh)
    if found.height_map is not None:
        files["height_map.csv"] = partial(write_height_map_csv, found.height_map)
    return files
