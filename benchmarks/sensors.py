"""What the imperfections of a force/torque sensor cost an exploration.

    python benchmarks/sensors.py [--quick]

A sphere of 40 mm on the stage (1 kHz, 2 N, mu 0.3, 20 kN/m, 40 x 40 mm, 20 mm/s). Errors are those of the true
normal force, and of the points against the true surface. Where several specimens were tried, the median, and the
worst after a slash.
"""

import argparse
from dataclasses import dataclass, replace

import msgspec
import numpy as np
from rich.console import Console
from rich.progress import track
from rich.table import Table

from palpate.errors import InvalidValueError
from palpate.experiments.explore.config import ExploreConfig
from palpate.experiments.explore.exploration import Exploration, found_by
from palpate.experiments.explore.plan import plan
from palpate.experiments.kit.recorded_run import carry_out
from palpate.robots.robot import Robot, load_robot
from palpate.robots.simulated_sensor_entry import (
    BiasEntry,
    DriftEntry,
    FirstOrderEntry,
    NoiseEntry,
    PresetSensor,
    QuantisationEntry,
    SaturationEntry,
    SimulatedSensorEntry,
)
from palpate.robots.surface_entries import SphereEntry
from palpate.sim.sensor.presets import NANO17_RESOLUTION, sensor_preset

SPECIMENS = 5

HARDLY = NoiseEntry(force=1e-5, moment=1e-7)
"""Noise that does nothing but show that the sensor lives."""

NOTHING = SimulatedSensorEntry(
    preset=PresetSensor.NANO17,
    cross_talk=0.0,
    drift=DriftEntry(time_constant=1.0),
    quantisation=QuantisationEntry(),
    sample_rate=0.0,
    latency=0.0,
)
"""A Nano17 without its imperfections."""

STEP = NANO17_RESOLUTION[0], NANO17_RESOLUTION[3]
NANO17 = sensor_preset(PresetSensor.NANO17)


@dataclass(frozen=True, slots=True)
class Case:
    """One row of a table.

    Attributes:
        name: For people.
        sensor: Of the robot file; None: a perfect one.
        noise: Likewise; None: as the preset.
        specimens: How many to try.
        tip: Radius [m].
        force: To press with [N].
        sample_age: The supervisor's limit [s].
    """

    name: str
    sensor: SimulatedSensorEntry | None = None
    noise: NoiseEntry | None = None
    specimens: int = 1
    tip: float = 0.008
    force: float = 2.0
    sample_age: float = 0.02


def robot_of(case: Case, specimen: int) -> Robot:
    """Return the stage with the sensor of a case."""
    file = load_robot("stage").file
    sensor = case.sensor and msgspec.structs.replace(case.sensor, specimen=specimen)
    surface = SphereEntry(radius=case.tip)
    finger = msgspec.structs.replace(file.fingers[0], surface=surface, noise=case.noise, simulated_sensor=sensor)
    limits = msgspec.structs.replace(file.limits, sample_age=case.sample_age)
    return Robot(msgspec.structs.replace(file, fingers=(finger,), limits=limits), (None,), {})


def explored(case: Case, specimen: int, config: ExploreConfig) -> Exploration:
    """Explore with one specimen of a sensor."""
    robot = robot_of(case, specimen)
    planned = plan(replace(config, force=case.force, seed=specimen), robot, {})
    return found_by(planned, carry_out(planned))


