"""Friction runs on known surfaces: mu, e and the exponents come out, with intervals that hold the truth."""

import pytest

from palpate.errors import InvalidValueError
from palpate.friction.friction_file import How, friction_file_text, read_friction_file
from support.friction_runs import FRICTION, rubbed

NOISY = {"force_noise": 0.01, "moment_noise": 1e-4}
MODEL = {"friction": 0.8, "spin_length": 0.004, "calibration": 0.01}
PLANT = {"fit_exponents": True, "norm_exponent": 1.4, "load_exponent": 0.25, "loads": (1.0, 5.0), **NOISY}
FOUND = {
    "arm, box": ({"robot": "ur5e-sim", "object": "box", **MODEL}, {"friction": 0.03, "spin_length": 0.05}),
    "Nano17, sphere": (
        {"robot": "turning-stage-nano17", "object": "sphere", **MODEL},
        {"friction": 0.03, "spin_length": 0.05},
    ),
    "exponents of the friction plant": (PLANT, {"friction": 0.03, "spin_length": 0.05}),
    # slip begins after mu f_n / K = 1.7 mm, back after twice that: 4.6 mm are too short to be sure
    "a skin that slips late": ({"loads": (1.0,), "skin_stiffness": 300.0, "robot": "stage"}, {"friction": 0.005}),
    # at one speed alone e would be 11 % too long
    "friction that falls with the speed": (
        {"loads": (2.0,), "static_friction": 0.7, "friction": 0.5},
        {"spin_length": 0.04},
    ),
    "a sensor that drifts": (
        {"loads": (1.0,), "robot": "turning-stage-nano17", "drift": 0.6, "calibration": 0.01},
        {"friction": 0.03, "spin_length": 0.05},
    ),
}
TRUE = {"friction": 0.5, "spin_length": 0.003}


@pytest.mark.slow
@pytest.mark.parametrize(("fields", "within"), FOUND.values(), ids=list(FOUND))
def test_a_run_finds_the_surface_and_its_intervals_hold_it(fields, within):
    run = rubbed(quick=True, **fields)
    assert run.run.at_rest
    for name, relative in within.items():
        estimate, true = getattr(run.file, name), fields.get(name, TRUE[name])
        assert estimate.how is How.MEASURED
        assert estimate.lower <= true <= estimate.upper
        assert estimate.value == pytest.approx(true, rel=relative)
    if "fit_exponents" in fields:
        assert run.file.norm_exponent.value == pytest.approx(1.4, abs=0.15)
        assert run.file.load_exponent.value == pytest.approx(0.25, abs=0.05)
        assert {run.file.norm_exponent.how, run.file.load_exponent.how} == {How.MEASURED}
    if "drift" in fields:
        assert abs(run.air.moved[:3]).max() > 0.05


@pytest.mark.slow
def test_static_and_kinetic_friction_are_told_apart_by_the_speeds():
    run = rubbed(static_friction=0.7, stribeck_speed=0.005, loads=(1.0, 2.0, 4.0), **NOISY)
    assert run.found.curve.kinetic_friction == pytest.approx(0.5, rel=0.03)
    assert run.file.static_friction.value == pytest.approx(0.7, rel=0.1)
    # e by mu at the speed of the twists, not at that of the strokes
    assert run.file.spin_length.value == pytest.approx(0.003, rel=0.05)


@pytest.mark.slow
def test_static_friction_is_measured_where_mu_has_levelled():
    static = rubbed(loads=(2.0,), static_friction=0.6, stribeck_speed=0.02).file.static_friction
    assert static.how is How.MEASURED
    assert static.lower <= static.value <= static.upper < static.lower + 0.03
    assert static.lower <= 0.6 <= static.upper


def test_a_robot_that_cannot_turn_finds_mu_and_reports_that_e_is_unknown():
    run = rubbed(quick=True, loads=(2.0,), robot="stage")
    assert run.file.friction.value == pytest.approx(0.5, rel=0.01)
    assert run.file.spin_length is None
    assert "nothing is known of e" in FRICTION.report(run).outcome
    with pytest.raises(InvalidValueError, match="spin_length_m: not known"):
        run.file.limit_surface()
    assert read_friction_file(friction_file_text(run.file)) == run.file
