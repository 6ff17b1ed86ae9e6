"""Bad inputs of friction, and the words with which each is refused."""

import math

import msgspec
import numpy as np
import pytest

from palpate import LimitSurface
from palpate.errors import InvalidValueError
from palpate.friction.materials.library import MaterialLibrary, load_materials, read_materials, simulated_materials
from palpate.friction.materials.next_touch import next_touch
from palpate.friction.materials.recognition import recognise
from palpate.friction.materials.touch_evidence import NeverSlipped, TouchEvidence, twist_row
from palpate.friction.materials.trials import UNKNOWN, Confusion
from palpate.friction.pressure import fitted_limit_surface
from palpate.friction.rubbing.estimate import Estimate, SensorErrors
from palpate.friction.rubbing.sliding import measure_friction
from palpate.friction.rubbing.slip_load import SlipLoad
from palpate.friction.rubbing.slip_loads import slip_load
from palpate.friction.rubbing.speed_curve import SpeedPoint, fit_speed_curve
from palpate.friction.rubbing.speed_ratio import friction_ratio
from palpate.friction.rubbing.stroke import TwoWay
from palpate.friction.rubbing.stroke_plan import PlannedSlip, planned_slips
from palpate.friction.rubbing.surface_fit import fit_limit_surface
from palpate.friction.rubbing.twisting import measure_spin
from palpate.friction.slip.belief import FrictionBelief
from palpate.friction.slip.excited_slip import ExcitedParameters
from palpate.friction.slip.fingers import LearntSurface
from palpate.friction.slip.grip_dither import GripDither
from palpate.friction.slip.load_noise import LoadNoise
from palpate.friction.slip.page_test import PageTest
from palpate.friction.slip.place_watch import PlaceWatch
from support.closed_strokes import Sensed, changed, nothing, slips

NAN = math.nan
SENSED = Sensed()
PAIR = SENSED.two_way(slips(0.3, 1e-4), nothing, 0.02)
TURN = SENSED.stroke(nothing, slips(0.001, 0.1), spin=2.0)
STILL = changed(PAIR.there, velocity=0.0 * PAIR.there.velocity)
LIBRARY = simulated_materials()
SLIDES = [SlipLoad(force, 0.5 * force, 0.0, 0.02, 0.0) for force in (1.0, 2.0, 3.0, 4.0, 5.0)]
CREEPING = [
    SpeedPoint(v, Estimate(mu, 1e-5, 0.0)) for v, mu in ((0.001, 0.2), (0.005, 0.5), (0.01, 0.5), (0.02, 0.5))
]
NOT_NUMBERS = ("a", "0.5", None, [0.5], np.array([0.5]), np.array([0.5, 0.6]), 1j)
SURFACE = LimitSurface(0.5, 0.003, 0.2, 1.0)
LOAD = {"normal_force": 2.0, "tangential_force": 0.5, "spin_torque": 1e-4}
ONE_NUMBER = {
    "friction": lambda x: LimitSurface(x, 0.003),
    "spin_length": lambda x: LimitSurface(0.5, x),
    "load_exponent": lambda x: LimitSurface(0.5, 0.003, x),
    "norm_exponent": lambda x: LimitSurface(0.5, 0.003, norm_exponent=x),
    "normal_force": SURFACE.spin_length_at,
} | {
    f"{name} of {function.__name__}": lambda x, name=name, function=function: function(**(LOAD | {name: x}))
    for function in (SURFACE.load_ratio, SURFACE.margin)
    for name in LOAD
}
TEXT = """palpate_materials: 1
fingertip: made up
materials:
  - name: felt
    kinetic_friction: 0.5
    spin_length_m: 0.003
    scatter: {friction: 0.02, spin_length: 0.03}
    provenance: made up
"""


def belief():
    return FrictionBelief(0.5, 0.004, friction_deviation=0.3, spin_length_deviation=0.4)


def renamed():
    felt = read_materials(TEXT).materials[0]
    return MaterialLibrary(fingertip="", materials=(felt, msgspec.structs.replace(felt, name="wool")))


