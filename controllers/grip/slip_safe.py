"""The least grip that keeps every contact within its limit surface, with a margin.

Each finger tells by its own sensor which share of the load it bears: its tangential force and spin torque, and
where they will be when a command given now has become a force. From those the limit surface says the least normal
force. The largest of the fingers' needs is the grip of all: fingers opposite each other balance with one.

The grip rises as fast as the actuator may, and is let down slowly. What the fingers feel of it corrects the
command, slowly too: gears rub. Where a finger feels nothing, or nothing to be believed, the grip is raised once by
a bounded share, and not let down before all fingers feel again. It never opens.
"""

import math
from collections.abc import Sequence

from palpate.controllers.grip.belief import NobodyWatches, SlipWatch, SurfaceBelief
from palpate.controllers.grip.load_ahead import LoadAhead
from palpate.controllers.grip.need import GripNeed, NeedWithSpin
from palpate.controllers.grip.parameters import GripParameters, live_grip
from palpate.errors import InvalidValueError
from palpate.friction.contact_load import ContactLoad
from palpate.runtime.data import FingerObservation, Observation

_TOO_FEW = 2
"""Fingers that a grip takes, at least."""

ANSWER_TIME = 0.05
"""[s] After which a slip that goes on is answered once more: about what it takes until a raised grip is felt (bus,
servo, and the swing of its rotor on the contact: 2 + 15 + 30 ms for the simulated hand)."""


