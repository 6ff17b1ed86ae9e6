"""The object of an exploration: from its name and size, from a file, or again from the text in a log."""

from collections.abc import Mapping

import numpy as np

from palpate.errors import FloatArray, InvalidValueError
from palpate.experiments.explore.config import ExploreConfig, ObjectName
from palpate.experiments.explore.heights_file import heights_text, load_heights, read_heights_text
from palpate.experiments.kit.scene import attached_scene, scene_attachments
from palpate.sim import (
    Box,
    ConvexMesh,
    CylinderObject,
    EllipsoidObject,
    FrozenScene,
    HeightField,
    SceneFile,
    SceneObject,
    SceneTarget,
    SphereObject,
    Target,
    Torus,
    TracedMesh,
    Triangles,
    bumps,
)
from palpate.sim.objects.mesh_file import LARGEST, SMALLEST, read_facets

MESH_TEXT = "object.off"
"""Under this name a log keeps a mesh, as Object File Format, which other programs read, too."""

HEIGHTS_TEXT = "object.csv"
"""Under this name a log keeps a height field, as `palpate explore --file` reads it."""

_SPHERES_ONLY: tuple[ObjectName, ...] = ("torus", "bumps", "height-field")
"""Objects of which a simulation knows where a sphere touches, and no other tip."""


def object_of(config: ExploreConfig, attachments: Mapping[str, str]) -> SceneObject | SceneTarget:
    """Return the object that a configuration asks for, from its file or, for an earlier run, from its log.

    Args:
        config: Complete, as plans have it.
        attachments: By file name, as `object_texts` wrote them; empty to read the file.

    Raises:
        InvalidValueError: There is no such object, or its geometry is not among the attachments.
    """
    return scene_object(config) if config.file is None or not attachments else _object_in(attachments, config)


def scene_object(config: ExploreConfig) -> SceneObject | SceneTarget:
    """Return the object that a configuration asks for; a file is read, and what stands in it put in its place.

    Raises:
        InvalidValueError: If the object is impossible, its file cannot be read, or the tip cannot touch it.
    """
    if len(config.tip) > 1 and config.object in _SPHERES_ONLY:
        tip = " ".join(f"{length:g}" for length in config.tip)
        raise InvalidValueError(
            f"tip = {tip}: {config.article} {config.object} is touched by a sphere only; give --tip one number"
        )
    size = config.size
    match config.object:
        case "sphere":
            return SphereObject(size[0])
        case "ellipsoid":
            return EllipsoidObject((size[0], size[1], size[2]))
        case "box":
            return Box((size[0], size[1], size[2]))
        case "cylinder":
            return CylinderObject(size[0], size[1])
        case "torus":
            return Torus(size[0], size[1])
        case "bumps":
            return bumps(size[0], size[1], size[2])
        case "mesh":
            return _mesh(_standing(config), config)
        case "height-field":
            assert config.file is not None  # ExploreConfig has made sure
            return load_heights(config.file, config.scale, size)
        case "scene":
            assert config.file is not None
            return _touched(FrozenScene.read(config.file), config)


def object_texts(target: SceneObject | Target, config: ExploreConfig) -> dict[str, str]:
    """Return the geometry of an object that came from a file, as text that gives the very same bits again.

    Args:
        target: From `scene_object`.
        config: Configuration of the plan.

    Returns:
        Texts by file name; none for an object without a file.
    """
    if config.file is None:
        return {}
    if isinstance(target, HeightField):
        return {HEIGHTS_TEXT: heights_text(target)}
    if isinstance(target, TracedMesh | ConvexMesh):
        return {MESH_TEXT: _off(target.triangles)}
    if isinstance(target, SceneTarget):
        return scene_attachments(target.file)
    raise TypeError(f"a {type(target).__name__} comes from no file")


def _object_in(attachments: Mapping[str, str], config: ExploreConfig) -> SceneObject | SceneTarget:
    if config.object == "scene":
        return _touched(attached_scene(attachments, FrozenScene), config)
    name = MESH_TEXT if config.object == "mesh" else HEIGHTS_TEXT
    if name not in attachments:
        raise InvalidValueError(f"{name!r} is missing: there are {', '.join(attachments) or 'no files'}")
    if name == HEIGHTS_TEXT:
        return read_heights_text(attachments[name], name)
    return _mesh(_read_off(attachments[name]), config)


