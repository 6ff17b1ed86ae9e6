"""Robot files: what people write is read as they mean it, and what they get wrong is named."""

import math
from pathlib import Path

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.errors import InvalidValueError
from palpate.nearest_name import unit_of, without_unit
from palpate.open_kinds import as_written
from palpate.robots.robot import ROBOT_TEXT, load_robot, read_robot, shipped_robots
from palpate.robots.robot_file import FingerEntry, RobotFile, read_robot_file
from palpate.robots.simulated_stage import StageEntry
from palpate.runtime.supervision.limits import Limits
from palpate.sensing.ft import PayloadEntry
from palpate.surfaces import Ellipsoid
from palpate.yaml_text import yaml_text

STAGE = Path(shipped_robots()["stage"]).read_text(encoding="utf-8")
MINIMAL = """
palpate_robot: 1
name: mine
backend: {kind: stage, mass_kg: 5, bandwidth_rad_per_s: 1e2, following_error_m: 25e-4, time_step_s: 5e-4}
period_s: 1e-3
fingers:
  - surface: {kind: ellipsoid, semi_axes_m: [8e-3, .008, 1.2e-2], center_m: [0, 0, 2e-2]}
    payload: {mass_kg: 3e-2, center_of_mass_m: [0, 0, 0.02]}
"""


def refused(text):
    with pytest.raises(InvalidValueError) as found:
        read_robot_file(text)
    message = str(found.value)
    assert len(message.splitlines()) == 1
    return message


def test_what_people_write_is_read_as_they_mean_it():
    robot = read_robot_file(MINIMAL)
    assert isinstance(robot.backend, StageEntry)
    assert robot.backend.mass == 5.0
    assert robot.period == 0.001
    surface = robot.fingers[0].surface.surface()
    assert isinstance(surface, Ellipsoid)
    assert surface.semi_axes == (0.008, 0.008, 0.012)
    assert surface.center.tolist() == [0.0, 0.0, 0.02]
    assert robot.fingers[0].payload == PayloadEntry(mass=0.03, center_of_mass=(0.0, 0.0, 0.02))
    assert robot.fingers[0].noise is None
    assert robot.fingers[0].simulated_sensor is None
    assert robot.limits == Limits()


def test_the_limits_of_turning_are_read_and_have_defaults():
    text = STAGE.replace("angular_speed_rad_per_s: 2.5", "angular_speed_rad_per_s: 0.7")
    limits = read_robot_file(text.replace("_rad_per_s2: 250", "_rad_per_s2: 40")).limits
    assert (limits.angular_speed, limits.angular_acceleration) == (0.7, 40.0)
    assert (Limits().angular_speed, Limits().angular_acceleration) == (2.5, 250.0)


def test_the_key_of_a_limit_is_its_name_with_a_unit():
    keys = {field.name: field.encode_name for field in msgspec.structs.fields(Limits)}
    assert {name: without_unit(key) for name, key in keys.items()} == {name: name for name in keys}
    assert all(unit_of(key) for key in keys.values())


@pytest.mark.parametrize("name", shipped_robots())
def test_shipped_robots_read_back_from_their_texts_to_the_very_same(name):
    robot = load_robot(name)
    assert read_robot_file(yaml_text(as_written(robot.file))) == robot.file
    again = read_robot(robot.texts)
    assert (again.file, again.sensors, again.texts) == (robot.file, robot.sensors, robot.texts)


def test_the_shipped_stage_shows_every_key_that_there_is():
    written = msgspec.to_builtins(read_robot_file(STAGE))
    for key in (*written["backend"], *written["limits"], *written["fingers"][0]["noise"], "payload", "center_m"):
        assert f"{key}:" in STAGE


reals = st.floats(1e-5, 1e-1)
vectors = st.tuples(*[st.floats(-2.0, 2.0)] * 3)


@pytest.mark.slow
@given(
    radius=reals, center=vectors, force=reals, lower=vectors, period=reals,
    name=st.text(min_size=1, max_size=30).filter(lambda s: s.strip() and s.isprintable()),
)  # fmt: skip
def test_every_number_and_name_reads_back_to_the_same_bits(radius, center, force, lower, period, name):
    limits = Limits(force=force, workspace_lower=lower, workspace_upper=(3.0, 3.0, 3.0))
    base = read_robot_file(MINIMAL)
    finger = msgspec.structs.replace(base.fingers[0], surface=sphere(radius, center))
    robot = RobotFile(name=name, backend=base.backend, period=period, fingers=(finger,), limits=limits)
    assert read_robot_file(yaml_text(as_written(robot))) == robot


