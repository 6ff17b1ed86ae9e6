"""How the felt surface is curved: principal curvatures and their directions, from the map's second derivatives."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from palpate.errors import FloatArray
from palpate.mapping.surface_map.blend import PatchEstimate, weighty
from palpate.mapping.surface_map.estimate import Knowledge
from palpate.mapping.surface_map.surface_map import SurfaceMap

ANY_DIRECTION = np.pi / 12.0**0.5
"""Standard deviation of a direction that may be any: even over half a turn [rad]."""


@dataclass(frozen=True, slots=True, eq=False)
class SurfaceCurvature:
    """Principal curvatures of the surface at n points, positive where it is convex; NaN where no patch reaches.

    Where the two are equal to within their deviations, as on a sphere, their directions mean nothing (see
    `direction_sd`) and noise drives the larger up and the smaller down; their mean stays right.

    Attributes:
        principal: The larger, then the smaller, shape (n, 2) [1/m].
        sd: Their standard deviations, shape (n, 2) [1/m].
        directions: Of the larger, then of the smaller, unit tangents in the base frame, shape (n, 2, 3).
        direction_sd: Standard deviation of the directions about the normal, at most `ANY_DIRECTION`, shape (n,)
            [rad].
        mean_sd: Standard deviation of `mean`, shape (n,) [1/m].
        knowledge: Values of `Knowledge`, shape (n,): nothing is claimed but where it is observed.
    """

    principal: FloatArray
    sd: FloatArray
    directions: FloatArray
    direction_sd: FloatArray
    mean_sd: FloatArray
    knowledge: npt.NDArray[np.int8]

    @property
    def mean(self) -> FloatArray:
        """Mean of the two, shape (n,) [1/m]."""
        return np.asarray(self.principal.mean(axis=1))

    @property
    def observed(self) -> npt.NDArray[np.bool_]:
        """Where it is claimed, shape (n,)."""
        return np.asarray(self.knowledge == Knowledge.OBSERVED)


def surface_curvature(surface: SurfaceMap, points: FloatArray) -> SurfaceCurvature:
    """Return how the surface is curved at the points nearest to some points.

    Args:
        surface: A map.
        points: Shape (n, 3) [m], in the base frame.

    Raises:
        InvalidValueError: As `SurfaceMap.query`.
    """
    estimate = surface.query(points)
    return curvature_on(surface, estimate.nearest, estimate.normal, estimate.knowledge)


def curvature_on(
    surface: SurfaceMap, points: FloatArray, normals: FloatArray, knowledge: npt.NDArray[np.int8]
) -> SurfaceCurvature:
    """Return how the surface is curved at points of it, such as the vertices of its mesh.

    Args:
        surface: A map.
        points: Points of its surface, shape (n, 3) [m].
        normals: Its unit normals there, shape (n, 3).
        knowledge: Values of `Knowledge`, shape (n,).
    """
    n = len(points)
    there = np.isfinite(points).all(axis=1) & np.isfinite(normals).all(axis=1)
    tangents = np.full((n, 3, 2), np.nan)
    tangents[there] = tangent_basis(normals[there])
    index = np.flatnonzero(there)
    total, form, covariance = np.zeros(n), np.zeros((n, 3)), np.zeros((n, 3, 3))
    for each in weighty(list(surface.patch_estimates(points[there])), len(index)):
        at = index[each.chosen]
        w, C = _second_form(each, tangents[at])
        total[at] += each.weight
        form[at] += each.weight[:, None] * w
        # as deviations of heights: patches share their data and err alike
        covariance[at] += each.weight[:, None, None] * C
    total = np.where(total > 0.0, total, np.nan)
    factor = surface.agreement.factor**2
    return _principal(form / total[:, None], factor * covariance / total[:, None, None], tangents, knowledge)


def tangent_basis(normals: FloatArray) -> FloatArray:
    """Return any two orthonormal tangents for each unit normal (n, 3), as columns, shape (n, 3, 2)."""
    x = np.eye(3)[np.abs(normals).argmin(axis=1)]
    x = x - (x * normals).sum(axis=1, keepdims=True) * normals
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    return np.asarray(np.stack([x, np.cross(normals, x)], axis=2), np.float64)


def _second_form(estimate: PatchEstimate, tangents: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return (w_11, w_12, w_22) of the second fundamental form in `tangents` (k, 3, 2), and its covariance.

    A tangent t moves x and y of the patch by its components there, so the form is -cos t_xy' H t_xy, with H the
    second derivatives of the heights; outward normals make it positive where the surface is convex. Errors of the
    slopes are small beside 1 and left out.
    """
    H, C = estimate.patch.bends(estimate.local[:, :2])
    b = np.einsum("ij,kjt->kit", estimate.patch.frame.axes[:2], tangents)
    rows = []
    for s, t in ((0, 0), (0, 1), (1, 1)):
        mixed = b[:, 0, s] * b[:, 1, t] + b[:, 1, s] * b[:, 0, t]
        rows.append(np.stack([b[:, 0, s] * b[:, 0, t], mixed, b[:, 1, s] * b[:, 1, t]], axis=1))
    M = -estimate.cos[:, None, None] * np.stack(rows, axis=1)
    return np.einsum("kij,kj->ki", M, H), M @ C @ M.transpose(0, 2, 1)


def _principal(
    form: FloatArray, covariance: FloatArray, tangents: FloatArray, knowledge: npt.NDArray[np.int8]
) -> SurfaceCurvature:
    half, mean = 0.5 * (form[:, 0] - form[:, 2]), 0.5 * (form[:, 0] + form[:, 2])
    radius = np.hypot(half, form[:, 1])
    angle = 0.5 * np.arctan2(form[:, 1], half)
    c, s = np.cos(angle), np.sin(angle)

    def deviation(x: FloatArray, y: FloatArray, z: FloatArray) -> FloatArray:
        row = np.stack([x, y, z], axis=1)
        return np.asarray(np.sqrt(np.maximum(np.einsum("ni,nij,nj->n", row, covariance, row), 0.0)))

    across = deviation(-c * s, c * c - s * s, c * s)  # of the entry that turns the directions
    with np.errstate(divide="ignore", invalid="ignore"):
        turn = np.minimum(across / (2.0 * radius), ANY_DIRECTION)
    first = c[:, None] * tangents[:, :, 0] + s[:, None] * tangents[:, :, 1]
    second = -s[:, None] * tangents[:, :, 0] + c[:, None] * tangents[:, :, 1]
    one, zero = np.ones_like(c), np.zeros_like(c)
    return SurfaceCurvature(
        principal=np.stack([mean + radius, mean - radius], axis=1),
        sd=np.stack([deviation(c * c, 2.0 * c * s, s * s), deviation(s * s, -2.0 * c * s, c * c)], axis=1),
        directions=np.stack([first, second], axis=1),
        direction_sd=turn,
        mean_sd=0.5 * deviation(one, zero, one),
        knowledge=knowledge,
    )
