"""A fingertip made of patches: `surface.kind: composite` of a robot file."""

from typing import Annotated

import msgspec
import numpy as np

from palpate.errors import FloatArray, InvalidValueError
from palpate.open_kinds import Settings, name_of_kind
from palpate.robots.surface_entries import SurfaceKind
from palpate.runtime.robot_ranges import at_most
from palpate.spatial import Vector, norm, scale
from palpate.surfaces import CenteredQuadric, Composite, Patch

MOST_PATCHES, MOST_BOUNDS = 100, 20
"""A rounded box has 21 patches, with four half spaces each."""


class HalfSpaceEntry(Settings, frozen=True, kw_only=True):
    """Where normal.x <= distance, sensor frame.

    Attributes:
        normal: Of any length.
        distance: From the sensor's origin along the normal [m].
    """

    normal: Vector
    distance: float = msgspec.field(name="distance_m", default=0.0)

    def __post_init__(self) -> None:
        if not norm(self.normal) > 0.0:
            raise InvalidValueError(f"normal = {self.normal}: must have a length above 0")
        at_most("distance_m", self.distance, 2.0, "m")

    @property
    def row(self) -> tuple[float, ...]:
        """As `Patch` takes it."""
        return (*scale(1.0 / norm(self.normal), self.normal), self.distance)


class PatchEntry(Settings, frozen=True, kw_only=True):
    """A sphere, ellipsoid, cylinder or plane where it is the tip's surface.

    Attributes:
        surface: Of which it is a part.
        within: Half spaces that it lies in; none: all of the surface.
    """

    surface: SurfaceKind
    within: Annotated[tuple[HalfSpaceEntry, ...], msgspec.Meta(max_length=MOST_BOUNDS)] = ()

    def __post_init__(self) -> None:
        if not isinstance(self.surface.surface(), CenteredQuadric):
            raise InvalidValueError(
                f"surface.kind = {name_of_kind(self.surface)}: a patch is part of a sphere, an ellipsoid, a "
                "cylinder or a plane"
            )

    @property
    def patch(self) -> Patch:
        """It itself, sensor frame."""
        quadric = self.surface.surface()
        assert isinstance(quadric, CenteredQuadric)  # __post_init__ has made sure
        return Patch(quadric, np.array([each.row for each in self.within]).reshape(-1, 4))


class CompositeEntry(SurfaceKind, Settings, frozen=True, kw_only=True):
    """A convex tip of patches that join smoothly; the first one is where it is to touch.

    Attributes:
        patches: All of them.
    """

    patches: Annotated[tuple[PatchEntry, ...], msgspec.Meta(min_length=1, max_length=MOST_PATCHES)]

    @property
    def center(self) -> Vector:  # type: ignore[override]  # read from a patch; nobody writes a frozen one
        """Of the first patch [m]."""
        return self.patches[0].surface.center

    @property
    def rotation(self) -> FloatArray:
        """Of the first patch."""
        return self.patches[0].surface.rotation

    def surface(self) -> Composite:
        """See `SurfaceKind`."""
        return Composite([each.patch for each in self.patches])
