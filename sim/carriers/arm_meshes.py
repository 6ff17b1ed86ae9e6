"""Meshes of an arm that is only looked at: found where ROS finds them; those that MuJoCo cannot read taken out."""

from collections.abc import Iterator
from pathlib import Path

import mujoco

from palpate.sim.carriers.arm_source import ArmSourceFile

READABLE = frozenset({".stl", ".obj", ".msh"})
"""Endings of meshes that MuJoCo reads."""

_SCHEMES = ("package://", "model://")
"""Of names that begin with a package, whose folder ROS looks up."""


def find_meshes(spec: mujoco.MjSpec, source: ArmSourceFile) -> None:
    """Give meshes in packages the path of their file, in one of the folders that the arm's file is in.

    Raises:
        InvalidValueError: One is in none of them.
    """
    folder = source.path.resolve().parent
    for mesh in spec.meshes:
        scheme = next((each for each in _SCHEMES if mesh.file.startswith(each)), None)
        if scheme is None:
            continue
        found = next(filter(Path.is_file, _places(mesh.file.removeprefix(scheme), folder)), None)
        if found is None:
            problem = f"a mesh cannot be found ({mesh.file})"
            raise source.refusal(mesh.file, problem, "put it into its package, above the arm's file")
        mesh.file = str(found)


def take_unreadable_out(spec: mujoco.MjSpec) -> list[str]:
    """Take shapes out whose meshes are of a format that MuJoCo does not read; returns the meshes' names."""
    unread = {mesh.name: mesh for mesh in spec.meshes if mesh.file and _ending(mesh) not in READABLE}
    for geom in list(spec.geoms):
        if geom.meshname in unread:
            spec.delete(geom)
    for mesh in unread.values():
        spec.delete(mesh)
    return list(unread)


def _places(name: str, folder: Path) -> Iterator[Path]:
    """Where a file of a package may be: in a folder called like the package, or in another one."""
    _, _, within = name.partition("/")
    for around in (folder, *folder.parents):
        yield around / name
        yield around / within


def _ending(mesh: mujoco.MjsMesh) -> str:
    return Path(mesh.file).suffix.lower()
