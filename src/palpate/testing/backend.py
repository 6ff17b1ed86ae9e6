"""Check of a back end."""

import math
from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import Any

from palpate.runtime.data import ArmSample, Command, Sample
from palpate.runtime.pacing import SimulatedTime
from palpate.runtime.protocols import Backend
from palpate.spatial import ZERO, Vector, rotate_back
from palpate.testing.arm_samples import (
    MAX_RATIO_REAL,
    MAX_RATIO_SIMULATED,
    MAX_SAMPLE_AGE,
    examine_arm,
    examine_motion,
    examine_rest,
    examine_turn,
)
from palpate.testing.nonconformity import Inspection
from palpate.testing.wrenches import examine_gravity, examine_stamps, examine_wrenches

UPWARD_VELOCITY: Vector = (0.0, 0.0, 0.005)
"""Velocity of the tip [m/s]: half the speed of a careful approach, away from anything below."""

TURN_RATE: Vector = (0.0, 0.0, 0.05)
"""Angular velocity [rad/s]: a tip 0.2 m beside the axis moves with 10 mm/s."""

PART_DURATION = 0.3
"""Duration of each part of the check [s]: stand, move, turn, stand again; 1.5 mm at `UPWARD_VELOCITY`."""

MAX_PERIOD, MIN_PERIOD = 0.1, 1e-5
"""Limits of the control period [s]: beyond, it is a number in another unit."""

STAMP_TOLERANCE = 1e-9
"""Largest rounding error of sums of periods [s]."""

MAX_PERIOD_ERROR = 0.5
"""Largest relative error of the median period in real time: a busy computer delays single periods."""

BAD_VELOCITIES: tuple[Any, ...] = ((math.nan, 0.0, 0.0), (0.0, math.inf, 0.0), (0.0, 0.0))
"""Velocities that no back end may follow."""


class _AbortedError(Exception):
    """Leaves a `with` block as an error in a run does."""


def check_backend(make: Callable[[], Backend], motion: Vector | None = UPWARD_VELOCITY) -> None:
    """Check a back end: time stamps, period, units and frames, motion, refusals, and rest however a run ends.

    The back end is started twice, moved for `PART_DURATION` with `motion`, and turned by 15 mrad if it can turn
    its tip. Nothing may be in its path; keep your hand on the emergency stop. A simulation (its pacer is
    `SimulatedTime`) runs once more, beside another one, and must repeat itself bit for bit.

    Args:
        make: Function that returns a new back end. It is called again when the one before is closed; two
            simulations are open at a time.
        motion: Velocity of the tip in a free direction, base frame [m/s]. None: the back end follows no command,
            as a replay.

    Raises:
        ConformanceError: If the back end breaks a rule.
    """
    backend = make()
    with Inspection(type(backend).__name__) as inspection:
        with inspection.part("close before start"):
            backend.close()
        backend = make()
        seen: list[Sample] = []
        with inspection.part("a run"):
            seen = _run_and_abort(inspection, backend, motion)
        with inspection.part("close once more"):
            backend.close()
        if motion is not None:
            _examine_after_close(inspection, backend)
        with inspection.part("close after all"):
            backend.close()
        if seen:
            _examine_samples(inspection, seen, backend.period, simulated=isinstance(backend.pacer, SimulatedTime))
        if seen and isinstance(backend.pacer, SimulatedTime):
            with inspection.part("the same run again"):
                _examine_repetition(inspection, make, seen, motion)


def _run_and_abort(inspection: Inspection, backend: Backend, motion: Vector | None) -> list[Sample]:
    """Stand, move, turn, command bad velocities, move again; leave by an exception."""
    samples: list[Sample] = []
    passed_on = False
    try:
        with backend as entered:
            inspection.require(entered is backend, "with", "`with` gives something else", "itself", "return self")
            samples.append(backend.start())
            inspection.require(
                MIN_PERIOD <= backend.period <= MAX_PERIOD,
                "period",
                f"{backend.period:g} s",
                f"between {MIN_PERIOD:g} and {MAX_PERIOD:g} s",
                "give the period in seconds, not in milliseconds",
            )
            count = max(20, round(PART_DURATION / backend.period))
            backend.pacer.start()
            for part in (Command(), Command(motion or ZERO)):
                samples += [backend.step(part) for _ in range(count)]
            if motion is not None:
                _examine_following(inspection, backend, samples, count, motion)
            raise _AbortedError
    except _AbortedError:
        passed_on = True
    finally:
        backend.pacer.stop()
    inspection.require(
        passed_on,
        "exceptions in a with block",
        "an exception in the block was swallowed",
        "the exception, after `close`",
        "return None from __exit__: `palpate.runtime.closing.Closing` does",
    )
    return samples


