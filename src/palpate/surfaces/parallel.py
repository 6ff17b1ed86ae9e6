"""The surface that is felt where a fingertip yields: as far inside its own as it is pressed in."""

from dataclasses import replace

import numpy as np

from palpate.surfaces.compliant import CompliantTip
from palpate.surfaces.composite import Composite, Patch, RoundedBox
from palpate.surfaces.implicit import Implicit
from palpate.surfaces.open_quadric import OpenQuadric, Paraboloid
from palpate.surfaces.quadric import CenteredQuadric
from palpate.surfaces.shapes import Ellipsoid, Plane

Surface = CenteredQuadric | OpenQuadric | Composite | Implicit | CompliantTip


def yielding(surface: Surface, depth: float, stiffness: float) -> Surface:
    """Return the surface that is felt of a tip that yields.

    Where only a parallel surface is known in closed form it is for this depth alone, which force control keeps: of
    spheres, cylinders, planes and what is made of them exactly, of ellipsoids and paraboloids up to depth^2 times
    the curvature. An implicit surface yields with the force itself (`CompliantTip`), and so does one that is
    compliant already.

    Args:
        surface: Undeformed.
        depth: By which it yields [m]; below its smallest radius of curvature.
        stiffness: With which it yields [N/m].

    Raises:
        InvalidValueError: It is pressed in deeper than it is thick.
    """
    if depth == 0.0 or isinstance(surface, CompliantTip):
        return surface
    if isinstance(surface, Implicit):
        return CompliantTip(surface, stiffness)
    if isinstance(surface, Composite):
        return Composite([Patch(_inside(each.surface, depth), each.half_spaces) for each in surface.patches])
    if isinstance(surface, CenteredQuadric):
        return _inside(surface, depth)
    if isinstance(surface, Paraboloid):
        a, b = surface.radii
        apex = surface.center - depth * surface.rotation[:, 2]
        return Paraboloid((a - depth, b - depth), center=apex, rotation=surface.rotation)
    return surface


def _inside(surface: CenteredQuadric, depth: float) -> CenteredQuadric:
    if isinstance(surface, Ellipsoid):
        a, b, c = (length - depth for length in surface.semi_axes)
        return Ellipsoid((a, b, c), center=surface.center, rotation=surface.rotation)
    name = "distance" if isinstance(surface, Plane) else "radius"
    return replace(surface, **{name: getattr(surface, name) - depth})


def half_extents(surface: Surface) -> tuple[float, float, float]:
    """Return the half lengths along the axes of the sensor frame of an ellipsoid that stands for a tip [m].

    What is unbounded is as long there as it is thick; of a composite the first patch counts, of a paraboloid its
    radii of curvature.
    """
    if isinstance(surface, Composite) and not isinstance(surface, RoundedBox):
        return half_extents(surface.patches[0].surface)
    if isinstance(surface, OpenQuadric):
        a, b, _, eta = surface.coefficients
        lengths = np.array([eta * a**2, eta * b**2, eta * min(a, b) ** 2])
    else:
        lengths = np.array(surface.half_lengths, dtype=np.float64)
    lengths[~np.isfinite(lengths)] = lengths[np.isfinite(lengths)].min()
    if (surface.rotation == np.eye(3)).all():
        x, y, z = lengths.tolist()
    else:
        x, y, z = np.linalg.norm(surface.rotation * lengths, axis=1).tolist()
    return (x, y, z)
