"""Forces and speed of a record over time, for its figures."""

import numpy as np

from palpate.errors import FloatArray
from palpate.reporting.data import TimeSeries
from palpate.runtime import Record


def recorded_series(
    record: Record,
    set_force: FloatArray,
    measured_force: FloatArray | None = None,
    true_force: FloatArray | None = None,
    true_spin_torque: FloatArray | None = None,
) -> TimeSeries:
    """Return the series of a record; see `TimeSeries`. `measured_force` defaults to the normal force."""
    felt = record.normal_force if measured_force is None else measured_force
    return TimeSeries(
        time=record.time,
        phase=[str(phase) for phase in record.phase],
        measured_force=np.where(record.touching, felt, np.nan),
        set_force=set_force,
        spin_torque=np.where(record.touching, record.spin_torque, np.nan),
        speed=np.linalg.norm(record.velocity, axis=1),
        true_force=true_force,
        true_spin_torque=true_spin_torque,
    )
