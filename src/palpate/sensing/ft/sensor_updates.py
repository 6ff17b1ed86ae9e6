"""A sensor file with something newly determined in it."""

import msgspec

from palpate.errors import InvalidValueError
from palpate.sensing.compensation import contact_wrench
from palpate.sensing.ft.bias import BiasEstimate
from palpate.sensing.ft.calibration import CalibrationFit, CalibrationStatus
from palpate.sensing.ft.payload import IdentifiedPayload, PayloadStatus
from palpate.sensing.ft.sensor_file import CalibrationEntry, PayloadEntry, SensorFile
from palpate.spatial import ZERO, Vector


def with_payload(sensor: SensorFile, found: IdentifiedPayload, *, date: str, provenance: str) -> SensorFile:
    """Return the sensor with an identified payload, and the bias that comes with it.

    Args:
        sensor: As it was. The wrenches of the identification must not have had its bias taken off.
        found: The identified payload.
        date: As YYYY-MM-DD.
        provenance: How it was determined.

    Raises:
        InvalidValueError: The identification is INCONSISTENT, or the result is no possible sensor.
    """
    if found.status is PayloadStatus.INCONSISTENT:
        raise InvalidValueError(
            f"the payload does not explain the wrenches (chi2 per degree of freedom {found.force_chi2:.3g} of the "
            f"force, {found.moment_chi2:.3g} of the moment, should be 1): measure again, at rest, without contact"
        )
    payload = PayloadEntry(mass=found.payload.mass, center_of_mass=found.payload.center_of_mass)
    return msgspec.structs.replace(
        sensor,
        payload=payload,
        bias_force=found.bias_force,
        bias_moment=found.bias_moment,
        date=date,
        provenance=provenance,
    )


def with_bias(
    sensor: SensorFile, found: BiasEstimate, specific_force: Vector, *, date: str, provenance: str
) -> SensorFile:
    """Return the sensor with a newly averaged bias; the weight of its payload is taken off.

    Args:
        sensor: As it was. The averaged wrenches must not have had its bias taken off.
        found: The average at rest.
        specific_force: In that pose, sensor frame [m/s^2]: up, of length g.
        date: As YYYY-MM-DD.
        provenance: How it was determined.

    Raises:
        InvalidValueError: The result is no possible sensor.
    """
    bias = contact_wrench(found.mean, specific_force, sensor.payload.payload)
    return msgspec.structs.replace(
        sensor, bias_force=bias[:3], bias_moment=bias[3:], date=date, provenance=provenance
    )


def with_calibration(
    sensor: SensorFile,
    found: CalibrationFit,
    *,
    raw_unit: str,
    raw_range: tuple[float, float],
    date: str,
    provenance: str,
) -> SensorFile:
    """Return the sensor with a newly fitted calibration; its bias is zero again.

    Args:
        sensor: As it was.
        found: The fit.
        raw_unit: Of the channels ("V", "counts").
        raw_range: Lowest and highest reading that is not saturated [raw unit].
        date: As YYYY-MM-DD.
        provenance: How it was determined.

    Raises:
        InvalidValueError: The fit is POOR_FIT, or the result is no possible sensor.
    """
    if found.status is CalibrationStatus.POOR_FIT:
        raise InvalidValueError(
            "the calibration does not predict loads that were left out (RMS "
            f"{', '.join(f'{x:.3g}' for x in found.left_out_rms)} N, N m): check the loads and their order"
        )
    entry = CalibrationEntry(
        raw_unit=raw_unit,
        matrix=found.map.matrix,
        offset=found.map.offset,
        raw_range=raw_range,
        condition=found.condition,
    )
    return msgspec.structs.replace(
        sensor,
        calibration=entry,
        bias_force=ZERO,
        bias_moment=ZERO,
        date=date,
        provenance=provenance,
    )
