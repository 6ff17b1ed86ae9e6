"""Puts another fingertip into the text of a robot file; all else stays as it is written, comments included."""

from collections.abc import Mapping

from palpate.errors import InvalidValueError
from palpate.robots.robot_file import read_robot_file
from palpate.strict_yaml import span_of
from palpate.yaml_text import yaml_text


def with_surface(text: str, finger: int, surface: Mapping[str, object], sd: Mapping[str, object]) -> str:
    """Return a robot file with another fingertip.

    Args:
        text: Of the file.
        finger: Whose tip it is, from 0.
        surface: What `surface` says then, by key.
        sd: What `surface_sd` says.

    Raises:
        InvalidValueError: The file has no such finger, or is none any more with it.
    """
    place = ("fingers", finger, "surface")
    span = span_of(text, place)
    if span is None:
        raise InvalidValueError(f"fingers[{finger}].surface: the robot file has none; write it by hand")
    text = text[: span.begin] + _in_brackets(surface) + text[span.end :]
    before, span = span_of(text, ("fingers", finger, "surface_sd")), span_of(text, place)
    assert span is not None  # it has just been written
    if before is not None:
        text = text[: before.begin] + _in_brackets(sd) + text[before.end :]
    elif span.flow:
        text = f"{text[: span.end]}, surface_sd: {_in_brackets(sd)}{text[span.end :]}"
    else:
        line = text.find("\n", span.end)
        at = len(text) if line < 0 else line
        text = f"{text[:at]}\n{' ' * span.column}surface_sd: {_in_brackets(sd)}{text[at:]}"
    read_robot_file(text)
    return text


def _in_brackets(value: object) -> str:
    """A value on one line, as it may stand in any place."""
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{key}: {_in_brackets(each)}" for key, each in value.items()) + "}"
    return yaml_text({"value": value}).removeprefix("value: ").strip()
