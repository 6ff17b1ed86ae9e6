"""What a replay may change of a run, and how it is written: `force=3`."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from typing import Any, Protocol, TypeVar

from palpate.errors import InvalidValueError
from palpate.experiments.kit.owned_options import Owners, foreign_options
from palpate.nearest_name import nearest, without_unit
from palpate.robots.values import load_named_robot
from palpate.runtime.robot import Robot, read_robot
from palpate.strict_decode import decode_some
from palpate.strict_yaml import read_yaml

SEVERAL = ("tip", "center", "axis", "frequencies")
"""Of all experiments, those that are several numbers, or one."""

Config = TypeVar("Config")


@dataclass(frozen=True, slots=True)
class Changeable:
    """What a replay may change of one kind of experiment.

    Attributes:
        what: It is, with its article, for messages.
        kind: Of its configuration.
        fixed: Fields of that which no replay can change, and why.
        choices: Of its fields, those that say which others there are; see `foreign_options`.
    """

    what: str
    kind: type[Any]
    fixed: Mapping[str, str]
    choices: Mapping[str, Owners] = field(default_factory=dict)

    @property
    def names(self) -> tuple[str, ...]:
        """Fields that it can: what sensing, control and supervision go by."""
        return tuple(each.name for each in fields(self.kind) if each.name not in self.fixed)


class OnRobot(Protocol):
    """A configuration that names a robot."""

    @property
    def robot(self) -> str:
        """Its name, or its file."""
        ...


def settings_of(words: Sequence[str]) -> dict[str, object]:
    """Return the settings that are typed as `name=value`, as yet unchecked.

    Raises:
        InvalidValueError: Something else is typed, or a name twice.
    """
    settings: dict[str, object] = {}
    for word in words:
        name, equals, text = word.partition("=")
        if not (name and equals and text):
            raise InvalidValueError(
                f"--set {word}: write NAME=VALUE without spaces, as in --set force=3 speed=0.03, and LOG before it"
            )
        if name in settings:
            raise InvalidValueError(f"--set {word}: {name} is given twice")
        settings[name] = _value(name, text)
    return settings


def _value(name: str, text: str) -> object:
    if name in SEVERAL and not text.startswith("["):
        text = f"[{text}]"
    try:
        return read_yaml(text)
    except InvalidValueError as error:
        raise InvalidValueError(f"--set {name}={text}: {error}") from None


def changed_config(config: Config, settings: Mapping[str, object], may: Changeable) -> Config:
    """Return a configuration with other values for what a replay can change.

    What was given for a choice that is changed, as the time of steps for another profile, is left out.

    Raises:
        InvalidValueError: A name is not known or cannot be changed, or a value is impossible.
    """
    for name in settings:
        if name in may.fixed:
            raise InvalidValueError(f"{name}: a replay cannot change it: {may.fixed[name]}")
        if name not in may.names:
            names = (*may.names, *may.fixed)
            near = nearest(name, names) or nearest(without_unit(name), names)
            advice = f"did you mean {near}?" if near else f"a replay can change {', '.join(may.names)}"
            raise InvalidValueError(f"{name}: {may.what} has no such setting; {advice}")
    changed = decode_some(settings, may.kind)
    recorded = {each.name: getattr(config, each.name) for each in fields(may.kind)}
    foreign = foreign_options(recorded | changed, may.choices) - changed.keys()
    default = {each.name: each.default for each in fields(may.kind) if each.name in foreign}
    return replace(config, **default, **changed)  # type: ignore[type-var]


def robot_of(config: OnRobot, settings: Mapping[str, object], texts: Mapping[str, str]) -> Robot:
    """Return the robot of a run as it is replayed: that of its log, or another one if that is set.

    Raises:
        InvalidValueError: There is no such robot, or something in its files is wrong.
    """
    return load_named_robot(config.robot) if "robot" in settings else read_robot(texts)