class SlipSafeGrip:
    """From what the fingers feel to the force with which they press. Part of a controller; a pure step function.

    Attributes:
        live: What may be changed while it runs: `margin` and `least_grip`; the loop moves them on.
        target: Grip that is wanted [N].
        needed: Least grip of the present load by the limit surface believed in, without margin [N]; while a finger
            is faulty, that of the last load that all of them felt.
        faulty: Whether a finger feels nothing, or nothing to be believed.
        regrips: How often a slip was answered.
    """

    def __init__(
        self,
        fingers: int,
        belief: SurfaceBelief,
        period: float,
        parameters: GripParameters | None = None,
        watch: SlipWatch | None = None,
        need: GripNeed | None = None,
    ) -> None:
        """Take the pieces.

        Args:
            fingers: How many there are, 2 or more.
            belief: What the contacts bear.
            period: Of control [s].
            parameters: How; safe defaults if not given.
            watch: Tells when a contact begins to slip; nobody if not given.
            need: From load to least grip; with spin if not given.
        """
        if fingers < _TOO_FEW:
            raise InvalidValueError(f"fingers = {fingers!r}: must be {_TOO_FEW} or more")
        self.parameters = parameters = parameters or GripParameters()
        self.live = live_grip(parameters)
        self._belief, self._watch, self._need = belief, watch or NobodyWatches(), need or NeedWithSpin()
        self._ahead = tuple(LoadAhead(parameters.smoothing, period) for _ in range(fingers))
        self._period = period
        self.start(parameters.least_grip)

    def start(self, grip: float) -> None:
        """Begin a new grip, of which nothing is known yet, with one that has been commanded so far [N]."""
        self.live.restart()
        self._belief.start()
        self._watch.start()
        self.regrips, self._correction = 0, 0.0
        self.resume(grip)

    def resume(self, grip: float) -> None:
        """Go on with the same object after something else has moved the fingers, with what they press now [N].

        What was learned of the contacts is kept, and what the gears swallow, and so are live parameters and the
        count of slips answered. Loads felt before do not count, nor slips told before, nor a grip that was to be
        kept for a while.
        """
        for ahead in self._ahead:
            ahead.restart()
        self.target, self.needed, self.faulty = grip, 0.0, False
        self._safe = grip
        self._floor, self._floor_until, self._answered = 0.0, -math.inf, -math.inf
        self._resumed, self._heeded = True, False

    def step(self, now: Observation, at_least: float = 0.0) -> tuple[float, ...]:
        """Return with which force each finger is to press during the next period [N].

        Args:
            now: What is known.
            at_least: Grip that is wanted whatever the load [N].

        Raises:
            InvalidValueError: Another number of fingers than the grip has.
        """
        if len(now.fingers) != len(self._ahead):
            raise InvalidValueError(
                f"the observation has {len(now.fingers)} fingers: the grip has {len(self._ahead)}"
            )
        p = self.parameters
        loads = tuple(_load_of(finger) for finger in now.fingers)
        nothing = (None,) * len(loads)
        if self._resumed:  # what detectors heard before is a gap to them
            self._watch.step(now.time, nothing)
            self._resumed = False
        onsets = self._watch.step(now.time, loads)
        ongoing = self._watch.slipping
        # a load under which something goes on slipping was not held
        self._belief.watch(now.time, nothing if ongoing and not any(onsets) else loads, onsets)
        self._heeded |= not ongoing or any(onsets)
        wanted = self._wanted(loads)
        self.faulty = None in loads
        if self.faulty:  # from the last safe grip: a contact that comes and goes must not raise it again and again
            self._hold(now.time, now.time, max(self.target, self._safe * (1.0 + p.fault_raise)))
        # what a detector says of a finger that feels nothing is old
        slips = any(onsets) or (ongoing and self._heeded and not self.faulty)
        if slips and now.time >= self._answered + ANSWER_TIME:
            self._answered, self.regrips = now.time, self.regrips + 1
            self._hold(now.time, now.time + p.regrip_time, max(self.target, self.needed) * (1.0 + p.regrip))
        wanted = max(wanted, at_least, self.live.value("least_grip"))
        if not self.faulty:
            self._safe = self._towards(wanted, self._safe)
        self.target = self._towards(
            max(wanted, self._floor) if now.time <= self._floor_until else wanted, self.target
        )
        self._correct(loads)
        command = max(self.target + self._correction, 0.5 * self.live.value("least_grip"))
        return (min(command, p.largest_grip),) * len(loads)

    def _towards(self, wanted: float, before: float) -> float:
        """The grip of the next period on its way to the wanted one [N]: as fast as may be up, slowly down."""
        p, wanted = self.parameters, min(wanted, self.parameters.largest_grip)
        if wanted >= before:
            return min(wanted, before + p.grip_rate * self._period)
        return before - min(p.release_rate, (before - wanted) / p.release_time) * self._period

    def _hold(self, time: float, until: float, grip: float) -> None:
        """Keep at least this grip until then, and what was to be kept before."""
        kept = self._floor if time <= self._floor_until else 0.0
        self._floor, self._floor_until = max(kept, grip), max(until, self._floor_until)

    def _wanted(self, loads: Sequence[ContactLoad | None]) -> float:
        """The grip that the present load and that of a little later want, with margin [N]."""
        p, most, now_most = self.parameters, 0.0, 0.0
        for i, load in enumerate(loads):
            ahead = self._ahead[i]
            if load is None:  # the floor stands for it: its last rate is that of a fall or a glitch, not of a load
                ahead.restart()
                continue
            ahead.step(load)
            surface = self._belief.surface(i)
            need = self._need.least(surface, *ahead.ahead(0.0))
            now_most = max(now_most, need)
            most = max(most, need, self._need.least(surface, *ahead.ahead(p.lead)))
        if None not in loads:
            self.needed = now_most
        return most * (1.0 + self.live.value("margin")) + p.reserve

    def _correct(self, loads: Sequence[ContactLoad | None]) -> None:
        """Move the command by what the fingers feel too little or too much."""
        p, felt = self.parameters, [load.normal_force for load in loads if load is not None]
        if len(felt) < len(loads):
            return
        share = self._period / p.correction_time
        most = p.correction_share * self.target
        correction = self._correction + share * (self.target - min(felt))
        self._correction = min(max(correction, -most), most)


def _load_of(finger: FingerObservation) -> ContactLoad | None:
    """What a finger bears, if it can be believed."""
    return ContactLoad.of(finger.contact) if finger.believed else None
