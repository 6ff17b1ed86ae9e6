"""How a force was regulated: worked out from what was recorded."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from palpate.controllers.guarded_approach import Loss
from palpate.experiments.kit.recorded_periods import ContactTruth, Periods
from palpate.experiments.kit.recorded_run import ChangeOutcome, Recorded
from palpate.experiments.kit.registry import ShownResult
from palpate.experiments.regulate.held import Held
from palpate.experiments.regulate.held_responses import HeldResponses
from palpate.experiments.regulate.held_sums import HeldSums
from palpate.experiments.regulate.plan import RegulationPlan
from palpate.experiments.regulate.response import FrequencyResponse, StepResponse
from palpate.robots.known_truth import cost_of
from palpate.runtime import Phase, RunResult
from palpate.sim.scene_cost import SceneCost


@dataclass(frozen=True, slots=True, eq=False)
class RegulationResult(Held, ShownResult):
    """How a force was regulated. Its periods are those that figures show; its metrics are of all.

    Attributes:
        run: How the run ended, and its timing.
        pieces: Yields the force in all periods, piece by piece.
        loss: Whether contact was lost, and how.
        bounces: How often it was lost again before it had settled.
        guard_trips: How often gain and forward feed were halved because the loop swung.
        changes: Which of the requested changes of live parameters took effect, and when.
        sums: Errors and peaks.
        judged_steps: Response of the judged force to the profile's steps; None if it has none.
        felt_steps: Likewise of the sensed force, 0 where nothing is felt.
        judged_tones: Response of the judged force to the profile's sines; None if it has none.
        felt_tones: Likewise of the sensed force.
        every: 1 if the metrics are of all periods; else of every second, fourth, ... one, and of responses
            nothing is known.
    """

    experiment = "regulate"

    run: RunResult
    pieces: Callable[[], Iterator[Held]]
    loss: Loss
    bounces: int
    guard_trips: int
    changes: tuple[ChangeOutcome, ...]
    sums: HeldSums
    judged_steps: StepResponse | None
    felt_steps: StepResponse | None
    judged_tones: FrequencyResponse | None
    felt_tones: FrequencyResponse | None
    every: int

    @property
    def true_rms(self) -> float:
        """RMS error of the true force while the profile is held [N]."""
        return self.sums.true_rms

    @property
    def sensed_rms(self) -> float:
        """Likewise of the sensed force [N]."""
        return self.sums.sensed_rms

    @property
    def landing_peak(self) -> float:
        """Largest true force from the first touch until the profile begins [N]; NaN if nothing was touched."""
        return self.sums.landing_peak

    @property
    def peak(self) -> float:
        """Largest true force of the whole run, tangential part included [N]; on a robot the largest sensed one."""
        return self.sums.peak

    @property
    def sensor_error(self) -> float:
        """Sensed less true force, mean over the last second of holding [N]: what drift has done; NaN without."""
        return self.sums.sensor_error

    @property
    def cost(self) -> SceneCost | None:
        """Of the simulated scene; None on a robot."""
        return cost_of(self.planned.ready.backend)


def regulation_in(planned: RegulationPlan, recorded: Recorded) -> RegulationResult:
    """Return the result of a run, however it ended."""
    controller, periods = recorded.controller, recorded.periods

    def held(some: Periods, force: Sequence[float]) -> Held:
        moved = np.array(force) - planned.parameters.force
        truth = ContactTruth.of(some.truth, len(some))
        return Held(planned, some.record(), truth, moved, controller.held_since)

    def shown() -> Held:
        return held(periods.shown(), recorded.live_values("force", planned.controller().live))

    def pieces() -> Iterator[Held]:
        if not periods.thinned:
            yield shown()
            return
        live = recorded.live_again(planned.controller().live, float(periods.shown().time[0]))
        for piece in periods.pieces():
            yield held(piece, live("force", piece.time.tolist()))

    sums, responses = HeldSums(planned), HeldResponses(planned)
    for piece in pieces():
        sums.take(piece)
        if periods.all_known:
            responses.take(piece)
    (judged_steps, felt_steps), (judged_tones, felt_tones) = responses.end()
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
        sums,
        judged_steps,
        felt_steps,
        judged_tones,
        felt_tones,
        1 if periods.all_known else periods.memory.stride,
    )


def write_forces(regulation: RegulationResult, path: Path) -> None:
    """Write the forces over time as CSV.

    Raises:
        OSError: It cannot be written.
    """
    heading = "time_s,set_force_N,sensed_force_N,true_force_N"
    with path.open("w") as file:
        for piece in regulation.pieces():
            columns = (piece.record.time, piece.set_force, piece.sensed_force, piece.true_force)
            np.savetxt(file, np.column_stack(columns), fmt="%.9g", delimiter=",", header=heading, comments="")
            heading = ""
