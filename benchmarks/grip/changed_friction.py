"""Simulated grasp whose friction changes or differs from the estimate, judged by the simulation's truth.

The experiment's own plan, controller and touch grip and lift the object; a light load pulls beside the line of the
contacts. Once the grasp is steady, mu of some contacts falls to a share of its value. With MuJoCo's friction, slip
and spin are motions of the object over each fingertip; with the friction plant, the distance that each contact
slipped. Slip begins when a contact has moved by `ONSET_SLIP` or `ONSET_SPIN` from its position at the start of the
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
from palpate.experiments.grasp.metrics import SLIP_LIMIT, SPIN_LIMIT
from palpate.experiments.grasp.plan import GraspPlan
from palpate.experiments.grasp.truth import GraspTruth, GraspTruthRecorder
from palpate.runtime.touch import Touch
from palpate.sim.friction.bristle import KINETIC, STATIC
from palpate.sim.hand.backend import HandBackend
from palpate.sim.hand.hand import finger_name
from palpate.sim.tip import TIP_GEOM

ONSET_SLIP, ONSET_SPIN = 5e-6, math.radians(0.05)
"""[m], [rad] More than the elastic motion of a contact when its load is redistributed."""

RISE, SETTLED = 0.4, 0.1
"""[s] Rise time of the pull, and time from then to the change of friction."""

DROPPED = 0.01
"""Slip of an object that counts as dropped [m]."""


@dataclass(frozen=True, slots=True)
class FrictionChange:
    """Change of mu.

    Attributes:
        left: Share of mu that remains at the end; 1: no change.
        duration: Duration of the change [s].
        fingers: Fingers whose contacts change; all if empty.
    """

    left: float = 1.0
    duration: float = 0.02
    fingers: tuple[int, ...] = ()


@dataclass(frozen=True, slots=True)
class Held:
    """Result of one hold.

    Attributes:
        dropped: Whether the object was lost.
        slip: Slip since the change, or since the lift if nothing changed [m].
        spin: Spin since the change, or since the lift if nothing changed [rad].
        latency: Time from the first slip to the first alarm [s]; infinite without an alarm, NaN without a slip
            that an experiment counts.
        grip: Mean finger force before the change [N].
        after: Mean finger force of the last 0.1 s [N].
        alarms: Number of alarms.
        early: Number of alarms before the change.
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
    """Return a grasp with object, weight, friction, pull and its lever arm drawn at random."""
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
        """Set friction for the time since the change began [s]."""
        share = min(max(gone / self.change.duration, 0.0), 1.0)
        now = self.first[self.at] * (1.0 - share * (1.0 - self.change.left))
        plant = self.backend._plant
        if plant is None:
            self.rows[self.at] = now
        else:
            for i, mu in zip(self.at, now.tolist(), strict=True):
                plant._served.laws[i, [STATIC, KINETIC]] = mu


class Run:
    """Run of a plan in pieces, with the plan's own controller unless another is given."""

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
        """Truth recorded so far."""
        return self._kept.truth()

    def until(self, end: float, change: FrictionChange | None = None) -> None:
        """Continue until this time [s]; friction changes once the grasp is steady."""
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
        """Continue for this long after the change [s]; judge from the change on, or from the lift without one."""
        begins, since = self.changes, 0.0 if change is None else self.changes
        self.until(begins + seconds, change)
        truth, time, alarms = self.truth, self.truth.time, [each.time for each in self.controller.grip.alarms]
        first = int(np.searchsorted(time, since))
        slid, turned = truth.slid[first:] - truth.slid[first], truth.turned[first:] - truth.turned[first]
        if self._planned.config.plant:
            slid, turned = np.abs(slid), np.abs(turned)
        slip, spin, latency = float(np.abs(slid).max()), float(np.abs(turned).max()), math.nan
        if slip > SLIP_LIMIT or spin > SPIN_LIMIT:
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
        """Continue with each of several changes from the same instant, each in a fork of this process."""
        self.until(self.changes)
        return [_forked(partial(self.held, change, seconds)) for change in changes]


def _forked(work: Callable[[], Held]) -> Held:
    receives, sends = os.pipe()
    if child := os.fork():
        os.close(sends)
        with os.fdopen(receives, "rb") as pipe:
            sent = pipe.read()
        os.waitpid(child, 0)
        found = pickle.loads(sent)  # of our own fork
        assert isinstance(found, Held)
        return found
    with os.fdopen(sends, "wb") as pipe:
        pickle.dump(work(), pipe)
    os._exit(0)
