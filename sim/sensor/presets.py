"""Presets of common sensors, from their data sheets.

A maker states limits, not one sensor: a preset is one specimen of its kind, drawn within them (`specimen`). The
same number is the same sensor, with the same errors, in every run; the seed of a run is another thing.

What no document says is an ASSUMPTION, marked as such here and in `SensorModel.source`; QUOTED is what was read in
others' quotations of the maker, not in his own document. All presets show no bias: they were tared (software bias)
before the run. Replace what you know better:

    dataclasses.replace(sensor_preset(PresetSensor.NANO17), bandwidth=SecondOrderLag(326.0))
"""

import numpy as np

from palpate.sensing.ft.preset_sensor import PresetSensor
from palpate.sim.sensor.model import SensorModel
from palpate.sim.sensor.stages import (
    CrossTalk,
    Quantisation,
    SampleClock,
    Saturation,
    WhiteNoise,
    alike,
    drawn_cross_talk,
)
from palpate.sim.sensor.temperature import ThermalDrift, WarmUp
from palpate.spatial import Wrench

__all__ = ["PresetSensor", "axia80", "ft300s", "nano17", "sensor_preset", "ur5e_sensor"]

OVERLOAD = 1.05
"""Of the rated load, where ATI's Axia reports that its range is exceeded: manual 9610-05-Ethernet Axia-09, section
4.8, and 9620-05-C-Ethernet Axia-02, section 5.5.1. ASSUMPTION: readings end there, and so for the Nano17 and the
UR5e, whose maker states none. Above 1, so that an overload is seen."""

CROSS_TALK = 0.01
"""ASSUMPTION: of a full load, how much of it another axis may show; makers claim 1 to 2 % for all errors together
(see `palpate.sensing.ft.calibration`)."""

ZERO_DRIFT = 5e-4
"""ASSUMPTION: of the full load per kelvin. A load cell of one axis is sold with 5e-5 (Octogon, data sheet FRB,
"temp. effect on zero"); ten times that for six axes in little room."""

WARM_UP = WarmUp(rise=5.0, time_constant=600.0)
"""ASSUMPTION: of a small sensor by its own electronics, and what it is bolted to."""

LIMIT_SIGMAS = 3.0
"""ASSUMPTION: standard deviations in what a maker gives as a limit of the noise, or as "precision"."""

NANO17_RATED: Wrench = (12.0, 12.0, 17.0, 0.12, 0.12, 0.12)
"""Calibration SI-12-0.12 [N, N m]. QUOTED from ATI's page of the Nano17."""

NANO17_RESOLUTION = alike(1 / 320, 1e-3 / 64)
"""1/320 N, QUOTED likewise, and 1/64 N mm, as in palpate's sensor files."""

NET_BOX_RATE = 7000.0
"""[Hz]. ASSUMPTION: `ft_sequence` of a Net box counts about so fast; ATI states 7000, accurate to 0.5 %, for
its Digital F/T (page ft_SystemInterfaces.aspx)."""

NET_BOX_LATENCY = 288e-6
"""[s] between an event and its Ethernet packet, Net F/T, RDT over UDP: ATI's page ft_SystemInterfaces.aspx."""

AXIA80_RATED: Wrench = (500.0, 500.0, 900.0, 20.0, 20.0, 20.0)
"""Axia80-M20, calibration SI-500-20 [N, N m]: manual 9610-05-Ethernet Axia-09, table 4.8."""

AXIA80_RATE = 488.0
"""[Hz]. The slowest of those it offers, 488 to 7912: manual 9620-05-C-Ethernet Axia-02, table 5.5."""

AXIA80_NOISE = 5e-4
"""Of the full scale: larger jumps are abnormal, says manual 9610-05-Ethernet Axia-09, section 14.5."""

FT300S_RATED: Wrench = alike(300.0, 30.0)
"""[N, N m]. QUOTED from Robotiq's product page."""

FT300S_STEP = alike(0.01, 0.001)
"""[N, N m] per count of its stream: FT 300-S instruction manual, section 4.4.2."""

FT300S_RATE = 100.0
"""[Hz] of its stream: likewise."""

FT300S_LATENCY = 16 * 10 / 19200
"""[s] that a message of 16 bytes (likewise) takes, ten bits to the byte. ASSUMPTION: at 19200 baud."""

