"""What a tip calibration writes besides report and log."""

from collections.abc import Mapping
from functools import partial
from pathlib import Path, PurePosixPath
from typing import TYPE_CHECKING

from palpate.atomic_file import replacing
from palpate.experiments.kit.experiment import Writer
from palpate.yaml_text import yaml_text

if TYPE_CHECKING:
    from palpate.experiments.tip_calibration.result import TipCalibrationResult
    from palpate.robots.robot import Robot

TOUCHES_FILE, NEXT_FILE, TIP_FILE, ROBOT_FILE = "touches.csv", "next_touches.csv", "tip.yaml", "robot.yaml"
FILE_NAMES = (TOUCHES_FILE, NEXT_FILE, TIP_FILE, ROBOT_FILE)


def calibration_files(result: "TipCalibrationResult") -> Mapping[str, Writer]:
    """Return what is written, by file name: without touches, the plan of those to be made alone."""
    from palpate.experiments.tip_calibration.found_tip import surface_entry, surface_sd_entry
    from palpate.experiments.tip_calibration.touches_csv import planned_text, touches_text
    from palpate.robots.robot import ROBOT_TEXT
    from palpate.robots.surface_text import with_surface

    targets = result.known.targets
    found = {NEXT_FILE: partial(_write, planned_text(result.next_touches, targets))}
    if result.touches is None or result.fit is None:
        return found
    found[TOUCHES_FILE] = partial(_write, touches_text(result.touches, targets))
    surface, sd = surface_entry(result.fit, result.robot), surface_sd_entry(result.fit)
    found[TIP_FILE] = partial(_write, yaml_text({"surface": surface, "surface_sd": sd}))
    if result.usable:
        text = with_surface(result.robot.texts[ROBOT_TEXT], 0, surface, sd)
        found[ROBOT_FILE] = partial(_write, text)
        found |= {name: partial(_write, text) for name, text in _sensors_beside(result.robot).items()}
    return found


def _sensors_beside(robot: "Robot") -> Mapping[str, str]:
    """The sensor files that a robot file names by a path from its own folder, so that its new one is whole."""
    from palpate.robots.robot import SENSOR_TEXT

    return {
        finger.sensor: robot.texts[SENSOR_TEXT.format(i)]
        for i, finger in enumerate(robot.file.fingers)
        if finger.sensor is not None and _below(PurePosixPath(finger.sensor))
    }


def _below(path: PurePosixPath) -> bool:
    return not path.is_absolute() and ".." not in path.parts


def _write(text: str, path: Path) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    with replacing(path) as file:
        file.write(text.encode())
