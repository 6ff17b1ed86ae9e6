"""Values that controllers refuse, each with the message that names the value: one table."""

import math
from dataclasses import replace

import pytest

from palpate.controllers import (
    ExploreParameters,
    ForceGain,
    IdentifyController,
    IdentifyParameters,
    LandingModel,
    NormalAxis,
    NormalTracker,
    RampForce,
    Raster,
    SineForce,
    Tones,
    VelocityTable,
    force_gain,
    series_stiffness,
    tracking_delay,
)
from palpate.controllers.damped_contact import DampedContact, SpringMounting
from palpate.controllers.grip.belief import KnownSurface
from palpate.controllers.grip.controller_sequence import ControllerSequence
from palpate.controllers.grip.expected_load import ExpectedLoad
from palpate.controllers.grip.grasp_solver import RobustGrip
from palpate.controllers.grip.lift import LiftController, LiftParameters
from palpate.controllers.grip.parameters import GripParameters
from palpate.controllers.grip.rubbed_need import NeedWithinRubbed
from palpate.controllers.grip.shared_grip import SharedGrip
from palpate.controllers.grip.slip_safe import SlipSafeGrip
from palpate.controllers.grip.turn import TurnParameters
from palpate.controllers.margins import whole_delays
from palpate.controllers.paths import (
    Active,
    EdgeSteering,
    Goal,
    LevelSteering,
    PathFollower,
    PathPlane,
    Spiral,
    Stroke,
    Taps,
    Waypoints,
)
from palpate.controllers.paths.rows import RasterRows
from palpate.controllers.regulate_parameters import RegulateParameters, live_regulation
from palpate.controllers.rub_program import SurveyWanted
from palpate.controllers.rubs import Rub
from palpate.controllers.tangent_motion import PathTable
from palpate.controllers.touch_sequence import TouchParameters, TouchSequence, TouchStep
from palpate.errors import InvalidValueError
from palpate.friction.limit_surface import LimitSurface
from palpate.runtime.data import ArmSample, Observation
from palpate.spatial import IDENTITY, ZERO
from support.felt_finger import finger
from support.rubbed_plane import WANTED as RUBBING

PERIOD, PLANE, TRIPLE = 1e-3, PathPlane(), ((0.0, 0.0, 0.0),) * 2
NOT_POSITIVE = (0.0, -1.0, math.nan, math.inf)
KNOWN, GAIN = KnownSurface(LimitSurface(0.5, 0.004)), force_gain(20e3, 0.0215)
EXPLORE = ExploreParameters(force=2.0, speed=0.02, gain=GAIN, lead=0.0215)
MOUNTED = DampedContact(20e3, 0.03, 5e4, SpringMounting(2e3, 60.0, 1.0))
LIVE = live_regulation(RegulateParameters(GAIN, 0.02, 1.0, 2.0, (0.5, 5.0)))
ONE_FINGER = Observation(0.0, ArmSample(0.0, ZERO, IDENTITY, ZERO), (finger(),))


def grip(fingers=2):
    return SlipSafeGrip(fingers, KNOWN, PERIOD)


NOT_POSITIVE_CALLS = {
    "explore force": (lambda x: replace(EXPLORE, force=x), "force"),
    "explore speed": (lambda x: replace(EXPLORE, speed=x), "speed"),
    "explore lead": (lambda x: replace(EXPLORE, lead=x), "lead"),
    "explore landing": (lambda x: replace(EXPLORE, landing_speed=x), "landing_speed"),
    "explore approach": (lambda x: replace(EXPLORE, approach_distance=x), "approach_distance"),
    "explore slew": (lambda x: replace(EXPLORE, slew=x), "slew"),
    "least force": (lambda x: replace(EXPLORE, force_range=(x, 1.0)), "force_range"),
    "largest force": (lambda x: replace(EXPLORE, force_range=(0.1, x)), "force_range"),
    "least speed": (lambda x: replace(EXPLORE, speed_range=(x, 1.0)), "speed_range"),
    "largest speed": (lambda x: replace(EXPLORE, speed_range=(0.1, x)), "speed_range"),
    "gain stiffness": (lambda x: force_gain(x, 0.02), "stiffness"),
    "gain delay": (lambda x: force_gain(15e3, x), "delay"),
    "loop gain": (lambda x: force_gain(15e3, 0.02, x), "gain"),
    "tracker period": (lambda x: NormalTracker(x, 0.01, 0.02), "period"),
    "tracker smoothing": (lambda x: NormalTracker(PERIOD, x, 0.02), "time_constant"),
    "raster width": (lambda x: Raster(x, 0.04, 0.004), "width"),
    "raster depth": (lambda x: Raster(0.04, x, 0.004), "depth"),
    "raster spacing": (lambda x: Raster(0.04, 0.04, x), "spacing"),
    "follower": (lambda x: PathFollower(((0.0, 0.0), (0.03, 0.0)), x), "acceleration"),
}

