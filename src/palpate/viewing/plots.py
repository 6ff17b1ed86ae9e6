"""Forces over time beside the 3-D view."""

from collections.abc import Sequence

import numpy as np
import viser
import viser.uplot

from palpate.errors import FloatArray
from palpate.runtime import palette
from palpate.runtime.palette import Colour
from palpate.viewing.frames import Frames

SPAN = 10.0
"""How much of the past is shown [s]."""

POINTS = 400
"""Per line: about one per pixel of the panel."""

ONE_FINGER = (palette.FELT, palette.CONE_RIM, palette.SPIN_COLOUR)
"""Of its normal and its tangential force and its spin torque, as in reports."""

FINGERS = palette.SIDE_BY_SIDE
"""Of several; those beyond begin again."""

INCREMENTS = tuple(digit * 10.0**power for power in range(-1, 5) for digit in (1.0, 2.0, 5.0))
"""Between two numbers beside a plot: browsers show three digits after the point, and finer ones as 0, 0, -0."""

PLOT_ORDER = 1e12
"""Below what people operate; viser counts from 0."""

_NOTHING = np.zeros(2)


class ForcePlots:
    """Contact forces and spin torques of the last `SPAN` seconds.

    With one finger its normal and its tangential force; with several the normal force of each.
    """

    def __init__(self, server: viser.ViserServer, fingers: int = 1) -> None:
        """Add them to the panel."""
        self._fingers = fingers
        forces, torques = ["normal [N]", "tangential [N]"], ["spin torque [mN m]"]
        if fingers > 1:
            forces = [f"finger {i + 1}, normal [N]" for i in range(fingers)]
            torques = [f"finger {i + 1}, spin [mN m]" for i in range(fingers)]
        colours = ONE_FINGER if fingers == 1 else FINGERS
        self._force = _plot(server, "Contact force [N]", forces, colours, 1.6)
        # one finger's torque has a colour of its own; with several, colours are the fingers'
        self._torque = _plot(server, "Spin torque [mN m]", torques, colours[2:] if fingers == 1 else colours, 2.2)
        self._forces = len(forces)
        self.clear()

    def clear(self) -> None:
        """Forget the past."""
        self._past = np.empty((0, 1 + self._forces + self._fingers))

    def add(self, frames: Frames) -> None:
        """Take frames; they are shown by `show`."""
        if not len(frames):
            return
        contacts = [frames.finger(i) for i in range(self._fingers)]
        forces = [contact.normal_force for contact in contacts]
        touching = [contact.touching for contact in contacts]
        spins = [1e3 * contact.spin_torque for contact in contacts]
        if self._fingers == 1:
            forces, touching = [*forces, contacts[0].tangential_force], touching * 2
        # no contact is no force
        values = [np.where(at, value, 0.0) for at, value in zip(touching, forces, strict=True)]
        values += [np.where(at, value, 0.0) for at, value in zip(touching[: self._fingers], spins, strict=True)]
        past = np.concatenate([self._past, np.column_stack([frames.time, *values])])
        self._past = past[past[:, 0] >= past[-1, 0] - SPAN]

    def show(self) -> None:
        """Send what there is."""
        if len(self._past) < 2:
            return
        time, *lines = extremes(self._past, POINTS // 2).T
        self._force.data = (time, *lines[: self._forces])
        self._torque.data = (time, *lines[self._forces :])


def _plot(
    server: viser.ViserServer, title: str, labels: Sequence[str], colours: Sequence[Colour], aspect: float
) -> viser.GuiUplotHandle:
    lines = [
        viser.uplot.Series(label=label, stroke=colours[i % len(colours)].light, width=1.5)
        for i, label in enumerate(labels)
    ]
    return server.gui.add_uplot(
        (_NOTHING,) * (1 + len(lines)),
        (viser.uplot.Series(label="t [s]"), *lines),
        title=title,
        order=PLOT_ORDER,
        # without it browsers show the numbers as dates
        scales={"x": viser.uplot.Scale(time=False)},
        axes=(viser.uplot.Axis(), viser.uplot.Axis(incrs=INCREMENTS)),
        aspect=aspect,
    )


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
