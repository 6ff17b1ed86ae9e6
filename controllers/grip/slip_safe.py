"""The least grip that keeps every contact within its limit surface, with a margin.

What each finger is to press with, a plan says (`palpate.controllers.grip.grip_plan`) from what all of them feel,
for now and for when a command given now has become a force. Here it becomes a grip that is safe.

The grip rises as fast as the actuator may, and is let down slowly. What the fingers feel of it corrects the
command, slowly too: gears rub. Where a finger feels nothing, or nothing to be believed, the grip is raised once by
a bounded share, and not let down before all fingers feel again. It never opens.
"""

import math
from collections.abc import Sequence

from palpate.controllers.grip.announced_loads import Announcer, NothingAnnounced
from palpate.controllers.grip.belief import NoSlipWatch, SlipWatch, SurfaceBelief
from palpate.controllers.grip.expected_load import ExpectedLoad
from palpate.controllers.grip.foresight import Foresight
from palpate.controllers.grip.grip_plan import CommonGrip, GripPlan, Loads
from palpate.controllers.grip.parameters import GripParameters, live_grip
from palpate.controllers.grip.preload import Preload
from palpate.controllers.grip.slip_alarm import Signal, SlipAlarm
from palpate.controllers.grip.slip_hearing import SlipHearing
from palpate.controllers.grip.zeros import SteadyZeros, Zeros
from palpate.errors import InvalidValueError
from palpate.friction.contact_load import ContactLoad
from palpate.friction.slip.kinds import kind_of_slip
from palpate.friction.slip.recent_swing import RecentSwing
from palpate.runtime.data import FingerObservation, Observation

_TOO_FEW = 2
"""Fingers that a grip takes, at least."""

REGRIP_INTERVAL = 0.05
"""[s] After which a slip that goes on raises the grip once more: about what it takes until a raised grip is felt
(bus, servo, and the swing of its rotor on the contact: 2 + 15 + 30 ms for the simulated hand)."""

REFUTED_RELEASE = 4.0
"""Times the usual rate at which the grip is let down after a slip that was none: it held before with less."""

SMOOTH = 0.02
"""[s] Time constant with which noise is taken off what is wanted: a shaking of 10 Hz keeps 0.6 of its swing."""

SWINGS, SWINGING_RELEASE = 0.2, 10.0
"""Share by which what is wanted has gone back and forth of late, and times the usual time constant with which the
grip is then let down: the next peak comes, and fingers that pump work an object out of a grip that holds it."""

Forces = tuple[float, ...]
"""One per finger [N]."""


