"""Pictures as files: stills as PNG, videos as animated GIF, which every browser plays."""

import os
from collections.abc import Iterable, Iterator

from PIL import Image

from palpate.atomic_file import replacing
from palpate.errors import InvalidValueError, positive
from palpate.sim.render.renderer import Figure

_TICK = 0.01
"""A GIF counts time in hundredths of a second (GIF89a, Graphic Control Extension)."""

FASTEST_PICTURES = 2.0 * _TICK
"""Shortest time between two pictures [s]: browsers play anything faster at 0.1 s."""


def write_png(picture: Figure, path: str | os.PathLike[str]) -> None:
    """Write a still, whole or not at all.

    Raises:
        OSError: It cannot be written.
    """
    with replacing(path) as file:
        Image.fromarray(picture).save(file, "PNG")


def write_gif(pictures: Iterable[Figure], path: str | os.PathLike[str], interval: float) -> int:
    """Write a video that repeats, whole or not at all; pictures are taken one by one.

    Args:
        pictures: All of one size, at least one.
        path: The file.
        interval: From one to the next [s]; rounded to hundredths.

    Returns:
        How many pictures there were.

    Raises:
        InvalidValueError: There are no pictures, or they are to follow too fast.
        OSError: It cannot be written.
    """
    if positive("interval", interval, "s") < FASTEST_PICTURES - 1e-9:
        raise InvalidValueError(f"interval = {interval:g} s: must be at least {FASTEST_PICTURES:g} s")
    counted = 0

    def palettes() -> Iterator[Image.Image]:
        nonlocal counted
        for picture in pictures:
            counted += 1
            # without dithering: flat areas stay flat, and the file a fraction as large
            yield Image.fromarray(picture).quantize(256, dither=Image.Dither.NONE)

    images = palettes()
    first = next(images, None)
    if first is None:
        raise InvalidValueError("there are no pictures to write: a video needs at least one")
    ticks = round(interval / _TICK)
    with replacing(path) as file:
        first.save(file, "GIF", save_all=True, append_images=images, duration=10 * ticks, loop=0)
    return counted
