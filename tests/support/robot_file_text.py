"""Robot files written, for tests that read them back."""

import msgspec

from palpate.yaml_text import yaml_text


def robot_file_text(robot):
    """The text of a robot file, every value written out; it reads back to the same."""
    written = msgspec.to_builtins(robot)
    written["fingers"] = [_without_none(finger) for finger in written["fingers"]]
    return yaml_text(written)


def _without_none(value):
    """The same without keys that say nothing."""
    if not isinstance(value, dict):
        return value
    return {key: _without_none(item) for key, item in value.items() if item is not None}
