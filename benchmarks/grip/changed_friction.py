"""One object held while its friction changes, or is another one than believed, and what came of it by the truth.

The object is gripped and lifted by the experiment's own plan, controller and touch; something pulls lightly beside
the line of the contacts. Long after all of that is steady, mu of some contacts goes over to a share of itself.
With MuJoCo's friction slip and spin are of the object over each fingertip; with the friction plant, the way along
which contacts slipped. Onset is when a contact has moved by `ONSET` beyond where it was when friction began to
change: MuJoCo's contacts creep by less in that time.
"""

import math
from dataclasses import dataclass, field

import numpy as np

from palpate.controllers.grip.grasp import GraspController
from palpate.experiments.grasp.config import GraspConfig, Knowledge
from palpate.experiments.grasp.plan import GraspPlan, plan
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
        latency: From the first slip to the first alarm [s]; NaN: no slip, infinite: no alarm.
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


def hold(config: GraspConfig, change: FrictionChange | None = None, seconds: float = 0.38) -> Held:
    """Grip, lift, hold, change friction, and hold on.

    Args:
        config: What is held, and what is believed of it.
        change: Of friction, long after the lift; None: nothing, and all counts from the lift on.
        seconds: From the change to the end; the pull goes away 0.4 s after the change.
    """
    planned = plan(config, None, {})
    return held(planned, change, seconds)


def held(
    planned: GraspPlan,
    change: FrictionChange | None,
    seconds: float,
    controller: GraspController | None = None,
) -> Held:
    """Carry out a plan until so long after the change [s], with its own controller if no other is given."""
    begins = planned.times.grows + planned.config.rising + SETTLED
    truth, controller = carried_out(planned, begins + seconds, change, controller)
    time = truth.time
    changed = int(np.searchsorted(time, begins)) if change is not None else 0
    slid, turned = truth.slid[changed:] - truth.slid[changed], truth.turned[changed:] - truth.turned[changed]
    if planned.config.plant:
        slid, turned = np.abs(slid), np.abs(turned)
    moved = (np.abs(slid) > ONSET_SLIP) | (np.abs(turned) > ONSET_SPIN)
    alarms = [each.time for each in controller.grip.alarms]
    latency = math.nan
    if moved.any():
        began = float(time[changed + int(moved.any(axis=1).argmax())])
        after = [each for each in alarms if each >= (begins if change is not None else 0.0)]
        latency = max(min(after, default=math.inf) - began, 0.0)
    slip = float(np.abs(slid).max())
    lost = not bool((truth.touching[changed:].sum(axis=1) >= 2)[-1]) or truth.clearance[-1] <= 0.0
    grips = truth.loads[:, :, 0].mean(axis=1)
    before = (time > begins - 0.1) & (time <= begins)
    return Held(
        lost or slip > DROPPED,
        slip,
        float(np.abs(turned).max()),
        latency,
        float(grips[before].mean()),
        float(grips[-100:].mean()),
        len(alarms),
        sum(each < begins for each in alarms),
    )


def carried_out(
    planned: GraspPlan,
    end: float,
    change: FrictionChange | None = None,
    controller: GraspController | None = None,
    every: int = 1,
) -> tuple[GraspTruth, GraspController]:
    """Carry out a plan until then [s]; return the truth of every so many periods, and who controlled."""
    backend = planned.backend()
    assert isinstance(backend, HandBackend)
    controller, touch = controller or planned.controller(), Touch(*planned.fingers)
    kept = planned.observer(controller, backend)
    assert isinstance(kept, GraspTruthRecorder)
    begins = planned.times.grows + planned.config.rising + SETTLED
    friction = _Friction(backend, change or FrictionChange())
    sample = backend.start()
    now = touch.sense(sample)
    controller.start(now)
    while now.time < end:
        command = controller.step(now)
        if round(now.time / planned.period) % every == 0:
            kept(sample, now, command)
        if change is not None:
            friction.set(now.time - begins)
        sample = backend.step(command)
        now = touch.sense(sample)
    return kept.truth(), controller
