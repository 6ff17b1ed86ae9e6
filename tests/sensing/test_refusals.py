"""Bad inputs of contact sensing, and the words with which each is refused."""

import math
from dataclasses import replace

import msgspec
import numpy as np
import pytest
from grip.held_pin import PIN

from palpate import Solver, Sphere, contact_from_wrench, contacts_from_wrenches
from palpate.errors import InvalidValueError
from palpate.sensing.curvature import shape_operator
from palpate.sensing.ft import (
    Butterworth,
    CalibrationMap,
    ContactEntry,
    CriticallyDamped,
    FirstOrder,
    FTPipeline,
    Notch,
    WrenchFilter,
    average_bias,
    choose_calibration,
    fit_calibration,
    identify_mounting,
    identify_payload,
    specific_force_from_gravity,
    specific_force_from_rotations,
    with_calibration,
    with_payload,
)
from palpate.sensing.ft.health import DriftWatch, HealthLimits
from palpate.sensing.ft.touch_detector import ContactDetector
from palpate.sensing.held import (
    ContactBounds,
    ExternalWrenches,
    FingersFelt,
    HeldBody,
    HeldTool,
    ObjectMotion,
    external_wrenches,
    locate_tool,
)
from palpate.sensing.tip_calibration import TargetKind, Touches, TouchTarget, fit_tip, tip_shape
from palpate.sensing.uncertainty import contact_uncertainty
from palpate.surfaces import Cylinder
from sensing.ft.payload_examples import NANO17, WRIST, about, identify, measured, poses
from sensing.ft.sensor_examples import RANGES, fingertip, known_loads, linear_sensor
from support.touched_targets import TARGETS, typed_tip

BALL, PUSH, NAN, INF = Sphere(1.0), [0, 0, -1, 0, 0, 0], math.nan, math.inf
NO_WRENCHES = ("abc", ["a"] * 6, None, [1, 2, 3, [4], 5, 6], {"f": 1}, [1 + 2j] * 6)
NO_BATCHES = ([1] * 6, [[1] * 5], [[1] * 7] * 3, 1.0, np.ones((2, 3, 6)), np.ones((6, 2)), np.empty((0, 5)))


def spread(covariance):
    return contact_uncertainty(BALL, contact_from_wrench(BALL, PUSH), covariance)


CONTACTS = [
    *((f"one of {bad!r:.20}", lambda bad=bad: contact_from_wrench(BALL, bad), "wrench") for bad in NO_WRENCHES),
    *(
        (f"two of {bad!r:.20}", lambda bad=bad: contacts_from_wrenches(BALL, [bad, bad]), "wrenches")
        for bad in NO_WRENCHES
    ),
    *(
        (f"batch {np.shape(bad)}", lambda bad=bad: contacts_from_wrenches(BALL, bad), r"wrenches.*6\)")
        for bad in NO_BATCHES
    ),
    *(
        (
            f"model {bad!r}, {n} rows",
            lambda bad=bad, n=n: contacts_from_wrenches(BALL, np.ones((n, 6)), model=bad),
            f"model = {bad!r}.*soft.*hard",
        )
        for bad in ("sof", "", "SOFT", None, 1)
        for n in (0, 2)
    ),
    ("no model", lambda: Solver(BALL, []), "model"),
    ("one, no model", lambda: contact_from_wrench(BALL, PUSH, {}), "model"),
    ("no surface", lambda: Solver([]), "surface"),
    ("one, no surface", lambda: contact_from_wrench([], PUSH), "surface"),
    ("five numbers", lambda: Solver(BALL)(np.ones(5)), "wrench has shape"),
    (
        "curvature of a number",
        lambda: shape_operator(1.0, np.zeros((1, 3))),
        r"curvature of a float is not known.*register",
    ),
    ("variances", lambda: spread(np.ones(6)), r"shape \(6,\).*np.diag"),
    ("negative variance", lambda: spread(np.diag([1, 1, 1, 1, 1, -1.0])), "negative eigenvalues"),
    ("lopsided", lambda: spread(np.eye(6) + np.eye(6, k=1)), "symmetric"),
    ("covariance of nan", lambda: spread(np.full((6, 6), NAN)), "finite"),
    ("covariance of a word", lambda: spread("noise"), "must be numbers"),
]


# --- force/torque sensors ---

