"""A scene of one's own: an MJCF file with all that it refers to, as text and bytes, so that a log can keep it."""

import base64
import binascii
import json
import os
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Self

import mujoco

from palpate.bounded_file import Bounds, PathLike, read_bytes, read_text
from palpate.errors import InvalidValueError, shown

BOUNDS = Bounds(size=1 << 25)
"""Of each file: a text of 130 000 triangles."""

MOST_FILES = 200
"""That a scene refers to: robots of MuJoCo's collections have up to 100 meshes."""

_INCLUDED = re.compile(r"<include\s+file\s*=\s*[\"']([^\"']+)[\"']")
_COMMENT = re.compile(r"<!--.*?-->", re.DOTALL)


@dataclass(frozen=True, eq=False, slots=True)
class SceneFile:
    """An MJCF file and what it refers to.

    Attributes:
        name: For messages.
        text: Of the file.
        included: Texts of the files that it includes, by name, as UTF-8.
        assets: Meshes, textures and height fields, by path from the file.
    """

    name: str
    text: str = field(repr=False)
    included: Mapping[str, bytes] = field(repr=False)
    assets: Mapping[str, bytes] = field(repr=False)

    @classmethod
    def read(cls, path: PathLike) -> Self:
        """Read a file and all that it refers to.

        Raises:
            InvalidValueError: One of them cannot be read, or MuJoCo does not take the text.
        """
        name, folder = os.fspath(path), Path(path).parent
        try:
            text = read_text(path, BOUNDS, "a scene is MJCF, XML text")
        except OSError as error:
            raise InvalidValueError(f"file = {name}: cannot be read: {error.strerror}") from None
        included: dict[str, bytes] = {}
        waiting = _included_in(text)
        while waiting:
            found = waiting.pop()
            if found not in included:
                included[found] = _beside(folder, found, name, text)
                _check_count(name, len(included))
                waiting += _included_in(included[found].decode("utf-8", "replace"))
        spec = cls(name, text, included, {}).spec()
        wanted = sorted(set(_assets_of(spec)))
        _check_count(name, len(wanted))
        return cls(name, text, included, {each: _beside(folder, each, name, text) for each in wanted})

    @classmethod
    def kept(cls, name: str, text: str, files: str) -> Self:
        """Return what a log kept: the text of the file, and `files_text` of it.

        Raises:
            InvalidValueError: It is not as it was written.
        """
        try:
            groups = json.loads(files)
            included, assets = (
                {path: base64.b64decode(data, validate=True) for path, data in groups[group].items()}
                for group in ("included", "assets")
            )
        except (ValueError, KeyError, TypeError, AttributeError, binascii.Error) as error:
            raise InvalidValueError(f"{name}: its files are not as palpate writes them ({error})") from None
        return cls(name, text, included, assets)

    def files_text(self) -> str:
        """Return all that it refers to as text."""
        groups = {"included": self.included, "assets": self.assets}
        return json.dumps(
            {
                group: {path: base64.b64encode(data).decode("ascii") for path, data in files.items()}
                for group, files in groups.items()
            },
            indent=1,
        )

    def spec(self) -> mujoco.MjSpec:
        """Return a fresh specification, without what would be in the way of a larger scene: keyframes, sensors.

        Raises:
            InvalidValueError: MuJoCo does not take the text.
        """
        try:
            spec = mujoco.MjSpec.from_string(self.text, include=dict(self.included), assets=dict(self.assets))
        except (ValueError, mujoco.FatalError) as error:
            raise refused(self.name, error) from None
        for each in (*spec.keys, *spec.sensors):
            spec.delete(each)
        return spec


class FrozenScene(SceneFile):
    """A scene in which nothing moves: everything stays where the file puts it, its joints are left out."""

    __slots__ = ()

    def spec(self) -> mujoco.MjSpec:
        """See `SceneFile`."""
        spec = SceneFile.spec(self)
        for each in (*spec.actuators, *spec.tendons, *spec.equalities, *spec.joints):
            spec.delete(each)
        return spec


def refused(name: str, error: Exception) -> InvalidValueError:
    """Return what MuJoCo has against a scene, in one line."""
    why = shown(" ".join(str(error).split()).removeprefix("Error: "), 300).strip("'\"")
    return InvalidValueError(f"file = {name}: MuJoCo refuses it: {why}; correct it there")


def line_of(text: str, word: str) -> str:
    """Return the first line of a text in which a word stands, for messages; nothing if it is in no line."""
    lines = (i for i, line in enumerate(text.splitlines(), 1) if word in line)
    found = next(lines, None)
    return "" if found is None else f", line {found}"


def _included_in(text: str) -> list[str]:
    return _INCLUDED.findall(_COMMENT.sub("", text))


def _assets_of(spec: mujoco.MjSpec) -> list[str]:
    """Paths of the files that it needs, from its own folder."""
    meshes = [os.path.join(spec.meshdir, each.file) for each in (*spec.meshes, *spec.hfields) if each.file]
    pictures = [each.file for each in spec.textures] + [file for each in spec.textures for file in each.cubefiles]
    paths = meshes + [os.path.join(spec.texturedir, each) for each in pictures if each]
    return [os.path.basename(path) for path in paths] if spec.strippath else paths


def _beside(folder: Path, path: str, name: str, text: str) -> bytes:
    try:
        return read_bytes(folder / path, BOUNDS)
    except OSError as error:
        raise InvalidValueError(
            f"file = {name}{line_of(text, Path(path).name)}: {path}: cannot be read: {error.strerror}; put it "
            f"into {folder}, or correct its name"
        ) from None


def _check_count(name: str, count: int) -> None:
    if count > MOST_FILES:
        raise InvalidValueError(f"file = {name}: refers to {count} files: at most {MOST_FILES} are read")
