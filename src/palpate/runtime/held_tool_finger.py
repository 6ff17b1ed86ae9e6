"""A held tool, as touch knows it: a fingertip whose sensor is the sum of those behind the fingers that hold it."""

from dataclasses import dataclass

from palpate.runtime.touch import NOISELESS, FingerDescription, PlainPipeline, WrenchPipeline
from palpate.sensing.compensation import SensorPayload
from palpate.sensing.ft.health import StillnessWatch
from palpate.sensing.solver import Surface
from palpate.spatial import Wrench


@dataclass(frozen=True, slots=True)
class HeldToolFinger:
    """A tool in fingers. A `FingerDescription`.

    Attributes:
        surface: Of the tool, in the frame of the sum.
        payload: Its weight and inertia, in that frame.
        fingers: That hold it; what their pipelines do to a wrench has been done.
        touch_force: A force above this [N] is a touch,
        release_force: and the touch ends below this [N].
        noise: Of the sum, each axis [N, N m].
    """

    surface: Surface
    payload: SensorPayload
    fingers: tuple[FingerDescription, ...]
    touch_force: float
    release_force: float
    noise: Wrench = NOISELESS

    @property
    def gives_wrenches(self) -> bool:
        """See `FingerDescription`."""
        return True

    def pipeline(self) -> WrenchPipeline:
        """See `FingerDescription`: as late as the slowest finger's."""
        delay = max(finger.pipeline().delay for finger in self.fingers)
        return PlainPipeline(self.payload, self.touch_force, self.release_force, delay)

    def stillness(self) -> StillnessWatch | None:
        """See `FingerDescription`: the fingers' own tell."""
        return None
