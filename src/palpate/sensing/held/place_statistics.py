"""Places of one window, in blocks: are they one, how do they wander, and what would have shown?"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.linalg import solve_triangular
from scipy.optimize import minimize_scalar

from palpate.errors import FloatArray
from palpate.sensing.contact import Contacts
from palpate.sensing.contact_jacobian import ContactJacobians
from palpate.sensing.held.external_wrench import ExternalWrenches


def blocks(samples: int, most: int) -> list[npt.NDArray[np.intp]]:
    """Return which of consecutive samples are in each block: as many as there may be."""
    return np.array_split(np.arange(samples), min(most, samples))


@dataclass(frozen=True, slots=True, eq=False)
class Places:
    """Mean contact places of B blocks in a tangent plane.

    Attributes:
        origin: Of the plane, on the object, shape (3,) [m].
        tangents: Its axes as rows, shape (2, 3).
        place: Of each block, shape (B, 2) [m].
        covariance: Of all places together, shape (2B, 2B) [m^2].
        aside: How far the force of each block points aside from the mean one, tan(angle) along the direction in
            which it does so most, shape (B,).
    """

    origin: FloatArray
    tangents: FloatArray
    place: FloatArray
    covariance: FloatArray
    aside: FloatArray

    @classmethod
    def of(
        cls,
        contacts: Contacts,
        jacobians: ContactJacobians,
        wrenches: ExternalWrenches,
        used: npt.NDArray[np.bool_],
        most: int,
        wander: float,
    ) -> "Places":
        """Return the places of those samples that are used.

        Args:
            contacts: n contacts.
            jacobians: Theirs, for the same wrenches.
            wrenches: That they were found from.
            used: Which of them count, shape (n,).
            most: Blocks.
            wander: Standard deviation by which each block's place may differ by itself [m].
        """
        normal = contacts.normal[used].mean(axis=0)
        T = np.linalg.svd(normal[None])[2][1:]
        origin = contacts.centroid[used].mean(axis=0)
        J = T @ jacobians.centroid[used]
        S, H = J @ wrenches.noise[used] @ J.transpose(0, 2, 1), J @ wrenches.common[used]
        parts = blocks(int(used.sum()), most)
        B = len(parts)
        noise = np.array([S[part].sum(axis=0) / len(part) ** 2 for part in parts])
        noise += wander**2 * np.eye(2)
        common = np.array([H[part].mean(axis=0) for part in parts]).reshape(2 * B, -1)
        C = common @ common.T
        for i in range(B):
            C[2 * i : 2 * i + 2, 2 * i : 2 * i + 2] += noise[i]
        force = np.array([contacts.force[used][part].mean(axis=0) for part in parts])
        mean = force.mean(axis=0)
        axis = mean / np.linalg.norm(mean)
        across = force / (force @ axis)[:, None] - axis
        most = np.linalg.svd(across - across.mean(axis=0), full_matrices=False)[2][0]
        return cls(
            origin=origin,
            tangents=T,
            place=np.array([((contacts.centroid[used] - origin) @ T.T)[part].mean(axis=0) for part in parts]),
            covariance=C,
            aside=(across - across.mean(axis=0)) @ most,
        )

    @property
    def freedom(self) -> int:
        """Degrees of freedom of the places about a common one."""
        return 2 * len(self.place) - 2

    @property
    def turned(self) -> float:
        """Root mean square angle by which the force's direction changes [rad]."""
        return float(np.arctan(np.sqrt(np.mean(self.aside**2))))

    def common(self) -> tuple[FloatArray, FloatArray, float]:
        """Return the common place (3,), its covariance (3, 3), and the sum of squares about it."""
        mean, covariance, squares = _about_mean(self.place.ravel(), self.covariance, np.eye(2))
        T = self.tangents
        return self.origin + mean @ T, T.T @ covariance @ T, float(squares)

    def wander(self) -> FloatArray:
        """Return by how much blocks wander beyond noise, root mean square along where they do most, (3,) [m]."""
        centred = np.kron(np.eye(len(self.place)) - 1.0 / len(self.place), np.eye(2))
        noise = (centred @ self.covariance @ centred).reshape(len(self.place), 2, len(self.place), 2)
        spread = np.cov(self.place, rowvar=False) - np.einsum("iaib->ab", noise) / (len(self.place) - 1)
        values, vectors = np.linalg.eigh(spread)
        return np.asarray(np.sqrt(max(float(values[-1]), 0.0)) * vectors[:, -1] @ self.tangents)

    def about_line(self) -> float:
        """Return the least sum of squares of places about a straight line, with B - 2 degrees of freedom."""

        def squares(angle: float) -> float:
            across = np.kron(np.eye(len(self.place)), [[-np.sin(angle), np.cos(angle)]])
            place, covariance = across @ self.place.ravel(), across @ self.covariance @ across.T
            return float(_about_mean(place, covariance, np.eye(1))[2])

        along = np.linalg.svd(self.place - self.place.mean(axis=0))[2][0]
        angle = float(np.arctan2(along[1], along[0]))
        found = minimize_scalar(squares, bounds=(angle - np.pi / 2.0, angle + np.pi / 2.0), method="bounded")
        return min(float(found.fun), squares(angle))

    def shown_by_shares(self) -> float:
        """Return the sum of squares by two contacts 1 m apart, whose shares change by half of `aside` [1/m^2].

        They lie along that direction of the plane in which they show least.
        """
        moved = np.asarray(np.kron(0.5 * self.aside[:, None], np.eye(2)), np.float64)  # (2B, 2): along either axis
        squares = _about_mean(moved, self.covariance, np.eye(2))[2]
        return max(float(np.linalg.eigvalsh(np.asarray(squares))[0]), 0.0)


def _about_mean(
    y: FloatArray, covariance: FloatArray, one: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the weighted mean of B stacked vectors, its covariance, and the sum of squares about it.

    Args:
        y: Shape (B d,), or (B d, k) for k data at once.
        covariance: Shape (B d, B d).
        one: The unit matrix of d.
    """
    A = np.tile(one, (len(y) // len(one), 1))
    L = np.linalg.cholesky(covariance)
    A, y = solve_triangular(L, A, lower=True), solve_triangular(L, y, lower=True)
    of_mean = np.linalg.inv(A.T @ A)
    mean = of_mean @ (A.T @ y)
    off = y - A @ mean
    return np.asarray(mean), np.asarray(of_mean, dtype=np.float64), np.asarray(off.T @ off)
