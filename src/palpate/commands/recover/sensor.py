"""A force/torque sensor after a stop."""

from palpate.commands.recover.condition import DeviceCondition
from palpate.hw.devices import SensorDevice


class RecoverableSensor:
    """A `Recoverable` sensor: it has nothing to unlock."""

    def __init__(self, device: SensorDevice) -> None:
        """Take a sensor that is not started."""
        self._device = device

    @property
    def name(self) -> str:
        """See `Recoverable`."""
        return self._device.name

    def condition(self) -> DeviceCondition:
        """See `Recoverable`.

        Raises:
            DeviceError: It cannot be reached, or sends nothing.
        """
        self._device.start()
        if self._device.read().healthy:
            return DeviceCondition(self.name, "sends good readings", fit=True)
        why = getattr(self._device, "problem", "") or "its status says that the reading is no good"
        return DeviceCondition(self.name, why, fit=False, remedy="take loads off, and see its manual")

    def recover(self) -> None:
        """See `Recoverable`: there is nothing to do."""

    def close(self) -> None:
        """See `Recoverable`."""
        self._device.close()
