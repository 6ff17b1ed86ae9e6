"""The file of an arm: what MuJoCo makes of it, what it leaves out, and one line about what is wrong with it."""

import re
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from xml.parsers import expat
from xml.parsers.expat import ExpatError

import mujoco

from palpate.bounded_file import Bounds, read_text
from palpate.errors import InvalidValueError

_KINDS = {"continuous": False, "revolute": True, "prismatic": True}


@dataclass(slots=True)
class UrdfWords:
    """Contents of a URDF file that MuJoCo leaves out; empty for an MJCF file.

    Attributes:
        speeds: Largest speed of each joint that has one [rad/s or m/s].
        limited: Whether a joint has a range: a `continuous` one has none.
        is_xacro: Whether it is not a URDF yet.
    """

    speeds: dict[str, float] = field(default_factory=dict)
    limited: dict[str, bool] = field(default_factory=dict)
    is_xacro: bool = False
    _joint: str = ""

    @classmethod
    def of(cls, text: str) -> "UrdfWords":
        """Return those in a text.

        Raises:
            ExpatError: It is no well-formed XML.
            ValueError: A speed is no number.
        """
        found = cls()
        reader = expat.ParserCreate()  # it does not mind prefixes that nobody has declared
        reader.StartElementHandler = found._begin
        reader.Parse(text, True)
        return found

    def _begin(self, tag: str, attributes: dict[str, str]) -> None:
        self.is_xacro |= tag.startswith("xacro:")
        if tag == "joint":
            self._joint = attributes.get("name", "")
            kind = attributes.get("type", "")
            if kind in _KINDS:
                self.limited[self._joint] = _KINDS[kind]
        elif tag == "limit":
            self.speeds[self._joint] = _number(self._joint, attributes.get("velocity", "0"))


def _number(joint: str, text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise ValueError(f"joint {joint}: velocity = {text!r} is no number") from None


BOUNDS = Bounds(size=1 << 24, lines=200_000)
"""Of an arm's file; the largest that is published has some thousand lines."""

_LINE = re.compile(r"(?:\bline |Line number=)(\d+)")
_NAME = re.compile(r"Element name '([^']*)'")
_QUOTED = re.compile(r"file '([^']*)'")
_WRONG = (
    (
        "mjMINVAL",
        "a moving body has no mass or no inertia",
        "give it an <inertial>, or a shape with a density",
    ),
    (
        "multiple parents",
        "a link with two parents makes a closed kinematic chain",
        "must be serial: take one of the joints out",
    ),
    ("opening file", "a mesh or picture cannot be opened", "put it there, or take it out of the arm's file"),
    ("range[0] should be", "the range of a joint is empty", "give it one, lower end first [rad or m]"),
    ("parse error", "this is no well-formed XML", "mend it there"),
    ("empty file", "the file is empty", "give an MJCF or a URDF"),
)
"""What MuJoCo reports, what that means for an arm, and the remedy."""


@dataclass(frozen=True)
class ArmSourceFile:
    """An MJCF or URDF file.

    Attributes:
        path: Of the file.
        text: In it.
        is_there: Whether the file still is what it was.
    """

    path: Path
    text: str = field(repr=False)
    is_there: bool

    @classmethod
    def of(cls, path: Path, text: str | None) -> "ArmSourceFile":
        """Return a file, or what stood in it.

        Raises:
            InvalidValueError: It cannot be read.
        """
        try:
            found = read_text(path, BOUNDS, "an arm")
        except OSError as error:
            if text is not None:
                return cls(path, text, False)
            problem = f"cannot be opened: {error.strerror}; give an MJCF or URDF"
            raise InvalidValueError(f"{path}: {problem}") from error
        return cls(path, found if text is None else text, text in (None, found))

    def spec(self) -> mujoco.MjSpec:
        """Return what the file says, taken apart anew.

        Raises:
            InvalidValueError: It is no MJCF or URDF.
        """
        try:
            if self.is_there:
                spec = mujoco.MjSpec.from_file(str(self.path))
            else:  # meshes may still lie beside it
                spec = mujoco.MjSpec.from_string(self.text)
                spec.modelfiledir = str(self.path.parent)
        except ValueError as error:
            raise self._of_mujoco(str(error)) from error
        spec.compiler.fusestatic = False  # a URDF's flange is a link without mass
        spec.compiler.discardvisual = False  # nor are its shapes to vanish that touch nothing
        if self.urdf.is_xacro:
            raise self.refusal("", "this is a xacro", "must be the URDF that `xacro FILE` writes")
        return spec

    def compiled(self, spec: mujoco.MjSpec) -> mujoco.MjModel:
        """Return the model of a spec that comes from this file.

        Raises:
            InvalidValueError: There is none.
        """
        try:
            return spec.compile()
        except ValueError as error:
            raise self._of_mujoco(str(error)) from error

    @cached_property
    def urdf(self) -> UrdfWords:
        """What a URDF says that MuJoCo leaves out.

        Raises:
            InvalidValueError: It cannot be read.
        """
        try:
            return UrdfWords.of(self.text)
        except (ExpatError, ValueError) as error:
            raise self.refusal("", str(error), "mend it there") from error

    def refusal(self, name: str, problem: str, remedy: str) -> InvalidValueError:
        """Return an error of one line, with the line in the file where a name or a `<tag` stands, if one does."""
        sign = name if name.startswith("<") else f'"{name}"'
        named = [i for i, line in enumerate(self.text.splitlines(), 1) if name and sign in line]
        where = f", line {named[0]}" if named else ""
        return InvalidValueError(f"{self.path}{where}: {problem}; {remedy}")

    def _of_mujoco(self, message: str) -> InvalidValueError:
        first = re.sub(r"^(XML )?Error: ", "", message.strip().splitlines()[0]).strip(" :.")
        problem, remedy = next((words for sign, *words in _WRONG if sign in message), (first, "mend it there"))
        line, name, quoted = _LINE.search(message), _NAME.search(message), _QUOTED.search(message)
        concerned = name or quoted
        if concerned:
            problem += f" ({concerned[1]})"
        if line is None:
            return self.refusal(quoted[1] if quoted else "", problem, remedy)
        return InvalidValueError(f"{self.path}, line {line[1]}: {problem}; {remedy}")
