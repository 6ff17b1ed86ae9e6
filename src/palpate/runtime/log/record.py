"""A run as arrays in base coordinates, for one finger: what reports and maps are made of."""

from dataclasses import dataclass

import numpy as np

from palpate.errors import FloatArray, InvalidValueError
from palpate.runtime.data import Phase
from palpate.runtime.log.period_codec import PeriodCodec
from palpate.runtime.log.poses import poses_at
from palpate.sensing.contact import ContactStatus


@dataclass(frozen=True, slots=True, eq=False)
class Record:
    """What happened, one row per period, for one finger.

    Contact quantities are in base coordinates, and NaN where `status` is not OK. They belong to where the tip was
    when the wrench was sampled: a sensor that comes late by 18 ms would shift what it felt at 20 mm/s by 0.4 mm.

    Attributes:
        time: Shape (n,) [s].
        wrench_time: When the wrench was sampled, shape (n,) [s].
        position: Of the tip frame, shape (n, 3) [m].
        rotation: Of the tip frame when the wrench was sampled, base from tip, shape (n, 3, 3).
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
    wrench_time: FloatArray
    position: FloatArray
    rotation: FloatArray
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


def record_of(codec: PeriodCodec, rows: FloatArray, finger: int) -> Record:
    """Return the record of one finger.

    Args:
        codec: Of the run.
        rows: Shape (n, width).
        finger: Which, from 0.

    Raises:
        InvalidValueError: There is no such finger.
    """
    fingers = len(codec.heading.layout.channels)
    if not 0 <= finger < fingers:
        raise InvalidValueError(f"finger = {finger}: must be from 0 to {fingers - 1}")

    def vectors(name: str) -> FloatArray:
        return rows[:, codec.columns[name]]

    def numbers(name: str) -> FloatArray:
        return rows[:, codec.columns[name].start]

    at = f"finger_{finger}"
    origin, rotation = poses_at(
        numbers(f"{at}.time"),
        numbers("arm.time"),
        vectors("arm.position"),
        vectors("arm.rotation").reshape(-1, 3, 3),
    )

    def to_base(name: str) -> FloatArray:
        return np.asarray(np.einsum("nij,nj->ni", rotation, vectors(name)))

    phases = np.array([Phase[name].value for name in codec.heading.codes.phases])
    statuses = np.array([ContactStatus[name] for name in codec.heading.codes.statuses], np.int8)
    with np.errstate(over="ignore", invalid="ignore"):  # what a faulty device says may be anything
        return Record(
            time=numbers("time"),
            wrench_time=numbers(f"{at}.time"),
            position=vectors("arm.position"),
            rotation=rotation,
            velocity=vectors("arm.velocity"),
            wrench=vectors(f"{at}.wrench"),
            centroid=origin + to_base(f"{at}.centroid"),
            normal=to_base(f"{at}.normal"),
            normal_force=numbers(f"{at}.normal_force"),
            tangential_force=to_base(f"{at}.tangential_force"),
            spin_torque=numbers(f"{at}.spin_torque"),
            status=statuses[numbers(f"{at}.status").astype(int)],
            touching=numbers(f"{at}.touching").astype(bool),
            command=vectors("command.velocity"),
            phase=phases[numbers("command.phase").astype(int)],
        )
