"""The contacts of an exploration from its record: which count, and as points of the object."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from palpate.errors import FloatArray
from palpate.mapping import TouchCloud
from palpate.runtime import FingerDescription, Phase, Record, SensorFinger


@dataclass(frozen=True, slots=True, eq=False)
class ScanContacts:
    """What a scan felt, n contacts.

    Attributes:
        cloud: Points on the object's surface.
        centroid: Of the sensed fingertip, base frame, not corrected for compression, shape (n, 3) [m].
        speed: Of the tip, shape (n,) [m/s].
        half_compliance: Compliance of the tip's half of the contact [m/N]; the object's is equal.
        force_noise: Standard deviation of one sample's normal force [N].
    """

    cloud: TouchCloud
    centroid: FloatArray
    speed: FloatArray
    half_compliance: float
    force_noise: float

    @classmethod
    def of(
        cls,
        record: Record,
        finger: FingerDescription,
        *,
        half_compliance: float,
        sensed_force: float,
        force_noise: float,
    ) -> "ScanContacts":
        """Return the contacts of a record.

        Args:
            record: Of every period.
            finger: That felt them.
            half_compliance: Of tip and object together, half their compression per force [m/N].
            sensed_force: Force at which the sensed surface is taken as compressed [N]; see `touch_cloud`.
            force_noise: Of a finger whose sensor no file describes, each axis [N].
        """
        kept = felt_in_scan(record)
        return cls(
            touch_cloud(record, half_compliance, sensed_force),
            record.centroid[kept],
            np.linalg.norm(record.velocity[kept], axis=1),
            half_compliance,
            max(finger.sensor.noise[:3]) if isinstance(finger, SensorFinger) else force_noise,
        )


def felt_in_scan(record: Record) -> npt.NDArray[np.bool_]:
    """Return which periods give a point of the map, shape (n,)."""
    return np.asarray((record.phase == Phase.SCAN.value) & record.touching & (record.status == 0))


def touch_cloud(record: Record, half_compliance: float, sensed_force: float) -> TouchCloud:
    """Return the points of the object that a scan touched.

    The centroid lies in the middle of the overlap of the undeformed tip and object. The object's own half of the
    compression, `half_compliance` [m/N] times the normal force, is subtracted along the normal; so is the
    tip's compression beyond that of its sensed surface, which is taken at `sensed_force` [N].
    """
    kept = felt_in_scan(record)
    normal = -record.normal[kept]
    offset = half_compliance * (2.0 * record.normal_force[kept] - sensed_force)
    return TouchCloud(
        time=record.time[kept],
        position=record.centroid[kept] + offset[:, None] * normal,
        normal=normal,
        normal_force=record.normal_force[kept],
        tangential_force=record.tangential_force[kept],
        spin_torque=record.spin_torque[kept],
    )
