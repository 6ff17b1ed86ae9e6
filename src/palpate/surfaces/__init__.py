"""Surfaces of fingertips."""

from palpate.surfaces.compliant import HERTZ, LINEAR, CompliantTip
from palpate.surfaces.composite import Capsule, Composite, Patch, RoundedBox
from palpate.surfaces.implicit import ImplicitSurface, Superellipsoid
from palpate.surfaces.mesh import MeshSurface, load_mesh
from palpate.surfaces.near_sphere import NearSphere
from palpate.surfaces.open_quadric import Hyperboloid, Paraboloid
from palpate.surfaces.quadric import CenteredQuadric
from palpate.surfaces.shapes import Cylinder, Ellipsoid, Plane, Sphere

__all__ = [
    "HERTZ",
    "LINEAR",
    "Capsule",
    "CenteredQuadric",
    "CompliantTip",
    "Composite",
    "Cylinder",
    "Ellipsoid",
    "Hyperboloid",
    "ImplicitSurface",
    "MeshSurface",
    "NearSphere",
    "Paraboloid",
    "Patch",
    "Plane",
    "RoundedBox",
    "Sphere",
    "Superellipsoid",
    "load_mesh",
]