def sphere(radius, center):
    kind = type(read_robot_file(STAGE).fingers[0].surface)
    return kind(radius=radius, center=center)


SURFACES = {
    "{kind: sphere, radius_m: 0.01}": "Sphere",
    "{kind: ellipsoid, semi_axes_m: [0.01, 0.02, 0.03]}": "Ellipsoid",
    "{kind: cylinder, radius_m: 0.01}": "Cylinder",
    "{kind: plane, distance_m: 0.01}": "Plane",
    "{kind: paraboloid, radii_m: [0.01, 0.02]}": "Paraboloid",
    "{kind: capsule, radius_m: 0.01, length_m: 0.03}": "Capsule",
    "{kind: rounded_box, half_lengths_m: [0.01, 0.01, 0.02], radius_m: 0.002}": "RoundedBox",
}


@pytest.mark.parametrize(("text", "kind"), SURFACES.items())
def test_every_kind_of_fingertip_is_built_where_the_file_puts_it(text, kind):
    turned = text[:-1] + ", center_m: [0, 0, 0.1], rotvec_rad: [0, 1.5707963267948966, 0]}"
    old = "{kind: ellipsoid, semi_axes_m: [8e-3, .008, 1.2e-2], center_m: [0, 0, 2e-2]}"
    surface = read_robot_file(MINIMAL.replace(old, turned)).fingers[0].surface
    assert type(surface.surface()).__name__ == kind
    assert surface.center == (0.0, 0.0, 0.1)
    # a quarter turn about y takes the surface's z axis to the sensor's x axis
    assert surface.rotation[:, 2] == pytest.approx([1.0, 0.0, 0.0], abs=1e-15)
    built = surface.surface()
    assert "center=[0.0, 0.0, 0.1]" in repr(built)
    assert f"rotation={surface.rotation.tolist()}" in repr(built)


