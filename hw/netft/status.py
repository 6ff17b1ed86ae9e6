"""What the status word of a record says. Two makes of boxes have two meanings for its bits.

Common to both: 0 is healthy, and bit 31 is set whenever any other bit is set that makes a reading useless.
"""

from dataclasses import dataclass

ANY_ERROR = 1 << 31
"""Set if the reading must not be used."""


@dataclass(frozen=True, slots=True)
class StatusWords:
    """The bits of one make.

    Attributes:
        meaning: Of each bit that has one, and what to do.
        out_of_range: The bits that a load beyond the range sets.
    """

    meaning: dict[int, str]
    out_of_range: int

    def problem(self, status: int) -> str:
        """Return what is wrong with a reading, in words; empty if it is good."""
        if not status & ANY_ERROR:
            return ""
        causes = [words for bit, words in self.meaning.items() if status >> bit & 1]
        return f"status {status:#010x}: " + ("; ".join(causes) or "an error that it does not name")


AXIA = StatusWords(
    {
        30: "force or torque out of range, take the load off",
        29: "checksum of the calibration wrong, send it in",
        28: "made-up data, switch simulation off on its web page",
        27: "gage out of range, take the load off; if it stays, it was overloaded",
        16: "monitor condition latched",
        5: "a common fault",
        3: "busy",
        2: "gage broken, send it in",
        1: "supply voltage out of range",
        0: "temperature out of range",
    },
    out_of_range=ANY_ERROR | 1 << 30,
)
"""Of ATI's Axia sensors (their Ethernet manual)."""

NET_BOX = StatusWords(
    {
        30: "CPU or RAM error",
        29: "digital board error",
        28: "analog board error",
        27: "error of the serial link",
        26: "program memory damaged",
        25: "halted by configuration errors",
        24: "settings invalid",
        23: "settings do not fit the calibration",
        22: "network failure",
        21: "CAN error",
        20: "RDT error",
        19: "EtherNet/IP failure",
        18: "DeviceNet failure",
        17: "transducer saturated or converter error, take the load off; if it stays, check its cable",
        16: "monitor condition latched",
        14: "watchdog timeout",
        13: "stack check error",
        12: "EEPROM failure",
        11: "flash failure",
        10: "watchdog of the analog board timed out",
        9: "gage excitation current too high",
        8: "gage excitation current too low: is the transducer plugged in?",
        7: "artificial analog ground out of range",
        6: "supply of the analog board too high",
        5: "supply of the analog board too low",
        4: "serial link without data",
        3: "reference voltage out of range",
        2: "temperature out of range",
        1: "HTTP failure",
    },
    out_of_range=ANY_ERROR | 1 << 17,
)
"""Of the Net F/T box (its manual, "system status code"); to be checked on the box at hand."""
