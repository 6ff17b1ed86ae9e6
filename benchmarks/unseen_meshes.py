"""Mesh files of shapes that no test was developed with, explored: trimesh's primitives, and files of users.

All lie within 60 mm or so and are smooth on top, or have the facets, edges and noise that they are named for.
"""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import trimesh
from hostile_scenes import NANO17

from palpate.experiments.explore import explore
from palpate.experiments.explore.config import ExploreConfig
from palpate.experiments.explore.experiment import Explore
from palpate.experiments.explore.exploration import ExplorationResult

FORCE_RMS, MAP_RMS, COVERED = 0.05, 1e-5, 0.90
"""Largest RMS error of the force [N] and of the map [m] on smooth meshes; least share inside the band."""

INCH = 0.0254

MILLI = 1e-3
"""Shapes with small triangles are made in millimetres: trimesh leaves out those below 1e-8, whatever the unit."""


@dataclass(frozen=True, slots=True)
class MeshCase:
    """A mesh in a file.

    Attributes:
        name: Name of the case.
        suffix: Suffix of the file's format.
        make: Returns the mesh in metres; it is written in units of `unit`.
        unit: Metres per unit of the file.
        smooth: Whether facets are too small to be detected where the tip goes: force and map must then be as good
            as on an analytic shape.
        center: Place to explore, x and y from the middle of its bounding box [m].
        side: Radius of the disc that is explored, or half the length of rows [m].
    """

    name: str
    suffix: str
    make: Callable[[], trimesh.Trimesh]
    unit: float = 1.0
    smooth: bool = True
    center: tuple[float, float] = (0.0, 0.0)
    side: float = 0.012

    def write(self, folder: Path) -> Path:
        """Write the file and return its path."""
        mesh = self.make()
        mesh.apply_scale(1.0 / self.unit)
        path = folder / f"{self.name.replace(' ', '_')}.{self.suffix}"
        mesh.export(path)
        return path


def lying_capsule(sides: int = 384) -> trimesh.Trimesh:
    """Return a capsule along x, its cylinder of so many sides, along x, too."""
    mesh = trimesh.creation.capsule(height=40.0, radius=20.0, count=[48, sides]).apply_scale(MILLI)
    mesh.apply_transform(trimesh.transformations.rotation_matrix(math.pi / 2, (0.0, 1.0, 0.0)))
    return mesh


def lying_cone() -> trimesh.Trimesh:
    """Return a cone on its side, its upper line level."""
    radius, height = 0.02, 0.07
    mesh = trimesh.creation.cone(radius=radius, height=height, sections=720)
    mesh.apply_transform(trimesh.transformations.rotation_matrix(math.pi / 2, (0.0, 1.0, 0.0)))
    mesh.apply_transform(trimesh.transformations.rotation_matrix(-math.atan2(radius, height), (0.0, 1.0, 0.0)))
    return mesh


def ball(subdivisions: int) -> trimesh.Trimesh:
    """Return an icosphere of 30 mm."""
    return trimesh.creation.icosphere(subdivisions=subdivisions, radius=0.03)


def lens() -> trimesh.Trimesh:
    """Return a lens: a polygon revolved about z, 50 mm wide, crowned with 60 mm."""
    half, crown = 25.0, 60.0
    angle = np.linspace(0.0, math.asin(half / crown), 160)
    x, z = crown * np.sin(angle), crown * (np.cos(angle) - math.cos(angle[-1]))
    profile = np.column_stack([np.append(x, [half, 0.0]), np.append(z, [-10.0, -10.0])])
    return trimesh.creation.revolve(profile[::-1], sections=720).apply_scale(MILLI)


def ring() -> trimesh.Trimesh:
    """Return an annulus: flat on top, a hole in the middle."""
    return trimesh.creation.annulus(r_min=0.012, r_max=0.03, height=0.015, sections=180)


def prism() -> trimesh.Trimesh:
    """Return a prism over a polygon with seven corners: flat on top."""
    angle = np.linspace(0.0, 2.0 * math.pi, 7, endpoint=False)
    outline = 0.025 * np.column_stack([np.cos(angle), np.sin(angle), 0.0 * angle])
    return trimesh.Trimesh(np.vstack([outline, outline + np.array([0.0, 0.0, 0.012])])).convex_hull