MISTAKES = [
    # pace
    ("  kind: simulated ", "  kind: realtime ", ["pace.kind = 'realtime'", "did you mean real_time?"]),
    ("  kind: simulated ", "  kind: real_time\n  overrun: skipp ", ["pace.overrun", "did you mean skip?"]),
    ("  kind: simulated ", "  kind: real_time\n  priority: 500 ", ["pace", "priority = 500", "1 to 99"]),
    ("  kind: simulated ", "  kind: real_time\n  spin_s: 0.002 ", ["spin = 0.002 s", "shorter than the period"]),
    ("  kind: simulated ", "  kind: simulated\n  priority: 50 ", ["pace.priority: unknown key"]),
    # misspelt
    ("radius_m", "raduis_m", ["fingers[0].surface.raduis_m", "did you mean radius_m?", "line 26, column 7"]),
    ("mass_kg: 5.0", "mas_kg: 5.0", ["backend.mas_kg", "did you mean mass_kg?", "line 10, column 3"]),
    ("backend:", "backedn:", ["backedn: unknown key", "did you mean backend?"]),
    ("fingers:", "finger:", ["finger: unknown key", "did you mean fingers?"]),
    ("limits:", "Limits:", ["Limits: unknown key", "did you mean limits?"]),
    ("workspace_lower_m:", "workspace_low_m:", ["limits.workspace_low_m", "workspace_lower_m"]),
    ("kind: stage", "kind: stagee", ["backend.kind = 'stagee'", "did you mean stage?", "line 9"]),
    ("kind: sphere", "kind: spere", ["fingers[0].surface.kind = 'spere'", "did you mean sphere?", "capsule"]),
    ("kind: sphere", "kin: sphere", ["fingers[0].surface.kind: missing", "is kin misspelt?"]),
    ("palpate_robot:", "palpate_robt:", ["no robot file", "palpate_robot: 1", "'palpate_robt' misspelt"]),
    # another unit, or none
    ("radius_m: 0.008", "radius_mm: 8", ["fingers[0].surface.radius_mm", "write radius_m, in m"]),
    ("mass_kg: 0.03", "mass_g: 30", ["fingers[0].payload.mass_g", "write mass_kg, in kg"]),
    ("period_s: 0.001", "period_ms: 1", ["period_ms", "write period_s, in s"]),
    ("period_s: 0.001", "period: 0.001", ["period: unknown key", "write period_s, in s"]),
    ("speed_m_per_s", "speed_mm_per_s", ["limits.speed_mm_per_s", "write speed_m_per_s, in m/s"]),
    ("speed_m_per_s", "speed_m_s", ["limits.speed_m_s", "write speed_m_per_s, in m/s"]),
    ("acceleration_m_per_s2", "acceleration", ["limits.acceleration", "acceleration_m_per_s2, in m/s^2"]),
    ("bandwidth_rad_per_s", "bandwidth_Hz", ["backend.bandwidth_Hz", "write bandwidth_rad_per_s, in rad/s"]),
    ("spin_torque_Nm: 1.0", "spin_torque_mNm: 1000", ["limits.spin_torque_mNm", "spin_torque_Nm, in Nm"]),
    ("joint_lower_rad: []", "joint_lower_deg: [-180]", ["limits.joint_lower_deg", "joint_lower_rad, in rad"]),
    ("sample_age_s", "sample_age_ms", ["limits.sample_age_ms", "write sample_age_s, in s"]),
    ("moment_Nm: 0", "moment_N: 0", ["fingers[0].noise.moment_N", "write moment_Nm, in Nm"]),
    # right key, number in another unit
    ("radius_m: 0.008", "radius_m: 8", ["fingers[0].surface.radius_m = 8", "to 0.5 m", "another unit?"]),
    ("period_s: 0.001", "period_s: 1000", ["period_s = 1000", "from 1e-05 to 1 s"]),
    (
            "following_error_m: 0.0025",
            "following_error_m: 2.5",
            ["backend.following_error_m = 2.5", "from 1e-06 to 0.1 m"],
        ),
    ("sample_age_s: 0.02", "sample_age_s: 20", ["limits.sample_age_s = 20", "at most 1 s"]),
    ("speed_m_per_s: 0.25", "speed_m_per_s: 250", ["limits.speed_m_per_s = 250", "at most 10 m/s"]),
    ("[1, 1, 1]", "[1000, 1000, 1000]", ["limits.workspace_upper_m = 1000", "at most 100 m"]),
    ("angular_speed_rad_per_s", "angular_speed_deg_per_s", ["write angular_speed_rad_per_s"]),
    ("angular_speed_rad_per_s", "angular_speed", ["limits.angular_speed: unknown key", "angular_speed_rad_per_s"]),
    # impossible
    *(
        (f"{key}: {given_}", f"{key}: {value}", [key])
        for key, given_ in (("angular_speed_rad_per_s", "2.5"), ("angular_acceleration_rad_per_s2", "250"))
        for value in ("0 #", "-1 #", ".nan #", ".inf #", "1e5 #", "fast #")
    ),
    ("radius_m: 0.008", "radius_m: -0.008", ["fingers[0].surface.radius_m = -0.008: must be from"]),
    ("radius_m: 0.008", "radius_m: 0", ["fingers[0].surface.radius_m = 0.0: must be from"]),
    ("radius_m: 0.008", "radius_m: .nan", ["fingers[0].surface.radius_m = nan: must be from"]),
    ("force_N: 20 ", "force_N: .inf ", ["limits.force_N = inf N", "finite"]),
    ("[-1, -1, -1]", "[1, -1, -1]", ["limits.workspace_lower_m, x, is 1", "the smaller one"]),
    ("joint_upper_rad: []", "joint_upper_rad: [1]", ["limits.joint_lower_rad has 0 numbers", "joint_upper_rad 1"]),
    ("mass_kg: 0.03", "mass_kg: -1", ["fingers[0].payload.mass_kg = -1", "0 or above"]),
    ("palpate_robot: 1", "palpate_robot: 2", ["palpate_robot = 2", "reads version 1"]),
    # another type
    ("mass_kg: 5.0", "mass_kg: 5 kg", ["backend.mass_kg = '5 kg': must be a number", "plain number in SI units"]),
    ("mass_kg: 5.0", "mass_kg: 5,0", ["backend.mass_kg = '5,0': must be a number", "plain number"]),
    ("mass_kg: 5.0", "mass_kg: yes", ["backend.mass_kg = 'yes': must be a number"]),
    ("mass_kg: 5.0", "mass_kg:    ", ["backend.mass_kg: no value: must be a number", "write one"]),
    ("mass_kg: 5.0", "mass_kg: [5.0]", ["backend.mass_kg = [5.0]: must be a number"]),
    ("center_m: [0, 0, 0]", "center_m: [0, 0]", ["fingers[0].surface.center_m", "length 3, got 2"]),
    ("center_m: [0, 0, 0]", "center_m: [0, 0, up]", ["fingers[0].surface.center_m[2] = 'up': must be a number"]),
    ("name: simulated three", "name: 3 #", ["name = 3: must be text", "put it in quotes"]),
    ("  - surface: ", "    surface: ", ["fingers = {", "must be a list of mappings with the keys surface"]),
    # missing, twice, both
    ("period_s: 0.001", "", ["period_s: missing"]),
    ("      radius_m: 0.008", "", ["fingers[0].surface.radius_m: missing"]),
    ("  kind: stage", "", ["backend.kind: missing", "write kind: and one of emulated_hand"]),
    ("time_step_s: 0.0005", "mass_kg: 4", ["'mass_kg' appears a second time", "line 13"]),
    ("    payload:", "    sensor: a.yaml\n    payload:", ["fingers[0]: both given of payload", "give one"]),
    # no YAML
    ("period_s: 0.001", "period_s 0.001", ["no valid YAML", "line"]),
    ("backend:", "backend: *stage", ["line"]),
    ("period_s:", "\tperiod_s:", ["no valid YAML", "line"]),
]  # fmt: skip


