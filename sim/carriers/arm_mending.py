"""What is amiss in many files of arms, and does not matter to one that servos hold and that touches nothing."""

from collections.abc import Iterator
from pathlib import Path

import mujoco
import numpy as np

from palpate.errors import FloatArray
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


LEAST_SUM = 1.0 - 1e-9
"""Of the largest principal moment, that the others must come to; those of a plate do but for rounding."""


def mend(spec: mujoco.MjSpec, source: ArmSourceFile) -> dict[str, list[str]]:
    """Mend a spec before it is compiled, and return what was done, with whom.

    Raises:
        InvalidValueError: A mesh is not there.
    """
    for word, elements in (("body", spec.bodies), ("joint", spec.joints)):
        for i, element in enumerate(elements):
            element.name = element.name or f"unnamed-{word}-{i}"
    for joint in spec.joints:
        if joint.name in source.urdf.limited:
            joint.limited = int(source.urdf.limited[joint.name])
    for geom in spec.geoms:
        geom.contype = geom.conaffinity = 0  # before it is compiled: no hulls of meshes are sought then
    unread = take_unreadable_out(spec)
    find_meshes(spec, source)
    return {
        "not shown, for MuJoCo does not read such meshes": unread,
        "with an inertia that no body has, made the same about all axes": _balanced(spec),
    }


def _balanced(spec: mujoco.MjSpec) -> list[str]:
    """Give bodies whose principal moments break A + B >= C, as rounded ones do, their mean (`balanceinertia`)."""
    found: list[str] = []
    for body in spec.bodies:
        if not body.explicitinertial:
            continue
        moments = _principal_moments(body)
        mean = float(np.abs(moments).mean())
        if mean > 0.0 and (moments[0] <= 0.0 or moments[0] + moments[1] < LEAST_SUM * moments[2]):
            body.inertia, body.fullinertia = [mean] * 3, [np.nan] * 6
            found.append(body.name)
    return found


def _principal_moments(body: mujoco.MjsBody) -> FloatArray:
    """The smallest first [kg m^2]."""
    if np.isnan(body.fullinertia[0]):
        return np.sort(body.inertia)
    xx, yy, zz, xy, xz, yz = body.fullinertia
    result: FloatArray = np.linalg.eigvalsh([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    return result
