"""The materials that touch recognises, as one YAML file; read strictly, as robot and sensor files are."""

import importlib.resources
import os
from pathlib import Path
from typing import Annotated

import msgspec

from palpate.errors import InvalidValueError
from palpate.friction.materials.material import Material
from palpate.strict_decode import decode_file, load

VERSION = 1
"""Of the file format, under the key `palpate_materials`."""

MAX_MATERIALS = 1000
"""More is a data base, not what one finger tells apart."""


class MaterialLibrary(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Some surfaces, all as rubbed by the same kind of fingertip: another has other mu and e.

    Attributes:
        palpate_materials: Version of the format.
        fingertip: What rubbed them; one line for people.
        materials: One or more, each with a name of its own.
    """

    palpate_materials: int = VERSION
    fingertip: str
    materials: Annotated[tuple[Material, ...], msgspec.Meta(min_length=1, max_length=MAX_MATERIALS)]

    def __post_init__(self) -> None:
        if self.palpate_materials != VERSION:
            raise InvalidValueError(
                f"palpate_materials = {self.palpate_materials!r}: this palpate reads version {VERSION}"
            )
        if not self.fingertip.strip() or not self.fingertip.isprintable():
            raise InvalidValueError(
                f"fingertip = {self.fingertip[:40]!r}: must be one line of printable characters"
            )
        if not 1 <= len(self.materials) <= MAX_MATERIALS:
            raise InvalidValueError(f"{len(self.materials)} materials: must be 1 to {MAX_MATERIALS}")
        seen: set[str] = set()
        for material in self.materials:
            if material.name in seen:
                raise InvalidValueError(f"two materials are named {material.name!r}: give each a name of its own")
            seen.add(material.name)

    @property
    def names(self) -> tuple[str, ...]:
        """Of all materials, in order."""
        return tuple(material.name for material in self.materials)


def read_materials(text: str) -> MaterialLibrary:
    """Return the library described by the text of a materials file.

    Raises:
        InvalidValueError: It is no materials file, or something in it is wrong; the message names it.
    """
    return decode_file(text, MaterialLibrary, "materials file", "palpate_materials", VERSION)


def load_materials(path: str | os.PathLike[str]) -> MaterialLibrary:
    """Return the library of a materials file.

    Raises:
        OSError: The file cannot be read.
        InvalidValueError: As in `read_materials`, with the file's name in front.
    """
    return load(path, read_materials, "a materials file")


def simulated_materials() -> MaterialLibrary:
    """Return the materials that come with palpate: figures assumed for simulation, measured by nobody."""
    return load_materials(Path(str(importlib.resources.files("palpate").joinpath("materials/simulated.yaml"))))
