"""A rig whose sensors are tared whenever it is started."""

from palpate.hw.rig.rig import Rig
from palpate.runtime.data import Sample
from palpate.runtime.wrapped_backend import WrappedBackend


class FreshlyTared(WrappedBackend[Rig]):
    """A back end: at its start nothing may be touched. What a rig is otherwise, it is."""

    def start(self) -> Sample:
        """See `Rig.start` and `Rig.tare`.

        Raises:
            DeviceError: A device is not fit, or a sensor's readings move.
        """
        self.backend.start()
        try:
            self.backend.tare()
            return self.backend.start()
        except BaseException:
            self.backend.close()
            raise