NOISE = np.repeat([0.003, 16e-6], 3)
TIME = np.linspace(0.0, 1.0, 1000)[:, None]
STILL = NOISE * np.random.default_rng(1).normal(size=(1000, 6))
SENSITIVITY, OFFSET = linear_sensor(6, np.random.default_rng(0))
LOADS = known_loads(20, np.random.default_rng(1))
CHANNELS = np.arange(6)
LIMITS = (12.0, 12.0, 17.0, 0.12, 0.12, 0.12)
ANGLES = np.linspace(0.0, 5.0, 24)
TURNED = about((1, 0, 0), ANGLES)
UP = poses(24, 4)
HUNG = measured(WRIST, UP, np.random.default_rng(4))[0]
QUICK = ContactEntry(touch_force=0.012, release_force=0.01)
SLOW = ContactEntry(touch_force=2.5 / 320, release_force=1.0 / 320)
DATED = {"date": "2026-11-21", "provenance": "test"}


def tare(motion):
    return average_bias(STILL + motion, noise=NOISE)


def fitted(change, raw=LOADS @ SENSITIVITY.T + OFFSET):
    known = change(LOADS)
    return fit_calibration(raw[: len(known)], known, ranges=RANGES)


def deaf(noise=0.0, channels=6):
    """The fit of a sensor that does not feel My."""
    shown = (LOADS @ (SENSITIVITY * [1, 1, 1, 1, 0, 1]).T)[:, :channels]
    return fitted(lambda w: w, shown + noise * np.random.default_rng(2).normal(size=shown.shape))


def doubtful_payload():
    rng = np.random.default_rng(0)
    found = identify_payload(
        UP, np.hstack([-0.03 * UP, rng.normal(size=(24, 3))]), force_sd=0.003, moment_sd=16e-6
    )
    return with_payload(fingertip(), found, **DATED)


def doubtful_calibration():
    rng = np.random.default_rng(0)
    known = rng.normal(size=(20, 6))
    fit = fit_calibration(known + 0.2 * rng.normal(size=(20, 6)), known, ranges=np.ones(6))
    return with_calibration(fingertip(), fit, raw_unit="V", raw_range=(-9, 9), **DATED)


def products(*pairs):
    return CalibrationMap(tuple(map(tuple, np.eye(6, 6 + len(pairs)).tolist())), (0.0,) * 6, pairs)


def hung(up):
    return identify(WRIST, up, measured(WRIST, up, np.random.default_rng(0))[0])


def mounted(up, wrench, noise=0.01):
    return identify_mounting(up, wrench, force_sd=noise, moment_sd=1e-2 * noise)


def flat(up):
    return 9.81 * up * [1, 1, 0] / np.linalg.norm(up * [1, 1, 0], axis=1, keepdims=True)


def detector(**changes):
    return ContactDetector(**{"touch_force": 0.2, "release_force": 0.1, "noise": 0.01, "period": 0.001, **changes})


def sensor(**changes):
    return FTPipeline(msgspec.structs.replace(fingertip(), **changes))


