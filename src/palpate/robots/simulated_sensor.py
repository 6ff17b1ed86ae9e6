"""From a robot file to the simulated sensor that it asks for."""

from dataclasses import replace
from typing import Any

from palpate.robots.simulated_sensor_entry import (
    DriftEntry,
    FirstOrderEntry,
    NoiseEntry,
    SecondOrderEntry,
    SimulatedSensorEntry,
)
from palpate.sim.sensor.model import SensorModel
from palpate.sim.sensor.presets import sensor_preset
from palpate.sim.sensor.stages import (
    CrossTalk,
    Dropouts,
    FirstOrderLag,
    Quantisation,
    SampleClock,
    Saturation,
    SecondOrderLag,
    WhiteNoise,
    alike,
    drawn_cross_talk,
)
from palpate.sim.sensor.temperature import ThermalDrift, WarmUp
from palpate.spatial import Wrench


def model_of(entry: SimulatedSensorEntry | None, noise: NoiseEntry | None) -> SensorModel:
    """Return the sensor of a finger.

    Args:
        entry: As its robot file says; None: a perfect one.
        noise: Instead of what it has.

    Raises:
        InvalidValueError: It cannot be.
    """
    entry = entry or SimulatedSensorEntry()
    model = sensor_preset(entry.preset, entry.specimen)
    changes = _changes(entry, model)
    if noise is not None:
        changes["noise"] = _white(noise.force, noise.moment)
    return replace(model, **changes) if changes else model


def with_noise(model: SensorModel, force: float, moment: float) -> SensorModel:
    """Return the sensor with white noise of these standard deviations, each axis [N, N m], instead of its own."""
    return replace(model, noise=_white(force, moment))


def _white(force: float, moment: float) -> WhiteNoise | None:
    return WhiteNoise(alike(force, moment)) if force or moment else None


def _changes(entry: SimulatedSensorEntry, model: SensorModel) -> dict[str, Any]:
    """What a robot file has otherwise than the preset: fields of `SensorModel`."""
    changes: dict[str, Any] = {}
    if entry.range is not None:
        changes["rated"] = (*entry.range.force, *entry.range.moment)
    if entry.cross_talk is not None:
        changes["cross_talk"] = _cross_talk(entry.cross_talk, changes.get("rated", model.rated), entry.specimen)
    match entry.bandwidth:
        case FirstOrderEntry():
            changes["bandwidth"] = FirstOrderLag(entry.bandwidth.cutoff)
        case SecondOrderEntry():
            changes["bandwidth"] = SecondOrderLag(entry.bandwidth.natural_frequency, entry.bandwidth.damping)
    if entry.bias is not None:
        changes["bias"] = (*entry.bias.force, *entry.bias.moment)
    if entry.drift is not None:
        changes["thermal_drift"] = _drift(entry.drift)
    if entry.quantisation is not None:
        steps = alike(entry.quantisation.force, entry.quantisation.moment)
        changes["quantisation"] = Quantisation(steps) if any(steps) else None
    if entry.saturation is not None:
        changes["saturation"] = Saturation((*entry.saturation.force, *entry.saturation.moment))
    if entry.sample_rate is not None:
        changes["clock"] = SampleClock(entry.sample_rate) if entry.sample_rate else None
    if entry.latency is not None:
        changes["latency"] = entry.latency
    if entry.lost_share is not None:
        changes["dropouts"] = Dropouts(entry.lost_share) if entry.lost_share else None
    return changes


def _cross_talk(share: float, rated: Wrench | None, specimen: int) -> CrossTalk | None:
    if share == 0.0:
        return None
    assert rated is not None  # SimulatedSensorEntry has made sure of it
    return drawn_cross_talk(rated, alike(share, share), specimen)


def _drift(entry: DriftEntry) -> ThermalDrift | None:
    """One kelvin stands for the whole warm-up: only the product of the two is felt."""
    whole = (*entry.force, *entry.moment)
    return ThermalDrift(whole, WarmUp(1.0, entry.time_constant)) if any(whole) else None
