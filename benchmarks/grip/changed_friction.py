"""One object held while its friction changes, or is another one than believed, and what came of it by the truth.

The object is gripped and lifted by the experiment's own plan, controller and touch; something pulls lightly beside
the line of the contacts. Long after all of that is steady, mu of some contacts goes over to a share of itself.
With MuJoCo's friction slip and spin are of the object over each fingertip; with the friction plant, the way along
which contacts slipped. Onset is when a contact has moved by `ONSET` beyond where it was when friction began to
change: MuJoCo's contacts creep by less in that time.
"""

import math
import os
import pickle
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from functools import partial

import numpy as np

from palpate.controllers.grip.grasp import GraspController
from palpate.experiments.grasp.config import GraspConfig, Knowledge
from palpate.experiments.grasp.plan import GraspPlan
from palpate.experiments.grasp.result import SLIPPED, SPUN
from palpate.experiments.grasp.truth import GraspTruth, GraspTruthRecorder
from palpate.runtime.touch import Touch
from palpate.sim.friction.bristle import KINETIC, STATIC
from palpate.sim.hand.backend import HandBackend
from palpate.sim.hand.hand import finger_name
from palpate.sim.tip import TIP_GEOM

ONSET_SLIP, ONSET_SPIN = 5e-6, math.radians(0.05)
"""[m], [rad] Above what an elastic contact gives way by when its load is shared anew."""

RISE, SETTLED = 0.4, 0.1
"""[s] In which the pull grows, and from there to the change of friction."""

DROPPED = 0.01
"""[m] Of slip."""


@dataclass(frozen=True, slots=True)
class FrictionChange:
    """How mu changes.

    Attributes:
        left: Share of mu that is left in the end; 1: nothing changes.
        duration: In which it goes over [s].
        fingers: Where; all if empty.
    """

    left: float = 1.0
    duration: float = 0.02
    fingers: tuple[int, ...] = ()


@dataclass(frozen=True, slots=True)
class Held:
    """What came of it.

    Attributes:
        dropped: Whether the object was lost.
        slip: Since the change, or since the lift if nothing changed [m].
        spin: Likewise [rad].
        latency: From the first slip to the first alarm [s]; infinite: no alarm; NaN: no slip, or less than
            counts as slip in an experiment.
        grip: Mean of what the fingers press with before the change [N].
        after: Mean of the last 0.1 s [N].
        alarms: How many in all.
        early: Of them, before anything changed.
    """

    dropped: bool
    slip: float
    spin: float
    latency: float
    grip: float
    after: float
    alarms: int
    early: int


def drawn(seed: int, known: Knowledge, fingers: int, **more: object) -> GraspConfig:
    """Return a grasp: object, weight, friction, pull and where it pulls are drawn."""
    draw = np.random.default_rng((seed, 23))
    chosen: dict[str, object] = {
        "known": known,
        "fingers": fingers,
        "object": "box" if fingers == 2 else "cylinder",
        "mass": float(draw.uniform(0.08, 0.25)),
        "friction": float(draw.uniform(0.45, 0.65)),
        "spin_length": float(draw.uniform(0.003, 0.006)),
        "load": "ramp",
        "pull_before": 0.0,
        "pull": float(draw.uniform(0.1, 0.5)),
        "rise": RISE,
        "offset": float(draw.uniform(0.0, 0.006)),
        "seed": seed,
    }
    return GraspConfig(**(chosen | more))  # type: ignore[arg-type]


def believed_too_high(
    seed: int, known: Knowledge, fingers: int, share: float = 0.3, **more: object
) -> GraspConfig:
    """The same, where the truth is that share less than is believed at the middle of what it may be."""
    config = drawn(seed, known, fingers, **more)
    assert config.friction is not None
    return drawn(seed, known, fingers, believed_friction=config.friction / (1.0 - share), **more)


