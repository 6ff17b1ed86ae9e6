"""Digital and analog outputs and the speed slider: what RTDEIOInterface writes and clients read back."""

from collections.abc import Mapping

from palpate.hw.emulators.ur.variables import Values

_DIGITAL = (("standard", 0), ("configurable", 8), ("tool", 16))
"""Where each kind begins in `actual_digital_output_bits`."""

VOLTAGE_SPAN = 10.0
"""[V] of an analog output."""

CURRENT_LEAST, CURRENT_SPAN = 4.0, 16.0
"""[mA] of an analog output: 4 to 20 mA."""


class Channels:
    """Outputs as they are now.

    Attributes:
        digital: Bits 0-7 standard, 8-15 configurable, 16-17 tool.
        analog: Of the two standard outputs [V or mA].
        speed: Fraction of full speed.
    """

    def __init__(self) -> None:
        """Be off, at full speed."""
        self.digital = 0
        self.analog = [0.0, 0.0]
        self.speed = 1.0

    def write(self, values: Mapping[str, Values]) -> None:
        """Take what a data package says of outputs; masked channels only."""
        for kind, first in _DIGITAL:
            mask = int(values.get(f"{kind}_digital_output_mask", (0,))[0]) << first
            if mask:
                bits = int(values.get(f"{kind}_digital_output", (0,))[0]) << first
                self.digital = (self.digital & ~mask) | (bits & mask)
        mask = int(values.get("standard_analog_output_mask", (0,))[0])
        voltages = int(values.get("standard_analog_output_type", (0,))[0])
        for i in range(2):
            if mask >> i & 1:
                share = min(1.0, max(0.0, values.get(f"standard_analog_output_{i}", (0.0,))[0]))
                voltage = voltages >> i & 1
                self.analog[i] = share * VOLTAGE_SPAN if voltage else CURRENT_LEAST + share * CURRENT_SPAN

    def speed_from(self, inputs: Mapping[str, Values]) -> None:
        """Let the slider follow the inputs, if they are masked in."""
        if inputs["speed_slider_mask"][0]:
            fraction = inputs["speed_slider_fraction"][0]
            if 0.0 <= fraction <= 1.0:
                self.speed = fraction
