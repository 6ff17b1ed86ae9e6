"""The same question on the simulated hand: slip told on touch's own contacts, and what a ripple on the grip gives.

    python benchmarks/slip_hand.py [--quick]

Two fingers hold a box of 0.1 kg (friction plant, MuJoCo, Nano17 class noise, drift, resolution and latency,
contacts by touch) with a grip command that does not change, and something pulls at it, up to 8 mm off the line of
the contacts, until it slips, or up to 80 % of what it bears. "Touched": mu is known within 3 %, e within 5 %.
"Excited": both within 30 %, and a ripple of 0.3 N at 100 Hz is commanded on top of the grip. The last line says
how much of such a ripple the fingertips press with. Few runs: nothing is judged.
"""

import argparse
import itertools
import math
from dataclasses import dataclass

import numpy as np
from grip.holding_run import MASS, PERIOD, Rubs, Surface, scene_with, sensor_of
from rich.console import Console
from rich.progress import track
from rich.table import Table

from palpate.friction.contact_load import ContactLoad
from palpate.friction.slip.excited_slip import ExcitedSlip
from palpate.friction.slip.fingers import SlipDetector
from palpate.friction.slip.grip_dither import GripDither
from palpate.friction.slip.kinds import SlipKind
from palpate.friction.slip.load_noise import LoadNoise
from palpate.friction.slip.margin_crossing import MarginCrossing
from palpate.runtime.data import Command
from palpate.runtime.touch import Finger, Touch
from palpate.sensing.compensation import Payload
from palpate.sim import Lift
from palpate.sim.fidelity import GRAVITY
from palpate.sim.hand.backend import HandBackend
from palpate.sim.hand.load import RampLoad
from palpate.spatial import ZERO, norm

GRIP = 4.0
CLOSED, LIFTED, PULLED = 1.6, 2.0, 2.2
"""[s] When the grip stands, the box is up, and the pull begins."""
RISING = 0.02
"""[m/s] Of the lift."""
ONSET = 1e-6
"""[m] Of slip."""
AFTER = 0.15
"""[s] For which a run goes on once it slips, or the whole pull is there."""


@dataclass(frozen=True, slots=True)
class Run:
    """Latency [s] (inf: not told, NaN: it did not slip), the first kind told, e omega over v of the slip."""

    latency: float
    kind: SlipKind | None
    turning: float
    alarms: int


DITHER = GripDither(frequency=100.0)


def command_at(time: float, dither: GripDither | None) -> Command:
    grip = min(GRIP, 8.0 * time)
    if dither is not None and time >= CLOSED:
        grip += dither.force_at(time, GRIP)
    return Command((0.0, 0.0, RISING if CLOSED <= time < LIFTED else 0.0), grip_force=(grip, grip))


