"""A sensor or fingertip of somebody's own is named in a robot file and read as strictly as palpate's."""

import pytest

from palpate.errors import InvalidValueError
from palpate.open_kinds import as_written, declared_in, kind_named
from palpate.robots.robot_file import read_robot_file
from palpate.robots.sensor_kind import SensorKind
from palpate.robots.surface_entries import SurfaceKind
from palpate.surfaces import Sphere
from palpate.yaml_text import yaml_text

MODULE = """
from palpate.errors import InvalidValueError
from palpate.open_kinds import Settings
from palpate.robots.sensor_kind import SensorKind
from palpate.robots.surface_entries import PlacedSurface
from palpate.surfaces import Sphere


class Box(SensorKind, Settings, frozen=True, kw_only=True):
    port: int

    def __post_init__(self):
        if self.port < 1:
            raise InvalidValueError(f"port = {self.port}: must be at least 1")

    def device(self, finger):
        return "a box"


class Tip(PlacedSurface, frozen=True, kw_only=True):
    radius_m: float

    def surface(self):
        return Sphere(self.radius_m, center=self.center)


class Half(SensorKind, Settings, frozen=True, kw_only=True):
    pass


class Other(Settings, frozen=True, kw_only=True):
    pass
"""

ROBOT = """\
palpate_robot: 1
name: mine
backend: {kind: rig}
period_s: 0.002
pace: {kind: real_time}
fingers:
  - surface: {kind: "own.py:Tip", radius_m: 0.01, center_m: [0, 0, 0.02]}
    payload: {mass_kg: 0.03}
    noise: {force_N: 0.01, moment_Nm: 0.0001}
    sensor_device: {kind: "own.py:Box", port: 3}
"""


@pytest.fixture(autouse=True)
def own(tmp_path, monkeypatch):
    (tmp_path / "own.py").write_text(MODULE)
    monkeypatch.chdir(tmp_path)


def test_classes_of_ones_own_are_read_with_their_settings_and_written_again():
    robot = read_robot_file(ROBOT)
    surface, written = robot.fingers[0].surface, as_written(robot)["fingers"][0]
    assert isinstance(surface.surface(), Sphere)
    assert surface.center == (0.0, 0.0, 0.02)
    assert written["sensor_device"]["port"] == 3
    assert written["surface"]["radius_m"] == 0.01


@pytest.mark.parametrize(
    ("before", "after", "words"),
    [
        ("port: 3", "prot: 3", "fingers[0].sensor_device.prot: unknown key; did you mean port? (line 10"),
        ("port: 3", "port: 0", "fingers[0].sensor_device.port = 0: must be at least 1 (line 10"),
        ("port: 3", "port: x", "fingers[0].sensor_device.port = 'x': must be a whole number (line 10"),
        (", port: 3", "", "fingers[0].sensor_device.port: missing"),
        ("own.py:Box", "own.py:Bax", "nothing in own.py is called Bax; did you mean Box? (line 10"),
        ("own.py:Box", "own.py:Half", "Half lacks device; see palpate.robots.sensor_kind.SensorKind"),
        ("own.py:Box", "own.py:Other", "must be a class that inherits from palpate.robots.sensor_kind.SensorKind"),
        ("own.py:Box", "own.py:Tip", "must be a class that inherits from palpate.robots.sensor_kind.SensorKind"),
        ("own.py:Box", "netfft", "did you mean netft? known: "),
        ("own.py:Tip", "gone.py:Tip", "fingers[0].surface.kind = gone.py:Tip: there is no file gone.py"),
        ('kind: "own.py:Box", ', "", "fingers[0].sensor_device.kind: missing; write kind: and one of "),
        ('{kind: "own.py:Box", port: 3}', "3", "sensor_device = 3: must be a mapping"),
        ("radius_m: 0.01,", "radius_m: 0.01, center_m: [0, 0],", "appears a second time (line 7"),
        ("[0, 0, 0.02]", "[0, 0]", "fingers[0].surface.center_m"),
    ],
)
def test_a_mistake_is_named_with_its_place(before, after, words):
    with pytest.raises(InvalidValueError) as refused:
        read_robot_file(ROBOT.replace(before, after))
    assert words in str(refused.value)


@pytest.mark.parametrize("family", [SensorKind, SurfaceKind])
def test_palpates_own_kinds_come_in_as_those_of_others(family):
    for name in declared_in(family.GROUP):
        assert issubclass(kind_named(family, name), family)


def test_a_robot_file_is_written_with_the_words_it_was_read_with():
    text = ROBOT.replace('"own.py:Tip"', "sphere").replace('"own.py:Box", port: 3', "bota, path: /dev/ttyUSB0")
    robot = read_robot_file(text)
    again = read_robot_file(yaml_text(as_written(robot)))
    assert again == robot
    assert as_written(robot)["fingers"][0]["sensor_device"]["kind"] == "bota"
