"""The outline that a contour felt, beside the true one: a line, of whose surroundings nothing is claimed."""

from dataclasses import replace

import numpy as np

from palpate.errors import FloatArray
from palpate.experiments.explore.exploration import ExplorationResult
from palpate.experiments.explore.felt_path import felt_path
from palpate.experiments.explore.mark_places import SIZE, look_of, places_by_event
from palpate.experiments.explore.surface_colours import MICRO, MILLI
from palpate.experiments.explore.surface_figure import MISSED, missed
from palpate.reporting.figure import Axis, Figure, Panel
from palpate.reporting.marks import Line, Mark, Points, Rule, Symbol
from palpate.runtime.palette import FELT, QUIET_COLOUR, TRUTH


def contour_figure(exploration: ExplorationResult) -> Figure | None:
    """Return the outline from above, and its error along the arc if the truth is known; None if none was felt."""
    if not len(exploration.cloud):
        return None
    path = felt_path(exploration.cloud, exploration.point_error, lift=0.0)
    arc = _arc(path.points)
    panels = [Panel(_outline(exploration, path.points), _across("x"), _across("y"), equal=True, height=460)]
    size = ""
    if exploration.truth.known:
        error = Line(MILLI * arc, MICRO * path.error, colour=FELT, width=1.2)
        marks = _marks_along(exploration, path.points, arc, path.error)
        zero = Rule(0.0, colour=QUIET_COLOUR, upright=False)
        along = Axis("arc length along what was felt", "mm")
        panels.append(Panel((zero, error, *marks), along, Axis("error", "µm", span=0.5), height=460))
        largest = MICRO * float(np.abs(exploration.point_error).max())
        size = (
            " The error is the signed distance of the points from the true surface, + is outside; root mean "
            f"square {MICRO * exploration.point_rms:.3g} µm, {largest:.3g} µm at most."
        )
    return Figure(
        title="The outline",
        caption=(
            f"Seen from above, {MILLI * np.nanmax(arc):.4g} mm from where the finger landed.{size} Beside the "
            "line nothing was felt, and nothing is claimed. Good is the felt line on the true one, and an error "
            "without steps."
        ),
        panels=tuple(panels),
        columns=len(panels),
        wide=True,
    )


def _across(name: str) -> Axis:
    return Axis(name, "mm")


def _arc(points: FloatArray) -> FloatArray:
    """Length along points from the first on, gaps left out, shape (n,) [m]."""
    steps = np.linalg.norm(np.diff(points, axis=0, prepend=points[:1]), axis=1)
    return np.where(np.isfinite(steps), np.nancumsum(steps), np.nan)


def _outline(exploration: ExplorationResult, points: FloatArray) -> tuple[Mark, ...]:
    cloud, marks = exploration.cloud, list[Mark]()
    if exploration.truth.known:
        true = felt_path(replace(cloud, position=cloud.position - exploration.point_error[:, None] * cloud.normal),
                         exploration.point_error, lift=0.0).points  # fmt: skip
        marks.append(Line(MILLI * true[:, 0], MILLI * true[:, 1], "true", TRUTH, width=5.0, opacity=0.55))
    marks.append(Line(MILLI * points[:, 0], MILLI * points[:, 1], "felt", FELT, width=1.6))
    left = MILLI * missed(exploration.map)
    if len(left):
        marks.append(Points(left[:, 0], left[:, 1], MISSED, TRUTH, 4.0, Symbol.CROSS))
    for event, places in places_by_event(exploration.marks).items():
        colour, symbol = look_of(event)
        x, y, _ = MILLI * places.T
        marks.append(Points(x, y, event, colour, SIZE, symbol, texts=(event,) * len(places)))
    return tuple(marks)


def _marks_along(
    exploration: ExplorationResult, points: FloatArray, arc: FloatArray, error: FloatArray
) -> tuple[Points, ...]:
    """The marks at the nearest points of the line."""
    drawn = []
    for event, places in places_by_event(exploration.marks).items():
        colour, symbol = look_of(event)
        nearest = [int(np.nanargmin(np.linalg.norm(points - place, axis=1))) for place in places]
        drawn.append(
            Points(MILLI * arc[nearest], MICRO * error[nearest], "", colour, SIZE, symbol,
                   texts=(event,) * len(places))
        )  # fmt: skip
    return tuple(drawn)
