"""What is held for long, or suddenly pulled at: no slip beyond what is claimed, and its grip is told."""

from palpate.experiments.grasp.price import growth_in_hold, held_before, price_of_preload
from support.grasp_runs import plan_of, run_grasp


def test_what_is_held_while_zeros_wander_fast_does_not_slip_and_its_grip_is_told():
    done = run_grasp(load="none", rise=4.0, drift=0.1)
    assert not done.dropped
    assert not done.gave_way
    assert 0.9 <= done.growth <= growth_in_hold(done.planned)
    assert any("grip may grow" in note for note in done.planned.dry_run().notes)


def test_where_nothing_wanders_far_nothing_is_told_or_paid():
    quiet = plan_of(load="none", drift=0.0)
    assert growth_in_hold(quiet) == 1.0
    assert price_of_preload(quiet) == 0.0
    assert not quiet.dry_run().notes


def test_the_price_of_a_preload_is_told_before_the_run():
    planned = plan_of(preload=1.5)
    factor = 1.0 + price_of_preload(planned) / held_before(planned)
    assert any(f"steps up to 1.5 N in 5 ms, 6 mm aside: grip x {factor:.2g}" in n for n in planned.dry_run().notes)
