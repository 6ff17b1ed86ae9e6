"""Contacts to surface: what a finger felt along its way becomes points, fits, maps and files."""

from palpate.mapping.cloud import TouchCloud as TouchCloud
from palpate.mapping.files import write_cloud_csv as write_cloud_csv
from palpate.mapping.files import write_cloud_ply as write_cloud_ply
from palpate.mapping.files import write_height_map_csv as write_height_map_csv
from palpate.mapping.files import write_height_map_ply as write_height_map_ply
from palpate.mapping.height_map import HeightMap as HeightMap
from palpate.mapping.sphere_fit import SphereFit as SphereFit
from palpate.mapping.sphere_fit import SphereFitStatus as SphereFitStatus
from palpate.mapping.sphere_fit import fit_sphere as fit_sphere
from palpate.mapping.triangulation import height_map_triangles as height_map_triangles