def pillow() -> trimesh.Trimesh:
    """Return a superellipsoid, |x/a|^p + |y/b|^p + |z/c|^p = 1 with p = 3: a box with edges rounded all over."""
    mesh = trimesh.creation.icosphere(subdivisions=6, radius=1.0)
    direction = np.asarray(mesh.vertices)
    semi = np.array([0.03, 0.024, 0.018])
    length = np.sum(np.abs(direction / semi) ** 3, axis=1) ** (-1.0 / 3.0)
    return trimesh.Trimesh(direction * length[:, None], mesh.faces, process=False)


def scanned() -> trimesh.Trimesh:
    """Return a ball as a scanner would give it: noise of 10 um on vertices about 1 mm apart."""
    mesh = ball(5)
    mesh.vertices += 1e-5 * np.random.default_rng(7).normal(size=mesh.vertices.shape)
    return mesh


def tray() -> trimesh.Trimesh:
    """Return a cuboid of trimesh.primitives, low, turned by half a right angle about z."""
    mesh = trimesh.primitives.Box(extents=(0.04, 0.03, 0.01)).to_mesh()
    mesh.apply_transform(trimesh.transformations.rotation_matrix(math.pi / 4, (0.0, 0.0, 1.0)))
    return mesh


def overturned() -> trimesh.Trimesh:
    """Return a cone standing on its tip: its base, upside down, on top."""
    mesh = trimesh.creation.cone(radius=0.025, height=0.03, sections=180)
    mesh.apply_transform(trimesh.transformations.rotation_matrix(math.pi, (1.0, 0.0, 0.0)))
    return mesh


def wedge() -> trimesh.Trimesh:
    """Return a roof: two planes at 20 degrees that meet in a ridge along y."""
    half, rise = 0.025, 0.025 * math.tan(math.radians(20.0))
    section = [(-half, 0.0), (half, 0.0), (half, 0.008), (0.0, 0.008 + rise), (-half, 0.008)]
    front = np.array([(x, -0.02, z) for x, z in section])
    return trimesh.Trimesh(np.vstack([front, front + np.array([0.0, 0.04, 0.0])])).convex_hull


CASES = (
    MeshCase("capsule", "stl", lying_capsule),
    MeshCase("capsule of 192 sides", "stl", lambda: lying_capsule(192), smooth=False),
    MeshCase("cone", "obj", lying_cone),
    MeshCase("icosphere 6", "ply", lambda: ball(6)),
    MeshCase("lens", "ply", lens),
    MeshCase("superellipsoid", "stl", pillow),
    MeshCase("capsule in inches", "stl", lying_capsule, unit=INCH),
    MeshCase("icosphere 5 in mm", "obj", lambda: ball(5), unit=1e-3, smooth=False),
    MeshCase("cuboid turned", "off", tray, side=0.01),
    MeshCase("annulus", "stl", ring, center=(0.0, 0.021), side=0.01),
    MeshCase("prism", "ply", prism),
    MeshCase("cone on its tip", "off", overturned),
    MeshCase("icosphere 2", "stl", lambda: ball(2), smooth=False),
    MeshCase("icosphere 3", "obj", lambda: ball(3), smooth=False),
    MeshCase("roof", "stl", wedge, smooth=False, side=0.016),
    MeshCase("scanned ball", "ply", scanned, smooth=False),
)


def explored(
    case: MeshCase, folder: Path, robot: str, way: str, noise: tuple[float, float] = NANO17
) -> ExplorationResult:
    """Explore the middle of a mesh, with white noise of the force [N] and of the moment [N m]."""
    size = {"radius": 0.5 * case.side} if way == "spiral" else {"width": 2.0 * case.side, "depth": 0.5 * case.side}
    config = ExploreConfig(
        robot=robot,
        object="mesh",
        file=case.write(folder),
        scale=case.unit,
        center=case.center,
        strategy=way,
        force_noise=noise[0],
        moment_noise=noise[1],
        identify=robot != "stage",  # an arm is not one lag: the figures asked of it are those of a measured law
        **size,
    )
    return explore(config)


def missed(case: MeshCase, found: ExplorationResult) -> Iterator[str]:
    """Name the figures that an exploration of a mesh misses."""
    if not found.truth.touching[found.scanning].all() or found.run.ending.value != "done":
        yield f"contact was lost ({Explore().report(found).outcome})"
    if case.smooth and found.force_rms >= FORCE_RMS:
        yield f"force RMS {found.force_rms:.3f} N"
    if found.map is None or not found.map.claimed.any():
        yield "no map"
    elif found.map.covered < COVERED:
        yield f"{100.0 * found.map.covered:.1f} % inside the band"
    elif case.smooth and found.map.rms >= MAP_RMS:
        yield f"map RMS {1e6 * found.map.rms:.1f} um"