SENSORS = [
    ("swinging", lambda: tare(0.02 * np.sin(20.0 * TIME) * np.eye(6)[1]), "Fy has a standard deviation"),
    ("pushed", lambda: tare(1e-4 * (TIME > 0.5) * np.eye(6)[5]), "Mz has a standard deviation"),
    ("creeping", lambda: tare(0.0105 * TIME * np.eye(6)[2]), "Fz changed by 0.01"),
    ("50 readings", lambda: average_bias(np.zeros((50, 6)), noise=NOISE), "50"),
    ("five axes", lambda: average_bias(np.zeros((200, 5)), noise=NOISE), r"\(n, 6\)"),
    ("readings of nan", lambda: average_bias(np.full((200, 6), NAN), noise=NOISE), "nan"),
    ("readings of a word", lambda: average_bias("x", noise=NOISE), "numbers"),
    ("no Mz", lambda: fitted(lambda w: w * [1, 1, 1, 1, 1, 0]), "do not vary in Mz "),
    ("constant Fz", lambda: fitted(lambda w: np.where(CHANNELS == 2, -9.0, w)), "do not vary in Fz "),
    ("two missing", lambda: fitted(lambda w: w * [1, 0, 1, 1, 1, 0]), "do not vary in (Mz; Fy|Fy; Mz) "),
    # all forces in x act at one height, so that each comes with the same moment about y
    (
        "coupled",
        lambda: fitted(lambda w: np.where(CHANNELS == 4, 0.01 * w[:, :1], w)),
        r"do not vary in \+0\... (My|Fx) -0\...",
    ),
    ("tiny Mz", lambda: fitted(lambda w: w * [1, 1, 1, 1, 1, 1e-6]), "do not vary in Mz "),
    (
        "lonely Mz",
        lambda: fitted(lambda w: np.where((np.arange(20) > 0)[:, None] & (CHANNELS == 5), 0.0, w)),
        "load 0, .* only one of",
    ),
    ("few loads", lambda: fitted(lambda w: w[:7]), "7 loads: give 8"),
    ("loads of five", lambda: fitted(lambda w: w[:, :5]), r"must be \(n, 6\)"),
    ("infinite load", lambda: fitted(lambda w: np.where(w == w[3, 2], np.inf, w)), r"wrench\[3, 2\] = inf"),
    ("deaf", lambda: deaf(1e-4), "hardly respond to My "),
    ("deaf, no noise", deaf, "hardly respond to My "),
    ("five channels", lambda: deaf(channels=5), "5 channels"),
    (
        "kelvins",
        lambda: choose_calibration(LOADS @ SENSITIVITY.T, LOADS, ranges=RANGES, temperature=np.full(20, 298.0)),
        "from -50 to 150 degrees",
    ),
    ("product of no channel", lambda: products((0, 6)), "channels 0 and 6"),
    ("product backwards", lambda: products((2, 1)), "channels 2 and 1"),
    ("product twice", lambda: products((1, 1), (1, 1)), "no pair twice"),
    (
        "beyond Nyquist",
        lambda: WrenchFilter((Butterworth(500.0),), 1000.0),
        r"cutoff_Hz = 500: must be from 0.01 to 490 Hz .* Nyquist",
    ),
    (
        "too slow a filter",
        lambda: WrenchFilter((FirstOrder(1e-3),), 1000.0),
        "cutoff_Hz = 0.001: must be from 0.01",
    ),
    ("notch beyond Nyquist", lambda: WrenchFilter((Notch(600.0, 3.0),), 1000.0), "center_Hz = 600"),
    ("no cutoff", lambda: Butterworth(0.0), "cutoff_Hz"),
    ("negative cutoff", lambda: Butterworth(-3.0), "cutoff_Hz"),
    ("wide notch", lambda: Notch(50.0, 0.2), "quality"),
    ("notch of nan", lambda: Notch(50.0, NAN), "quality"),
    ("negative notch", lambda: Notch(-1, 2), "center_Hz"),
    ("no range", lambda: HealthLimits((0.0, *LIMITS[1:])), "above 0"),
    ("combined nan", lambda: HealthLimits(LIMITS, combined=NAN), "combined"),
    ("raw backwards", lambda: HealthLimits(LIMITS, raw=(1.0, -1.0)), "raw"),
    ("stuck at once", lambda: HealthLimits(LIMITS, stuck_samples=1), "stuck_samples"),
    ("drift within samples", lambda: DriftWatch(LIMITS, 0.005, 0.001), "averaging_time"),
    ("negative drift", lambda: DriftWatch((*LIMITS[:5], -1.0), 1.0, 0.001), "above 0"),
    (
        "threshold in the noise",
        lambda: detector(noise=0.05),
        r"noise of 0.05 N would pass for a touch; give at least 0.25 N",
    ),
    ("release above touch", lambda: detector(release_force=0.3), "must not exceed touch_force"),
    ("touch of nan", lambda: detector(touch_force=NAN), "touch_force"),
    ("negative time", lambda: detector(release_time=-1.0), "release_time"),
    ("five readings", lambda: sensor().step((0.0,) * 5, (0, 0, 9.81)), r"5 channels: sensor ATI Nano17 .* has 6"),
    ("touch in the noise", lambda: sensor(contact=QUICK, filters=()), "noise of"),
    (
        "touch in held noise",
        lambda: sensor(calibration=None, contact=SLOW, filters=(CriticallyDamped(20.0),), device_rate=50.0),
        "would pass for a touch",
    ),
    *(
        (f"rate {rate}", lambda rate=rate: sensor(device_rate=rate), "device_rate_Hz")
        for rate in (0.0, -1.0, 1001.0, 0.5, NAN)
    ),
    ("sampled never", lambda: sensor(sample_rate=NAN), "sample_rate_Hz"),
    ("two lines", lambda: sensor(provenance="two\nlines"), "provenance"),
    ("doubtful payload", doubtful_payload, r"payload is not to be used: .*noise"),
    ("doubtful calibration", doubtful_calibration, r"calibration is not to be used: .*left out"),
    (
        "one pose",
        lambda: hung(about((0, 0, 1), 0 * ANGLES)),
        "same direction of gravity.*weight cannot be distinguished from the force bias",
    ),
    ("about gravity", lambda: hung(about((0, 0, 1), ANGLES)), "turning about the vertical changes nothing"),
    (
        "two poses",
        lambda: hung(about((1, 0, 0), np.where(ANGLES > 2, 0.5, 0.0))),
        "centre of mass along that direction cannot be",
    ),
    ("hardly tilted", lambda: hung(about((1, 0, 0), 1e-4 * ANGLES)), "same direction of gravity"),
    ("three poses", lambda: hung(about((1, 1, 0), ANGLES)[:3]), "3 poses: give 4"),
    ("unit vectors", lambda: hung(TURNED / 9.80665), "unit vectors become so by"),
    ("moving", lambda: hung(TURNED * np.where(ANGLES > 4.9, 1.2, 1.0)[:, None]), r"\[23\].*not at rest"),
    ("wrong sign", lambda: identify(WRIST, UP, -HUNG), "wrong sign"),
    ("one row less", lambda: identify(WRIST, UP[:-1], HUNG), "23 rows and wrench has 24"),
    ("poses, five axes", lambda: identify(WRIST, UP, HUNG[:, :5]), r"must be \(n, 6\)"),
    (
        "gravity of nan",
        lambda: identify(WRIST, np.where(UP[2, 1] == UP, NAN, UP), HUNG),
        r"specific_force\[2, 1\] = nan",
    ),
    ("wrenches of words", lambda: identify(WRIST, UP, [["a"] * 6] * 24), "must be numbers"),
    ("no noise", lambda: identify_payload(UP, HUNG, force_sd=0.0, moment_sd=1.0), "force_sd = "),
    *(
        (f"no rotation, {k}", lambda bad=bad: specific_force_from_rotations(bad), "rotation_sensor_base")
        for k, bad in enumerate(
            [np.zeros((2, 3, 3)), -np.eye(3)[None], np.eye(3), np.full((1, 3, 3), NAN), [[["x"] * 3] * 3]]
        )
    ),
    ("no gravity", lambda: specific_force_from_gravity([[0.0, 0.0, 1.0], [0.0, 0.0, 0.0]]), "is zero"),
    (
        "never turned over",
        lambda: mounted(flat(UP), measured(NANO17, UP, np.random.default_rng(0), 0.0)[0], 1e-4),
        "turn the flange over",
    ),
    (
        "weightless",
        lambda: mounted(UP, np.random.default_rng(0).normal(size=(24, 6)) * np.repeat([0.1, 1e-3], 3), 0.1),
        "lost in the noise",
    ),
]


