"""Where a contact is felt, period by period, with the covariance of its noise."""

from dataclasses import dataclass

import numpy as np

from palpate.errors import FloatArray
from palpate.kinematics.pose import Pose, times, transposed
from palpate.sensing.contact import ContactStatus
from palpate.sensing.held.tool_contact import HeldTool
from palpate.sensing.held.wrench_frame import into_matrix, wrench_into
from palpate.sensing.solver import contact_from_wrench, contacts_from_wrenches
from palpate.sensing.uncertainty import contacts_uncertainties
from palpate.spatial import (
    IDENTITY,
    ZERO,
    Matrix,
    Vector,
    Wrench,
    add,
    add_scaled,
    as_vector,
    dot,
    norm,
    rotate,
    scale,
    subtract,
)

CHANGED, TURNED = 0.1, 0.05
"""Relative change of the force, and its turn [rad], for which covariances are found anew: they go with the inverse
square of the force."""

BLOCK = 8
"""Samples whose mean wrench gives a place: one alone may lie so far off on a round end that its depth is off, too,
more often than a normal distribution has it."""

MEAN = 8
"""Places of the mean wrench that covariances are found at: of a few, the normal is off by their noise over the
radius of the tool, and with it the plane in which the place is uncertain."""

FIRST = (1, 2, 4, MEAN)
"""Places at which covariances are found, too."""

NOTHING: Wrench = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)

STILL: Matrix = (ZERO, ZERO, ZERO)
"""What does not spread."""


@dataclass(frozen=True, slots=True)
class FeltPlace:
    """A place and how well one sample tells it.

    Attributes:
        position: [m]
        covariance: Of its noise, shape (3, 3) [m^2].
        drift: Covariance of its random walk, as zeros drift, shape (3, 3) [m^2/s].
    """

    position: Vector
    covariance: Matrix
    drift: Matrix = STILL


class PlaceFelt:
    """Where a tool touches, as its hand moves. One call of `step` per period, a place once in `block` of them.

    A contact takes about 10 us. Covariances take a millisecond; they are found anew as the force changes, and a
    few times at first. What is wrong all the time does not count: it moves no place that stands still.
    """

    def __init__(
        self, tool: HeldTool, noise: FloatArray, drift: FloatArray | None = None, block: int = BLOCK
    ) -> None:
        """Take what is held, and how its wrench errs, in the frame that its pose is given in.

        Args:
            tool: What is held.
            noise: Covariance of a sample's wrench, shape (6, 6).
            drift: Covariance of the random walk of its zero in a second, shape (6, 6); None: it stays.
            block: Samples whose mean gives a place.
        """
        self._tool, self._block = tool, block
        X = into_matrix(tool.pose)
        self._noise = X @ noise @ X.T / block
        self._drift = np.zeros((6, 6)) if drift is None else X @ drift @ X.T
        self.start()

    def start(self) -> None:
        """Something else is touched now."""
        self._seen, self._mean = 0, NOTHING
        self._force, self._spread, self._walk = ZERO, STILL, STILL
        self._begin()

    def _begin(self) -> None:
        self._count, self._sum, self._place, self._rotation = 0, NOTHING, ZERO, IDENTITY

    def step(self, wrench: Wrench, pose_base_hand: Pose) -> FeltPlace | None:
        """Return where it touches, in the base frame, at the end of a block; None before, or if that is nowhere.

        Args:
            wrench: What the environment exerts on the tool, in the frame that its pose is given in.
            pose_base_hand: Of that frame.
        """
        self._count += 1
        self._sum = _added(self._sum, 1.0, wrench)
        self._place = add(self._place, pose_base_hand.position)
        if self._count == (self._block + 1) // 2:
            self._rotation = pose_base_hand.rotation
        if self._count < self._block:
            return None
        share = 1.0 / self._block
        mean = _added(NOTHING, share, self._sum)
        pose = Pose(scale(share, self._place), self._rotation) @ self._tool.pose
        self._begin()
        return self._felt(wrench_into(self._tool.pose, mean), pose)

    def _felt(self, here: Wrench, pose: Pose) -> FeltPlace | None:
        contact = contact_from_wrench(self._tool.surface, here)
        if contact.status is not ContactStatus.OK:
            return None
        self._seen += 1
        share = 1.0 / min(self._seen, MEAN)
        self._mean = _added(_added(self._mean, -share, self._mean), share, here)
        if self._seen in FIRST or self._has_changed():
            self._find()
        R = pose.rotation
        return FeltPlace(
            add(pose.position, rotate(R, as_vector(contact.centroid))),
            times(times(R, self._spread), transposed(R)),
            times(times(R, self._walk), transposed(R)),
        )

    def _has_changed(self) -> bool:
        x, y, z, *_ = self._mean
        was, now = norm(self._force), norm((x, y, z))
        if not was or not now or abs(now - was) > CHANGED * was:
            return True
        off = subtract(scale(1.0 / now, (x, y, z)), scale(1.0 / was, self._force))
        return dot(off, off) > TURNED * TURNED

    def _find(self) -> None:
        surface, here = self._tool.surface, np.array([self._mean])
        contacts = contacts_from_wrenches(surface, here)
        if contacts.status[0] != ContactStatus.OK:
            return
        told = contacts_uncertainties(surface, contacts, self._noise)
        J = told.jacobians.centroid[0]
        self._force = as_vector(contacts.force[0])
        self._spread, self._walk = _matrix(told.centroid[0]), _matrix(J @ self._drift @ J.T)


def _added(a: Wrench, factor: float, b: Wrench) -> Wrench:
    return (*add_scaled(a[:3], factor, b[:3]), *add_scaled(a[3:], factor, b[3:]))


def _matrix(array: FloatArray) -> Matrix:
    x, y, z = array
    return (as_vector(x), as_vector(y), as_vector(z))
