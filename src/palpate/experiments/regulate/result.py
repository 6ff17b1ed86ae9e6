"""Result of a force regulation: forces, errors, peaks and responses, evaluated from all periods of a run."""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np

from palpate.controllers.force_program import StepForce, Tones
from palpate.controllers.guarded_approach import Loss
from palpate.errors import FloatArray
from palpate.experiments.kit.recorded_periods import ContactTruth, Periods
from palpate.experiments.kit.recorded_run import ChangeOutcome, Recorded
from palpate.experiments.kit.registry import ShownResult
from palpate.experiments.regulate.plan import RegulationPlan
from palpate.experiments.regulate.response import (
    FrequencyResponse,
    StepResponse,
    frequency_response,
    step_response,
)
from palpate.runtime import Phase, Record, RunResult

SETTLING_TIME = 0.5
"""Time after the start of the profile before errors count [s]: the transient of landing is over by then."""

MAX_PENDING_PERIODS = 2**18
"""Periods kept until their step or sine is complete; if it takes longer, its last periods count."""

BoolArray = np.ndarray[tuple[int], np.dtype[np.bool_]]


@dataclass(frozen=True, slots=True, eq=False)
class Held:
    """The force in some periods of a run.

    Attributes:
        planned: Plan of the run.
        record: Record of these periods.
        truth: Simulated truth in these periods.
        moved: Shift of the profile by the live parameter `force` [N], shape (n,).
        held_since: Start time of the profile [s]; None if it never started.
    """

    planned: RegulationPlan
    record: Record
    truth: ContactTruth
    moved: FloatArray
    held_since: float | None

    @property
    def holding(self) -> BoolArray:
        """Whether the profile runs in each period, shape (n,)."""
        return np.asarray(self.record.phase == Phase.HOLD.value)

    @property
    def counted(self) -> BoolArray:
        """Whether each period counts for errors, shape (n,)."""
        begin = math.nan if self.held_since is None else self.held_since
        return self.holding & (self.record.time >= begin + SETTLING_TIME)

    @property
    def since(self) -> FloatArray:
        """Time since the start of the profile, shape (n,) [s]; NaN if it never started."""
        return self.record.time - (math.nan if self.held_since is None else self.held_since)

    @property
    def set_force(self) -> FloatArray:
        """Set force, shape (n,) [N]; NaN outside the profile."""
        profile, holding = self.planned.profile, self.holding
        setpoint = np.full(len(self.record), np.nan)
        setpoint[holding] = [profile.at(time)[0] for time in self.since[holding].tolist()]
        return setpoint + self.moved

    @property
    def sensed_force(self) -> FloatArray:
        """Sensed force along the regulated direction, shape (n,) [N]; NaN without contact."""
        record, axis = self.record, self.planned.parameters.axis
        if axis is None:
            felt = record.normal_force
        else:
            force = record.tangential_force - record.normal_force[:, None] * record.normal
            felt = -force @ np.array(axis)
        return np.where(record.touching, felt, np.nan)

    @property
    def true_force(self) -> FloatArray:
        """Simulated force along the regulated direction, shape (n,) [N]; 0 without contact, NaN on a robot."""
        if not self.truth.known:
            return np.full(len(self.record), np.nan)
        axis, force = self.planned.parameters.axis, self.truth.force
        normal = self.record.normal if axis is None else np.broadcast_to(np.array(axis), force.shape)
        along = -np.sum(force * normal, axis=1)
        # before contact is detected the normal is unknown: the whole force counts
        along = np.where(np.isfinite(along), along, np.linalg.norm(force, axis=1))
        return np.where(self.truth.touching, along, 0.0)

    @property
    def judged_force(self) -> FloatArray:
        """Force that is judged, shape (n,) [N]: the true one; on a robot the sensed one, 0 without contact."""
        return self.true_force if self.truth.known else np.nan_to_num(self.sensed_force, nan=0.0)


class _Moments:
    """Count, mean square and variance of finite numbers that arrive in batches."""

    def __init__(self) -> None:
        self.count, self._sum, self._squares, self._spread = 0, 0.0, 0.0, 0.0
        self._offset = math.nan  # mean of the first batch, subtracted to keep digits

    def add(self, values: FloatArray) -> None:
        values = values[np.isfinite(values)]
        if not values.size:
            return
        if not self.count:
            self._offset = float(values.mean())
        self.count += values.size
        self._squares += float(np.sum(np.square(values)))
        self._sum += float(np.sum(values - self._offset))
        self._spread += float(np.sum(np.square(values - self._offset)))

    def rms(self) -> float:
        return math.sqrt(self._squares / self.count) if self.count else math.nan

    def deviation(self) -> float:
        variance = self._spread / self.count - (self._sum / self.count) ** 2 if self.count else 0.0
        return math.sqrt(max(0.0, variance))


