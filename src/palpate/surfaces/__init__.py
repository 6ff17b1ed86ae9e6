"""What a fingertip looks like."""

from palpate.surfaces.quadric import CenteredQuadric
from palpate.surfaces.shapes import Cylinder, Ellipsoid, Plane, Sphere

__all__ = ["CenteredQuadric", "Cylinder", "Ellipsoid", "Plane", "Sphere"]