@dataclass(slots=True)
class _Friction:
    """Changes friction of a running simulation."""

    backend: HandBackend
    change: FrictionChange
    rows: np.ndarray = field(init=False)
    first: np.ndarray = field(init=False)
    at: list[int] = field(init=False)

    def __post_init__(self) -> None:
        scene, plant = self.backend.scene, self.backend._plant
        fingers = self.change.fingers or range(scene.hand.fingers)
        if plant is None:
            tips = [scene.model.geom(f"{finger_name(i)}_{TIP_GEOM}").id for i in fingers]
            pairs = np.column_stack([scene.model.pair_geom1, scene.model.pair_geom2])
            self.at = [int(np.flatnonzero((pairs == tip).any(axis=1))[0]) for tip in tips]
        else:
            self.at = list(fingers)
        self.rows = scene.model.pair_friction[:, :3] if plant is None else plant._served.laws[:, [STATIC, KINETIC]]
        self.first = self.rows.copy()

    def set(self, gone: float) -> None:
        """Take what is so long after the change began [s]."""
        share = min(max(gone / self.change.duration, 0.0), 1.0)
        now = self.first[self.at] * (1.0 - share * (1.0 - self.change.left))
        plant = self.backend._plant
        if plant is None:
            self.rows[self.at] = now
        else:
            for i, mu in zip(self.at, now.tolist(), strict=True):
                plant._served.laws[i, [STATIC, KINETIC]] = mu


class Run:
    """A plan that is carried out piece by piece, with its own controller if no other is given."""

    def __init__(self, planned: GraspPlan, controller: GraspController | None = None, every: int = 1) -> None:
        """Begin; the truth of every so many periods is kept."""
        backend = planned.backend()
        assert isinstance(backend, HandBackend)
        self._planned, self._backend, self._every = planned, backend, every
        self.controller, self._touch = controller or planned.controller(), Touch(*planned.fingers)
        kept = planned.observer(self.controller, backend)
        assert isinstance(kept, GraspTruthRecorder)
        self._kept = kept
        self._sample = backend.start()
        self._now = self._touch.sense(self._sample)
        self.controller.start(self._now)
        self.changes = planned.times.grows + planned.config.rising + SETTLED

    @property
    def truth(self) -> GraspTruth:
        """What happened so far."""
        return self._kept.truth()

    def until(self, end: float, change: FrictionChange | None = None) -> None:
        """Go on until then [s]; friction changes long after the lift."""
        friction = None if change is None else _Friction(self._backend, change)
        while self._now.time < end:
            command = self.controller.step(self._now)
            if round(self._now.time / self._planned.period) % self._every == 0:
                self._kept(self._sample, self._now, command)
            if friction is not None:
                friction.set(self._now.time - self.changes)
            self._sample = self._backend.step(command)
            self._now = self._touch.sense(self._sample)

    def held(self, change: FrictionChange | None, seconds: float) -> Held:
        """Go on until so long after the change [s]; all counts from there on, or from the lift without one."""
        begins, since = self.changes, 0.0 if change is None else self.changes
        self.until(begins + seconds, change)
        truth, time, alarms = self.truth, self.truth.time, [each.time for each in self.controller.grip.alarms]
        first = int(np.searchsorted(time, since))
        slid, turned = truth.slid[first:] - truth.slid[first], truth.turned[first:] - truth.turned[first]
        if self._planned.config.plant:
            slid, turned = np.abs(slid), np.abs(turned)
        slip, spin, latency = float(np.abs(slid).max()), float(np.abs(turned).max()), math.nan
        if slip > SLIPPED or spin > SPUN:
            moved = (np.abs(slid) > ONSET_SLIP) | (np.abs(turned) > ONSET_SPIN)
            began = float(time[first + int(moved.any(axis=1).argmax())])
            latency = max(min((each for each in alarms if each >= since), default=math.inf) - began, 0.0)
        lost = int(truth.touching[-1].sum()) < 2 or truth.clearance[-1] <= 0.0
        grips = truth.loads[:, :, 0].mean(axis=1)
        before = (time > begins - 0.1) & (time <= begins)
        return Held(
            lost or slip > DROPPED,
            slip,
            spin,
            latency,
            float(grips[before].mean()),
            float(grips[-100:].mean()),
            len(alarms),
            sum(each < begins for each in alarms),
        )

    def each_held(self, changes: Iterable[FrictionChange | None], seconds: float) -> list[Held]:
        """Go on with each of several changes, from the same instant: in processes that are forks of this one."""
        self.until(self.changes)
        return [_forked(partial(self.held, change, seconds)) for change in changes]


def _forked(work: Callable[[], Held]) -> Held:
    receives, sends = os.pipe()
    if child := os.fork():
        os.close(sends)
        with os.fdopen(receives, "rb") as pipe:
            said = pipe.read()
        os.waitpid(child, 0)
        found = pickle.loads(said)  # of our own fork
        assert isinstance(found, Held)
        return found
    with os.fdopen(sends, "wb") as pipe:
        pickle.dump(work(), pipe)
    os._exit(0)
