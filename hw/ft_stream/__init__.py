"""What force/torque sensors have in common, whatever wire they stream on."""

from palpate.hw.ft_stream.link import Link, Record, StreamCounts
from palpate.hw.ft_stream.sample_clock import SampleClock
from palpate.hw.ft_stream.streamed_sensor import StreamedSensor, StreamSettings
from palpate.hw.ft_stream.succession import Step, Succession

__all__ = [
    "Link",
    "Record",
    "SampleClock",
    "Step",
    "StreamCounts",
    "StreamSettings",
    "StreamedSensor",
    "Succession",
]
