"""Robot files written, for tests that read them back."""

import msgspec

from palpate.open_kinds import OpenKind, name_of_kind
from palpate.yaml_text import yaml_text


def robot_file_text(robot):
    """The text of a robot file, every value written out; it reads back to the same."""
    return yaml_text(written(robot))


def written(value):
    """Plain values as they stand in a file, without keys that say nothing."""
    if isinstance(value, tuple):
        return [written(item) for item in value]
    if not isinstance(value, msgspec.Struct):
        return msgspec.to_builtins(value)
    config = value.__struct_config__
    kind = {config.tag_field: config.tag} if config.tag else {}
    if isinstance(value, OpenKind):
        kind = {"kind": name_of_kind(value)}
    fields = ((field.encode_name, getattr(value, field.name)) for field in msgspec.structs.fields(value))
    return kind | {key: written(item) for key, item in fields if item is not None}
