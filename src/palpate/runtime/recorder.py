"""A run kept in memory."""

from array import array
from dataclasses import dataclass

import numpy as np

from palpate.errors import FloatArray
from palpate.runtime.data import Command, Observation, Phase, Sample

_PHASES = tuple(Phase)
_INDEX = {phase: float(i) for i, phase in enumerate(_PHASES)}

_WIDTHS = {
    "time": 1,
    "position": 3,
    "velocity": 3,
    "rotation": 9,
    "wrench": 6,
    "centroid": 3,
    "normal": 3,
    "normal_force": 1,
    "tangential_force": 3,
    "spin_torque": 1,
    "status": 1,
    "touching": 1,
    "command": 3,
    "phase": 1,
}
_WIDTH = sum(_WIDTHS.values())


@dataclass(frozen=True, slots=True, eq=False)
class Record:
    """What happened, one row per period, for one finger.

    Contact quantities are in base coordinates, and NaN where `status` is not OK.

    Attributes:
        time: Shape (n,) [s].
        position: Of the tip frame, shape (n, 3) [m].
        velocity: Of the tip frame, shape (n, 3) [m/s].
        wrench: What the object exerts on the finger, sensor frame, shape (n, 6) [N, N m].
        centroid: Shape (n, 3) [m].
        normal: Outward normal of the fingertip, shape (n, 3).
        normal_force: Shape (n,) [N].
        tangential_force: Shape (n, 3) [N].
        spin_torque: Shape (n,) [N m].
        status: Values of `ContactStatus`, shape (n,).
        touching: Shape (n,).
        command: Commanded velocity, shape (n, 3) [m/s].
        phase: Values of `Phase`, shape (n,).
    """

    time: FloatArray
    position: FloatArray
    velocity: FloatArray
    wrench: FloatArray
    centroid: FloatArray
    normal: FloatArray
    normal_force: FloatArray
    tangential_force: FloatArray
    spin_torque: FloatArray
    status: np.ndarray[tuple[int], np.dtype[np.int8]]
    touching: np.ndarray[tuple[int], np.dtype[np.bool_]]
    command: FloatArray
    phase: np.ndarray[tuple[int], np.dtype[np.str_]]

    def __len__(self) -> int:
        """Number of periods."""
        return len(self.time)


class Recorder:
    """An observer that keeps one finger's run in memory, 312 bytes per period."""

    def __init__(self, finger: int = 0) -> None:
        """Record the given finger."""
        self._finger = finger
        self._rows = array("d")

    def __call__(self, sample: Sample, now: Observation, command: Command) -> None:
        """Append one period."""
        finger = now.fingers[self._finger]
        contact, arm = finger.contact, now.arm
        row0, row1, row2 = arm.rotation_base_tip
        self._rows.extend(
            (
                now.time,
                *arm.position_base_tip,
                *arm.velocity_base_tip,
                *row0,
                *row1,
                *row2,
                *finger.wrench,
                *contact.centroid.tolist(),
                *contact.normal.tolist(),
                contact.normal_force,
                *contact.tangential_force.tolist(),
                contact.spin_torque,
                contact.status,
                finger.touching,
                *command.velocity_base_tip,
                _INDEX[command.phase],
            )
        )

    def record(self) -> Record:
        """Return all that was appended so far."""
        rows = np.array(self._rows).reshape(-1, _WIDTH)
        column, start = {}, 0
        for name, width in _WIDTHS.items():
            column[name] = rows[:, start] if width == 1 else rows[:, start : start + width]
            start += width
        rotation = column["rotation"].reshape(-1, 3, 3)

        def to_base(vectors: FloatArray) -> FloatArray:
            return np.asarray(np.einsum("nij,nj->ni", rotation, vectors))

        return Record(
            time=column["time"],
            position=column["position"],
            velocity=column["velocity"],
            wrench=column["wrench"],
            centroid=column["position"] + to_base(column["centroid"]),
            normal=to_base(column["normal"]),
            normal_force=column["normal_force"],
            tangential_force=to_base(column["tangential_force"]),
            spin_torque=column["spin_torque"],
            status=column["status"].astype(np.int8),
            touching=column["touching"].astype(bool),
            command=column["command"],
            phase=np.array(_PHASES)[column["phase"].astype(int)],
        )
