"""What force/torque sensors have in common, whatever wire they stream on."""

from palpate.hw.ft_stream.link import Link, StreamCounts, StreamReading
from palpate.hw.ft_stream.streamed_sensor import StreamedSensor, StreamSettings
from palpate.hw.ft_stream.succession import Step, Succession

__all__ = [
    "Link",
    "Step",
    "StreamCounts",
    "StreamReading",
    "StreamSettings",
    "StreamedSensor",
    "Succession",
]
