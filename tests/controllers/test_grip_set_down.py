"""An object is let go only where it stands again: what is met higher up ends the run, held as it was."""

import pytest

from palpate.controllers.grip.belief import KnownSurface
from palpate.controllers.grip.grasp import GROWN, GROWN_BY, SLOW, GraspController, GraspStage, SetDownParameters
from palpate.controllers.grip.lift import LiftController, LiftParameters
from palpate.controllers.grip.slip_safe import SlipSafeGrip
from palpate.friction.limit_surface import LimitSurface
from palpate.runtime.data import ArmSample, Observation, Phase
from palpate.spatial import IDENTITY, ZERO
from support.felt_finger import finger

PERIOD = 1e-3
SURFACE = LimitSurface(0.5, 0.004)
DOWN = SetDownParameters(height=0.01, speed=0.02)
WEIGHT = 0.5
"""[N] That a finger bears: with mu = 0.5 it takes 1 N."""


def lowered(table, first=(WEIGHT, 0.0)):
    """Close, hold, lower; returns the controller, commands of lowering, and ways left [m] when they were given.

    Args:
        table: From the way that is left [m] to what (tangential force, spin torque) the first finger bears.
        first: What it bears before.
    """
    grip = SlipSafeGrip(2, KnownSurface(SURFACE), PERIOD)
    lift = LiftController(grip, PERIOD, LiftParameters(height=0.0, settle_time=0.05, hold_time=0.5))
    controller = GraspController(lift, grip, PERIOD, DOWN)
    now = Observation(0.0, ArmSample(0.0, ZERO, IDENTITY, ZERO), (finger(*first, 3.0), finger(WEIGHT, 0.0, 3.0)))
    controller.start(now)
    commands, left = [], DOWN.height
    lefts = []
    for i in range(5000):
        lowering = controller.stage is GraspStage.SET_DOWN
        its = table(left) if lowering else first
        normal = grip.target
        fingers = (finger(*its, normal), finger(WEIGHT, 0.0, normal))
        command = controller.step(Observation(i * PERIOD, now.arm, fingers))
        if lowering:
            commands.append(command)
            lefts.append(left)
            left += command.velocity_base_tip[2] * PERIOD
        if command.phase.is_final or controller.stage is GraspStage.LET_GO:
            break
    return controller, commands, lefts


EDGE = 0.006
"""[m] Above where it stood: where a tilted object meets the table with an edge."""


@pytest.mark.parametrize(
    "pushed", [(2.0, 0.0), (0.0, 0.006), (-2.0, 0.0)], ids=["harder down", "turned", "lifted off"]
)
def test_an_edge_that_is_met_while_lowering_ends_it_there_with_the_grip_as_it_is(pushed):
    controller, commands, lefts = lowered(lambda left: pushed if left < EDGE else (WEIGHT, 0.0))
    last = commands[-1]
    assert last.phase is Phase.LOST
    assert controller.met_early
    assert last.velocity_base_tip == ZERO
    assert EDGE - 0.02 * 0.1 < lefts[-1] < EDGE  # within 0.1 s: the load's way through the tracker
    assert all(now >= before - 1e-9 for now, before in zip(last.grip_force, commands[0].grip_force, strict=True))


@pytest.mark.parametrize("share", [0.0, 0.5, 1.4])
def test_a_load_that_goes_away_or_hardly_grows_is_no_edge(share):
    """Up to `GROWN` times what it was; the table then takes it all, and a bit."""
    controller, _, lefts = lowered(lambda left: (WEIGHT * share, 0.0) if left > 0.0 else (-3.0 * WEIGHT, 0.0))
    assert controller.stage is GraspStage.LET_GO
    assert not controller.met_early
    assert lefts[-1] < 0.0


def test_what_is_met_about_where_it_stood_is_the_table_however_the_load_grows():
    controller, _, lefts = lowered(lambda left: (-4.0 * WEIGHT, 0.01) if left < 0.9 * SLOW else (WEIGHT, 0.0))
    assert controller.stage is GraspStage.LET_GO
    assert not controller.met_early
    assert 0.0 < lefts[-1] < SLOW


def test_what_counts_as_grown_goes_with_what_was_borne_before():
    """A heavy torque before lowering is no edge, and the same torque after a light load is."""
    torque = 2.0 * (GROWN * WEIGHT / SURFACE.friction + GROWN_BY) * SURFACE.friction * SURFACE.spin_length
    steady, _, _ = lowered(lambda left: (WEIGHT if left > 0.0 else -3.0, torque), (WEIGHT, torque))
    assert not steady.met_early
    grown, _, _ = lowered(lambda left: (0.7 * WEIGHT, torque) if left < EDGE else (WEIGHT, 0.0))
    assert grown.met_early


def test_another_distribution_of_the_same_load_is_no_edge():
    """Torques that fingers turn against one another come from no table: that takes a part of the weight."""
    controller, _, lefts = lowered(lambda left: (WEIGHT if left > 0.0 else -3.0 * WEIGHT, 0.006))
    assert not controller.met_early
    assert lefts[-1] < 0.0


def test_one_odd_sample_while_lowering_is_neither_edge_nor_table():
    lefts_seen = []

    def spiked(left):
        lefts_seen.append(left)
        return (-50.0, 0.0) if len(lefts_seen) == 100 else (WEIGHT, 0.0)

    controller, commands, lefts = lowered(spiked)
    assert lefts[99] > SLOW
    assert not controller.met_early
    assert lefts[-1] < 0.0
    assert max(force for command in commands for force in command.grip_force) < 1.01 * commands[0].grip_force[0]
