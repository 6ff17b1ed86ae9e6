"""What a view gets of every period: one row of numbers, so that it passes between processes without ado."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import Rotation

from palpate.errors import FloatArray, InvalidValueError, not_negative
from palpate.kinematics import Pose
from palpate.kinematics.posture import Posture
from palpate.runtime.data import Phase
from palpate.runtime.log import Log
from palpate.sensing.contact import ContactStatus
from palpate.spatial import Matrix, as_vector

PHASES = tuple(Phase)
"""A row holds a phase's place in here."""

NUMBER, TIME, POSITION, ROTATION, PHASE = 0, 1, slice(2, 5), slice(5, 14), 14
FINGERS = 15
"""Columns of a row, and where those of its contacts begin; the last one is the row's number again: see
`palpate.viewing.row_ring`."""

CENTROID, FORCE, NORMAL_FORCE, SPIN_TORQUE, NORMAL, TOUCHING = slice(0, 3), slice(3, 6), 6, 7, slice(8, 11), 11
PER_FINGER = 12
"""Columns of one contact."""

PER_BODY = 7
"""Position and quaternion (w, x, y, z) of a free body."""

PER_PARAMETER = 2
"""A live parameter's value, and what it is moving to."""


@dataclass(frozen=True, slots=True)
class FrameLayout:
    """What a row holds beside time, phase and the pose of tip or hand.

    Attributes:
        fingers: With a contact each.
        joints: Of the arm.
        hand_joints: Of the hand.
        free: Bodies that move freely.
        live: Live parameters of the controller.
    """

    fingers: int = 1
    joints: int = 0
    hand_joints: int = 0
    free: int = 0
    live: int = 0

    def __post_init__(self) -> None:
        for name in self.__slots__:
            not_negative(name, getattr(self, name), "")

    @property
    def arm_columns(self) -> slice:
        """Of the arm's joints."""
        first = FINGERS + PER_FINGER * self.fingers
        return slice(first, first + self.joints)

    @property
    def hand_columns(self) -> slice:
        """Of the hand's joints."""
        first = self.arm_columns.stop
        return slice(first, first + self.hand_joints)

    @property
    def free_columns(self) -> slice:
        """Of the free bodies' poses."""
        first = self.hand_columns.stop
        return slice(first, first + PER_BODY * self.free)

    @property
    def live_columns(self) -> slice:
        """Of the live parameters: all values, then what they are moving to."""
        first = self.free_columns.stop
        return slice(first, first + PER_PARAMETER * self.live)

    @property
    def width(self) -> int:
        """Columns in all."""
        return int(self.live_columns.stop) + 1


@dataclass(frozen=True, slots=True, eq=False)
class ContactFrames:
    """One finger's contact, every period, in its sensor frame.

    Attributes:
        columns: Shape (n, PER_FINGER).
    """

    columns: FloatArray

    @property
    def centroid(self) -> FloatArray:
        """Shape (n, 3) [m]; NaN where there is no contact."""
        return self.columns[:, CENTROID]

    @property
    def force(self) -> FloatArray:
        """What the object exerts on the finger, shape (n, 3) [N]."""
        return self.columns[:, FORCE]

    @property
    def normal_force(self) -> FloatArray:
        """Shape (n,) [N]; NaN where there is no contact."""
        return self.columns[:, NORMAL_FORCE]

    @property
    def tangential_force(self) -> FloatArray:
        """Its size, shape (n,) [N]; NaN where there is no contact."""
        square = np.square(self.force).sum(axis=1) - np.square(self.normal_force)
        return np.asarray(np.sqrt(np.maximum(square, 0.0)))

    @property
    def spin_torque(self) -> FloatArray:
        """Shape (n,) [N m]; NaN where there is no contact."""
        return self.columns[:, SPIN_TORQUE]

    @property
    def normal(self) -> FloatArray:
        """Outward unit normal of the fingertip, into the object, shape (n, 3); NaN where there is no contact."""
        return self.columns[:, NORMAL]

    @property
    def touching(self) -> npt.NDArray[np.bool_]:
        """Where there is a contact that is known, shape (n,)."""
        found: npt.NDArray[np.bool_] = (self.columns[:, TOUCHING] > 0.0) & np.isfinite(self.centroid).all(axis=1)
        return found