class SlipSafeGrip:
    """From what the fingers feel to the force with which they press. Part of a controller; a pure step function.

    Attributes:
        live: What may be changed while it runs: `margin` and `least_grip`; the loop moves them on.
        belief: What the contacts are taken to bear, with what it has learnt.
        watch: Who tells when a contact begins to slip.
        hearing: Who hears that a load falls; None: nobody.
        targets: Grip that is wanted of each finger [N].
        faulty: Whether a finger feels nothing, or nothing to be believed.
        regrips: How often a slip raised the grip.
        alarms: Slips heard since the start.
    """

    def __init__(
        self,
        fingers: int,
        belief: SurfaceBelief,
        period: float,
        parameters: GripParameters | None = None,
        watch: SlipWatch | None = None,
        plan: GripPlan | None = None,
        hearing: SlipHearing | None = None,
        *,
        zeros: Zeros | None = None,
        announcer: Announcer | None = None,
        preload: Preload | None = None,
    ) -> None:
        """Take the pieces.

        Args:
            fingers: How many there are, 2 or more.
            belief: What the contacts bear; it is taught here.
            period: Of control [s].
            parameters: How; safe defaults if not given.
            watch: Tells when a contact begins to slip; nobody if not given.
            plan: From what is felt to what each finger is to press with, by that belief; one grip for all if not
                given.
            hearing: Hears a load that falls, and bounds that belief by what slips; nobody if not given.
            zeros: Of the fingers' sensors; whoever gives the observations has them take each period first. They do
                not wander if not given.
            announcer: Who knows of loads before they act; nobody if not given.
            preload: For steps that nobody announces; none if not given.
        """
        if fingers < _TOO_FEW:
            raise InvalidValueError(f"fingers = {fingers!r}: must be {_TOO_FEW} or more")
        self.parameters = parameters = parameters or GripParameters()
        self.live = live_grip(parameters)
        self.belief, self.watch = belief, watch or NoSlipWatch()
        self.hearing, self._zeros = hearing, zeros or SteadyZeros()
        self._announcer, self._preload = announcer or NothingAnnounced(), preload or Preload()
        self._falls, self._rises = RecentSwing(period), RecentSwing(period)
        self._smooth = -math.expm1(-period / SMOOTH)
        self._foresight = Foresight(parameters.lead, parameters.grip_rate)
        self._plan = plan or CommonGrip(fingers, belief, period, parameters)
        self._fingers, self._period = fingers, period
        self._nothing = (0.0,) * fingers
        self.start(parameters.least_grip)

    @property
    def target(self) -> float:
        """Grip that is wanted, mean over the fingers [N]."""
        return _mean(self.targets)

    @property
    def needed(self) -> float:
        """Least grip of the present load by what is believed, without margin, mean over the fingers [N].

        While a finger is faulty, that of the last load that all of them felt; 0 before the first.
        """
        return _mean(self._plan.needed)

    def pressed(self, now: Observation) -> float:
        """Return the grip that is felt [N], by the finger that presses least of its part of what is needed."""
        needed = self.needed
        parts = zip(now.fingers, self._plan.needed, strict=True)
        felt = [(finger.contact.normal_force, need) for finger, need in parts if need > 0.0]
        if not felt:
            return min(finger.contact.normal_force for finger in now.fingers)
        return min(force if need == needed else force * needed / need for force, need in felt)

    def start(self, grip: float) -> None:
        """Begin a new grip, of which nothing is known yet, with one that has been commanded so far [N]."""
        self.live.restart()
        self.belief.start()
        self.watch.start()
        if self.hearing is not None:
            self.hearing.start()
        self._plan.start()
        for way in (self._falls, self._rises):
            way.start()
        self._smoothed = 0.0
        self._foresight.start()
        self.regrips = 0
        self.alarms: tuple[SlipAlarm, ...] = ()
        nothing = self._correction = (0.0,) * self._fingers
        self.targets: Forces = (grip,) * self._fingers
        self.faulty = False
        self._safe = self._moved = self._before_squeeze = self.targets
        self._commanded = nothing
        self._unsqueezed: Forces | None = None
        self._release, self._release_time = self.parameters.release_rate, self.parameters.release_time
        self._floor, self._floor_until = nothing, -math.inf
        self._regripped_at = self._squeezed = -math.inf

    @property
    def overloaded(self) -> bool:
        """Whether the present load takes more than the grip may be, by what is believed."""
        return max(self._plan.needed) > self.parameters.largest_grip

    def expect(self, load: ExpectedLoad) -> None:
        """Be told of a load before it acts."""
        self._foresight.expect((load,))

    def step(self, now: Observation, at_least: float = 0.0, *, hanging: bool = True) -> Forces:
        """Return with which force each finger is to press during the next period [N].

        Args:
            now: What is known.
            at_least: Least grip, whatever the load [N].
            hanging: Whether nothing but the fingers bears the object: only then a load that falls means slip.

        Raises:
            InvalidValueError: Another number of fingers than the grip has.
        """
        if len(now.fingers) != self._fingers:
            raise InvalidValueError(
                f"the observation has {len(now.fingers)} fingers: the grip has {self._fingers}"
            )
        p, margin = self.parameters, self.live.value("margin")
        loads = tuple([_load_of(finger) for finger in now.fingers])
        missing, stopping, heard = self._hear(now, loads, hanging=hanging)
        onset, ongoing = self._listen(now.time, loads, heard)
        planned = self._plan.wanted(now, loads, margin, missing * (1.0 + self._zeros.hidden))
        most = self._smoothed = self._smoothed + self._smooth * (_mean(planned) - self._smoothed)
        self._falls.step(most)
        self._rises.step(-most)
        wanted = tuple([force * stopping + self._reserve(i, margin) for i, force in enumerate(planned)])
        wanted = _larger(wanted, self._foreseen(now.time, margin))
        self.faulty = None in loads
        if self.faulty:  # from the last safe grip: a contact that comes and goes must not raise it again and again
            raised = tuple(force * (1.0 + p.fault_raise) for force in self._safe)
            self._hold(now.time, now.time, _larger(self.targets, raised))
        self._squeeze(now.time)
        refuted_at = -math.inf if self.hearing is None else self.hearing.refuted_at
        refuted = now.time < refuted_at + p.regrip_time
        fell, rose = self._falls.size, self._rises.size
        swings = not refuted and min(fell, rose) > SWINGS * max(fell, rose, most)
        self._release = p.release_rate * (REFUTED_RELEASE if refuted else 1.0)
        self._release_time = p.release_time * (SWINGING_RELEASE if swings else 1.0)
        # what a detector says of a finger that feels nothing is old
        slips = onset or (ongoing and not self.faulty)
        if slips and now.time >= self._regripped_at + REGRIP_INTERVAL:
            self._regripped_at, self.regrips = now.time, self.regrips + 1
            held = _larger(self.targets, self._plan.needed)
            self._hold(now.time, now.time + p.regrip_time, tuple(force * (1.0 + p.regrip) for force in held))
        least = max(at_least, self.live.value("least_grip"))
        wanted = tuple([max(force, least) for force in wanted])
        if not self.faulty:
            self._safe = self._towards(wanted, self._safe)
        kept = _larger(wanted, self._floor) if now.time <= self._floor_until else wanted
        self._moved = self._towards(kept, self._moved)
        self.targets = self._plan.completed(self._moved)
        self._correct(loads, squeezed=now.time <= self._squeezed + REGRIP_INTERVAL)
        commanded = self._command()
        if self._squeezed < now.time:
            self._commanded = commanded
        return commanded

    def _squeeze(self, time: float) -> None:
        """Press more than was commanded before, while the hearing wants it; afterwards as before."""
        more = None if self.hearing is None else self.hearing.squeeze
        if more is None:
            self._moved, self._unsqueezed = self._unsqueezed or self._moved, None
            self._before_squeeze = tuple([a - b for a, b in zip(self._commanded, self._correction, strict=True)])
            return
        self._unsqueezed = self._unsqueezed or self._moved
        self._hold(time, time, tuple(a + b for a, b in zip(self._before_squeeze, more, strict=True)))
        self._squeezed = time

    def _listen(self, time: float, loads: Loads, heard: Sequence[bool]) -> tuple[bool, bool]:
        """Update the watch and limit surfaces; return whether it tells of a slip that begins, or goes on."""
        onsets = self.watch.step(time, loads)
        if any(onsets):
            self._record(time, loads, onsets, Signal.RIPPLE)
        ongoing = self.watch.slipping
        either = tuple([a or b for a, b in zip(onsets, heard, strict=True)])
        # a load under which something goes on slipping was not held
        slips = ongoing or (self.hearing is not None and self.hearing.slipping)
        self.belief.watch(time, (None,) * len(loads) if slips and not any(either) else loads, either)
        return any(onsets), ongoing

    def _reserve(self, finger: int, margin: float) -> float:
        """Grip beyond what the load needs [N]: for noise or a wandering zero, whichever is more, and for steps."""
        p, surface = self.parameters, self.belief.surface(finger)
        step = self._preload.grip(surface, self._fingers, margin, p.lead, p.grip_rate)
        return max(p.reserve, self._zeros.reserve(surface)) + step

    def _foreseen(self, time: float, margin: float) -> Forces:
        """Least grip for what is expected [N]."""
        self._foresight.expect(self._announcer.announced(time))
        if not self._foresight.expects:
            return self._nothing
        surfaces = [self.belief.surface(i) for i in range(self._fingers)]
        return self._foresight.least(time, self._plan.needed, surfaces, margin, self._moved)

    def _hear(self, now: Observation, loads: Loads, *, hanging: bool) -> tuple[float, float, Sequence[bool]]:
        """What hangs over what is felt of it, by how much more grip what slides stops, and where that begins."""
        if self.hearing is None:
            return 1.0, 1.0, (False,) * len(loads)
        onsets = self.hearing.step(now, loads, hanging=hanging)
        if any(onsets):
            self._record(now.time, loads, onsets, self.hearing.signal)
            self.regrips += 1
        stopping = 1.0 + self.parameters.regrip if self.hearing.slipping else 1.0
        return self.hearing.missing, stopping, onsets

    def _record(self, time: float, loads: Loads, onsets: Sequence[bool], signal: Signal) -> None:
        for finger, (load, onset) in enumerate(zip(loads, onsets, strict=True)):
            if onset and load is not None:
                kind = kind_of_slip(self.belief.surface(finger), load)
                self.alarms += (SlipAlarm(time, finger, kind, signal),)

    def _towards(self, wanted: Forces, before: Forces) -> Forces:
        """The grip of the next period [N]: towards the target, quickly upwards and slowly downwards."""
        p, dt = self.parameters, self._period
        largest, rise, release, time = p.largest_grip, p.grip_rate * dt, self._release, self._release_time
        moved = []
        for most, at in zip(wanted, before, strict=True):
            aim = most if most < largest else largest
            if aim >= at:
                moved.append(min(aim, at + rise))
            else:
                moved.append(at - min(release, (at - aim) / time) * dt)
        return tuple(moved)

    def _command(self) -> Forces:
        """What is wanted and corrected; where it has fallen but a bit, what was commanded before."""
        p, least = self.parameters, 0.5 * self.live.value("least_grip")
        out = []
        for target, more, before in zip(self.targets, self._correction, self._commanded, strict=True):
            command = max(target + more, least)
            out.append(min(max(command, min(before, command + p.play)), p.largest_grip))
        return tuple(out)

    def _hold(self, time: float, until: float, grip: Forces) -> None:
        """Keep at least this grip until then, and what was to be kept before."""
        self._floor = _larger(self._floor, grip) if time <= self._floor_until else grip
        self._floor_until = max(until, self._floor_until)

    def _correct(self, loads: Loads, *, squeezed: bool) -> None:
        """Move the command by what the fingers feel too little or too much; a squeeze is no error."""
        p, felt = self.parameters, tuple([load.normal_force for load in loads if load is not None])
        if len(felt) < len(loads):
            return
        share = self._period / p.correction_time
        missing = self._plan.missing(self._before_squeeze if squeezed else self.targets, felt)
        if self._zeros.resting:  # what changes are the zeros, as far as they may have wandered
            missing = tuple([lack - self._zeros.reserve(self.belief.surface(i)) for i, lack in enumerate(missing)])
        if squeezed or self._zeros.resting:
            missing = tuple([max(lack, 0.0) for lack in missing])
        moved = []
        for correction, lack, target in zip(self._correction, missing, self.targets, strict=True):
            least, most = -p.correction_down * target, p.correction_share * target
            moved.append(min(max(correction + share * lack, least), most))
        self._correction = tuple(moved)


def _load_of(finger: FingerObservation) -> ContactLoad | None:
    """Load of a finger; None if its reading is not valid."""
    return ContactLoad.of(finger.contact) if finger.believed else None


def _larger(first: Forces, second: Forces) -> Forces:
    return tuple([max(a, b) for a, b in zip(first, second, strict=True)])


def _mean(values: Forces) -> float:
    """Their mean; of equal ones, that very one."""
    return values[0] if min(values) == max(values) else sum(values) / len(values)
