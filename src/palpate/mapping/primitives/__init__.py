"""Planes, spheres, cylinders, ellipsoids, boxes and tori from touch, and which of them it is."""

from palpate.mapping.primitives.box import BoxShape as BoxShape
from palpate.mapping.primitives.choose import PrimitiveChoice as PrimitiveChoice
from palpate.mapping.primitives.choose import choose_primitive as choose_primitive
from palpate.mapping.primitives.cylinder import CylinderShape as CylinderShape
from palpate.mapping.primitives.ellipsoid import EllipsoidShape as EllipsoidShape
from palpate.mapping.primitives.fit import PrimitiveFit as PrimitiveFit
from palpate.mapping.primitives.fit import fit_primitive as fit_primitive
from palpate.mapping.primitives.plane import PlaneShape as PlaneShape
from palpate.mapping.primitives.shape import PrimitiveKind as PrimitiveKind
from palpate.mapping.primitives.shape import PrimitiveShape as PrimitiveShape
from palpate.mapping.primitives.sphere import SphereShape as SphereShape
from palpate.mapping.primitives.structure import Structure as Structure
from palpate.mapping.primitives.torus import TorusShape as TorusShape
