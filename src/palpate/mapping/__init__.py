"""Contacts to surface: points, fits, maps and files from what a finger felt along its path."""

from palpate.mapping.cloud import TouchCloud as TouchCloud
from palpate.mapping.cloud import standard_deviations as standard_deviations
from palpate.mapping.files import write_cloud_csv as write_cloud_csv
from palpate.mapping.files import write_cloud_ply as write_cloud_ply
from palpate.mapping.files import write_height_map_csv as write_height_map_csv
from palpate.mapping.height_map import HeightMap as HeightMap
from palpate.mapping.primitives import PrimitiveChoice as PrimitiveChoice
from palpate.mapping.primitives import PrimitiveFit as PrimitiveFit
from palpate.mapping.primitives import PrimitiveKind as PrimitiveKind
from palpate.mapping.primitives import choose_primitive as choose_primitive
from palpate.mapping.surface_map import Knowledge as Knowledge
from palpate.mapping.surface_map import MapSettings as MapSettings
from palpate.mapping.surface_map import SurfaceEstimate as SurfaceEstimate
from palpate.mapping.surface_map import SurfaceMap as SurfaceMap
from palpate.mapping.surface_map import SurfaceMesh as SurfaceMesh
from palpate.mapping.surface_map import SurfaceModel as SurfaceModel
from palpate.mapping.surface_map import surface_mesh as surface_mesh
from palpate.mapping.surface_map import write_mesh as write_mesh
from palpate.mapping.triangulation import height_map_triangles as height_map_triangles