@pytest.mark.parametrize(("before", "after", "words"), MISTAKES)
def test_a_typical_mistake_is_named_with_its_place_and_what_would_be_right(before, after, words):
    assert before in STAGE
    message = refused(STAGE.replace(before, after, 1))
    for word in words:
        assert word in message


def test_a_finger_has_either_a_payload_or_a_sensor():
    assert "neither given of payload" in refused(MINIMAL.split("    payload")[0])
    surface = read_robot_file(MINIMAL).fingers[0].surface
    with pytest.raises(InvalidValueError, match="sensor = "):
        FingerEntry(surface=surface, sensor=" ")


def test_a_robot_has_a_finger():
    assert "fingers: must be a list of length >= 1" in refused(MINIMAL.split("fingers:")[0] + "fingers: []")


def test_a_name_is_a_shipped_robot_or_a_file(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert load_robot("stage").file == load_robot("stage.yaml").file == read_robot_file(STAGE)
    (tmp_path / "stage.yaml").write_text(MINIMAL)
    assert load_robot("stage.yaml").file.name == "mine", "a file goes before a shipped robot"
    assert load_robot("stage").file == read_robot_file(STAGE), "a bare name is a shipped one"
    (tmp_path / "stage.yaml").rename(tmp_path / "robot")
    assert load_robot("./robot").file.name == "mine"
    for name, words in {
        "stgae": ["did you mean stage?", "stage, stage-nano17"],
        "ur5e.yaml": ["no such file and no such robot", "stage, stage-nano17"],
        "robot": ["no such robot; if you mean the file, say ./robot (a robot file ends in .yaml)"],
        "folder/stage.yaml": ["no such file"],
        ".": ["is a folder"],
    }.items():
        with pytest.raises(InvalidValueError) as found:
            load_robot(name)
        assert all(word in str(found.value) for word in words), str(found.value)


def test_a_sensor_file_is_found_next_to_the_robot_file_and_its_mistakes_name_both(tmp_path):
    text = MINIMAL.split("    payload")[0] + "    sensor: sub/tip.yaml\n"
    robot, folder = tmp_path / "r.yaml", tmp_path / "sub"
    robot.write_text(text)
    with pytest.raises(InvalidValueError, match=r"r\.yaml: .*fingers\[0\]\.sensor.*cannot read .*tip\.yaml"):
        load_robot(str(robot))
    folder.mkdir()
    sensor = load_robot("stage-nano17").texts["sensor-0.yaml"]
    (folder / "tip.yaml").write_text(sensor)
    assert load_robot(str(robot)).sensors[0].model.startswith("ATI Nano17")
    (folder / "tip.yaml").write_text(sensor.replace("mass_kg", "mass_g"))
    with pytest.raises(InvalidValueError, match=r"r\.yaml: .*sub/tip\.yaml: payload\.mass_g.*write mass_kg"):
        load_robot(str(robot))


def test_texts_of_a_log_must_be_complete():
    texts = dict(load_robot("stage-nano17").texts)
    assert read_robot({**texts, "experiment.yaml": "not looked at"}).texts == texts
    with pytest.raises(InvalidValueError, match=r"sensor-0\.yaml' is missing"):
        read_robot({ROBOT_TEXT: texts[ROBOT_TEXT]})
    with pytest.raises(InvalidValueError, match=r"'robot\.yaml' is missing"):
        read_robot({})


def test_a_robot_has_no_number_that_is_not_finite():
    for name in shipped_robots():
        text = yaml_text(as_written(load_robot(name).file))
        assert math.isfinite(load_robot(name).file.period)
        assert ".inf" not in text
        assert ".nan" not in text
