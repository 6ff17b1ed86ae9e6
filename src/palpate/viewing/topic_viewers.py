"""Which programs of others show a run's topics."""

from palpate.viewing.foxglove_publisher import FoxglovePublisher
from palpate.viewing.publisher import TopicViewer
from palpate.viewing.rerun_publisher import RerunPublisher

FOXGLOVE = TopicViewer(
    "Foxglove", "foxglove", "foxglove", 8765, "in Foxglove: Open connection, Foxglove WebSocket", FoxglovePublisher
)
RERUN = TopicViewer(
    "rerun", "rerun", "rerun", 9876, "the rerun viewer that is open there shows it", RerunPublisher
)