# --- held objects and touched targets ---

FINGERS = FingersFelt(
    wrench=np.zeros((5, 2, 6)),
    rotation=np.array([np.eye(3)] * 2),
    position=np.zeros((2, 3)),
    noise=np.array([np.eye(6)] * 2),
    zero=np.array([np.eye(6)] * 2),
    pose=np.array([np.eye(6)] * 2),
)
TOUCH = Touches(
    np.zeros(2, int), [[0, 0, 1, 0, 0, 0]] * 2, np.ones((2, 6)), [np.eye(3)] * 2, np.zeros((2, 3)), [0.0, 1.0]
)
TIP = typed_tip((0.008,))

HELD = [
    (
        "three places",
        lambda: replace(FINGERS, position=np.zeros((3, 3))),
        r"position has shape \(3, 3\): must be \(2, 3\) or \(5, 2, 3\)",
    ),
    ("negative zero", lambda: replace(FINGERS, zero=-FINGERS.zero), "without negative eigenvalues"),
    ("one wrench", lambda: replace(FINGERS, wrench=np.zeros(6)), r"wrench has shape \(6,\)"),
    ("negative mass", lambda: HeldBody(mass=-1.0), "mass"),
    (
        "other fingers",
        lambda: external_wrenches(FINGERS, HeldBody(mass=0.1), ObjectMotion.at_rest((0.0, 0.0, 9.81))).less(
            ExternalWrenches.measured(np.zeros((3, 6)), np.eye(6))
        ),
        "same fingers",
    ),
    ("exact pose", lambda: locate_tool(HeldTool(PIN), TOUCH, TARGETS), "pose_covariance of the tool"),
    ("no friction", lambda: ContactBounds(friction=0.0), "friction"),
    ("pulling", lambda: fit_tip(replace(TOUCH, wrench=-TOUCH.wrench), TARGETS, TIP), "its force pulls"),
    ("no touches", lambda: fit_tip(TOUCH.selected(np.zeros(2, dtype=bool)), TARGETS, TIP), "no touches"),
    ("plate without normal", lambda: TouchTarget("plate", TargetKind.PLANE, (0.0, 0.0, 0.0)), "outward normal"),
    ("cylinder", lambda: tip_shape(Cylinder(0.01)), "is a Cylinder"),
    ("no rotation", lambda: replace(TOUCH, rotation=2.0 * TOUCH.rotation), "no rotation"),
    (
        "deviations of an ellipsoid",
        lambda: typed_tip((0.008, 0.006, 0.01), deviation_degree=2),
        "only spheres have them",
    ),
]

ROWS = CONTACTS + SENSORS + HELD


@pytest.mark.parametrize(("call", "message"), [row[1:] for row in ROWS], ids=[row[0] for row in ROWS])
def test_bad_inputs_are_refused_by_name(call, message):
    with pytest.raises(InvalidValueError, match=message):
        call()