FT300S_NOISE = alike(0.1, 0.005)
"""ASSUMPTION [N, N m]: a buyers' guide gives 0.1 N as its resolution (roboticscenter.ai, force-torque sensor
selection guide); the moment is that at an arm of 50 mm."""

UR5E_RATED: Wrench = alike(50.0, 10.0)
"""Range [N, N m]; this and the two below are QUOTED from the UR5e's data sheet, "Force sensing, tool flange/torque
sensor"."""

UR5E_PRECISION: Wrench = alike(3.5, 0.2)
"""[N, N m]."""

UR5E_ACCURACY: Wrench = alike(4.0, 0.3)
"""[N, N m]."""

UR_RATE = 500.0
"""[Hz] of the e-Series' real-time data exchange (RTDE)."""

UR_LATENCY = 1.0 / UR_RATE
"""ASSUMPTION [s]: one cycle of the controller."""


def sensor_preset(preset: PresetSensor, specimen: int = 0) -> SensorModel:
    """Return a sensor.

    Args:
        preset: Its kind.
        specimen: Which one of its kind, 0 or above; see above.

    Raises:
        InvalidValueError: The specimen's number is negative.
    """
    match preset:
        case PresetSensor.PERFECT:
            return SensorModel()
        case PresetSensor.NANO17:
            return nano17(specimen)
        case PresetSensor.AXIA80:
            return axia80(specimen)
        case PresetSensor.FT300S:
            return ft300s(specimen)
        case PresetSensor.UR5E:
            return ur5e_sensor(specimen)


def nano17(specimen: int = 0) -> SensorModel:
    """Return an ATI Nano17, calibration SI-12-0.12, through a Net box: for a fingertip.

    A packet of the box holds no time but the number of the sample, `ft_sequence`, which counts 7000 a second and
    never restarts. A driver turns it into the time of sampling, up to the drift of two clocks, and that is the
    stamp here. A driver that stamps arrival is off by the latency.

    Its resonance at 7.2 kHz (ATI's page) is above what samples of 7 kHz show; the box's low-pass filter is off
    until one is chosen (ASSUMPTION: as of the Axia).
    """
    return SensorModel(
        name="ATI Nano17 SI-12-0.12, simulated",
        source="range and resolution QUOTED from ATI's page of the Nano17; latency of the Net box from ATI's page "
        "of system interfaces; ASSUMPTION: samples at 7000 Hz, noise is one resolution, cross-talk 1 % of the "
        "range, zero drift 0.05 % of the range per kelvin, warm-up of 5 K in 10 minutes, readings end at 105 % "
        "of the range",
        rated=NANO17_RATED,
        cross_talk=_cross_talk(NANO17_RATED, specimen),
        thermal_drift=_thermal_drift(NANO17_RATED, specimen),
        noise=WhiteNoise(NANO17_RESOLUTION),
        quantisation=Quantisation(NANO17_RESOLUTION),
        saturation=_overload(NANO17_RATED),
        clock=SampleClock(NET_BOX_RATE),
        latency=NET_BOX_LATENCY,
    )


def axia80(specimen: int = 0) -> SensorModel:
    """Return an ATI Axia80-M20, calibration SI-500-20: for a wrist.

    Its counts are a millionth of a newton (manual 9610-05-Ethernet Axia-09, table 8.3): far below the noise, so
    that no rounding is simulated. Its filter is off until one is chosen, and its latency is below 28 ms
    (9620-05-C-Ethernet Axia-02, sections 5.4 and 12.4): one sample is ASSUMED.
    """
    noise = _scaled(AXIA80_RATED, AXIA80_NOISE / LIMIT_SIGMAS)
    return SensorModel(
        name="ATI Axia80-M20 SI-500-20, simulated",
        source="range, sample rate, overload and limit of the noise from ATI's manuals 9610-05-Ethernet Axia-09 "
        "and 9620-05-C-Ethernet Axia-02; ASSUMPTION: that limit is three standard deviations, latency is one "
        "sample, cross-talk 1 % of the range, zero drift 0.05 % of the range per kelvin, warm-up of 5 K in "
        "10 minutes",
        rated=AXIA80_RATED,
        cross_talk=_cross_talk(AXIA80_RATED, specimen),
        thermal_drift=_thermal_drift(AXIA80_RATED, specimen),
        noise=WhiteNoise(noise),
        saturation=_overload(AXIA80_RATED),
        clock=SampleClock(AXIA80_RATE),
        latency=1.0 / AXIA80_RATE,
    )


