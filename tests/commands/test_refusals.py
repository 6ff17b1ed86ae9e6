"""Bad inputs and the messages that refuse them: one row per mistake, for every configuration, plan and command."""

import math
import re
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from palpate.commands.calibrate.config import MatrixConfig, PayloadConfig, TareConfig
from palpate.commands.contact.config import ContactConfig
from palpate.commands.devices.config import EmulateDynamixelConfig, EmulateNetftConfig, EmulateUrConfig
from palpate.commands.sweep import SweepConfig
from palpate.commands.view.config import ViewConfig
from palpate.errors import InvalidValueError
from palpate.experiments.explore.config import ExploreConfig
from palpate.experiments.friction.config import FrictionConfig
from palpate.experiments.grasp.config import FASTEST_LIFT, HIGHEST_LIFT, GraspConfig
from palpate.experiments.regulate.config import RegulateConfig
from palpate.experiments.tip_calibration import TipCalibrationConfig, calibrate_tip
from palpate.robots.robot_file import DriftRateEntry
from support.explore_runs import plan_of as plan_exploration
from support.friction_runs import planned as plan_friction
from support.grasp_runs import plan_of as plan_grasp
from support.regulate_runs import planned as plan_regulation
from support.tiny_experiment import TINY
from support.typed_mistakes import answer_to

BELIEVED = {"believed_friction": 0.4, "believed_spin_length": 0.003}
SMALL_HELD = {"robot": "pinch-and-index", "force": 0.5, "speed": 0.02, "width": 0.012, "depth": 0.006}


def plan_explored(**fields):
    return plan_exploration(ExploreConfig(**fields))


def calibrate(**fields):
    return calibrate_tip(TipCalibrationConfig(**fields))


