"""What a grip comes to while zeros wander, and what steps of the load do to it: by the simulation's truth.

    python benchmarks/grip_over_time.py long   [--seeds 40] [--seconds 600]   ten minutes at the default drift
    python benchmarks/grip_over_time.py fast   [--seeds 40]                   0.1 N/s for 10 s
    python benchmarks/grip_over_time.py steps  [--seeds 40]                   2.5 N within 5 ms

`--first` begins at another seed, `--known`, `--fingers` and `--object` hold otherwise, `--steady` takes zeros for
steady as a grip does that knows of no drift: what comes of it without. Slip and spin are of the object over each
fingertip since the hold began, or since the step.
"""

import argparse
import math
from dataclasses import dataclass, replace

import numpy as np

from palpate.experiments.grasp.config import GraspConfig
from palpate.experiments.grasp.plan import GraspPlan, plan
from palpate.experiments.grasp.wandering import wander_of
from palpate.robots.hand_description import simulated_hand
from palpate.runtime.touch import Touch

STEP = {"load": "step", "rise": 0.005, "pull_before": 0.5, "pull": 3.0}
DROPPED = 0.01
"""[m] Of slip."""


@dataclass(frozen=True, slots=True)
class Kept:
    """What came of one grip.

    Attributes:
        dropped: Whether the object was lost.
        slip: [m]
        spin: [rad]
        first: Mean grip of the first half second that counts [N].
        last: Of the last [N].
        most: Largest [N].
        unseen: For how long nobody followed the zeros [s].
    """

    dropped: bool
    slip: float
    spin: float
    first: float
    last: float
    most: float
    unseen: float


def keep(planned: GraspPlan, since: float, end: float, *, every: int = 1, steady: bool = False) -> Kept:
    """Grip, lift and hold, from when it counts to the end [s]; the truth is looked at every so many periods."""
    backend = planned.backend()
    controller, touch = planned.controller(), Touch(*planned.fingers)
    if steady:
        still = replace(planned, config=replace(planned.config, drift=0.0))
        controller = still.controller()
    kept = planned.observer(controller, backend)  # type: ignore[arg-type]
    sample = backend.start()
    now = touch.sense(sample)
    controller.start(now)
    while now.time < end:
        command = controller.step(now)
        if round(now.time / planned.period) % every == 0:
            kept(sample, now, command)
        sample = backend.step(command)
        now = touch.sense(sample)
    truth = kept.truth()
    at = int(np.searchsorted(truth.time, since))
    slip = float(np.abs(truth.slid[at:] - truth.slid[at]).max())
    spin = float(np.abs(truth.turned[at:] - truth.turned[at]).max())
    grip = truth.loads[at:, :, 0].mean(axis=1)
    half = round(0.5 / planned.period / every)
    lost = int(truth.touching[-1].sum()) < 2 or slip > DROPPED
    return Kept(
        lost,
        slip,
        spin,
        float(grip[:half].mean()),
        float(grip[-half:].mean()),
        float(grip.max()),
        getattr(controller.zeros, "unseen", 0.0),
    )


def _line(name: object, came: Kept) -> str:
    return (
        f"{name}: {'DROPPED' if came.dropped else 'held'}, slip {1e3 * came.slip:.4f} mm, "
        f"spin {math.degrees(came.spin):.3f} deg, grip {came.first:.3f} -> {came.last:.3f} N "
        f"(x {came.last / came.first:.2f}), most {came.most:.2f} N, zeros not followed for {came.unseen:.1f} s"
    )


def _summary(name: str, all_of_them: list[Kept]) -> None:
    slips, spins = [1e3 * each.slip for each in all_of_them], [math.degrees(each.spin) for each in all_of_them]
    growth = [each.last / each.first for each in all_of_them]
    print(
        f"{name}: {len(all_of_them)} runs, dropped {sum(each.dropped for each in all_of_them)}, "
        f"slip median {np.median(slips):.4f}, worst {max(slips):.4f} mm, spin {np.median(spins):.3f}, "
        f"{max(spins):.3f} degrees; grip {np.mean([each.first for each in all_of_them]):.3f} N at first, "
        f"then x {np.median(growth):.2f} (median), {min(growth):.2f} to {max(growth):.2f}; "
        f"most {max(each.most for each in all_of_them):.1f} N",
        flush=True,
    )


def main() -> None:
    """Run what was asked for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=("long", "fast", "steps"))
    parser.add_argument("--seeds", type=int, default=40)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--seconds", type=float, default=600.0)
    parser.add_argument("--known", default="touched")
    parser.add_argument("--fingers", type=int, default=2)
    parser.add_argument("--object", default="box")
    parser.add_argument("--plant", action="store_true")
    parser.add_argument("--steady", action="store_true")
    asked = parser.parse_args()
    more = {"known": asked.known, "fingers": asked.fingers, "object": asked.object, "plant": asked.plant}
    seeds = range(asked.first, asked.first + asked.seeds)
    if asked.what == "steps":
        kinds: dict[str, dict[str, float]] = {
            "unannounced": {},
            "15 ms before": {"announced": 0.015},
            "preload": {"preload": 2.5},
        }
        for name, option in kinds.items():
            came = []
            for seed in seeds:
                planned = plan(GraspConfig(seed=seed, **STEP, **option, **more), None, {})  # type: ignore[arg-type]
                came.append(keep(planned, planned.times.grows - 0.1, planned.times.end))
            _summary(name, came)
        return
    seconds, drift = (asked.seconds, 1e-3) if asked.what == "long" else (10.0, 0.1)
    came = []
    for seed in seeds:
        config = GraspConfig(seed=seed, load="none", rise=seconds, drift=drift, **more)  # type: ignore[arg-type]
        planned = plan(config, None, {})
        begin = planned.times.begin
        every = 1 if asked.plant else 10  # the plant's slip is a sum over periods
        came.append(keep(planned, begin, begin + seconds, every=every, steady=asked.steady))
        print(_line(seed, came[-1]), flush=True)
    wander = wander_of(config, simulated_hand(asked.fingers))
    _summary(f"{wander.force:g} N/s and {wander.moment:g} N m/s for {seconds:g} s", came)


if __name__ == "__main__":
    main()
