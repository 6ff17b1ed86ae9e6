"""Reading and validating sensor files."""

import os

from palpate.sensing.ft.sensor_file import VERSION, SensorFile
from palpate.strict_decode import decode_file, load


def load_sensor_file(path: str | os.PathLike[str]) -> SensorFile:
    """Return the sensor described by a file.

    Raises:
        OSError: The file cannot be read.
        InvalidValueError: It is no sensor file, or something in it is wrong; the message names file and key.
    """
    return load(path, read_sensor, "a sensor file")


def read_sensor(text: str) -> SensorFile:
    """Return the sensor described by the text of a sensor file.

    Raises:
        InvalidValueError: As in `load_sensor_file`.
    """
    return decode_file(text, SensorFile, "sensor file", "palpate_sensor", VERSION)