CONFIGURATIONS = {
    "explore": (
        ExploreConfig,
        [
            ({"friction": 30.0}, r"friction = 30: must be at most 10; for 30 % give 0\.3"),
            ({"spin_length": 4.0}, r"spin_length = 4 m: must be at most 0\.1 m; for 4 mm give 0\.004"),
            ({"friction": "0.5"}, r"friction = '0\.5': must be a number"),
            ({"force_noise": 10.0}, r"force_noise = 10 N: too large .* 15 N; for 10 mN give 0\.01"),
            ({"tip": (8.0,)}, r"tip = 8 m: must be at most 2 m; for 8 mm give 0\.008"),
            ({"force": "2"}, "force = '2': must be a number"),
            ({"force": None}, "force = None: must be a number"),
            ({"force": [2.0]}, r"force = \[2.0\]: must be a number"),
            (
                {"change": ((5.0, "forse", 4.0),)},
                "no live parameter is called 'forse'; did you mean",
            ),
            ({"object": "mesh"}, r"a file must describe it \(--file\)"),
            ({"object": "sphere", "file": "x.stl"}, r"a sphere is described by --size"),
            ({"object": "bumps", "scale": 0.001}, r"scale = 0\.001: is for files; bumps takes --size"),
            ({"object": "mesh", "file": "x.stl", "scale": 0.0}, r"scale = 0\.0"),
            ({"object": "mesh", "file": "x.stl", "size": (0.1,)}, r"a mesh takes nothing, the file gives it"),
            ({"object": "height-field", "file": "x.csv", "size": (0.1,)}, r"takes width and depth"),
            ({"object": "torus", "size": (0.1,)}, r"its radius of the ring and of its tube"),
            ({"center": (0.1,)}, r"center = 0\.1: give two numbers"),
            ({"center": (0.1, float("nan"))}, r"center = nan m"),
            ({"object": "scene"}, "a file must describe it"),
            ({"touch": "ball"}, "touch = ball: is for --object scene"),
            ({"object": "scene", "file": "a.xml", "scale": 0.001}, "a scene is in metres"),
        ],
    ),
    "regulate": (
        RegulateConfig,
        [
            ({"friction": 30.0}, r"friction = 30: must be at most 10; for 30 % give 0\.3"),
            ({"spin_length": 4.0}, r"spin_length = 4 m: must be at most 0\.1 m; for 4 mm give 0\.004"),
            ({"friction": "0.5"}, r"friction = '0\.5': must be a number"),
            ({"force_noise": 10.0}, r"force_noise = 10 N: too large .* 15 N; for 10 mN give 0\.01"),
            ({"tip": (8.0,)}, r"tip = 8 m: must be at most 2 m; for 8 mm give 0\.008"),
            ({"force": 20.0, "profile": "step"}, r"swing = 10 N \(swing: left out, half of it\): together"),
            ({"force": 14.0, "swing": 2.0, "profile": "step"}, "swing = 2 N: together"),
            ({"force": 14.0, "profile": "step"}, "together at most 15 N"),
            ({"profile": "sine", "swing": 2.0}, r"swing = 2 N: must be less than the force of 2 N"),
            ({"profile": "step", "duration": 1.0}, "twice the hold"),
            ({"motion": "table"}, "needs a file"),
            ({"motion": "circle", "motion_size": 0.2}, "at most 0.05 m"),
            (
                {"motion_size": 0.01},
                "motion_size = 0.01: is for --motion sine or circle; still takes no such",
            ),
            ({"motion": "sine", "motion_file": "a.csv"}, "motion_file = a.csv: is for --motion path or table"),
            ({"profile": "sine", "duration": 3.0}, "duration = 3: is for --profile constant or step or ramp"),
            ({"swing": 0.5}, "swing = 0.5: is for --profile step or ramp or sine; constant takes --duration"),
            ({"profile": "step", "frequencies": (1.0,)}, "frequencies = 1: is for --profile sine"),
            ({"profile": "hold"}, "must be one of constant, step, ramp, sine"),
            ({"motion": "spiral"}, "must be one of still, sine, circle, path, table"),
            ({"axis": (0.0, 0.0)}, "three numbers"),
            ({"force": -1.0}, "force = -1.0 N"),
            ({"profile": "sine", "frequencies": ()}, "give one at least"),
            ({"surface": "sine", "surface_amplitude": 5.0}, r"at most 0.1 m; for 5 mm give 0.005"),
            ({"surface": "sine", "surface_amplitude": 0.5}, r"surface_amplitude = 0.5 m: must be at most 0.1 m"),
            ({"surface_amplitude": 5.0}, "is for --surface sine; still takes no such options"),
            ({"surface": "leaving", "surface_speed": 20.0}, "at most 1 m/s; for 20 mm/s give 0.02"),
            ({"surface": "wavy"}, "must be one of still, sine, soft"),
            ({"object": "scene"}, "a file must describe it"),
            ({"file": "a.xml"}, "file = a.xml: is for --object scene"),
            ({"object": "scene", "file": "a.xml", "surface": "soft"}, "stands in its file"),
        ],
    ),
    "friction": (
        FrictionConfig,
        [
            ({"friction": 30.0}, r"friction = 30: must be at most 10; for 30 % give 0\.3"),
            ({"spin_length": 4.0}, r"spin_length = 4 m: must be at most 0\.1 m; for 4 mm give 0\.004"),
            ({"friction": "0.5"}, r"friction = '0\.5': must be a number"),
            ({"force_noise": 10.0}, r"force_noise = 10 N: too large .* 15 N; for 10 mN give 0\.01"),
            ({"tip": (8.0,)}, r"tip = 8 m: must be at most 2 m; for 8 mm give 0\.008"),
            ({"norm_exponent": 3.0}, "norm_exponent = 3: must lie between 1"),
            ({"load_exponent": 1.0}, "load_exponent = 1: must be at most 0.3333"),
            ({"spin_length": 3.0}, "spin_length = 3 m: must be at most 0.1 m; for 3 mm give 0.003"),
            ({"friction": 50.0}, "friction = 50: must be at most 10"),
            ({"skin_stiffness": 1e-3}, "skin_stiffness = 0.001 N/m: must be at least 1 N/m"),
            ({"speed": 1e-6}, "speed = 1e-06 m/s: must be at least 0.0001 m/s"),
            ({"speeds": (0.01, 1e-6)}, "speeds = 1e-06 m/s"),
            ({"object": "sphere", "size": (40.0,)}, "size = 40 m: must be at most 2 m; for 40 mm give 0.04"),
            ({"tip": (8.0,)}, "tip = 8 m: .*for 8 mm give 0.008"),
            ({"calibration": 5.0}, "calibration = 5: must be at most 0.2; 0.01 stands for 1 %"),
            ({"repeats": 0}, "repeats = 0: must be from 1 to 100"),
            ({"repeats": 100000}, "repeats = 100000: must be from 1 to 100"),
        ],
    ),
    "grasp": (
        GraspConfig,
        [
            ({"friction": 30.0}, r"friction = 30: must be at most 10; for 30 % give 0\.3"),
            ({"spin_length": 4.0}, r"spin_length = 4 m: must be at most 0\.1 m; for 4 mm give 0\.004"),
            ({"friction": "0.5"}, r"friction = '0\.5': must be a number"),
            ({"fingers": 4}, "2 or 3"),
            ({"fingers": 3}, "cylinder or a sphere"),
            ({"fingers": 3, "object": "sphere", "known": "nudged"}, "opposed"),
            ({"size": (0.08, 0.05, 0.06)}, "between the fingers"),
            ({"size": (0.05,)}, "takes 3"),
            ({"pull": 50.0}, "at most 8"),
            ({"offset": 0.05}, "within the object"),
            ({"controller": "coulomb", "against_ignoring_spin": True}, "leave one out"),
            ({"friction": -1.0}, "friction"),
            ({"margin": 50.0}, "margin = 50: must be at most 3; 0.12 stands for 12 %"),
            ({"lift_height": 5.0}, f"{HIGHEST_LIFT:g} m"),
            ({"lift_speed": 1.0}, f"{FASTEST_LIFT:g} m/s"),
            ({"preload": -1.0}, "preload"),
            ({"preload": 9.0}, "preload"),
            ({"announced": 0.0}, "announced"),
            ({"announced": 0.1, "load": "none"}, "announced"),
        ],
    ),
    "contact": (
        ContactConfig,
        [
            ({}, r"none given; give one of --sphere"),
            ({"sphere": 0.01, "plane": 0.01}, r"--sphere and --plane given"),
            ({"sphere": -0.01}, r"sphere = -0\.01 m"),
            ({"sphere": float("nan")}, r"sphere = nan m"),
            ({"ellipsoid": (0.01, 0.0, 0.01)}, r"ellipsoid = 0\.0 m"),
            ({"sphere": 8.0}, r"sphere = 8 m: must be at most 2 m; for 8 mm give 0\.008"),
            ({"ellipsoid": (8.0, 8.0, 12.0)}, r"ellipsoid = 8 m: must be at most 2 m"),
            ({"superellipsoid": (0.01, 0.01, 12.0, 4.0)}, r"superellipsoid = 12 m"),
            ({"superellipsoid": (0.01, 0.01, 0.01, 0.0)}, r"superellipsoid = 0\.0 as its exponent"),
            ({"sphere": 0.01, "center": (0.0, 0.0, float("inf"))}, r"center"),
            ({"sphere": 0.01, "force_noise": -1.0}, r"force_noise = -1\.0 N"),
            ({"sphere": 0.01, "force_noise": 0.1, "model": "hard"}, r"soft model only"),
        ],
    ),
    "TareConfig": (
        partial(TareConfig, sensor="sensor.yaml"),
        [
            ({"readings": None}, "none given"),
            ({"readings": "a", "live": "stage"}, "both given"),
            ({"readings": "a", "force_noise": 1.0}, "--live stage only"),
            ({"live": "stage", "gravity_direction": (0, 0, -1)}, "--readings only"),
            ({"readings": "a", "gravity_direction": (0, 0, 0)}, "direction"),
            ({"live": "stage", "duration": math.nan}, "duration"),
            ({"live": "stage", "duration": 1e6}, "600"),
            ({"live": "stage", "force_noise": -1.0}, "force_noise"),
            ({"live": "stage", "unknown_bias": (math.inf,) * 6}, "unknown_bias"),
            ({"live": "stage", "seed": -1}, "seed"),
        ],
    ),
    "PayloadConfig": (
        partial(PayloadConfig, sensor="sensor.yaml"),
        [
            ({"poses": "a", "up": (0, 0, 0)}, "up"),
            ({"poses": "a", "gravity": 0.0}, "gravity"),
            ({"poses": "a", "averaged": 0}, "averaged"),
        ],
    ),
    "MatrixConfig": (
        partial(MatrixConfig, sensor="sensor.yaml"),
        [
            ({"loads": "a", "raw_range": (1.0, -1.0)}, "raw_range"),
            ({"loads": "a", "raw_range": (-math.inf, 1.0)}, "raw_range"),
            ({"loads": "a", "channels": ("a", "a")}, "twice"),
        ],
    ),
    "EmulateUrConfig": (
        EmulateUrConfig,
        [
            ({"address": "localhost"}, "address"),
            ({"version": "4.3"}, "version"),
            ({"time_scale": 0.0}, "time_scale"),
            ({"plane": float("nan")}, "plane"),
            ({"stiffness": -1.0}, "stiffness"),
            ({"control_port": 70000}, "control_port"),
        ],
    ),
    "EmulateDynamixelConfig": (
        EmulateDynamixelConfig,
        [
            ({"servos": 0}, "servos"),
            ({"time_scale": 100.0}, "time_scale"),
            ({"wall": float("inf")}, "wall"),
            ({"control_port": 22}, "control_port"),
        ],
    ),
    "EmulateNetftConfig": (
        EmulateNetftConfig,
        [
            ({"rate": 0.0}, "rate"),
            ({"load": (float("nan"), 0.0, 0.0, 0.0, 0.0, 0.0)}, "load"),
        ],
    ),
    "view explore": (
        partial(ViewConfig, "explore"),
        [
            ({"time_scale": 0.0}, r"time_scale = 0"),
            ({"port": 70000}, r"port = 70000"),
            ({"video": Path("a.gif")}, r"name one"),
        ],
    ),
    "view a.mcap": (
        partial(ViewConfig, "a.mcap"),
        [
            ({"set": ("force=3",)}, r"leave them out"),
            ({"video": Path("a.mp4")}, r"must end in \.gif"),
            ({"picture": Path("a.jpg")}, r"must end in \.png"),
            ({"video": Path("a.gif"), "time_scale": float("inf")}, r"finite"),
        ],
    ),
    "sweep": (
        partial(SweepConfig, TINY),
        [({"seeds": 0}, "seeds"), ({"jobs": 0}, "jobs"), ({"ray": " "}, "ray")],
    ),
    "sensor that drifts": (
        DriftRateEntry,
        [
            ({"force": -1e-3}, "force"),
            ({"force": 10.0}, "force"),
            ({"moment": 1.0}, "moment"),
        ],
    ),
}
"""Refused as soon as the values are given."""

