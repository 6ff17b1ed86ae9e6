"""Forces over time beside the 3-D view."""

import numpy as np
import viser
import viser.uplot

from palpate.errors import FloatArray
from palpate.viewing.frames import Frames

SPAN = 10.0
"""How much of the past is shown [s]."""

POINTS = 400
"""Per line: about one per pixel of the panel."""

_MEASURED, _TANGENTIAL, _SPIN = "#0072b2", "#d55e00", "#009e73"
"""Of the palette of Okabe and Ito, as in the report."""

_NOTHING = np.zeros(2)


class ForcePlots:
    """Normal and tangential force, and spin torque, of the last `SPAN` seconds."""

    def __init__(self, server: viser.ViserServer) -> None:
        """Add them to the panel."""
        x = viser.uplot.Series(label="t [s]")
        # without it browsers show the numbers as dates
        scales = {"x": viser.uplot.Scale(time=False)}
        self._force = server.gui.add_uplot(
            (_NOTHING, _NOTHING, _NOTHING),
            (
                x,
                viser.uplot.Series(label="normal [N]", stroke=_MEASURED, width=1.5),
                viser.uplot.Series(label="tangential [N]", stroke=_TANGENTIAL, width=1.5),
            ),
            title="Contact force [N]",
            scales=scales,
            aspect=1.6,
        )
        self._torque = server.gui.add_uplot(
            (_NOTHING, _NOTHING),
            (x, viser.uplot.Series(label="spin torque [mN m]", stroke=_SPIN, width=1.5)),
            title="Spin torque [mN m]",
            scales=scales,
            aspect=2.2,
        )
        self.clear()

    def clear(self) -> None:
        """Forget the past."""
        self._past = np.empty((0, 4))

    def add(self, frames: Frames) -> None:
        """Take frames; they are shown by `show`."""
        if not len(frames):
            return
        normal = frames.normal_force
        force = frames.force
        tangential = np.sqrt(np.maximum(np.square(force).sum(axis=1) - np.square(normal), 0.0))
        # no contact is no force
        values = np.where(
            frames.touching[:, None], np.stack([normal, tangential, 1e3 * frames.spin_torque], axis=1), 0.0
        )
        past = np.concatenate([self._past, np.column_stack([frames.time, values])])
        self._past = past[past[:, 0] >= past[-1, 0] - SPAN]

    def show(self) -> None:
        """Send what there is."""
        if len(self._past) < 2:
            return
        time, normal, tangential, spin = extremes(self._past, POINTS // 2).T
        self._force.data = (time, normal, tangential)
        self._torque.data = (time, spin)


def extremes(rows: FloatArray, stretches: int) -> FloatArray:
    """Return rows thinned out so that no peak is lost: of every stretch the least and the largest of each column.

    Args:
        rows: Time, then values, shape (n, 1 + k).
        stretches: How many.

    Returns:
        Shape (up to 2 * stretches, 1 + k); the very rows if they are few.
    """
    if len(rows) <= 2 * stretches:
        return rows
    bounds = np.linspace(0, len(rows), stretches + 1).astype(int)[:-1]
    low, high = np.minimum.reduceat(rows, bounds), np.maximum.reduceat(rows, bounds)
    return np.stack([low, high], axis=1).reshape(-1, rows.shape[1])
