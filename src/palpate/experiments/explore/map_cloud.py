"""The map as points for viewers: the vertices of its mesh, as `map.ply` has them."""

from palpate.experiments.explore.explored_map import ExploredMap
from palpate.mapping.layers import VertexLayer
from palpate.runtime.log.standard.cloud import Cloud


def map_cloud(found: ExploredMap) -> Cloud | None:
    """Return the vertices of a map's mesh with normals, band [m] and layers; None if the mesh is empty."""
    mesh = found.mesh
    if not len(mesh.vertices):
        return None
    quantities = {f"normal_{axis}": mesh.normals[:, i] for i, axis in enumerate("xyz")} | {"band": mesh.band()}
    quantities |= {layer.name: layer.mean for layer in found.layers if isinstance(layer, VertexLayer)}
    return Cloud(mesh.vertices, quantities)