PLANS = {
    "explore": (
        plan_explored,
        [
            ({"width": 0.5}, r"(?s)at most .*--size"),
            (
                {"change": ((5.0, "force", 300.0),)},
                "force = 300 N: must lie between 0.3 and 15 N",
            ),
            ({"object": "mesh", "file": Path("none.stl")}, r"none\.stl.*there is no such file"),
            ({"robot": "pinch-and-index", "size": (0.09,)}, "reach|inside|off"),
        ],
    ),
    "explore what is held": (
        partial(plan_explored, **SMALL_HELD),
        [
            ({"object": "bumps"}, "take a sphere, an ellipsoid, a box or a cylinder"),
            ({"object": "torus"}, "take a sphere, an ellipsoid, a box or a cylinder"),
        ],
    ),
    "regulate": (
        plan_regulation,
        [
            ({"change": ((1.0, "force", 20.0),)}, "change after 1 s: force = 20 N: must lie between"),
            ({"force": 0.25}, "force = 0.25 N: .* must be at least 0.3 N"),
            ({"robot": "stage-nano17", "force": 7.0, "profile": "step"}, "must be at most 7.5 N"),
            ({"motion": "circle", "motion_speed": 1.0}, "robot's limit, 0.25 m/s"),
            ({"profile": "sine", "frequencies": (300.0,)}, "four periods of control"),
            ({"drift": 0.2}, "no range"),
            (
                {"robot": "stage-nano17", "surface": "sine", "landing_speed": 0.004},
                "robot's limit of 10 N",
            ),
            ({"surface": "sine", "surface_speed": 0.08}, "at most 0.05 m/s, the fastest that is followed$"),
            ({"surface": "sine", "surface_speed": 20.0}, "at most 0.05 m/s.*; for 20 mm/s give 0.02$"),
            ({"stiffness": 100.0}, "must be larger than its compression"),
        ],
    ),
    "friction": (
        plan_friction,
        [
            ({"library": Path("none.yaml")}, r"library = none\.yaml: cannot be read.*--library simulated"),
            ({"loads": ()}, "loads: there are none"),
            ({"loads": (2.0, 1.0)}, "loads = 2 1: must rise"),
            ({"loads": (0.1,)}, "must be at least"),
            ({"loads": (2.0, 3.0), "fit_exponents": True}, "at least twice the least"),
            ({"stribeck_speed": 0.005}, "stribeck_speed = 0.005 m/s: does nothing without --static-friction"),
            ({"drift": 0.06}, "give --force-noise and --moment-noise"),
            ({"friction": 0.5, "static_friction": 0.4}, "static_friction = 0.4: must be at least friction"),
            ({"object": "sphere", "size": (0.1, 0.1)}, "a sphere takes 1"),
            ({"object": "sphere", "most_travel": 0.02}, "most_travel = 0.02 m: must be at most 0.006 m"),
            ({"speed": 0.2}, "rub more slowly"),
            ({"travel": 0.05}, "travel = 0.05 m: must be at most 0.025 m"),
            ({"robot": "stage", "fit_exponents": True}, "it cannot turn its tip"),
        ],
    ),
    "grasp": (
        plan_grasp,
        [
            ({"friction": 0.01}, r"\(--friction\); with mu = .* \(planned with\) and a"),
            (
                {"mass": 1.2, "known": "untouched", **BELIEVED},
                "planned with",
            ),
        ],
    ),
    "grasp by a real hand": (
        partial(plan_grasp, robot="ur5e-hand"),
        [
            ({}, "the friction of a real object is unknown"),
            ({"believed_friction": 0.4}, "the friction of a real object is unknown"),
            ({**BELIEVED, "friction": 0.5}, "friction = 0.5: is the truth of a simulated object"),
            ({**BELIEVED, "load": "shake"}, "nothing is simulated that pulls at a real object"),
            ({**BELIEVED, "against_ignoring_spin": True}, "leave them out on a robot"),
        ],
    ),
    "tip": (
        calibrate,
        [
            ({"forces": (0.01, 1.0)}, r"the least is 0\.01 N and must be at least"),
        ],
    ),
}
"""Refused before anything moves."""


