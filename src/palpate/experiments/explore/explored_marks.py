"""The marks of an exploration: as text, and as a file."""

import csv
import io
import math
import os
from collections import Counter

from palpate.atomic_file import replacing
from palpate.controllers.paths import Mark, PathEvent

NOT_FELT = frozenset({PathEvent.STEEP, PathEvent.LOST, PathEvent.UNREACHABLE, PathEvent.BLOCKED, PathEvent.OPEN})
"""Events that left out part of what was to be felt; the others are of what was."""


def marks_text(marks: tuple[Mark, ...]) -> str:
    """Return how many of which marks there are, as in "2 steep, 1 lost"; "none" if there are none."""
    counted = Counter(mark.event for mark in marks)
    return ", ".join(f"{count} {event.value}" for event, count in counted.items()) or "none"


def not_felt(marks: tuple[Mark, ...]) -> tuple[Mark, ...]:
    """Return the marks of places that were to be felt and were not."""
    return tuple(mark for mark in marks if mark.event in NOT_FELT)


def write_marks_csv(marks: tuple[Mark, ...], path: str | os.PathLike[str]) -> None:
    """Write marks as CSV, in order: x_m, y_m, z_m in the base frame, event, radius_m, reason.

    The radius is that of the surface, positive where it is convex; empty where none was felt.

    Raises:
        OSError: The file cannot be written.
    """
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(("x_m", "y_m", "z_m", "event", "radius_m", "reason"))
    for mark in marks:
        radius = f"{mark.radius:z.6f}" if math.isfinite(mark.radius) else ""
        writer.writerow((*(f"{value:.6f}" for value in mark.position), mark.event.value, radius, mark.reason))
    with replacing(path) as file:
        file.write(text.getvalue().encode())
