"""A sensor file with something newly determined in it."""

import math

import msgspec
import numpy as np

from palpate.errors import FloatArray, InvalidValueError
from palpate.sensing.compensation import contact_wrench
from palpate.sensing.ft.bias import BiasEstimate
from palpate.sensing.ft.calibration import CalibrationFit
from palpate.sensing.ft.payload import IdentifiedPayload
from palpate.sensing.ft.sensor_file import CalibrationEntry, PayloadEntry, ProductEntry, SensorFile
from palpate.spatial import ZERO, Vector, as_vector


def with_payload(sensor: SensorFile, found: IdentifiedPayload, *, date: str, provenance: str) -> SensorFile:
    """Return the sensor with an identified payload, and the bias that comes with it.

    Args:
        sensor: As it was. The wrenches of the identification must not have had its bias taken off.
        found: The identified payload.
        date: As YYYY-MM-DD.
        provenance: How it was determined.

    Raises:
        InvalidValueError: An assumption of the identification is broken, or the result is no possible sensor.
    """
    if not found.verdict.ok:
        raise InvalidValueError(f"the payload is not to be used: {found.verdict}")
    payload = PayloadEntry(
        mass=found.payload.mass,
        center_of_mass=found.payload.center_of_mass,
        mass_sd=found.mass_sd,
        center_of_mass_sd=as_vector(found.center_sd) if found.payload.mass > 0.0 else ZERO,
    )
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


def bias_covariance(sensor: SensorFile, found: BiasEstimate, specific_force: Vector) -> FloatArray:
    """Return the covariance of the bias of `with_bias`, shape (6, 6) [N, N m].

    It is that of the average, and of the payload's weight, which was taken off: m a, and [a]x m c.

    Args:
        sensor: Whose payload is uncertain.
        found: The average at rest.
        specific_force: In that pose, sensor frame [m/s^2].
    """
    a, payload = np.array(specific_force), sensor.payload
    x, y, z = specific_force
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    covariance = np.diag(np.square(found.standard_error))
    covariance[:3, :3] += payload.mass_sd**2 * np.outer(a, a)
    covariance[3:, 3:] += payload.mass**2 * cross @ np.diag(np.square(payload.center_of_mass_sd)) @ cross.T
    return covariance


def touch_uncertainty(sensor: SensorFile, found: BiasEstimate, specific_force: Vector) -> float:
    """Return the standard deviation of the force felt without contact once the tip points the other way [N].

    The payload's weight is then off by twice what the tare has hidden in the bias.

    Args:
        sensor: Whose payload is uncertain.
        found: The average at rest.
        specific_force: In that pose, sensor frame [m/s^2].
    """
    return math.hypot(2.0 * math.hypot(*specific_force) * sensor.payload.mass_sd, *found.standard_error[:3])


def with_calibration(
    sensor: SensorFile,
    found: CalibrationFit,
    *,
    temperature: float | None = None,
    raw_unit: str,
    raw_range: tuple[float, float],
    date: str,
    provenance: str,
) -> SensorFile:
    """Return the sensor with a newly fitted calibration; its bias is zero again.

    Args:
        sensor: As it was.
        found: The fit.
        temperature: At which it holds [degrees Celsius], if that is known.
        raw_unit: Of the channels ("V", "counts").
        raw_range: Lowest and highest reading that is not saturated [raw unit].
        date: As YYYY-MM-DD.
        provenance: How it was determined.

    Raises:
        InvalidValueError: An assumption of the fit is broken, or the result is no possible sensor.
    """
    if not found.verdict.ok:
        raise InvalidValueError(f"the calibration is not to be used: {found.verdict}")
    k = found.map.channels
    columns = zip(*(row[k:] for row in found.map.matrix), strict=True)
    products = zip(found.map.products, columns, strict=True)
    entry = CalibrationEntry(
        raw_unit=raw_unit,
        matrix=tuple(row[:k] for row in found.map.matrix),
        offset=found.map.offset,
        raw_range=raw_range,
        condition=found.condition,
        products=tuple(
            ProductEntry(channels=pair, column=(a, b, c, d, e, f)) for pair, (a, b, c, d, e, f) in products
        ),
        temperature=temperature,
    )
    return msgspec.structs.replace(
        sensor,
        calibration=entry,
        bias_force=ZERO,
        bias_moment=ZERO,
        date=date,
        provenance=provenance,
    )