SURFACES = [
    *(
        (
            f"{name} {value}",
            lambda name=name, value=value: LimitSurface(
                **({"friction": 0.5, "spin_length": 0.004} | {name: value})
            ),
            name,
        )
        for name, value in [
            ("friction", 0.0),
            ("friction", math.inf),
            ("spin_length", -0.004),
            ("load_exponent", -0.1),
            ("load_exponent", 0.4),
            ("norm_exponent", 0.9),
            ("norm_exponent", NAN),
        ]
    ),
    *(
        (f"{name} {wrong!r}", lambda call=call, wrong=wrong: call(wrong), f"{name.split()[0]}.*must be one number")
        for name, call in ONE_NUMBER.items()
        for wrong in NOT_NUMBERS
    ),
    ("force of a word", lambda: SURFACE.least_normal_force("a", 1e-4), "tangential_force"),
    ("torque of a word", lambda: SURFACE.least_normal_force(0.5, None), "spin_torque"),
    ("pressure 0.9", lambda: fitted_limit_surface(0.9, 0.005, 0.0, 0.5), "pressure_exponent"),
    ("pressure nan", lambda: fitted_limit_surface(NAN, 0.005, 0.0, 0.5), "pressure_exponent"),
    ("no radius", lambda: fitted_limit_surface(2.0, 0.0, 0.0, 0.5), "contact_radius"),
    ("load exponent", lambda: fitted_limit_surface(2.0, 0.005, 0.5, 0.5), "load_exponent"),
    ("negative friction", lambda: fitted_limit_surface(2.0, 0.005, 0.0, -0.5), "friction"),
]

MATERIALS = [
    *(
        (f"{new!r:.40}", lambda old=old, new=new: read_materials(TEXT.replace(old, new, 1)), message)
        for old, new, message in [
            ("palpate_materials: 1", "palpate_materials: 2", "version 1"),
            ("palpate_materials: 1", "palpate_material: 1", "misspelt"),
            ("spin_length_m: 0.003", "spin_length_mm: 3.0", r"materials\[0\].spin_length_mm"),
            ("spin_length_m: 0.003", "spin_length_m: 3.0", "in millimetres"),
            ("kinetic_friction: 0.5", "kinetic_friction: 50.0", "in per cent"),
            ("kinetic_friction: 0.5", "kinetic_friction: 0.0", "above 0"),
            ("kinetic_friction: 0.5", "kinetic_friction: .nan", "kinetic_friction"),
            ("kinetic_friction: 0.5", "kinetic_friction: high", "kinetic_friction"),
            ("  scatter", "  static_friction: 0.4\n    scatter", "at least the kinetic_friction"),
            ("  scatter", "  norm_exponent: 5.0\n    scatter", "between 1 .* and 4"),
            ("  scatter", "  load_exponent: 0.5\n    scatter", "at most 0.3333"),
            ("friction: 0.02,", "friction: 2.0,", "0.02 stands for 2 %"),
            ("friction: 0.02,", "friction: 0.0,", "scatter.friction"),
            ("    provenance: made up\n", "", "provenance"),
            ("name: felt", 'name: " "', "name"),
        ]
    ),
    ("no materials", lambda: MaterialLibrary(fingertip="made up", materials=()), "0 materials"),
    ("no fingertip", renamed, "fingertip"),
    ("no candidates", lambda: next_touch(recognise(LIBRARY, []), ()), "0 candidates"),
    ("both", lambda: next_touch(recognise(LIBRARY, []), (PlannedSlip(1.0, 0.1, 1.0),)), "the other 0"),
    ("neither", lambda: next_touch(recognise(LIBRARY, []), (PlannedSlip(1.0, 0.0, 0.0),)), "speed"),
    ("unpressed", lambda: next_touch(recognise(LIBRARY, []), (PlannedSlip(0.0, 0.1, 0.0),)), "normal_force"),
    ("counts", lambda: Confusion(("a",), ("a", UNKNOWN), np.zeros((2, 2), dtype=np.int64)), "counts"),
    ("prior of a stranger", lambda: recognise(LIBRARY, [], {"d": 1.0}), "no such material"),
    ("prior of none", lambda: recognise(LIBRARY, [], {"PTFE": 0.0}), "above 0"),
    ("negative prior", lambda: recognise(LIBRARY, [], {"PTFE": -1.0}), "0 or above"),
    ("false rejection", lambda: recognise(LIBRARY, [], false_rejection=0.0), "false_rejection"),
    ("confidence", lambda: recognise(LIBRARY, [], confidence=1.5), "confidence"),
    ("stroke of 0", lambda: TouchEvidence.stroke(0.0, 0.01, 0.02), "friction"),
    ("error nan", lambda: TouchEvidence.stroke(0.5, NAN, 0.02), "error"),
    ("twist of 0", lambda: TouchEvidence.twist(1e-3, 0.01, 0.0, 2.0), "normal_force"),
    ("three columns", lambda: TouchEvidence(np.zeros(2), np.zeros((2, 3)), np.eye(2), 0.0), "rows"),
    ("negative", lambda: TouchEvidence(np.zeros(2), np.zeros((2, 4)), -np.eye(2), 0.0), "covariance"),
    ("no rows", lambda: TouchEvidence(np.zeros(0), np.zeros((0, 4)), np.zeros((0, 0)), 0.0), "at least 1"),
    ("negative bound", lambda: NeverSlipped.stroke(-0.1), "least_friction"),
    ("bound of nan", lambda: NeverSlipped(NAN, twist_row(1.0)), "least"),
]

