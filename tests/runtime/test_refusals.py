"""Bad input is refused where it enters, with a message that names the value, the limit and the remedy."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from palpate.errors import InvalidValueError
from palpate.runtime.batch import run_batch
from palpate.runtime.data import WrenchSample
from palpate.runtime.live import Change, LiveParameter, LiveParameters, ScheduledChanges
from palpate.runtime.log import Layout, LogWriter, MemoryLog, Recorder
from palpate.runtime.log.layout import MOST
from palpate.runtime.log.standard.cloud import Cloud
from palpate.runtime.loop import run
from palpate.runtime.real_time import RealTime
from palpate.runtime.replay import ReplayBackend, replay
from palpate.runtime.replay_extent import extent_of
from palpate.runtime.supervision import Hold, Limits, Retract
from palpate.runtime.touch import Finger, Touch
from palpate.sensing.compensation import SensorPayload
from palpate.surfaces import Sphere
from runtime.log.log_examples import ONE_FINGER, PERIOD, a_run
from runtime.puppets import PuppetBackend, PuppetController, sample, touch
from runtime.test_replay import LOG, Feeler

NO_NUMBER = (0.0, -1.0, math.nan, math.inf)
FORCE = LiveParameter("force", 2.0, 0.3, 15.0, 5.0, "N", "normal force to hold")
S, NOW, *_ = a_run(1, ONE_FINGER)[0]
EMPTY = MemoryLog()


def live(*more):
    return LiveParameters(FORCE, *more)


def stopped():
    pacer = RealTime(PERIOD)
    pacer.start()
    pacer.stop()
    return pacer


def begun(sample=S, period=PERIOD, times=1, closed=False):
    """A recorder that has been started, so often."""
    recorder = Recorder(MemoryLog())
    for _ in range(times):
        recorder.start(sample, NOW, period)
        if closed:
            recorder.close()
    return recorder


def recorded(fingers):
    memory = MemoryLog()
    now = touch(fingers)
    made = sample(wrenches=((0.0, 0.0, 1.0, 0.0, 0.0, 0.0),) * fingers)
    Recorder(memory).start(made, now.sense(made), PERIOD)
    return memory


def without_beginning(kept):
    return replace(LOG, sequence=LOG.sequence[kept], rows=LOG.rows[kept])


def wrench(channels):
    return {"wrenches": (WrenchSample(0.0, (0.0,) * channels, (0.0, 0.0, 0.0)),)}


LIMITED = ("force", "moment", "spin_torque", "grip_force", "speed", "acceleration", "sample_age", "angular_speed",
           "angular_acceleration")  # fmt: skip
REFUSED = {
    **{
        f"limit: {name} = {bad}": (lambda name=name, bad=bad: Limits(**{name: bad}), f"^{name}_[^ ]+ = ")
        for name in LIMITED
        for bad in NO_NUMBER
    },
    **{
        f"limit: workspace up to {upper}": (
            lambda upper=upper: Limits(workspace_upper=(1.0, upper, 1.0)),
            r"workspace_(lower_m, y|upper_m = nan)",
        )
        for upper in (-1.0, -2.0, math.nan)
    },
    **{
        f"limit: joint up to {upper}": (
            lambda upper=upper: Limits(joint_lower=(-1.0, -1.0), joint_upper=(1.0, upper)),
            r"joint_(lower_rad, joint 2|upper_rad = nan)",
        )
        for upper in (-1.0, -2.0, math.nan)
    },
    "limit: joints of two arms": (
        lambda: Limits(joint_lower=(-1.0,), joint_upper=(1.0, 2.0)),
        "joint_lower_rad has 1 numbers and joint_upper_rad 2",
    ),
    "reaction: retract by nothing": (lambda: Retract(-1.0), "-1"),
    "reaction: retract without speed": (lambda: Retract(1.0, 0.0), "0"),
    "reaction: retract at more than the fastest": (lambda: Retract(1.0, 0.02, fastest=0.01), "0.01"),
    "reaction: hold for less than nothing": (lambda: Hold(-1.0), "-1"),
    "pace: period 0": (lambda: RealTime(0.0), "period = 0"),
    "pace: period NaN": (lambda: RealTime(math.nan), "period = nan"),
    "pace: spin below 0": (lambda: RealTime(1e-3, spin=-1e-4), "spin"),
    "pace: spin of a period": (lambda: RealTime(1e-3, spin=1e-3), "shorter than the period"),
    "pace: priority 0": (lambda: RealTime(1e-3, priority=0), "from 1 to 99"),
    "pace: priority 100": (lambda: RealTime(1e-3, priority=100), "from 1 to 99"),
    "pace: unknown overrun": (lambda: RealTime(1e-3, overrun="wait"), "skip, catch up, stop"),
    "pace: before start": (lambda: RealTime(PERIOD).wait(), r"call start\(\) first"),
    "pace: after stop": (lambda: stopped().wait(), r"call start\(\) first"),
    **{
        f"run: for {bad} s": (
            lambda bad=bad: run(PuppetBackend(), touch(), PuppetController(), duration=bad),
            "duration",
        )
        for bad in (0.0, -1.0, math.nan, math.inf)
    },
    "live: nearly a name": (lambda: live().request("forze", 2.0), "'forze'; did you mean force"),
    "live: no name": (lambda: live(replace(FORCE, name="speed")).request("xyz", 2.0), "known are force, speed"),
    "live: nothing there": (lambda: LiveParameters().request("force", 2.0), "no live parameters"),
    "live: one name twice": (lambda: live(FORCE), "once only"),
    "live: out of its bounds": (lambda: replace(FORCE, lower=3.0), "force"),
    "live: bounds upside down": (lambda: replace(FORCE, lower=4.0, upper=3.0), "force"),
    "live: no bound": (lambda: replace(FORCE, upper=math.inf), "force"),
    "live: no rate": (lambda: replace(FORCE, rate=0.0), "force"),
    **{
        f"live: scheduled {name} = {value} at {at}": (
            lambda at=at, name=name, value=value: ScheduledChanges(live(), [Change(at, name, value)]),
            "force",
        )
        for at, name, value in ((1.0, "forse", 3.0), (1.0, "force", 300.0), (math.nan, "force", 3.0))
    },
    **{
        f"replay: recorded {name} = {value}": (
            lambda name=name, value=value: replay(
                LOG.samples(), PERIOD, touch(2), Feeler(), changes=[Change(0.5, name, value)]
            ),
            r"recorded at t = 0\.500 s",
        )
        for name, value in (("gian", 1e-3), ("gain", 1.0))
    },
    "replay: no samples": (lambda: ReplayBackend([], PERIOD), "no samples"),
    "replay: beginning lost": (lambda: extent_of(without_beginning(np.r_[5:20])), "its beginning is missing"),
    "replay: nothing left": (lambda: extent_of(without_beginning(np.r_[0:0])), "it has no periods"),
    "touch: no finger": (lambda: Touch(), "no finger"),
    "touch: wrenches and fingers": (lambda: touch(2).sense(sample()), "1 wrenches: there are 2 fingers"),
    "touch: ends above its beginning": (
        lambda: Finger(Sphere(0.01), touch_force=0.1, release_force=0.2),
        "release_force",
    ),
    **{
        f"payload: mass {mass}": (lambda mass=mass: SensorPayload(mass), "mass")
        for mass in (-0.1, math.nan, math.inf)
    },
    "log: time is NaN": (lambda: begun(replace(S, time=math.nan)), "must be finite"),
    "log: no fingers": (lambda: begun(replace(S, wrenches=())), "fingers"),
    "log: no channels": (lambda: begun(replace(S, **wrench(0))), "1 channel or more"),
    "log: too many channels": (lambda: begun(replace(S, **wrench(MOST + 1))), f"at most {MOST}"),
    **{f"log: period {bad}": (lambda bad=bad: begun(period=bad), "period") for bad in NO_NUMBER},
    "log: started twice": (lambda: begun(times=2), "make a new one for each run"),
    "log: started again": (lambda: begun(times=2, closed=True), "make a new one for each run"),
    "log: palpate's own attachment": (
        lambda: LogWriter(Path("a.mcap"), {"palpate_log.json": ""}),
        "is palpate's own",
    ),
    "log: large attachment": (lambda: LogWriter(Path("a.mcap"), {"a": "x" * (2**24 + 1)}), "at most 16777216"),
    "log: cloud of other length": (lambda: Cloud(np.zeros((2, 3)), {"band": np.zeros(3)}), "one for each point"),
    "log: finger velocities below 0": (lambda: Layout(7, 4, (6, 6), 4, -1), "-1"),
    "log: no such finger": (lambda: recorded(2).record(finger=2), "finger = 2: must be from 0 to 1"),
    **{
        f"batch: {bad!r} processes": (lambda bad=bad: run_batch(abs, [1], bad), r"processes = .*1 or above")
        for bad in (0, -1, 1.5, True, "2")
    },
}
"""What is called, and what its refusal says."""


@pytest.mark.parametrize(("call", "message"), REFUSED.values(), ids=REFUSED)
def test_bad_input_is_refused_with_its_reason(call, message):
    with pytest.raises(InvalidValueError, match=message):
        call()
