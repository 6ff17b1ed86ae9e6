"""Another fingertip in the text of a robot file: read as meant, and nothing else of the text changes."""

import pytest

from palpate.errors import InvalidValueError
from palpate.robots.robot import shipped_robots
from palpate.robots.robot_file import read_robot_file
from palpate.robots.surface_text import with_surface

SURFACE = {"kind": "ellipsoid", "semi_axes_m": [0.008, 0.0081, 0.012], "center_m": [1e-4, 0.0, -0.01]}
SD = {"size_m": 2e-6, "position_m": 3e-6, "rotation_rad": 0.0}
ONE_TIP = [path for path in shipped_robots().values() if not {"hand", "pinch", "pin"} & set(path.stem.split("-"))]


@pytest.mark.parametrize("path", ONE_TIP, ids=lambda path: path.stem)
def test_shipped_files_keep_all_but_the_tip(path):
    text = path.read_text(encoding="utf-8")
    changed = with_surface(text, 0, SURFACE, SD)
    before, after = read_robot_file(text), read_robot_file(changed)
    entry = after.fingers[0]
    assert entry.surface.half_extents == pytest.approx((0.008, 0.0081, 0.012))
    assert entry.surface_sd.position == 3e-6
    assert (after.backend, after.limits, after.pace, entry.payload, entry.sensor) == (
        before.backend,
        before.limits,
        before.pace,
        before.fingers[0].payload,
        before.fingers[0].sensor,
    )
    gone = [line for line in text.splitlines() if line not in changed.splitlines()]
    assert all(
        any(word in line for word in ("surface", "kind:", "radius", "semi_axes", "center")) for line in gone
    )
    again = with_surface(changed, 0, SURFACE, SD)
    assert again == changed


def test_what_stands_in_brackets_stays_there():
    text = (
        "palpate_robot: 1\nname: mine\n"
        "backend: {kind: stage, mass_kg: 5, bandwidth_rad_per_s: 1e2, following_error_m: 25e-4, time_step_s: 5e-4}"
        "\n"
        "period_s: 1e-3\n"
        "fingers: [{surface: {kind: sphere, radius_m: 8e-3}, payload: {mass_kg: 3e-2}}]  # one\n"
    )
    changed = with_surface(text, 0, SURFACE, SD)
    assert changed.endswith(", payload: {mass_kg: 3e-2}}]  # one\n")
    assert read_robot_file(changed).fingers[0].surface_sd.size == 2e-6


def test_a_finger_that_is_not_there_and_a_tip_that_cannot_be_are_refused():
    text = shipped_robots()["stage"].read_text(encoding="utf-8")
    with pytest.raises(InvalidValueError, match=r"fingers\[1\].surface: the robot file has none"):
        with_surface(text, 1, SURFACE, SD)
    with pytest.raises(InvalidValueError, match="radius_m"):
        with_surface(text, 0, {"kind": "sphere", "radius_m": -1.0}, SD)
