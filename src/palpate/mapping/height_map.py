"""The touched surface as heights on a regular grid."""

import math
from dataclasses import dataclass
from typing import Self

import numpy as np
import numpy.typing as npt
from scipy.spatial import KDTree

from palpate.errors import FloatArray, InvalidValueError, positive
from palpate.mapping.cloud import TouchCloud
from palpate.mapping.local_quadric import LocalContacts, heights_at

REACH_SPACINGS = 3.0
"""Default reach in grid spacings."""

SUPPORT_REACHES = 2.0
"""A height is drawn from contacts within this many reaches, so that a point between two rows sees both
sides."""

BINS_PER_REACH = 4.0
"""Contacts are first averaged in stretches of reach / 4: short against any detail the map resolves, and every
piece of path counts the same however slowly the finger went."""

STEEPEST = math.radians(75.0)
"""Contacts on steeper walls and overhangs [rad] are left out: there z is no function of x and y."""

MAX_NODES = 4_000_000
"""More grid points than this are refused: a spacing in the wrong unit, not a map."""


@dataclass(frozen=True, slots=True, eq=False)
class HeightMap:
    """Heights z(x, y) in the robot's base frame; NaN says that nothing was felt near there.

    Attributes:
        x: Grid lines, increasing, shape (nx,) [m].
        y: Grid lines, increasing, shape (ny,) [m].
        z: Heights, shape (ny, nx) [m], NaN where unobserved.
        distance: Horizontal distance to the nearest contact, shape (ny, nx) [m].
        reach: Largest `distance` at which a height is given [m].
    """

    x: FloatArray
    y: FloatArray
    z: FloatArray
    distance: FloatArray
    reach: float

    @property
    def observed(self) -> npt.NDArray[np.bool_]:
        """Where there is a height, shape (ny, nx)."""
        return np.isfinite(self.z)

    @classmethod
    def from_cloud(cls, cloud: TouchCloud, spacing: float, reach: float | None = None) -> Self:
        """Return the map of `cloud` on multiples of `spacing`.

        Around each grid point a quadratic surface is fitted to the heights **and** slopes of the contacts
        near it (each contact predicts the surface by its tangent plane), see `palpate.mapping.local_quadric`.
        Its error on a sphere of radius R is about (2 reach)^4 / (8 R^3).

        Args:
            cloud: At least one contact on a surface that faces up.
            spacing: Distance of grid lines [m].
            reach: How far from a contact a height is still given, measured horizontally [m]; by default
                `REACH_SPACINGS * spacing`. Choose about 0.75 times the distance between rows: less leaves
                stripes, more smooths and bridges what was not felt.

        Raises:
            InvalidValueError: No contact to map, `spacing` or `reach` not positive, or too many grid points.
        """
        spacing = positive("spacing", spacing, "m")
        reach = REACH_SPACINGS * spacing if reach is None else positive("reach", reach, "m")
        thin = cloud.thinned(reach / BINS_PER_REACH)
        thin = thin.select(thin.normal[:, 2] > math.cos(STEEPEST))
        if len(thin) == 0:
            raise InvalidValueError(
                f"none of {len(cloud)} contacts lies on a surface less than "
                f"{math.degrees(STEEPEST):.0f} degrees steep: a height map needs contacts felt from above"
            )
        low, high = thin.position[:, :2].min(axis=0), thin.position[:, :2].max(axis=0)
        nx, ny = (int(k) for k in np.floor(high / spacing) - np.floor(low / spacing) + 2)
        if nx * ny > MAX_NODES:
            raise InvalidValueError(
                f"spacing = {spacing} m makes {nx} x {ny} grid points, more than {MAX_NODES}: is it in metres?"
            )
        x = (np.floor(low[0] / spacing) + np.arange(nx)) * spacing
        y = (np.floor(low[1] / spacing) + np.arange(ny)) * spacing
        nodes = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
        tree = KDTree(thin.position[:, :2])
        distance = np.asarray(tree.query(nodes)[0], dtype=np.float64)
        # A hair beyond reach counts: grid points halfway between rows would flicker with rounding.
        observed = distance <= reach * (1.0 + 1e-9)
        z = np.full(len(nodes), np.nan)
        contacts = LocalContacts.of(thin)
        z[observed] = heights_at(nodes[observed], contacts, tree, SUPPORT_REACHES * reach)
        return cls(x=x, y=y, z=z.reshape(ny, nx), distance=distance.reshape(ny, nx), reach=reach)
