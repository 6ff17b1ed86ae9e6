"""The force/torque sensors that can be simulated by name."""

from enum import StrEnum


class PresetSensor(StrEnum):
    """Names of the sensors that palpate knows, as files write them."""

    PERFECT = "perfect"
    NANO17 = "nano17"
    AXIA80 = "axia80"
    FT300S = "ft300s"
    UR5E = "ur5e"
