"""The registers through which ur_rtde's control script takes commands and returns results."""

from collections.abc import MutableMapping, Sequence

from palpate.errors import InvalidValueError
from palpate.hw.emulators.ur.variables import REGISTERS, Values

READY, DONE = 1, 2
"""In output int register 0: waiting for a command, done with one."""

LARGEST = 1e6
"""Of any number in a command, whatever its unit: what is above means nothing."""

_RESULTS = tuple(range(24)) + tuple(range(36, 48))
"""Output double registers of results: from the 25th number on, behind the registers of other clients."""

_RUNNING = 1 << 15
_COUNTS = 128


class Registers:
    """Registers as a control script sees them, which may live in the upper half.

    Attributes:
        command_name: The input that has the command's id.
    """

    def __init__(
        self,
        inputs: MutableMapping[str, Values],
        outputs: MutableMapping[str, Values],
        int_offset: int = 0,
        double_offset: int = 0,
    ) -> None:
        """Use the registers of a controller from the offsets on."""
        self._inputs, self._outputs = inputs, outputs
        self._int_in = [f"input_int_register_{i}" for i in range(int_offset, REGISTERS)]
        self._double_in = [f"input_double_register_{i}" for i in range(double_offset, REGISTERS)]
        self._int_out = [f"output_int_register_{i}" for i in range(int_offset, REGISTERS)]
        self._double_out = [f"output_double_register_{i}" for i in range(double_offset, REGISTERS)]
        self.command_name = self._int_in[0]
        self._operation, self._writes = 0, 0

    @property
    def command(self) -> int:
        """The id of what is wanted."""
        return int(self._inputs[self.command_name][0])

    def integer(self, register: int) -> int:
        """Return an input."""
        return int(self._inputs[self._int_in[register]][0])

    def double(self, register: int) -> float:
        """Return an input.

        Raises:
            InvalidValueError: Nothing that a command means.
        """
        return self.doubles(register, 1)[0]

    def doubles(self, first: int, count: int = 6) -> tuple[float, ...]:
        """Return inputs that lie one after the other.

        Raises:
            InvalidValueError: Nothing that a command means.
        """
        values = tuple(self._inputs[name][0] for name in self._double_in[first : first + count])
        if len(values) == count and all(abs(value) <= LARGEST for value in values):
            return values
        raise InvalidValueError(f"double registers from {first} = {values}: each must be within +-{LARGEST:g}")

    def state(self, value: int) -> None:
        """Say READY or DONE."""
        self._outputs[self._int_out[0]] = (value,)

    def reply_integer(self, value: int) -> None:
        """Write an integer result."""
        self._outputs[self._int_out[1]] = (value,)

    def reply_doubles(self, values: Sequence[float]) -> None:
        """Write a result of several numbers."""
        for register, value in zip(_RESULTS, values, strict=False):
            if register < len(self._double_out):
                self._outputs[self._double_out[register]] = (float(value),)

    def begin_operation(self) -> None:
        """Say that an asynchronous operation has begun."""
        self._operation = (self._operation + 1) % _COUNTS
        self.progress(0)

    def progress(self, value: int) -> None:
        """Say how far it is."""
        self._asynchronous(_RUNNING | value & (_RUNNING - 1))

    def finish_operation(self) -> None:
        """Say that none is running."""
        self._asynchronous(0)

    def _asynchronous(self, low: int) -> None:
        self._writes = (self._writes + 1) % _COUNTS
        self._outputs[self._int_out[2]] = (low | self._writes << 16 | self._operation << 24,)