class _ErrorSums:
    """Accumulates force errors and peaks from the pieces of a run, in order."""

    def __init__(self, planned: RegulationPlan) -> None:
        self._peak, self._landing_peak, self._counted = 0.0, math.nan, 0
        self._last_second = max(1, round(1.0 / planned.period))
        self._true, self._sensed, self._difference = _Moments(), _Moments(), _Moments()
        self._last: FloatArray = np.empty(0)

    def add(self, piece: Held) -> None:
        counted, setpoint = piece.counted, piece.set_force
        true, sensed = piece.true_force, piece.sensed_force
        self._true.add((true - setpoint)[counted])
        self._sensed.add((sensed - setpoint)[counted])
        difference = (sensed - true)[counted]
        self._difference.add(difference)
        self._last = np.concatenate([self._last, difference])[-self._last_second :]
        self._counted += int(counted.sum())
        size = np.linalg.norm(piece.truth.force if piece.truth.known else piece.record.wrench[:, :3], axis=1)
        self._peak = float(np.nanmax(size, initial=self._peak))
        landing = piece.truth.touching & ~(piece.since >= 0.0)
        if landing.any():
            self._landing_peak = float(np.fmax(self._landing_peak, size[landing].max()))

    def errors(self) -> tuple[float, float, float, float, float, float]:
        """Return the errors in the order of the attributes of `RegulationResult`."""
        offset = float(np.nanmean(self._last)) if np.isfinite(self._last).any() else math.nan
        sd = self._difference.deviation() / math.sqrt(max(1, self._counted))
        return self._true.rms(), self._sensed.rms(), self._landing_peak, self._peak, offset, sd


class _Responses:
    """Accumulates step or frequency responses from the pieces of a run; keeps periods of unfinished steps only."""

    def __init__(self, planned: RegulationPlan) -> None:
        profile = self._profile = planned.profile
        self._period, self._next = planned.period, 0
        self._spans: list[tuple[float, float]] = []
        if isinstance(profile, StepForce):
            self._spans = [(at, at + profile.hold) for at in profile.steps(planned.parameters.duration)]
        elif isinstance(profile, Tones):
            self._spans = list(pairwise(profile.begins))
        self._columns: tuple[FloatArray, ...] = (np.empty(0),) * 4
        self._steps: tuple[list[StepResponse], ...] = ([], [])
        self._tones: tuple[list[FrequencyResponse], ...] = ([], [])

    def add(self, piece: Held) -> None:
        if not self._spans:
            return
        since = self._columns[0]
        if len(since):
            self._respond(sum(end + self._period < since[-1] for _, end in self._spans))
            begin = self._spans[self._next][0] if self._next < len(self._spans) else np.inf
            kept = since >= begin - self._period
            self._columns = tuple(each[kept][-MAX_PENDING_PERIODS:] for each in self._columns)
        held, felt = piece.holding, np.nan_to_num(piece.sensed_force, nan=0.0)
        new = (piece.since, piece.set_force, piece.judged_force, felt)
        self._columns = tuple(np.concatenate((old, x[held])) for old, x in zip(self._columns, new, strict=True))

    def responses(self) -> tuple[tuple[StepResponse | None, ...], tuple[FrequencyResponse | None, ...]]:
        """Return step and frequency responses, each of the judged and of the felt force."""
        self._respond(len(self._spans))
        return tuple(map(StepResponse.joined, self._steps)), tuple(map(FrequencyResponse.joined, self._tones))

    def _respond(self, until: int) -> None:
        """Evaluate the steps or sines up to an index; they are complete."""
        profile, spans, self._next = self._profile, slice(self._next, until), max(until, self._next)
        since, setpoint, *forces = self._columns
        for force, steps, tones in zip(forces, self._steps, self._tones, strict=True):
            if isinstance(profile, StepForce):
                half = 0.5 * profile.hold
                heights = [
                    (at, profile.at(at - half)[0], profile.at(at + half)[0]) for at, _ in self._spans[spans]
                ]
                # a period less: by rounding, the next step may begin a period early
                step = step_response(since, force, heights, profile.hold - 2.0 * self._period)
                steps.extend([] if step is None else [step])
            elif isinstance(profile, Tones):
                limits = profile.begins[spans.start : spans.stop + 1]
                tone = frequency_response(since, setpoint, force, limits, profile.frequencies[spans])
                tones.extend([] if tone is None else [tone])


