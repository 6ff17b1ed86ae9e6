"""The force/torque sensor behind a fingertip: description, calibration and processing of its readings.

Found out once, from data: `fit_calibration` (known loads), `identify_payload` (static poses), `average_bias` and
`estimate_drift` (readings at rest). Kept in one `SensorFile` per sensor (`load_sensor_file`, `save_sensor_file`).
Used once per sample: `FTPipeline`.
"""

from palpate.sensing.ft.bias import BiasEstimate, Drift, average_bias, estimate_drift
from palpate.sensing.ft.calibration import CalibrationFit, fit_calibration
from palpate.sensing.ft.calibration_choice import CalibrationChoice, choose_calibration
from palpate.sensing.ft.calibration_map import CalibrationMap
from palpate.sensing.ft.filter_specs import Butterworth, CriticallyDamped, FilterSpec, FirstOrder, Notch
from palpate.sensing.ft.filters import WrenchFilter
from palpate.sensing.ft.health import HEALTHY, DriftWatch, HealthCheck, HealthLimits, HealthMonitor, SampleHealth
from palpate.sensing.ft.mounting import IdentifiedMounting, identify_mounting
from palpate.sensing.ft.payload import IdentifiedPayload, identify_payload
from palpate.sensing.ft.pipeline import FTPipeline, PipelineOutput
from palpate.sensing.ft.poses import specific_force_from_gravity, specific_force_from_rotations
from palpate.sensing.ft.sensor_file import CalibrationEntry, ContactEntry, PayloadEntry, SensorFile
from palpate.sensing.ft.sensor_reader import load_sensor_file, read_sensor
from palpate.sensing.ft.sensor_updates import (
    bias_covariance,
    touch_uncertainty,
    with_bias,
    with_calibration,
    with_payload,
)
from palpate.sensing.ft.sensor_writer import save_sensor_file, sensor_text
from palpate.sensing.ft.touch_detector import ContactDetector

__all__ = [
    "HEALTHY",
    "BiasEstimate",
    "Butterworth",
    "CalibrationChoice",
    "CalibrationEntry",
    "CalibrationFit",
    "CalibrationMap",
    "ContactDetector",
    "ContactEntry",
    "CriticallyDamped",
    "Drift",
    "DriftWatch",
    "FTPipeline",
    "FilterSpec",
    "FirstOrder",
    "HealthCheck",
    "HealthLimits",
    "HealthMonitor",
    "IdentifiedMounting",
    "IdentifiedPayload",
    "Notch",
    "PayloadEntry",
    "PipelineOutput",
    "SampleHealth",
    "SensorFile",
    "WrenchFilter",
    "average_bias",
    "bias_covariance",
    "choose_calibration",
    "estimate_drift",
    "fit_calibration",
    "identify_mounting",
    "identify_payload",
    "load_sensor_file",
    "read_sensor",
    "save_sensor_file",
    "sensor_text",
    "specific_force_from_gravity",
    "specific_force_from_rotations",
    "touch_uncertainty",
    "with_bias",
    "with_calibration",
    "with_payload",
]
