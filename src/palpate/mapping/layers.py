"""Quantities at the vertices of a mesh: friction, stiffness, curvature."""

import os
from dataclasses import dataclass

import numpy as np
from scipy.spatial import KDTree
from trimesh.exchange.ply import export_ply

from palpate.atomic_file import replacing
from palpate.errors import FloatArray, InvalidValueError, numbers, positive
from palpate.mapping.surface_map.mesh import SurfaceMesh
from palpate.mapping.surface_map.mesh_files import to_trimesh

NEAREST = 8
"""Contacts whose mean a vertex shows: from the middle between two rows, a few of either."""


@dataclass(frozen=True, slots=True, eq=False)
class VertexLayer:
    """A quantity at the n vertices of a mesh.

    Attributes:
        name: Of the quantity, a word; under it a PLY file keeps it.
        mean: Shape (n,); NaN where it is not known.
        sd: Standard deviation, shape (n,); NaN where it is not known. From `vertex_layer` that among the contacts
            around, not of their mean; of stiffness and curvature that of the estimate.
    """

    name: str
    mean: FloatArray
    sd: FloatArray

    def __len__(self) -> int:
        """Number of vertices."""
        return len(self.mean)


@dataclass(frozen=True, slots=True, eq=False)
class VertexDirection:
    """A direction at the n vertices of a mesh, such as that of the largest curvature.

    Attributes:
        name: A word; a PLY file keeps the components under it and `_x`, `_y`, `_z`.
        value: Unit vectors in the base frame, shape (n, 3).
    """

    name: str
    value: FloatArray

    def __len__(self) -> int:
        """Number of vertices."""
        return len(self.value)


def vertex_layer(
    name: str, vertices: FloatArray, position: FloatArray, value: FloatArray, reach: float
) -> VertexLayer:
    """Return a quantity at vertices from the `NEAREST` contacts that measured it, none of them beyond `reach`.

    Args:
        name: Of the quantity, a word.
        vertices: Shape (n, 3) [m].
        position: Of the contacts, shape (m, 3) [m]; thin a dense cloud first, or all come from one row.
        value: At the contacts, shape (m,).
        reach: Farthest a contact is asked [m].

    Raises:
        InvalidValueError: The name is no word, `reach` is not positive, or numbers of contacts differ.
    """
    if not name.isidentifier():
        raise InvalidValueError(f"name = {name!r}: must be one word, as a PLY property is named")
    reach = positive("reach", reach, "m")
    value = numbers("value", value)
    if value.shape != (len(position),):
        raise InvalidValueError(f"value has shape {value.shape}: must be ({len(position)},), one per contact")
    count = len(vertices)
    if not count or not len(position):
        return VertexLayer(name, np.full(count, np.nan), np.full(count, np.nan))
    asked = min(NEAREST, len(position))
    distance, index = KDTree(position).query(vertices, asked, distance_upper_bound=reach)
    distance, index = np.reshape(distance, (count, asked)), np.reshape(index, (count, asked))
    found = np.isfinite(distance)
    near = np.where(found, value[np.where(found, index, 0)], 0.0)
    total = found.sum(axis=1)
    mean = near.sum(axis=1) / np.maximum(total, 1)
    square = np.where(found, (near - mean[:, None]) ** 2, 0.0).sum(axis=1) / np.maximum(total - 1, 1)
    return VertexLayer(name, np.where(total > 0, mean, np.nan), np.where(total > 1, np.sqrt(square), np.nan))


def write_layered_mesh(
    mesh: SurfaceMesh, layers: tuple[VertexLayer | VertexDirection, ...], path: str | os.PathLike[str]
) -> None:
    """Write a mesh as PLY like `write_mesh`, with each layer as properties more.

    They are called as the layer, and as the layer and `_sd`; those of a direction end in `_x`, `_y` and `_z`.

    Raises:
        InvalidValueError: The mesh is empty, or a layer has another number of vertices.
        OSError: The file cannot be written.
    """
    if not len(mesh.triangles):
        raise InvalidValueError(f"{os.fspath(path)}: the mesh is empty, nothing was observed; touch more")
    shape = to_trimesh(mesh)
    for layer in layers:
        if len(layer) != len(mesh.vertices):
            raise InvalidValueError(
                f"layer {layer.name} has {len(layer)} values: must be {len(mesh.vertices)}, one per vertex"
            )
        if isinstance(layer, VertexDirection):
            for k, axis in enumerate("xyz"):
                shape.vertex_attributes[f"{layer.name}_{axis}"] = layer.value[:, k].astype(np.float32)
            continue
        shape.vertex_attributes[layer.name] = layer.mean.astype(np.float32)
        shape.vertex_attributes[f"{layer.name}_sd"] = layer.sd.astype(np.float32)
    with replacing(path) as file:
        file.write(export_ply(shape, vertex_normal=True))
