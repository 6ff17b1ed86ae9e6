"""A robot as its files describe it: the robot file, and the sensor files that it names."""

import difflib
import importlib.resources
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import msgspec

from palpate.errors import InvalidValueError
from palpate.robots.named_description import PREFIX, described_path
from palpate.robots.robot_file import FingerEntry, RobotFile, read_robot_file
from palpate.sensing.ft.sensor_file import SensorFile
from palpate.sensing.ft.sensor_reader import read_sensor
from palpate.strict_decode import load_text
from palpate.strict_refusal import DecodeRefusal

ROBOT_TEXT = "robot.yaml"
"""Under this name a log keeps the robot file."""

SENSOR_TEXT = "sensor-{}.yaml"
"""Under this name, with the finger's number, it keeps the sensor files: their own paths may lead anywhere."""

SURFACE_TEXT = "surface-{}.txt"
"""Likewise, what the files of fingertips say: `SurfaceKind.text_of`."""

SUFFIXES = (".yaml", ".yml")


@dataclass(frozen=True, slots=True)
class Robot:
    """A robot, read and checked.

    Attributes:
        file: What the robot file says.
        sensors: One per finger; None for a sensor without flaws.
        texts: Of all its files, by `ROBOT_TEXT`, `SENSOR_TEXT` and what `RobotKind.files` says: enough to read the
            very same robot again.
    """

    file: RobotFile
    sensors: tuple[SensorFile | None, ...]
    texts: Mapping[str, str]


def read_robot(texts: Mapping[str, str]) -> Robot:
    """Return the robot that texts describe: those of a `Robot`, or of a log.

    Args:
        texts: The robot file's under `ROBOT_TEXT`, those of the sensor files that it names under `SENSOR_TEXT`;
            others are not looked at.

    Raises:
        InvalidValueError: One is missing, or something in one is wrong.
    """

    def text_of(name: str) -> str:
        if name not in texts:
            raise InvalidValueError(f"{name!r} is missing: there are {', '.join(texts) or 'no files'}")
        return texts[name]

    return _assembled(text_of(ROBOT_TEXT), lambda name, *_: text_of(name), lambda name, _: text_of(name))


def load_robot(name: str) -> Robot:
    """Return the robot of a robot file.

    Args:
        name: Of a robot that comes with palpate (`stage`), or the path of a robot file.

    Raises:
        OSError: A file cannot be read.
        InvalidValueError: There is no such robot, or something in its files is wrong; the message names the file.
    """
    path = robot_path(name)

    def place_of(named: str) -> Path:
        return described_path(named) if named.startswith(PREFIX) else path.parent / named

    def text_of(_: str, named: str, read: Callable[[Path], str] = _text_in) -> str:
        try:
            return read(place_of(named))
        except OSError as error:
            raise InvalidValueError(
                f"cannot read {place_of(named)}: {error.strerror}; the path is relative to the robot file"
            ) from None

    text = load_text(path, "a robot file")
    try:
        return _assembled(text, text_of, lambda _, named: str(place_of(named).resolve()))
    except InvalidValueError as error:
        raise InvalidValueError(f"{path}: {error}") from None


def _text_in(path: Path) -> str:
    return load_text(path, "a file that a robot file names")


def shipped_robots() -> dict[str, Path]:
    """Return the robot files that come with palpate, by name."""
    folder = Path(str(importlib.resources.files("palpate").joinpath("robots")))
    return {file.stem: file for file in sorted(folder.glob("*.yaml"), key=lambda file: file.stem)}


def robot_path(name: str) -> Path:
    """Return the file of a robot.

    A bare name is that of a shipped robot. A name with a folder or an ending is a path; without a folder, and if
    there is no such file, the shipped robot of that name.

    Raises:
        InvalidValueError: There is neither.
    """
    shipped = shipped_robots()
    path, stem = Path(name), _without_suffix(name)
    if stem != name and path.is_file():
        return path
    if path.name == name and stem in shipped:
        return shipped[stem]
    if path.is_dir():
        raise InvalidValueError(f"robot = {name!r}: is a folder; give a robot file in it")
    if path.name != name and path.exists():  # a device or pipe is refused by who reads it
        return path
    near = difflib.get_close_matches(_without_suffix(path.name), shipped, n=1, cutoff=0.5)
    meant = f"did you mean {near[0]}? " if near else ""
    comes = f"{meant}palpate comes with {', '.join(shipped)}"
    if path.is_file():
        raise InvalidValueError(
            f"robot = {name!r}: no such robot; if you mean the file, say ./{name} (a robot file ends in "
            f"{SUFFIXES[0]}); {comes}"
        )
    raise InvalidValueError(f"robot = {name!r}: no such file and no such robot; {comes}")


def _without_suffix(name: str) -> str:
    for suffix in SUFFIXES:
        name = name.removesuffix(suffix)
    return name


def _assembled(text: str, text_of: Callable[..., str], place_of: Callable[[str, str], str]) -> Robot:
    """Read a robot file, and the files that it names: their texts and places, by name in a log and path."""
    file = read_robot_file(text)
    texts = {ROBOT_TEXT: text}
    for name, path in file.backend.files.items():
        texts[name] = text_of(name, path)
        texts[f"{name}.path"] = place_of(f"{name}.path", path)
    file = msgspec.structs.replace(
        file,
        fingers=tuple(_read_surface(i, finger, text, text_of, texts) for i, finger in enumerate(file.fingers)),
    )
    sensors: list[SensorFile | None] = []
    for i, finger in enumerate(file.fingers):
        if finger.sensor is None:
            sensors.append(None)
            continue
        try:
            name = SENSOR_TEXT.format(i)
            texts[name] = found = text_of(name, finger.sensor)
            sensors.append(read_sensor(found))
        except InvalidValueError as error:
            raise InvalidValueError(f"fingers[{i}].sensor, {finger.sensor}: {error}") from None
    return Robot(file, tuple(sensors), texts)


def _read_surface(
    i: int, finger: FingerEntry, text: str, text_of: Callable[..., str], texts: dict[str, str]
) -> FingerEntry:
    """Return a finger with what the file of its fingertip says, if it names one."""
    surface = finger.surface
    if surface.file is None:
        return finger
    name = SURFACE_TEXT.format(i)
    try:
        texts[name] = text_of(name, str(surface.file), surface.text_of)
        return msgspec.structs.replace(finger, surface=surface.given(texts[name]))
    except InvalidValueError as error:
        path = ("fingers", i, "surface")
        raise InvalidValueError(DecodeRefusal(path, f": {surface.file}: {error}").located(text)) from None