def ft300s(specimen: int = 0) -> SensorModel:
    """Return a Robotiq FT 300-S that streams: for a wrist.

    Slow: its newest sample is 8 to 18 ms old. A message holds 16-bit counts, which end at 327.67 N and 32.767 N m.
    """
    counts = float(np.iinfo(np.int16).max)
    return SensorModel(
        name="Robotiq FT 300-S, simulated",
        source="range QUOTED from Robotiq's product page; counts and rate of the stream from the FT 300-S "
        "instruction manual, section 4.4.2; ASSUMPTION: latency is 16 bytes at 19200 baud, noise of 0.1 N and "
        "5 mN m, cross-talk 1 % of the range, zero drift 0.05 % of the range per kelvin, warm-up of 5 K in "
        "10 minutes",
        rated=FT300S_RATED,
        cross_talk=_cross_talk(FT300S_RATED, specimen),
        thermal_drift=_thermal_drift(FT300S_RATED, specimen),
        noise=WhiteNoise(FT300S_NOISE),
        quantisation=Quantisation(FT300S_STEP),
        saturation=Saturation(_scaled(FT300S_STEP, counts)),
        clock=SampleClock(FT300S_RATE),
        latency=FT300S_LATENCY,
    )


def ur5e_sensor(specimen: int = 0) -> SensorModel:
    """Return the sensor in a UR5e's tool flange, read over RTDE.

    The data sheet says "precision" and "accuracy" without saying of what. ASSUMPTION: precision is three standard
    deviations of a reading, and what accuracy has beyond it is the error of calibration at full load: so every
    specimen keeps to both, and not only the usual one, as if they were added in squares.
    (Measured: set to 1 to 10 N, a UR5e was off by 0.38 N on the average, and set to 10 N, by -1.1 to 3.3 N over
    its workspace; abstract of Trochimczuk et al. 2026, Sensors 26(5) 1709.) No document on bandwidth or on drift
    with temperature was found; none is simulated.
    """
    limits = zip(UR5E_ACCURACY, UR5E_PRECISION, UR5E_RATED, strict=True)
    a, b, c, d, e, f = ((accuracy - precision) / full for accuracy, precision, full in limits)
    return SensorModel(
        name="Universal Robots UR5e, simulated",
        source="range, precision and accuracy QUOTED from the UR5e's data sheet; rate of RTDE; ASSUMPTION: "
        "precision is three standard deviations, the rest of accuracy is cross-talk and gain, latency is one "
        "cycle, readings end at 105 % of the range",
        rated=UR5E_RATED,
        cross_talk=drawn_cross_talk(UR5E_RATED, (a, b, c, d, e, f), specimen),
        noise=WhiteNoise(_scaled(UR5E_PRECISION, 1.0 / LIMIT_SIGMAS)),
        saturation=_overload(UR5E_RATED),
        clock=SampleClock(UR_RATE),
        latency=UR_LATENCY,
    )


def _scaled(wrench: Wrench, factor: float) -> Wrench:
    a, b, c, d, e, f = wrench
    return (factor * a, factor * b, factor * c, factor * d, factor * e, factor * f)


def _overload(rated: Wrench) -> Saturation:
    return Saturation(_scaled(rated, OVERLOAD))


def _cross_talk(rated: Wrench, specimen: int) -> CrossTalk:
    return drawn_cross_talk(rated, alike(CROSS_TALK, CROSS_TALK), specimen)


def _thermal_drift(rated: Wrench, specimen: int) -> ThermalDrift:
    """Of one specimen: each axis drifts by up to `ZERO_DRIFT` in magnitude. Not the numbers of its cross-talk."""
    a, b, c, d, e, f = np.random.default_rng((specimen, 1)).uniform(-ZERO_DRIFT, ZERO_DRIFT, 6) * np.array(rated)
    return ThermalDrift((float(a), float(b), float(c), float(d), float(e), float(f)), WARM_UP)