def rows(tables):
    """The rows of tables, each with its call and a name that begins as that of its table."""
    return [
        pytest.param(call, fields, message, id=f"{name}-{i}")
        for name, (call, mistakes) in tables.items()
        for i, (fields, message) in enumerate(mistakes)
    ]


@pytest.mark.parametrize(("call", "fields", "message"), [*rows(CONFIGURATIONS), *rows(PLANS)])
def test_a_bad_value_is_refused_with_its_reason(call, fields, message):
    with pytest.raises(InvalidValueError, match=message):
        call(**fields)


@pytest.mark.parametrize("kind", [ExploreConfig, RegulateConfig, FrictionConfig, GraspConfig])
def test_the_largest_values_that_make_sense_are_accepted(kind):
    assert kind(friction=10.0, spin_length=0.1, out="x") == kind(friction=10.0, spin_length=0.1, out=Path("x"))
    assert kind(friction=np.float32(0.5)).friction == 0.5


TYPED = [
    ("explore --strategy spiral --width 0.02", "width = 0.02: is for --strategy raster or taps or active"),
    ("explore --object sphere --radius 0.03", "--beyond; the object's size is --size"),
    ("explore --strategy spiral --radius 20", "radius = 20 m: must be at most 2 m; for 20 mm give 0.02"),
    ("explore --strategy spiral --radius 0.001", "spacing = 0.002 m: must not exceed the radius"),
    ("explore --strategy spiral --radius 0.06", "a spiral of radius 0.06 m leaves the part of the sphere"),
    ("explore --strategy contour --curve edge --below 0.01", "below = 0.01 m: is for --curve level"),
    ("explore --strategy contour --below 0.2", "no curve goes once round the sphere so far below its top"),
    ("explore --strategy contour --object bumps --curve edge", "take --curve level"),
    ("explore --strategy active --area 90", "for 90 % give 0.9"),
    ("explore --strategy active --time 0", "time = 0"),
    ("explore --strategy active --accuracy -1e-5", "accuracy = -1e-05"),
    ("explore --strategy taps --spacing 5", "spacing = 5 m: must be at most 2 m; for 5 mm give 0.005"),
    ("explore --strategy taps --width 0.2 --depth 0.02", "a grid of taps of 0.2 x 0.02 m leaves the part"),
    ("explore --force-swing 2", "force_swing = 2 N: about 2 N at most 1.7 N"),
    ("explore --force-swing=-1", "force_swing = -1.0 N: must be a finite number, 0 or above"),
    ("explore --force 14.8 --force-swing 0.5", "at most 0.2 N"),
    ("explore --force-swing 0.5 --force-period 0.01", "force_period = 0.01 s: must be at least 0.1 s"),
    ("explore --force-swing 0.5 --force-period 0", "force_period = 0"),
    ("explore --force-swing 0.5 --change 1 force 3", "change after 1 s: force = 3 N: must lie between 2 and 2 N"),
    ("explore --force-swing 1 --force 7 --robot stage-nano17", "goes up to 8 N and must be at most 7.5 N"),
    ("emulate ur --address 127.0.9.97 --fault nonsense 1", "drop_rst"),
    ("emulate dynamixel --baud-rate 1234", "1000000"),
    ("emulate netft --address 127.0.9.98 --rate 9000", "7000"),
    ("emulate netft --address 127.0.9.99 --fault nonsense 1", "out_of_range"),
    ("friction --loads 1 --travel 0.05", "travel = 0.05 m: must be at most 0.025 m"),
    ("grasp --friction-file none.yaml", "none.yaml"),
    ("explore --speed 20", ("speed = 20 m/s", "0.1 m/s", "for 20 mm/s give 0.02")),
    ("explore --speed 0", "speed = 0 m/s"),
    ("explore --force -2", ("force = -2 N", "between 0.3 and 15 N")),
    ("explore --force nan", "force = nan N"),
    ("explore --force 100", "force = 100 N"),
    ("explore --force 0.5 --force-noise 0.1", ("force = 0.5 N", "with a force noise of 0.1 N")),
    ("explore --object ellipsoid --size 0.05", ("takes 3 numbers", "three semi-axes", "0.05 0.04 0.03")),
    ("explore --size -0.04", "size = -0.04 m"),
    ("explore --tip 0.008 0.01", ("tip = 0.008 0.01", "one number", "three")),
    ("explore --tip 1e-6", ("tip = 1e-06 m", "compression")),
    ("explore --tip 8", ("tip = 8 m", "at most 2 m", "for 8 mm give 0.008")),
    ("explore --size 40", ("size = 40 m", "for 40 mm give 0.04")),
    ("explore --width 20", ("width = 20 m", "for 20 mm give 0.02")),
    ("explore --width 0.2", ("0.2 x 0.04 m", "at most", "--size")),
    ("explore --spacing 0.1", ("raster spacing = 0.1 m", "depth = 0.04 m")),
    ("explore --spacing 2", ("raster spacing = 2 m", "depth = 0.04 m; for 2 mm give 0.002")),
    ("explore --strategy spiral --spacing 2", ("spiral spacing = 2 m", "= 0.02 m; for 2 mm give 0.002")),
    ("explore --friction 0", "friction = 0"),
    ("explore --stiffness 1e6", ("stiffness = 1e+06 N/m", "at most 120000 N/m", "time step")),
    ("explore --friction 0.005", ("friction = 0.005", "at least 0.01")),
    ("explore --seed -1", "seed = -1"),
    ("explore --period 0.5", ("period = 0.5 s", "0.008 s")),
    ("explore --spacing 1e-5", ("spacing = 1e-05 m", "rows at least")),
    ("explore --speed 1e-4", ("speed = 0.0001 m/s", "creeps")),
    ("explore --period 0.0003", ("period = 0.0003 s", "whole number of time steps")),
    ("explor --dry-run", "explor: no such command; did you mean palpate explore? there are explore, friction"),
    ("version", "did you mean palpate --version?"),
    ("help", "did you mean palpate --help?"),
    ("robot chek", "robot chek: no such command; did you mean palpate robot check? there are list"),
    ("qqqq", "qqqq: no such command; there are explore"),
    ("explore sphere", "options have names here: did you mean --object sphere?"),
    ("explore --force 2 sphere", "did you mean --object sphere?"),
    ("explore --beyond spiral", "did you mean --strategy spiral?"),
    ("explore --object spere", "did you mean sphere?"),
    ("explore --object=spere", "did you mean sphere?"),
    ("regulate --motion sin", "did you mean sine?"),
    ("calibrate new x.yaml --preset nano", "did you mean nano17?"),
    ("sweep explor", "did you mean explore?"),
    ("friction --mu 0.8", "did you mean --friction?"),
    ("grasp --mu=0.8", "did you mean --friction?"),
    ("explore --robot emulated-hand", "it has 2 fingers, this takes one; for a hand there is palpate grasp"),
    ("view explore --host 192.0.2.1", "host = '192.0.2.1': "),
    ("view explore --host a..b --json", "host = 'a..b': "),
    ("explore --object cube", "sphere"),
    ("explore --sped 1", "palpate: --sped 1: no such option; did you mean --speed?"),
    ("log exprot", "export"),
    (
        "robot check",
        "palpate: ROBOT is missing: A robot file, or a robot that comes with palpate. Example: palpate",
    ),
    ("robot show a b", "palpate: b: unexpected; `palpate robot show --help` explains the options"),
    ("explore --speed", "palpate: --speed: a value is missing; give --speed FLOAT"),
    ("explore --speed 2N", "palpate: speed = 2N: must be a number; units are not typed, this option is in m/s"),
    (
        "explore --force 2N",
        "palpate: force = 2N: must be a number; units are not typed, this option is in N: give 2",
    ),
    ("explore --speed=20mm/s", "this option is in m/s: give 0.02"),
    (
        "explore --size 0.05 40mm 30",
        "palpate: size = 40mm: must be a number; units are not typed, this option is in m: give",
    ),
    (
        "explore --seed 2s",
        "palpate: seed = 2s: must be a whole number; units are not typed, and this option has none",
    ),
    (
        "grasp --margin 10%",
        "palpate: margin = 10%: must be a number; units are not typed, and this option has none: give 0.1",
    ),
    ("explore --speed fast", "palpate: speed = fast: must be a number"),
    (
        "emulate ur --plane 10cm",
        "palpate: plane = 10cm: must be a number; units are not typed, this option is in m: give 0.1",
    ),
    ("emulate fault 1 ur e_stop 2x", "palpate: value = 2x: must be a number"),
    ("emulate ur --fault e_stop", "palpate: fault = e_stop: must be [NAME VALUE ...]"),
    ("--hlp", "palpate: --hlp: no such command; did you mean palpate --help?"),
    ("robot check .", "is a folder"),
    ("explore --config none.yaml", "config = none.yaml"),
    ("explore --robot stge", "robot = 'stge'"),
    ("robot show ur5e", "palpate comes with emulated-hand, emulated-ur5e, panda-hand, panda-sim"),
    (
        "calibrate matrix --loads a.csv --sensor s.yaml --raw-range 10 -10",
        "raw_range = 10 -10: give the lower one first",
    ),
    ("explore --speed 20", "palpate: speed = 20 m/s: "),
    ("regulate --force=-1", "palpate: force = -1"),
    ("view run.mcap --port=-1", "palpate: port = -1: must be from 0 to 65535"),
    ("robot show stage --sensor=-1", "palpate: sensor = -1: "),
    ("robot show stage --sensor 0", "no sensor file"),
    ("robot show stage --sensor 1", "last finger is 0"),
    ("view", "Example: palpate view explore --set "),
    ("view nothing", "neither an experiment nor a folder"),
    (f"sweep {TINY} --vary forse=1,2", ("no option forse", "did you mean force?")),
    (f"sweep {TINY} --vary force=1,20", ("with force=20", "at most 15 N")),
    (f"sweep {TINY} --show force_mean", ("force_mean", "did you mean force_mean_n?")),
    ("sweep regulat", ("did you mean regulate?", "explore", "grasp", "module:Class")),
    (f"sweep {TINY.replace('.py', '.txt')}", "no module"),
    (f"sweep {TINY} --seeds 0", "seeds = 0"),
    (f"sweep {TINY} --ray nowhere", ("ray = nowhere", "HOST:PORT")),
    (
        f"sweep {TINY} --ray 127.0.0.1:1",
        ("ray = 127.0.0.1:1", "cannot be reached", "ray start --head"),
    ),
    (f"sweep {TINY} --config no.yaml", ("no.yaml", "cannot be read")),
]
"""Typed after `palpate`, and what the answer names."""


@pytest.mark.parametrize(("typed", "message"), TYPED)
def test_a_mistake_on_the_command_line_is_answered_in_one_line(typed, message, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    said = answer_to(typed.split(), capsys)
    for words in (message,) if isinstance(message, str) else message:
        assert words in said
    assert not re.search("Traceback|Options:|Config\\b", said)
    assert said.startswith("palpate: "), "one form for all errors"
    assert not list(tmp_path.iterdir()), "nothing is written"
