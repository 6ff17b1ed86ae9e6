"""What every fault must lead to, on whatever robot."""

import math
from collections.abc import Callable

import pytest

from faults.fault_rig import Outcome, Rig
from faults.fault_table import FASTEST_RETRACT, Fault, Reaction
from palpate.errors import LatchedError
from palpate.runtime.data import Command
from palpate.runtime.loop import run
from palpate.runtime.rest import REST, RestState
from palpate.runtime.result import Ending
from palpate.spatial import ZERO, Vector, dot, norm

MOST_PERIODS = 2
"""From the period that shows the fault to the last one that is not safe."""

ALONG = math.cos(math.radians(5.0))
"""A retraction keeps to the contact normal within 5 degrees: what friction and noise leave of it."""

Away = Callable[[int], Vector]
"""True unit vector out of the object at the sample of an index, base frame."""


def is_safe(command: Command, reaction: Reaction, away: Vector, grip: tuple[float, ...] | None) -> bool:
    """Whether the robot may be sent this from the trip on."""
    velocity = command.velocity_base_tip
    if command.grip_force != grip:
        return False
    if velocity == ZERO:
        return True
    speed = norm(velocity)
    along = dot(velocity, away) >= ALONG * speed
    return reaction is Reaction.RETRACT and along and speed <= FASTEST_RETRACT * (1 + 1e-12)


def periods_until_safe(
    outcome: Outcome, fault: Fault, at: int, away: Away, grip: tuple[float, ...] | None = None
) -> int:
    """From the period that trips, or at which the signal came, to the first from which on all is safe."""
    first, sent = outcome.tripped_at(at), outcome.commands
    unsafe = [i for i in range(first, len(sent)) if not is_safe(sent[i], fault.reaction, away(i), grip)]
    return unsafe[-1] + 1 - first if unsafe else 0


def check_ending(outcome: Outcome, fault: Fault, at: int) -> None:
    """All of what a fault must lead to, but for the commands."""
    result, backend, delay = outcome.result, outcome.rig.backend, outcome.tripped_at(at) - at
    assert result.ending is fault.ending
    if fault.measure is None:
        assert result.trip is None
    else:
        assert result.trip.measure.startswith(fault.measure)
        assert fault.value in result.trip.value
        assert result.trip.limit
        assert str(result.trip) in outcome.errors()  # in the log too
        assert delay == fault.delay
    assert outcome.events[-1].text == f"ended: {fault.ending.value}"
    assert backend.closed_after == len(backend.commands)
    rows = outcome.log.record()
    assert len(rows) >= at
    logged = [tuple(row) for row in rows.command.tolist()]
    assert logged[:at] == [c.velocity_base_tip for c in backend.commands[:at]]
    if result.trip is not None:
        first = outcome.tripped_at(at) + (fault.measure == "back end")  # there, the command was sent and is logged
        assert all(norm(velocity) <= FASTEST_RETRACT * (1 + 1e-12) for velocity in logged[first:])


def check_rest(outcome: Outcome, at_rest: bool) -> None:
    """What is reported of rest is what was measured; not known it is only where no true state of the arm came."""
    rest, (logged,) = outcome.result.rest, [event for event in outcome.events if event.source == REST]
    assert logged.text == rest.words
    backend = outcome.rig.backend
    blind = backend.samples[-1].arm != backend.truly[-1].arm or len(backend.commands) in backend.errors
    measured = RestState.AT_REST if at_rest else RestState.MOVING
    assert rest.state is measured or (rest.state is RestState.NOT_KNOWN and blind)


def check_latch(outcome: Outcome, fresh: Rig) -> None:
    """A trip lets nothing move until it is reset."""
    if outcome.result.trip is None:
        return
    with pytest.raises(LatchedError, match="reset"):
        run(fresh.backend, fresh.touch, fresh.controller, outcome.supervisor, duration=0.02)
    assert fresh.backend.commands == []
    outcome.supervisor.reset()
    again = run(fresh.backend, fresh.touch, fresh.controller, outcome.supervisor, duration=0.02)
    assert again.ending is Ending.TIME_UP
    assert any(c.velocity_base_tip != ZERO for c in fresh.backend.commands)