@dataclass(frozen=True, slots=True, eq=False)
class RegulationResult(Held, ShownResult):
    """Result of a force regulation: the periods of its figures, and metrics over all periods.

    Attributes:
        run: Ending and timing of the run.
        pieces: Function that yields the force in all periods, piece by piece.
        loss: Whether and how contact was lost.
        bounces: Number of contact losses before the force had settled.
        guard_trips: Number of times that gain and feedforward were halved because the loop oscillated.
        changes: Requested changes of live parameters, and when they took effect.
        true_rms: RMS error of the true force while the profile runs [N].
        sensed_rms: RMS error of the sensed force while the profile runs [N].
        landing_peak: Largest true force from first touch to the start of the profile [N]; NaN without a touch.
        peak: Largest true force of the run, tangential part included [N]; on a robot the largest sensed force.
        sensor_error: Sensed minus true force, mean over the last second of the profile [N]; NaN if unknown.
        sensor_error_sd: Standard error of the mean difference of sensed and true force [N].
        judged_steps: Response of the judged force to the profile's steps; None without steps.
        felt_steps: Response of the sensed force to the profile's steps, 0 without contact; None without steps.
        judged_tones: Response of the judged force to the profile's sines; None without sines.
        felt_tones: Response of the sensed force to the profile's sines; None without sines.
        every: 1 if the metrics cover all periods; n if only every n-th period is known, without responses.
    """

    experiment = "regulate"

    run: RunResult
    pieces: Callable[[], Iterator[Held]]
    loss: Loss
    bounces: int
    guard_trips: int
    changes: tuple[ChangeOutcome, ...]
    true_rms: float
    sensed_rms: float
    landing_peak: float
    peak: float
    sensor_error: float
    sensor_error_sd: float
    judged_steps: StepResponse | None
    felt_steps: StepResponse | None
    judged_tones: FrequencyResponse | None
    felt_tones: FrequencyResponse | None
    every: int


def regulation_in(planned: RegulationPlan, recorded: Recorded) -> RegulationResult:
    """Return the result of a run, whatever ended it."""
    controller, periods = recorded.controller, recorded.periods

    def held(some: Periods, force: Sequence[float]) -> Held:
        moved = np.array(force) - planned.parameters.force
        return Held(planned, some.record(), ContactTruth.of(some.truth, len(some)), moved, controller.held_since)

    def shown() -> Held:
        return held(periods.shown(), recorded.live_values("force", planned.controller().live))

    def pieces() -> Iterator[Held]:
        if not periods.thinned:
            yield shown()
            return
        live = recorded.live_again(planned.controller().live, float(periods.shown().time[0]))
        for piece in periods.pieces():
            yield held(piece, live("force", piece.time.tolist()))

    sums, responses = _ErrorSums(planned), _Responses(planned)
    for piece in pieces():
        sums.add(piece)
        if periods.all_known:
            responses.add(piece)
    (judged_steps, felt_steps), (judged_tones, felt_tones) = responses.responses()
    some = shown()
    return RegulationResult(
        planned,
        some.record,
        some.truth,
        some.moved,
        some.held_since,
        recorded.run,
        pieces,
        controller.contact.loss,
        controller.contact.bounces,
        controller.guard.trips,
        recorded.change_outcomes(planned.changes(), Phase.HOLD),
        *sums.errors(),
        judged_steps,
        felt_steps,
        judged_tones,
        felt_tones,
        1 if periods.all_known else periods.memory.stride,
    )


def write_forces(regulation: RegulationResult, path: Path) -> None:
    """Write the forces over time as CSV.

    Raises:
        OSError: If the file cannot be written.
    """
    heading = "time_s,set_force_N,sensed_force_N,true_force_N"
    with path.open("w") as file:
        for piece in regulation.pieces():
            columns = (piece.record.time, piece.set_force, piece.sensed_force, piece.true_force)
            np.savetxt(file, np.column_stack(columns), fmt="%.9g", delimiter=",", header=heading, comments="")
            heading = ""
