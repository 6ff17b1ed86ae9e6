"""The seam between experiments and robots, and the loop that runs over it."""

from palpate.runtime.data import (
    ArmSample,
    Command,
    FingerObservation,
    HandSample,
    Observation,
    Phase,
    Sample,
    WrenchSample,
)
from palpate.runtime.log import MemoryLog, Record, Recorder
from palpate.runtime.loop import Observer, run
from palpate.runtime.pacing import Pacer, Punctuality, SimulatedTime
from palpate.runtime.protocols import Backend, Controller
from palpate.runtime.rest import RestState, RobotRest
from palpate.runtime.result import Ending, RunResult, result_until, speaks_for_itself
from palpate.runtime.supervision import Cause, Limits, Supervisor, Trip
from palpate.runtime.timing import Distribution, RunTiming
from palpate.runtime.touch import Finger, FingerDescription, PlainPipeline, SensorFinger, Touch, WrenchPipeline
from palpate.runtime.watchdog import DeviceWatchdog

__all__ = [
    "ArmSample",
    "Backend",
    "Cause",
    "Command",
    "Controller",
    "DeviceWatchdog",
    "Distribution",
    "Ending",
    "Finger",
    "FingerDescription",
    "FingerObservation",
    "HandSample",
    "Limits",
    "MemoryLog",
    "Observation",
    "Observer",
    "Pacer",
    "Phase",
    "PlainPipeline",
    "Punctuality",
    "Record",
    "Recorder",
    "RestState",
    "RobotRest",
    "RunResult",
    "RunTiming",
    "Sample",
    "SensorFinger",
    "SimulatedTime",
    "Supervisor",
    "Touch",
    "Trip",
    "WrenchPipeline",
    "WrenchSample",
    "result_until",
    "run",
    "speaks_for_itself",
]