REFUSED = {
    # gains, forces and landing
    "series of a zero": (lambda: series_stiffness(1.0, 0.0), "stiffness"),
    "negative lag": (lambda: tracking_delay(1e-3, -0.02), "servo_lag"),
    "no period": (lambda: tracking_delay(0.0, 0.02), "period"),
    "delay below sampling": (lambda: whole_delays(0.5e-3, PERIOD), "one and a half periods"),
    "sine that pulls": (lambda: SineForce(1.0, 1.0, 1.0), "pull"),
    "ramp rate": (lambda: RampForce(1.0, 2.0, -1.0), "rate"),
    "tones that pull": (lambda: Tones(2.0, 2.0, (1.0,)), r"amplitude = 2 N.*have to pull"),
    "touch above the force": (lambda: LandingModel(1e4, 0.02, 1e4).speed(1.0, touch_force=2.0), "touch_force"),
    "unstable on a mounting": (
        lambda: MOUNTED.margins(ForceGain(20.0 * MOUNTED.gain(0.0215).gain, MOUNTED.series, 0.0215)),
        "unstable on this contact; take at most",
    ),
    "live force": (lambda: LIVE.check("force", 5.1), "must lie between"),
    "live gain too high": (lambda: LIVE.check("force_gain", 1.3 * GAIN.gain), "must lie between"),
    "live gain of zero": (lambda: LIVE.check("force_gain", 0.0), "must lie between"),
    "force outside its range": (
        lambda: RegulateParameters(GAIN, 0.02, 1.0, 2.0, (2.5, 5.0)),
        "must lie in its range",
    ),
    "nothing identified": (
        lambda: IdentifyController(IdentifyParameters(), PERIOD).result(),
        "nothing was identified",
    ),
    "axis of zero length": (lambda: NormalAxis(ZERO), "axis"),
    # tables of motion
    "one time": (lambda: PathTable((0.0,), TRIPLE[:1]), "two at least"),
    "equal path times": (lambda: PathTable((0.0, 0.0), TRIPLE), r"times\[1\] = 0 s: must be later than 0 s"),
    "equal times": (lambda: VelocityTable((1.0, 1.0), TRIPLE), r"times\[1\] = 1 s: must be later than 1 s"),
    "lacking time": (lambda: VelocityTable((1.0,), TRIPLE), "1 times and 2 velocities"),
    # paths
    "raster spacing above depth": (lambda: Raster(0.04, 0.04, 0.05), "must not exceed"),
    "one corner": (lambda: PathFollower(((0.0, 0.0),), 0.5), "at least 2"),
    "equal corners": (lambda: PathFollower(((0.0, 0.0), (0.0, 0.0), (0.1, 0.0)), 0.5), "corner"),
    "no direction": (lambda: PathFollower(((0.0, 0.0), (0.0, 0.0)), 0.5), "direction"),
    "spiral spacing": (lambda: Spiral(0.01, 0.02), "spacing"),
    "one waypoint": (lambda: Waypoints(((0.0, 0.0),)), "at least 2"),
    "equal waypoints": (lambda: Waypoints(((0.0, 0.0), (0.0, 0.0))), "apart"),
    "waypoint of NaN": (lambda: Waypoints(((0.0, 0.0), (math.nan, 0.0))), "finite"),
    "no taps": (lambda: Taps(()), "points"),
    "empty stroke": (lambda: Stroke(()), "corners"),
    "plane that scales": (
        lambda: PathPlane(rotation_base_plane=((2.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))),
        "rotation",
    ),
    "begin beside the raster": (lambda: RasterRows(Raster(0.05, 0.05, 0.004), begin=(0.03, 0.0)), "begin"),
    "lean": (lambda: EdgeSteering(PLANE, math.radians(89.0), 4e-3, (1.0, 0.0, 0.0)), "lean"),
    "offset": (lambda: EdgeSteering.at_offset(PLANE, 4.4e-3, 4e-3, (1.0, 0.0, 0.0)), "offset"),
    "outward along the axis": (lambda: EdgeSteering(PLANE, 0.5, 4e-3, (0.0, 0.0, 1.0)), "outward"),
    "lookahead": (lambda: LevelSteering(PLANE, lookahead=0.0), "lookahead"),
    "error of zero": (lambda: Goal(0.0), "goal error"),
    "infinite error": (lambda: Goal(error=math.inf), "error"),
    "negative error": (lambda: Goal(error=-1e-5), "error"),
    "area above 1": (lambda: Goal(area=1 + 1e-9), "goal area"),
    "negative area": (lambda: Goal(area=-1e-9), "goal area"),
    "area of NaN": (lambda: Goal(area=math.nan), "goal area"),
    "length of zero": (lambda: Goal(length=0.0), "length"),
    "time of zero": (lambda: Goal(time=0.0), "goal time"),
    "negative time": (lambda: Goal(time=-1.0), "goal time"),
    "speed of NaN": (lambda: Goal(speed=math.nan), "goal speed"),
    "infinite speed": (lambda: Goal(speed=math.inf), "goal speed"),
    "negative field": (lambda: Active(-1.0, 0.02), "width"),
    # rubs and touches
    "rub without motion": (lambda: Rub(1.0, 0.0, 0.0, 0.5), "must slide or turn"),
    "short rub": (lambda: Rub(1.0, 0.01, 0.0, 0.05), r"duration = 0.05 s: must be more than 0.08 s"),
    "spin of NaN": (lambda: Rub(1.0, 0.0, math.nan, 0.5), "spin"),
    "infinite spin": (lambda: Rub(1.0, 0.0, math.inf, 0.5), "spin"),
    "negative infinite spin": (lambda: Rub(1.0, 0.0, -math.inf, 0.5), "spin"),
    "rub that ends before it turns": (lambda: Rub(1.0, 0.0, 2.0, 0.5, 5.0), "2 rad/s speeds up"),
    "no angular acceleration": (lambda: Rub(1.0, 0.0, 2.0, 0.5, 0.0), "angular_acceleration"),
    "falling loads": (lambda: SurveyWanted((2.0, 1.0), 0.01), "each above the one before"),
    "fast rub": (lambda: SurveyWanted((1.0,), 0.1), r"speed = 0.1 m/s: .* rub more slowly"),
    "minus one slip": (lambda: SurveyWanted((1.0, 4.0), 0.01, exponent_slips=-1), "exponent_slips = -1"),
    "one slip": (lambda: SurveyWanted((1.0, 4.0), 0.01, exponent_slips=1), "exponent_slips = 1"),
    "five slips": (lambda: SurveyWanted((1.0, 4.0), 0.01, exponent_slips=5), "exponent_slips = 5"),
    "no touches": (
        lambda: TouchSequence(TouchParameters(RUBBING.gain, None, 0.005), (), PERIOD),
        "there are no touches",
    ),
    "no forces": (lambda: TouchStep(ZERO, IDENTITY, (0.0, 0.0, -1.0), (), 0.01), "there are none"),
    # grips
    "one finger": (lambda: grip(1), "fingers = 1"),
    "fewer fingers observed": (lambda: grip().step(ONE_FINGER), "fingers"),
    "grip margin": (lambda: GripParameters(margin=-0.1), "margin"),
    "least grip above the largest": (lambda: GripParameters(least_grip=30.0), "least_grip"),
    "first grip": (
        lambda: LiftController(grip(), PERIOD, LiftParameters(first_grip=25.0)),
        r"first_grip = 25 N: must be at most largest_grip = 20 N",
    ),
    "load that ends first": (lambda: ExpectedLoad(1.0, 0.5), "end"),
    "negative load": (lambda: ExpectedLoad(1.0, 2.0, -1.0), "force"),
    "load from NaN": (lambda: ExpectedLoad(math.nan, 2.0), "begin"),
    "endless load": (lambda: ExpectedLoad(1.0, math.inf), "end"),
    "rubbed up to zero": (lambda: NeedWithinRubbed(0.0), "largest"),
    "negative friction error": (lambda: RobustGrip(3, -0.1, 0.25), "friction"),
    "friction error of NaN": (lambda: RobustGrip(3, math.nan, 0.25), "friction"),
    "negative trusted": (lambda: SharedGrip(3, KNOWN, PERIOD, None, trusted=-0.1), "trusted"),
    "trusted NaN": (lambda: SharedGrip(3, KNOWN, PERIOD, None, trusted=math.nan), "trusted"),
    "no angles": (lambda: TurnParameters(()), "angles"),
    "angle of NaN": (lambda: TurnParameters((math.nan,)), "angles"),
    "turn rate": (lambda: TurnParameters((0.1,), rate=0.0), "rate"),
    "infinite travel": (lambda: TurnParameters((0.1,), travel=math.inf), "travel"),
    "negative gain": (lambda: TurnParameters((0.1,), gain=-1.0), "gain"),
    "tolerance": (lambda: TurnParameters((0.1,), tolerance=0.0), "tolerance"),
    "empty sequence": (lambda: ControllerSequence(), "at least one"),
}


@pytest.mark.parametrize("bad", NOT_POSITIVE)
@pytest.mark.parametrize("name", NOT_POSITIVE_CALLS)
def test_a_value_that_is_not_positive_and_finite_is_refused_by_name(name, bad):
    call, message = NOT_POSITIVE_CALLS[name]
    with pytest.raises(InvalidValueError, match=message):
        call(bad)


@pytest.mark.parametrize("name", REFUSED)
def test_a_bad_value_is_refused_with_its_reason(name):
    call, message = REFUSED[name]
    with pytest.raises(InvalidValueError, match=message):
        call()
