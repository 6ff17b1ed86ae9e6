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
from palpate.runtime.loop import Ending, Observer, RunResult, run
from palpate.runtime.protocols import Backend, Controller
from palpate.runtime.recorder import Record, Recorder
from palpate.runtime.supervisor import Limits, Supervisor, Trip
from palpate.runtime.touch import Finger, FingerDescription, PlainPipeline, SensorFinger, Touch, WrenchPipeline

__all__ = [
    "ArmSample",
    "Backend",
    "Command",
    "Controller",
    "Ending",
    "Finger",
    "FingerDescription",
    "FingerObservation",
    "HandSample",
    "Limits",
    "Observation",
    "Observer",
    "Phase",
    "PlainPipeline",
    "Record",
    "Recorder",
    "RunResult",
    "Sample",
    "SensorFinger",
    "Supervisor",
    "Touch",
    "Trip",
    "WrenchPipeline",
    "WrenchSample",
    "run",
]
