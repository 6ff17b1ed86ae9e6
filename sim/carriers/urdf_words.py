"""What a URDF says that MuJoCo leaves out."""

from dataclasses import dataclass, field
from xml.parsers import expat

_KINDS = {"continuous": False, "revolute": True, "prismatic": True}


@dataclass(slots=True)
class UrdfWords:
    """Of one file; empty for an MJCF.

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
