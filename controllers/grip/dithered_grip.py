"""A slip-safe grip with dither, by which slip is detected where friction is unknown."""

from palpate.controllers.grip.announced_loads import Announcer
from palpate.controllers.grip.belief import SlipWatch, SurfaceBelief
from palpate.controllers.grip.grip_plan import GripPlan
from palpate.controllers.grip.parameters import GripParameters
from palpate.controllers.grip.preload import Preload
from palpate.controllers.grip.slip_hearing import SlipHearing
from palpate.controllers.grip.slip_safe import SlipSafeGrip
from palpate.controllers.grip.zeros import Zeros
from palpate.friction.slip.grip_dither import GripDither
from palpate.runtime.data import Observation


class DitheredGrip(SlipSafeGrip):
    """A `SlipSafeGrip` with dither, which `palpate.friction.slip.excited_slip` needs.

    The grip is raised by the ripple's amplitude, so that it never falls below what is safe.
    """

    def __init__(
        self,
        fingers: int,
        belief: SurfaceBelief,
        period: float,
        dither: GripDither,
        parameters: GripParameters | None = None,
        watch: SlipWatch | None = None,
        plan: GripPlan | None = None,
        hearing: SlipHearing | None = None,
        *,
        zeros: Zeros | None = None,
        announcer: Announcer | None = None,
        preload: Preload | None = None,
    ) -> None:
        """Take the ripple, and all else as `SlipSafeGrip` does.

        Raises:
            InvalidValueError: The ripple is too fast for the period.
        """
        dither.half_cycle(period)
        self._dither = dither
        super().__init__(
            fingers,
            belief,
            period,
            parameters,
            watch,
            plan,
            hearing,
            zeros=zeros,
            announcer=announcer,
            preload=preload,
        )

    def step(self, now: Observation, at_least: float = 0.0, *, hanging: bool = True) -> tuple[float, ...]:
        """See `SlipSafeGrip`."""
        dither = self._dither
        most = self.parameters.largest_grip
        return tuple(
            min(force + dither.amplitude_at(force) + dither.force_at(now.time, force), most)
            for force in super().step(now, at_least, hanging=hanging)
        )