RUBBING = [
    ("no strokes", lambda: measure_friction([]), "0 strokes"),
    ("not back", lambda: measure_friction([TwoWay(PAIR.there, PAIR.there)]), "does not reverse"),
    ("too short", lambda: measure_friction([PAIR], settling=0.48), "rub for longer"),
    ("not turned back", lambda: measure_spin([TwoWay(TURN, TURN)], measure_friction([PAIR])), "does not reverse"),
    ("slip not back", lambda: slip_load(TwoWay(PAIR.there, PAIR.there), SENSED.normal, 0.003), "does not reverse"),
    ("still", lambda: measure_friction([TwoWay(STILL, STILL)]), "does not move"),
    ("half a wrench", lambda: changed(STILL, wrench=STILL.wrench[:, :3]), "shape"),
    ("wrench of nan", lambda: changed(STILL, wrench=NAN * STILL.wrench), "finite"),
    ("time stands", lambda: changed(STILL, time=0.0 * STILL.time), "must rise"),
    ("ten samples", lambda: changed(STILL, time=STILL.time[:10]), "at least 40"),
    ("no force noise", lambda: SensorErrors(force_noise=0.0), "force_noise"),
    ("level 1", lambda: Estimate(1.0, 0.1, 0.1).interval(1.0), "level"),
    ("three loads", lambda: fit_limit_surface(SLIDES[:3]), "at least 4"),
    ("slides alone", lambda: fit_limit_surface(SLIDES), "of sliding and of spinning"),
    ("no slip", lambda: SlipLoad(1.0, 0.1, 0.0, 0.0, 0.0), "must slip"),
    ("load of nan", lambda: SlipLoad(1.0, NAN, 0.0, 0.01, 0.0), "finite"),
    ("forces alike", lambda: planned_slips((1.0, 1.5), (0.003, 0.003)), "at least 2 times"),
    ("five slips", lambda: planned_slips((1.0, 4.0), (0.003, 0.003), 5), "count"),
    ("no speeds", lambda: fit_speed_curve([]), "0 speeds"),
    ("creep", lambda: friction_ratio(fit_speed_curve(CREEPING), CREEPING[:1], 0.006, 0.01), "without creep"),
]

SLIP = [
    *((f"quantile {p}", lambda p=p: belief().quantile(p), "between 0 and 1") for p in (0.0, 1.0, NAN)),
    *((f"caution {p}", lambda p=p: LearntSurface(belief, p), "must be above 0") for p in (0.0, 0.6, NAN)),
    ("no threshold", lambda: PageTest(0.0, 1.0), "must"),
    ("whole ripple", lambda: GripDither(most_share=1.0), "must"),
    ("quick ripple", lambda: GripDither(frequency=300.0).half_cycle(1e-3), "must"),
    ("blow", lambda: ExcitedParameters(blow=1.0), "must"),
    ("no noise", lambda: LoadNoise(0.0), "must"),
    ("lever", lambda: LoadNoise.of_touch(0.01, 1e-4, 0.008, -1.0), "lever"),
    ("axes alike", lambda: PlaceWatch(2e-3).start([(1.0, 0.0, 0.0), (1.0, 0.0, 0.0)]), "right angles"),
]
ROWS = SURFACES + MATERIALS + RUBBING + SLIP


@pytest.mark.parametrize(("call", "message"), [row[1:] for row in ROWS], ids=[row[0] for row in ROWS])
def test_what_cannot_be_is_refused_by_name(call, message):
    with pytest.raises(InvalidValueError, match=message):
        call()


def test_names_are_each_a_materials_own_and_the_file_is_named(tmp_path):
    assert read_materials(TEXT).names == ("felt",)
    file = tmp_path / "twice.yaml"
    file.write_text(TEXT + TEXT[TEXT.index("  - name") :])
    with pytest.raises(InvalidValueError, match=r"twice.yaml: .*'felt'"):
        load_materials(file)