def object_line(target: SceneObject | Target, config: ExploreConfig) -> str:
    """Return the description of an object, one line for a report."""
    if config.file is None:
        return f"{config.object}, {' x '.join(f'{1e3 * s:g}' for s in config.size)} mm"
    if isinstance(target, HeightField):
        rows, columns = target.heights.shape
        extent = f"{columns} x {rows} heights over {1e3 * target.width:.4g} x {1e3 * target.depth:.4g} mm"
        extent += f", {target.untouched} of them filled" if target.untouched else ""
    elif isinstance(target, TracedMesh | ConvexMesh):
        sides = " x ".join(f"{1e3 * s:.4g}" for s in np.ptp(target.triangles.vertices, axis=0))
        extent = f"{len(target.triangles.faces)} triangles, {sides} mm"
    elif isinstance(target, SceneTarget):
        extent = f"{target.touched}, the scene moved by {' '.join(f'{1e3 * s:.4g}' for s in target.shift)} mm"
    else:
        raise TypeError(f"a {type(target).__name__} comes from no file")
    return f"{config.object} {config.file}, {extent}"


def object_notes(target: SceneObject | Target) -> tuple[str, ...]:
    """Return remarks on an object from a file."""
    if not isinstance(target, HeightField) or not target.untouched:
        return ()
    return (
        f"{target.untouched} of {target.heights.size} places of the height field were not touched; they "
        "continue the others smoothly.",
    )


def _touched(scene: SceneFile, config: ExploreConfig) -> SceneTarget:
    return SceneTarget.of(scene, config.touch, TracedMesh if len(config.tip) == 1 else ConvexMesh)


def _mesh(triangles: Triangles, config: ExploreConfig) -> SceneObject:
    """A sphere touches the triangles themselves; a tip of another shape what MuJoCo makes of them, if convex."""
    if len(config.tip) == 1:
        return TracedMesh(triangles)
    try:
        return ConvexMesh(triangles)
    except InvalidValueError as error:
        raise InvalidValueError(f"{error}; or a tip that is a sphere, which touches any mesh (--tip)") from None


def _standing(config: ExploreConfig) -> Triangles:
    """Return the mesh of the file, standing on z = 0, the middle of its bounding box over the origin."""
    assert config.file is not None  # ExploreConfig has made sure
    vertices, faces = read_facets(config.file)
    name = str(config.file)
    if not len(faces):
        kind = config.file.suffix.lstrip(".").upper() or "mesh"
        raise InvalidValueError(
            f"{name}: no triangles were found in it: is it really a file of kind {kind}, and whole?"
        )
    if not np.isfinite(vertices).all():
        return Triangles(vertices, faces, name)  # raises, and names the defect
    size = config.scale * float(np.ptp(vertices, axis=0).max())
    if not SMALLEST <= size <= LARGEST:
        raise InvalidValueError(
            f"{name}: {size:.4g} m across with scale = {config.scale:g}, must be {SMALLEST:g} to {LARGEST:g} m; "
            f"{_unit_hint(size, config.scale)}"
        )
    vertices = config.scale * vertices
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    x, y = 0.5 * (low + high)[:2]
    return Triangles(vertices - np.array([x, y, low[2]]), faces, name)


def _unit_hint(size: float, scale: float) -> str:
    """Return the remedy for a file whose mesh has a wrong size [m] at a scale."""
    if size < SMALLEST and scale < 1.0:
        return "is it in metres already? Then leave --scale out"
    if size > LARGEST and scale >= 1.0:
        return "is it in another unit? For a file in millimetres give --scale 0.001, in inches --scale 0.0254"
    return "is it in another unit? --scale is the metres in one of its units"


def _off(triangles: Triangles) -> str:
    """Object File Format: counts, vertices, triangles; the shortest digits that read back to the same bits."""
    lines = ["OFF", f"{len(triangles.vertices)} {len(triangles.faces)} 0"]
    lines += [f"{x!r} {y!r} {z!r}" for x, y, z in triangles.vertices.tolist()]
    lines += [f"3 {a} {b} {c}" for a, b, c in triangles.faces.tolist()]
    return "\n".join([*lines, ""])


def _read_off(text: str) -> Triangles:
    words = text.split()
    try:
        if words[0] != "OFF":
            raise ValueError("no OFF at its beginning")
        n, m = int(words[1]), int(words[2])
        numbers = words[4:]
        if len(numbers) != 3 * n + 4 * m:
            raise ValueError(f"{len(numbers)} numbers for {n} vertices and {m} triangles")
        vertices: FloatArray = np.array([float(word) for word in numbers[: 3 * n]]).reshape(n, 3)
        faces = np.array([int(word) for word in numbers[3 * n :]], np.int64).reshape(m, 4)[:, 1:]
    except (ValueError, IndexError) as error:
        raise InvalidValueError(f"{MESH_TEXT}: not as palpate writes it ({error})") from None
    return Triangles(vertices, faces, MESH_TEXT)
