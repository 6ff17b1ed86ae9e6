"""A Gaussian-process surface of what was touched, in patches, with what is known and what is not."""

from palpate.mapping.surface_map.agreement import Agreement as Agreement
from palpate.mapping.surface_map.curvature import SurfaceCurvature as SurfaceCurvature
from palpate.mapping.surface_map.curvature import surface_curvature as surface_curvature
from palpate.mapping.surface_map.estimate import Knowledge as Knowledge
from palpate.mapping.surface_map.estimate import SurfaceEstimate as SurfaceEstimate
from palpate.mapping.surface_map.estimate import half_widths as half_widths
from palpate.mapping.surface_map.learn import Parameter as Parameter
from palpate.mapping.surface_map.mesh import SurfaceMesh as SurfaceMesh
from palpate.mapping.surface_map.mesh import surface_mesh as surface_mesh
from palpate.mapping.surface_map.mesh_files import to_trimesh as to_trimesh
from palpate.mapping.surface_map.mesh_files import write_mesh as write_mesh
from palpate.mapping.surface_map.model import SurfaceModel as SurfaceModel
from palpate.mapping.surface_map.settings import MapSettings as MapSettings
from palpate.mapping.surface_map.surface_map import SurfaceMap as SurfaceMap