def _examine_following(
    inspection: Inspection, backend: Backend, samples: list[Sample], count: int, motion: Vector
) -> None:
    first, *others = samples
    factor = MAX_RATIO_SIMULATED if isinstance(backend.pacer, SimulatedTime) else MAX_RATIO_REAL
    if not examine_arm(inspection, [sample.arm for sample in samples]):
        return
    examine_rest(inspection, [sample.arm for sample in (first, *others[:count])], "after start")
    examine_motion(inspection, [sample.arm for sample in others[count:]], motion, factor)
    for bad in BAD_VELOCITIES:
        inspection.refuses(f"the velocity {bad}", backend.step, Command(bad))
    _let_rest(backend, count)
    stopped = [backend.step(Command()).arm for _ in range(count)]
    examine_rest(inspection, stopped, "after a refused command and zero ones")
    try:
        turned = [backend.step(Command(angular_velocity_base_tip=TURN_RATE)).arm for _ in range(count)]
    except ValueError:  # this back end cannot turn
        pass
    else:
        examine_turn(inspection, turned, TURN_RATE, factor)
    for _ in range(count // 4):
        backend.step(Command(motion))  # the end of the run has to stop it


def _let_rest(backend: Backend, count: int) -> None:
    for _ in range(count):
        backend.step(Command())


def _examine_after_close(inspection: Inspection, backend: Backend) -> None:
    """Samples after close, from a step or another start, must show a robot at rest."""
    after: list[ArmSample] = []
    try:
        after = [backend.step(Command()).arm for _ in range(5)]
    except Exception:  # a closed back end may refuse
        try:
            after = [backend.start().arm]
        except Exception:
            return
    with inspection.part("reading the arm after close"):
        examine_rest(inspection, after, "after close")


def _examine_samples(inspection: Inspection, samples: Sequence[Sample], period: float, *, simulated: bool) -> None:
    if not examine_arm(inspection, [sample.arm for sample in samples]):
        return
    times = [sample.time for sample in samples]
    gaps = sorted(b - a for a, b in pairwise(times))
    inspection.require(
        gaps[0] > 0.0,
        "time",
        f"sample.time advances by {gaps[0]:.3g} s",
        "a time that advances with every sample",
        "take it from one monotonic clock, or count periods",
    )
    off = max(abs(gap - period) for gap in gaps) if simulated else abs(gaps[len(gaps) // 2] - period)
    inspection.require(
        off <= (1e-6 if simulated else MAX_PERIOD_ERROR) * period,
        "period kept",
        f"samples are {gaps[len(gaps) // 2]:.4g} s apart, up to {gaps[-1]:.4g} s; period = {period:.4g} s",
        "one period from sample to sample",
        "wait with the pacer in step, or simulate exactly one period; both times are in seconds",
    )
    stamps = {"the arm": [sample.arm.time for sample in samples]}
    counts = {(len(sample.wrenches), len(sample.arm.joint_position), sample.hand is None) for sample in samples}
    if not inspection.require(
        len(counts) == 1,
        "constant make-up",
        "numbers of wrenches or joints change during the run",
        "as many in every sample",
        "raise an OSError when a device is lost",
    ):
        return
    if samples[0].hand is not None:
        stamps["the hand"] = [sample.hand.time for sample in samples if sample.hand is not None]
    for i in range(len(samples[0].wrenches)):
        readings = [sample.wrenches[i] for sample in samples]
        stamps[f"wrench {i}"] = [reading.time for reading in readings]
        if examine_wrenches(inspection, [reading.wrench for reading in readings]):
            examine_stamps(inspection, f"wrench {i}", [(reading.time, reading.wrench) for reading in readings])
        alone = len(samples[0].wrenches) == 1 and samples[0].hand is None
        up = rotate_back(samples[0].arm.rotation_base_tip, (0.0, 0.0, 1.0)) if alone else None
        examine_gravity(inspection, readings[0].acceleration, up)
    for name, each in stamps.items():
        ages = [time - stamp for time, stamp in zip(times, each, strict=True)]
        inspection.require(
            min(ages) >= -STAMP_TOLERANCE,
            f"stamps in the future ({name})",
            f"sampled {-1e3 * min(ages):.3g} ms after the sample's own time",
            "stamps at or before sample.time, on the same clock",
            "read the devices first and take sample.time afterwards; no forecast, no other clock",
        )
        inspection.require(
            max(ages) <= MAX_SAMPLE_AGE,
            f"age ({name})",
            f"{1e3 * max(ages):.4g} ms old",
            f"at most {1e3 * MAX_SAMPLE_AGE:g} ms, on the clock of sample.time",
            "raise an OSError for a state that is too old; stamps and sample.time need one clock and seconds",
        )
        real = not simulated and any(abs(gap - period) > 1e-9 for gap in gaps)
        inspection.require(
            not real or any(ages),
            f"time stamps of {name}",
            "each is the sample's own time",
            "when it was sampled, which takes time to arrive",
            "stamp it where it arrives from the device, not where it is logged or returned",
        )


def _examine_repetition(
    inspection: Inspection, make: Callable[[], Backend], seen: Sequence[Sample], motion: Vector | None
) -> None:
    """Equal commands must give equal samples, bit for bit, while another instance moves differently."""
    kept = [repr(sample) for sample in seen]
    count = len(seen) // 2
    with make() as backend, make() as other:
        if not inspection.require(
            backend is not other,
            "fresh instances",
            "make returns one object twice",
            "a new one",
            "construct it in make",
        ):
            return
        other.start()
        again = [repr(backend.start())]
        for k in range(1, len(seen)):
            if motion is not None:
                other.step(Command(tuple(-2.0 * v for v in motion)))  # type: ignore[arg-type]
            again.append(repr(backend.step(Command(ZERO if k <= count or motion is None else motion))))
    differs = next((k for k, pair in enumerate(zip(kept, again, strict=True)) if pair[0] != pair[1]), None)
    inspection.require(
        differs is None,
        "repetition",
        f"sample {differs} differs from that of another instance that was commanded the same",
        "the same samples bit for bit",
        "seed its chance, use no clock, and share nothing that changes between instances",
    )
    inspection.require(
        kept == [repr(sample) for sample in seen],
        "immutability",
        "samples that were returned earlier have changed",
        "values",
        "return new tuples, not arrays that are written to later",
    )
