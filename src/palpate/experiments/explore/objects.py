"""Objects that can be explored, by name, with the sizes or the file of each."""

from pathlib import Path
from typing import Literal

from palpate.errors import InvalidValueError, positive
from palpate.experiments.kit.checks import check_length, spaced

ObjectName = Literal["sphere", "ellipsoid", "box", "cylinder", "torus", "bumps", "mesh", "height-field", "scene"]

OBJECT_SIZES: dict[ObjectName, tuple[str, tuple[float, ...]]] = {
    "sphere": ("radius", (0.04,)),
    "ellipsoid": ("three semi-axes", (0.05, 0.04, 0.03)),
    "box": ("length, width and height", (0.08, 0.08, 0.04)),
    "cylinder": ("radius and length (it lies along x)", (0.03, 0.12)),
    "torus": ("radius of the ring and of its tube (it lies about z)", (0.06, 0.025)),
    "bumps": ("amplitude, wavelength and side of the square that they cover", (0.003, 0.06, 0.18)),
    "mesh": ("nothing, the file gives it", ()),
    "height-field": ("width and depth, unless the file gives them", ()),
    "scene": ("nothing, the file gives it", ()),
}
"""What sizes each object takes, and its defaults [m]."""

FROM_FILE: tuple[ObjectName, ...] = ("mesh", "height-field", "scene")
"""Objects that a file describes."""


def article_of(name: ObjectName) -> str:
    """Return the article before an object's name."""
    return "some" if name == "bumps" else "an" if name[0] in "aeiou" else "a"


def checked_size(name: ObjectName, size: tuple[float, ...]) -> tuple[float, ...]:
    """Return the size of an object [m], its default where none is given.

    Raises:
        InvalidValueError: There is no such object, or it has no such size.
    """
    if name not in OBJECT_SIZES:
        raise InvalidValueError(f"object = {name!r}: must be one of {', '.join(OBJECT_SIZES)}")
    meaning, default = OBJECT_SIZES[name]
    size = size or default
    if name in FROM_FILE:
        if len(size) not in ((0, 2) if name == "height-field" else (0,)):
            raise InvalidValueError(f"size = {spaced(size)}: {article_of(name)} {name} takes {meaning}")
    elif len(size) != len(default):
        raise InvalidValueError(
            f"size = {spaced(size)}: {article_of(name)} {name} takes {len(default)} number"
            f"{'s' if len(default) > 1 else ''}, its {meaning} [m]; for example {spaced(default)}"
        )
    for length in size:
        check_length("size", length)
    return size


def check_file(name: ObjectName, file: Path | None, scale: float) -> None:
    """Refuse an object without the file that must describe it, and one with a file that needs none.

    Args:
        name: Of the object.
        file: That is given, if any.
        scale: Metres per unit of it.

    Raises:
        InvalidValueError: It is such an object, or the scale is not positive or has no file.
    """
    positive("scale", scale, "m per unit of the file")
    if name in FROM_FILE:
        if file is None:
            raise InvalidValueError(f"object = {name}: a file must describe it (--file)")
        if name == "scene" and scale != 1.0:
            raise InvalidValueError(
                f"scale = {scale:g}: a scene is in metres; scale its meshes in the file, as "
                'scale="0.001 0.001 0.001"'
            )
    elif file is not None:
        raise InvalidValueError(
            f"file = {file}: {article_of(name)} {name} is described by --size; for a file give "
            f"--object {' or --object '.join(FROM_FILE)}"
        )
    elif scale != 1.0:
        raise InvalidValueError(f"scale = {scale:g}: is for files; {name} takes --size, in metres")