def alone() -> list[Case]:
    """One imperfection at a time, and how much it takes to do harm."""
    changed = msgspec.structs.replace
    bias = BiasEntry(force=(0.05, 0.0, 0.1), moment=(0.0, 0.0, 0.0))
    warm = DriftEntry(force=(0.03, 0.03, 0.0425), moment=(3e-4, 3e-4, 3e-4), time_constant=600.0)
    clock = changed(NOTHING, sample_rate=None, latency=None)
    limits = SaturationEntry(force=(12.6, 12.6, 17.85), moment=(0.126, 0.126, 0.126))
    return [
        Case("perfect"),
        Case("white noise 10 mN, 0.1 mN m", None, NoiseEntry(force=0.01, moment=1e-4)),
        Case("Nano17 with nothing but noise of 10 uN", NOTHING, HARDLY),
        Case("  noise of one step", NOTHING, NoiseEntry(force=STEP[0], moment=STEP[1])),
        Case(
            "  steps, and half of one for noise",
            changed(NOTHING, quantisation=QuantisationEntry(force=STEP[0], moment=STEP[1])),
            NoiseEntry(force=STEP[0] / 2.0, moment=STEP[1] / 2.0),
        ),
        Case("  cross-talk 1 %", changed(NOTHING, cross_talk=None), HARDLY, SPECIMENS),
        Case("  drift 0.05 %/K on every axis, 5 K in 10 min", changed(NOTHING, drift=warm), HARDLY),
        Case("  the Net box: 7 kHz, 0.29 ms late", clock, HARDLY),
        Case("  saturation at 105 %", changed(NOTHING, saturation=limits), HARDLY),
        Case("  10 % of its samples lost", changed(clock, lost_share=0.1), HARDLY),
        Case("  bandwidth 100 Hz", changed(NOTHING, bandwidth=FirstOrderEntry(cutoff=100.0)), HARDLY),
        Case("  10 ms late", changed(NOTHING, latency=0.01), HARDLY),
        Case("  bias 50, 0, 100 mN", changed(NOTHING, bias=bias), HARDLY),
        Case("  bias 50, 0, 100 mN, tared", changed(NOTHING, bias=bias, tare=1.0), HARDLY),
        Case("Nano17, all on", SimulatedSensorEntry(preset=PresetSensor.NANO17), None, SPECIMENS),
        Case("Nano17, all on, tared", SimulatedSensorEntry(preset=PresetSensor.NANO17, tare=1.0), None, SPECIMENS),
        Case(
            "Nano17, all on, bias 50, 0, 100 mN",
            SimulatedSensorEntry(preset=PresetSensor.NANO17, bias=bias),
            None,
            SPECIMENS,
        ),
        Case(
            "Nano17, all on, bias 50, 0, 100 mN, tared",
            SimulatedSensorEntry(preset=PresetSensor.NANO17, bias=bias, tare=1.0),
            None,
            SPECIMENS,
        ),
    ]


def coarse() -> list[Case]:
    """Sensors for wrists, and noise at the limit of what is accepted."""
    ladder = [
        Case(f"noise of {share:g} of force times radius", None, NoiseEntry(force=0.0, moment=share * 2.0 * 0.008))
        for share in (0.025, 0.05, 0.1, 0.11)
    ]
    wrist = [
        Case(f"{preset}, tip of {1e3 * tip:g} mm, {force:g} N", SimulatedSensorEntry(preset=preset, tare=1.0),
             None, SPECIMENS, tip, force, 0.03)
        for preset in (PresetSensor.AXIA80, PresetSensor.FT300S)
        for tip, force in ((0.008, 2.0), (0.008, 8.0), (0.025, 2.0), (0.025, 4.0), (0.025, 8.0))
    ]  # fmt: skip
    own = Case("ur5e, tip of 8 mm, 2 N", SimulatedSensorEntry(preset=PresetSensor.UR5E), None)
    return [*ladder, *wrist, own]


def table_of(title: str, cases: list[Case], config: ExploreConfig, specimens: int) -> Table:
    """Run cases."""
    table = Table(title=title)
    table.add_column("sensor")
    for heading in ("ending", "force RMS error N", "points RMS mm", "radius error mm"):
        table.add_column(heading, justify="right")
    for case in track(cases, title, transient=True):
        try:
            found = [explored(case, i, config) for i in range(min(case.specimens, specimens))]
        except InvalidValueError:
            table.add_row(case.name, "refused", "-", "-", "-")
            continue
        radii = [1e3 * abs(one.sphere.radius - 0.04) if one.sphere else np.nan for one in found]
        table.add_row(
            case.name,
            ", ".join(sorted({one.run.ending.value for one in found})),
            median_and_worst([one.force_rms for one in found]),
            median_and_worst([1e3 * one.point_rms for one in found]),
            median_and_worst(radii),
        )
    return table


def median_and_worst(values: list[float]) -> str:
    """Return a cell."""
    return "/".join(f"{x:.4f}" for x in ([np.median(values), max(values)] if len(values) > 1 else values))


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="a small patch and two specimens: half a minute")
    quick = parser.parse_args().quick
    config = ExploreConfig(spacing=0.004)
    if quick:
        config = replace(config, width=0.02, depth=0.008)
    console, specimens = Console(width=140), 2 if quick else SPECIMENS
    console.print(table_of("One imperfection at a time, then all of them", alone(), config, specimens))
    console.print(table_of("Coarse sensors", coarse(), config, specimens))


if __name__ == "__main__":
    main()
