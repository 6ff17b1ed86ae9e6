"""Recording: every period of a run, in memory and in MCAP files, and reading it back bit for bit."""

from palpate.runtime.live import Change
from palpate.runtime.log.entries import Event, Level
from palpate.runtime.log.heading import Heading
from palpate.runtime.log.layout import Layout
from palpate.runtime.log.log import Gap, Log
from palpate.runtime.log.log_path import log_in, new_log_path
from palpate.runtime.log.log_writer import LogWriter
from palpate.runtime.log.memory_log import MemoryLog
from palpate.runtime.log.reader import LogReader, read_log
from palpate.runtime.log.record import Record
from palpate.runtime.log.recorder import Recorder
from palpate.runtime.log.sink import RecordingSummary, Sink
from palpate.runtime.log.standard.cloud import Cloud
from palpate.runtime.log.standard.topics import RobotNotes
from palpate.runtime.log.told_log import add_topics

__all__ = [
    "Change",
    "Cloud",
    "Event",
    "Gap",
    "Heading",
    "Layout",
    "Level",
    "Log",
    "LogReader",
    "LogWriter",
    "MemoryLog",
    "Record",
    "Recorder",
    "RecordingSummary",
    "RobotNotes",
    "Sink",
    "add_topics",
    "log_in",
    "new_log_path",
    "read_log",
]
