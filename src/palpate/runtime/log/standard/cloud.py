"""Points with quantities as sensor_msgs/PointCloud2: what an experiment found, as a whole."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from palpate.errors import FloatArray, InvalidValueError
from palpate.runtime.log.message_layout import Messages, Stamps, put_heads, put_stamps
from palpate.runtime.log.standard.topic import BASE, begin

CLOUD_CHANNEL = 4
CLOUD_TOPIC = "/map"

MOST_POINTS = 2**17
"""Of one cloud: what a viewer draws at ease, and a chunk of a log holds."""

_FLOAT32 = 7
"""sensor_msgs/PointField"""


@dataclass(frozen=True, slots=True, eq=False)
class Cloud:
    """Points in the base frame.

    Attributes:
        position: Shape (n, 3) [m].
        quantities: Each of shape (n,), by name; SI.
    """

    position: FloatArray
    quantities: Mapping[str, FloatArray]

    def __post_init__(self) -> None:
        for name, values in self.quantities.items():
            if values.shape != (len(self.position),):
                raise InvalidValueError(
                    f"{name} has shape {values.shape}: must be ({len(self.position)},), one for each point"
                )

    @property
    def thinned(self) -> "Cloud":
        """At most `MOST_POINTS` of them, evenly over their order."""
        step = -(-len(self.position) // MOST_POINTS)
        if step <= 1:
            return self
        return Cloud(self.position[::step], {name: values[::step] for name, values in self.quantities.items()})


def cloud_message(cloud: Cloud, stamp: int) -> Messages:
    """Return a cloud as a whole message record, shape (1,), in single precision.

    Args:
        cloud: Points in the base frame.
        stamp: When it was found [ns].
    """
    columns = {axis: cloud.position[:, i] for i, axis in enumerate("xyz")} | dict(cloud.quantities)
    points = np.stack([np.asarray(values, "<f4") for values in columns.values()], axis=1)
    step = points.strides[0] if len(points) else 4 * len(columns)
    layout = begin(CLOUD_CHANNEL, BASE)
    layout.constant("<u4", 1, len(points), len(columns))
    for i, name in enumerate(columns):
        layout.text(name)
        layout.constant("<u4", 4 * i)
        layout.constant("u1", _FLOAT32)
        layout.constant("<u4", 1)
    layout.constant("u1", 0)
    layout.constant("<u4", step, step * len(points), step * len(points))
    layout.add("data", "u1", step * len(points))
    layout.constant("u1", int(np.isfinite(points).all()))
    stamps: Stamps = np.array([stamp], np.uint64)
    found = layout.template()
    put_heads(found, np.zeros(1, np.int64), stamps)
    put_stamps(found, stamps)
    found["data"] = points.view("u1").ravel()
    return found
