"""Force/torque sensors on a serial line or USB: Bota, Resense HEX."""

from palpate.hw.serial_ft.bota import Bota
from palpate.hw.serial_ft.resense import Resense
from palpate.hw.serial_ft.serial_sensor import SerialSensor

__all__ = ["Bota", "Resense", "SerialSensor"]
