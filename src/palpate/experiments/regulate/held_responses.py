"""Step and frequency responses over all periods of a run, which come piece by piece."""

from collections.abc import Iterator
from itertools import pairwise

import numpy as np

from palpate.controllers.force_program import StepForce, Tones
from palpate.errors import FloatArray
from palpate.experiments.regulate.held import Held
from palpate.experiments.regulate.plan import RegulationPlan
from palpate.experiments.regulate.response import (
    FrequencyResponse,
    StepResponse,
    frequency_response,
    step_response,
)

MOST_ROWS = 2**18
"""Periods that wait for the end of their step or sine: of one that lasts longer the last ones count."""


class HeldResponses:
    """Takes the pieces of a run in order, and keeps what belongs to a step or sine that is not over."""

    def __init__(self, planned: RegulationPlan) -> None:
        """Take what was to be done."""
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

    def take(self, piece: Held) -> None:
        """Take the next periods."""
        if not self._spans:
            return
        since = self._columns[0]
        if len(since):
            over = [end + self._period < since[-1] for _, end in self._spans]
            self._respond(sum(over))
            begin = self._spans[self._next][0] if self._next < len(self._spans) else np.inf
            self._columns = tuple(each[since >= begin - self._period][-MOST_ROWS:] for each in self._columns)
        held, felt = piece.holding, np.nan_to_num(piece.sensed_force, nan=0.0)
        new = (piece.since, piece.set_force, piece.judged_force, felt)
        self._columns = tuple(np.concatenate((old, x[held])) for old, x in zip(self._columns, new, strict=True))

    def end(self) -> tuple[tuple[StepResponse | None, ...], tuple[FrequencyResponse | None, ...]]:
        """Return the responses of judged and felt force to the profile's steps, and likewise to its sines."""
        self._respond(len(self._spans))
        return (
            tuple(StepResponse.joined(found) for found in self._steps),
            tuple(FrequencyResponse.joined(found) for found in self._tones),
        )

    def _respond(self, until: int) -> None:
        spans, self._next = slice(self._next, until), max(until, self._next)
        since, wanted, *forces = self._columns
        for force, steps, tones in zip(forces, self._steps, self._tones, strict=True):
            steps.extend(self._step_responses(since, force, spans))
            tones.extend(self._tone_responses(since, wanted, force, spans))

    def _step_responses(self, since: FloatArray, force: FloatArray, spans: slice) -> Iterator[StepResponse]:
        profile = self._profile
        if isinstance(profile, StepForce):
            half = 0.5 * profile.hold
            steps = [(at, profile.at(at - half)[0], profile.at(at + half)[0]) for at, _ in self._spans[spans]]
            # a period less: by rounding, the next step may be taken a period early
            found = step_response(since, force, steps, profile.hold - 2.0 * self._period)
            yield from () if found is None else (found,)

    def _tone_responses(
        self, since: FloatArray, wanted: FloatArray, force: FloatArray, spans: slice
    ) -> Iterator[FrequencyResponse]:
        profile = self._profile
        if isinstance(profile, Tones):
            begins = profile.begins[spans.start : spans.stop + 1]
            found = frequency_response(since, wanted, force, begins, profile.frequencies[spans])
            yield from () if found is None else (found,)
