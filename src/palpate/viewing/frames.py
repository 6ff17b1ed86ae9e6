"""What a view gets of every period: one row of numbers, so that it passes between processes without ado."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from palpate.errors import FloatArray, InvalidValueError
from palpate.runtime.data import Phase
from palpate.runtime.log import Log
from palpate.sensing.contact import ContactStatus

PHASES = tuple(Phase)
"""A row holds a phase's place in here."""

NUMBER, TIME, POSITION, ROTATION = 0, 1, slice(2, 5), slice(5, 14)
CENTROID, FORCE, NORMAL_FORCE, SPIN_TORQUE = slice(14, 17), slice(17, 20), 20, 21
TOUCHING, PHASE, JOINTS = 22, 23, 24
"""Columns of a row. Its last one is the row's number again: see `palpate.viewing.frame_ring`."""


def width_of(joints: int) -> int:
    """Return how many columns a row has."""
    return JOINTS + joints + 1


@dataclass(frozen=True, slots=True, eq=False)
class Frames:
    """Periods in order, for one finger.

    Attributes:
        rows: Shape (n, width). Position and rotation are those of the tip in the base frame; centroid and force in
            the tip frame, NaN where there is no contact; then the arm's joints.
    """

    rows: FloatArray

    def __post_init__(self) -> None:
        if self.rows.ndim != 2 or self.rows.shape[1] < width_of(0):
            raise InvalidValueError(f"rows have shape {self.rows.shape}: must be (n, {width_of(0)} or more)")

    def __len__(self) -> int:
        """Number of periods."""
        return len(self.rows)

    def __getitem__(self, chosen: slice) -> "Frames":
        """Return some of them."""
        return Frames(self.rows[chosen])

    @property
    def time(self) -> FloatArray:
        """Shape (n,) [s]."""
        return self.rows[:, TIME]

    @property
    def position(self) -> FloatArray:
        """Of the tip frame, base coordinates, shape (n, 3) [m]."""
        return self.rows[:, POSITION]

    @property
    def rotation(self) -> FloatArray:
        """Maps tip to base coordinates, shape (n, 3, 3)."""
        return self.rows[:, ROTATION].reshape(-1, 3, 3)

    @property
    def centroid(self) -> FloatArray:
        """In base coordinates, shape (n, 3) [m]; NaN where there is no contact."""
        return np.asarray(self.position + np.einsum("nij,nj->ni", self.rotation, self.rows[:, CENTROID]))

    @property
    def force(self) -> FloatArray:
        """What the object exerts on the finger, base coordinates, shape (n, 3) [N]."""
        return np.asarray(np.einsum("nij,nj->ni", self.rotation, self.rows[:, FORCE]))

    @property
    def normal_force(self) -> FloatArray:
        """Shape (n,) [N]; NaN where there is no contact."""
        return self.rows[:, NORMAL_FORCE]

    @property
    def spin_torque(self) -> FloatArray:
        """Shape (n,) [N m]; NaN where there is no contact."""
        return self.rows[:, SPIN_TORQUE]

    @property
    def touching(self) -> npt.NDArray[np.bool_]:
        """Where there is a contact that is known, shape (n,)."""
        found: npt.NDArray[np.bool_] = (self.rows[:, TOUCHING] > 0.0) & np.isfinite(self.rows[:, CENTROID]).all(
            axis=1
        )
        return found

    @property
    def scanning(self) -> npt.NDArray[np.bool_]:
        """Which of them belong to the map: touching while scanning, shape (n,)."""
        found: npt.NDArray[np.bool_] = self.touching & (self.rows[:, PHASE] == PHASES.index(Phase.SCAN))
        return found

    @property
    def joint_position(self) -> FloatArray:
        """Of the arm, shape (n, joints) [rad]."""
        return self.rows[:, JOINTS:-1]

    def phase(self, index: int) -> Phase:
        """Return what the controller was doing."""
        return PHASES[int(self.rows[index, PHASE])]


def frames_of_log(log: Log, finger: int = 0) -> Frames:
    """Return what a view shows of a log.

    Raises:
        InvalidValueError: There is no such finger.
    """
    if not 0 <= finger < len(log.layout.channels):
        raise InvalidValueError(f"finger = {finger}: must be from 0 to {len(log.layout.channels) - 1}")
    columns, at, joints = log.codec.columns, f"finger_{finger}", log.layout.joints
    rows = np.zeros((len(log), width_of(joints)))

    def of(name: str) -> FloatArray:
        return log.rows[:, columns[name]]

    rows[:, NUMBER] = rows[:, -1] = log.sequence
    rows[:, TIME] = of("time")[:, 0]
    rows[:, POSITION], rows[:, ROTATION] = of("arm.position"), of("arm.rotation")
    rows[:, CENTROID] = of(f"{at}.centroid")
    rows[:, FORCE] = of(f"{at}.wrench")[:, :3]
    rows[:, NORMAL_FORCE], rows[:, SPIN_TORQUE] = of(f"{at}.normal_force")[:, 0], of(f"{at}.spin_torque")[:, 0]
    statuses = np.array([ContactStatus[name] for name in log.heading.codes.statuses])
    known = statuses[of(f"{at}.status")[:, 0].astype(int)] == ContactStatus.OK
    rows[:, TOUCHING] = (of(f"{at}.touching")[:, 0] > 0.0) & known
    phases = np.array([PHASES.index(Phase[name]) for name in log.heading.codes.phases])
    rows[:, PHASE] = phases[of("command.phase")[:, 0].astype(int)]
    if joints:
        rows[:, JOINTS:-1] = of("arm.joint_position")
    return Frames(rows)