@dataclass(frozen=True, slots=True, eq=False)
class Frames:
    """Periods in order.

    Attributes:
        rows: Shape (n, layout.width). Position and rotation are those of the tip in the base frame (of the hand
            frame, if there is a hand); contacts are in each finger's sensor frame.
        layout: What the columns are.
    """

    rows: FloatArray
    layout: FrameLayout

    def __post_init__(self) -> None:
        if self.rows.ndim != 2 or self.rows.shape[1] != self.layout.width:
            raise InvalidValueError(f"rows have shape {self.rows.shape}: must be (n, {self.layout.width})")

    def __len__(self) -> int:
        """Number of periods."""
        return len(self.rows)

    def __getitem__(self, chosen: slice) -> "Frames":
        """Return some of them."""
        return Frames(self.rows[chosen], self.layout)

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
    def joint_position(self) -> FloatArray:
        """Of the arm, shape (n, joints) [rad]."""
        return self.rows[:, self.layout.arm_columns]

    @property
    def live_values(self) -> FloatArray:
        """Of the live parameters, shape (n, live)."""
        return self.rows[:, self.layout.live_columns][:, : self.layout.live]

    @property
    def live_targets(self) -> FloatArray:
        """What they are moving to, shape (n, live)."""
        return self.rows[:, self.layout.live_columns][:, self.layout.live :]

    def finger(self, number: int) -> ContactFrames:
        """Return a finger's contact.

        Raises:
            InvalidValueError: There is no such finger.
        """
        if not 0 <= number < self.layout.fingers:
            raise InvalidValueError(f"finger = {number}: must be from 0 to {self.layout.fingers - 1}")
        first = FINGERS + PER_FINGER * number
        return ContactFrames(self.rows[:, first : first + PER_FINGER])

    @property
    def centroid(self) -> FloatArray:
        """Of the contact of a run with one finger, base coordinates, shape (n, 3) [m]; NaN where there is none."""
        return np.asarray(self.position + np.einsum("nij,nj->ni", self.rotation, self.finger(0).centroid))

    @property
    def force(self) -> FloatArray:
        """What the object exerts on the finger of such a run, base coordinates, shape (n, 3) [N]."""
        return np.asarray(np.einsum("nij,nj->ni", self.rotation, self.finger(0).force))

    @property
    def scanning(self) -> npt.NDArray[np.bool_]:
        """Which periods of such a run belong to the map: touching while scanning, shape (n,)."""
        found: npt.NDArray[np.bool_] = self.finger(0).touching & (self.rows[:, PHASE] == PHASES.index(Phase.SCAN))
        return found

    def phase(self, index: int) -> Phase:
        """Return what the controller was doing."""
        return PHASES[int(self.rows[index, PHASE])]

    def postures(self, count: int) -> tuple[Posture, ...]:
        """Return postures spread evenly over the run, first and last one among them; none of an empty run."""
        if not len(self):
            return ()
        return tuple(self.posture(i) for i in np.linspace(0, len(self) - 1, count).astype(int).tolist())

    def posture(self, index: int) -> Posture:
        """Return where everything was, as far as the row holds it."""
        row, layout = self.rows[index], self.layout
        return Posture(
            Pose(as_vector(row[POSITION]), _matrix(row[ROTATION].reshape(3, 3))),
            tuple(row[layout.arm_columns].tolist()),
            tuple(row[layout.hand_columns].tolist()),
            tuple(_body_pose(body) for body in row[layout.free_columns].reshape(-1, PER_BODY)),
            float(row[TIME]),
        )


def frames_of_log(log: Log, free_poses: FloatArray | None = None) -> Frames:
    """Return what a view shows of a log.

    Args:
        log: The log.
        free_poses: Where free bodies were: position [m] and quaternion (w, x, y, z) of each,
            base frame, one after the other, shape (n, 7 bodies). Left out: the frames do not hold them.

    Raises:
        InvalidValueError: These poses have another shape.
    """
    free = 0 if free_poses is None else free_poses.shape[-1] // PER_BODY
    if free_poses is not None and free_poses.shape != (len(log), PER_BODY * free):
        raise InvalidValueError(
            f"free_poses has shape {free_poses.shape}: must be ({len(log)}, {PER_BODY} for each body)"
        )
    layout = FrameLayout(len(log.layout.channels), log.layout.joints, log.layout.hand_joints or 0, free)
    columns, rows = log.codec.columns, np.zeros((len(log), layout.width))

    def of(name: str) -> FloatArray:
        return log.rows[:, columns[name]]

    rows[:, NUMBER] = rows[:, -1] = log.sequence
    rows[:, TIME] = of("time")[:, 0]
    rows[:, POSITION], rows[:, ROTATION] = of("arm.position"), of("arm.rotation")
    phases = np.array([PHASES.index(Phase[name]) for name in log.heading.codes.phases])
    rows[:, PHASE] = phases[of("command.phase")[:, 0].astype(int)]
    statuses = np.array([ContactStatus[name] for name in log.heading.codes.statuses])
    frames = Frames(rows, layout)
    for i in range(layout.fingers):
        contact, at = frames.finger(i).columns, f"finger_{i}"
        contact[:, CENTROID] = of(f"{at}.centroid")
        contact[:, FORCE] = of(f"{at}.wrench")[:, :3]
        contact[:, NORMAL_FORCE] = of(f"{at}.normal_force")[:, 0]
        contact[:, SPIN_TORQUE] = of(f"{at}.spin_torque")[:, 0]
        contact[:, NORMAL] = of(f"{at}.normal")
        known = statuses[of(f"{at}.status")[:, 0].astype(int)] == ContactStatus.OK
        contact[:, TOUCHING] = (of(f"{at}.touching")[:, 0] > 0.0) & known
    if layout.joints:
        rows[:, layout.arm_columns] = of("arm.joint_position")
    if layout.hand_joints:
        rows[:, layout.hand_columns] = of("hand.joint_position")
    if free_poses is not None:
        rows[:, layout.free_columns] = free_poses
    return frames


def _body_pose(columns: FloatArray) -> Pose:
    rotation = Rotation.from_quat(np.roll(columns[3:], -1))  # scipy has w last
    return Pose(as_vector(columns[:3]), _matrix(rotation.as_matrix()))


def _matrix(rotation: FloatArray) -> Matrix:
    return (as_vector(rotation[0]), as_vector(rotation[1]), as_vector(rotation[2]))