def held_up(seed: int, rise: float, share: float, excited: bool) -> Run:
    """Pull, from nothing to a share of what the grip bears, within `rise` [s]."""
    rng = np.random.default_rng(seed)
    surface = Surface(friction_spread=0.3, spin_spread=0.3) if excited else Surface()
    true = surface.drawn(rng)
    offset = float(rng.uniform(0.0, 0.008))
    # both contacts alike: the force that brings them onto the limit surface, weight included
    bears = 2.0 * true.friction * GRIP / math.hypot(1.0, offset / true.spin_length)
    load = RampLoad(ZERO, (0.0, 0.0, MASS * GRAVITY - share * bears), PULLED, rise, (0.0, offset, 0.0))
    scene = scene_with(true, Rubs.BRISTLES, Lift())
    backend = HandBackend(scene, PERIOD, sensor=sensor_of(seed), load=load)
    tip = scene.hand.tip
    finger = Finger(tip.surface, Payload(tip.mass, tip.center_of_mass))
    touch = Touch(finger, finger)
    dither = DITHER if excited else None
    noise = LoadNoise.of_touch(0.010, 0.1e-3, 0.008)  # that of `sensor_of`, the default fingertip
    detectors: list[SlipDetector] = [
        ExcitedSlip(surface.worst, DITHER, PERIOD, noise)
        if excited
        else MarginCrossing(surface.believed, PERIOD, noise)
        for _ in range(2)
    ]
    now = touch.sense(backend.start())
    onset = told = math.inf
    kind: SlipKind | None = None
    ways = np.zeros((2, 2))
    alarms, before = 0, [False, False]
    while now.time < min(onset, PULLED + rise) + AFTER:
        now = touch.sense(backend.step(command_at(now.time, dither)))
        if now.time < LIFTED + 0.1:
            continue
        for way, contact in zip(ways, backend.rubbing, strict=True):
            way += PERIOD * norm(contact.slip_velocity), PERIOD * true.spin_length * abs(contact.slip_spin)
        if math.isinf(onset) and np.hypot(*ways.T).max() > ONSET:
            onset = now.time
        for i, detector in enumerate(detectors):
            its = detector.step(ContactLoad.of(now.fingers[i].contact))
            if its is not None and math.isinf(told):
                told, kind = now.time, its
            alarms += its is not None and not before[i]
            before[i] = its is not None
    worst = ways[np.hypot(*ways.T).argmax()]
    latency = math.nan if math.isinf(onset) else told - onset
    return Run(latency, kind, float(worst[1] / max(worst[0], 1e-12)), alarms)


def ripple_of(frequency: float) -> float:
    """Amplitude of what a fingertip presses with [N], of a ripple of 0.3 N that is commanded."""
    dither = GripDither(frequency=frequency)
    backend = HandBackend(scene_with(Surface().believed, Rubs.BRISTLES, Lift()), PERIOD)
    backend.start()
    felt, times = [], []
    for k in range(2500):
        time = k * PERIOD
        grip = min(GRIP, 8.0 * time)
        if time > CLOSED:
            grip += dither.force_at(time, GRIP)
        backend.step(Command(grip_force=(grip, grip)))
        if time > CLOSED + 0.3:
            felt.append(abs(backend.truth().fingers[0].force[0]))
            times.append(time)
    phase = np.exp(2j * math.pi * frequency * np.array(times))
    return float(2.0 * abs(np.mean((np.array(felt) - np.mean(felt)) * phase)))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="two runs of each kind")
    count = 2 if parser.parse_args().quick else 10
    console = Console(width=120)
    table = Table(title="on the hand")
    for head in ("", "pull", "slipped", "latency least/50/most ms", "slide or spin right", "alarms without slip"):
        table.add_column(head)
    pulls = (("ramp 1 s", 1.0, 1.3), ("step 50 ms", 0.05, 1.3), ("ramp to 80 %", 1.0, 0.8))
    for excited, (name, rise, share) in itertools.product((False, True), pulls):
        runs = [held_up(300_000 + i, rise, share, excited) for i in track(range(count), name, transient=True)]
        slipped = [run for run in runs if not math.isnan(run.latency)]
        late = np.sort([1e3 * run.latency for run in slipped])
        # the rest is both
        clear = [run for run in slipped if not 0.8 < run.turning < 1.25]
        right = sum((run.kind is SlipKind.SPIN) == (run.turning > 1.0) for run in clear)
        table.add_row(
            "excited" if excited else "touched",
            name,
            f"{len(slipped)} of {count}",
            f"{late[0]:.0f} / {late[len(late) // 2]:.0f} / {late[-1]:.0f}" if len(late) else "-",
            f"{right} of {len(clear)}",
            str(sum(run.alarms for run in runs if math.isnan(run.latency))),
        )
    console.print(table)
    ripples = ", ".join(f"{f:g} Hz: {ripple_of(f):.3f} N" for f in (10.0, 50.0, 100.0))
    console.print(f"of a ripple of 0.3 N the fingertips press with {ripples}")


if __name__ == "__main__":
    main()
