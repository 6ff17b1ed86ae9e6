"""Force and points of explorations in simulation, by sensor and arm.

    python benchmarks/explorations.py [sensors | coarse | arms ...] [--quick]

sensors: each imperfection of a Nano17 alone, then all of them. coarse: wrist sensors, and noise at the limit of
what is accepted. arms: beside the UR5e. Errors are those of the true normal force, of the points against
the true surface, and of the map; typical is the median over specimens. The cost is computing time per simulated
second.
"""

import statistics
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import msgspec
from harness.command import start
from harness.study import Effort, Errors, Row, Study

from palpate.errors import InvalidValueError
from palpate.experiments.explore.config import ExploreConfig
from palpate.experiments.explore.exploration import ExplorationResult, evaluate
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
from palpate.sim.sensor.presets import NANO17_RESOLUTION

SPECIMENS = 5
BASE = ExploreConfig(spacing=0.004)
PATCH = replace(BASE, width=0.02, depth=0.008)
"""Explored by --quick."""


@dataclass(frozen=True, slots=True)
class Way:
    """One way to explore.

    Attributes:
        name: Name in the table.
        config: What is explored, and how.
        robot: Takes the number of the specimen; returns the robot.
        specimens: Number of specimens of the sensor.
    """

    name: str
    config: ExploreConfig
    robot: Callable[[int], Robot]
    specimens: int = 1

    def explore(self, specimen: int) -> ExplorationResult:
        """Explore with one specimen."""
        planned = plan(replace(self.config, seed=self.config.seed + specimen), self.robot(specimen), {})
        return evaluate(planned, carry_out(planned))


def study(title: str, case: Callable[[Way], str], ways: Sequence[Way], effort: Effort) -> Study:
    """Explore in all ways."""
    rows = []
    for way in ways:
        effort.tell(f"{title}: {way.name}")
        try:
            found = [way.explore(i) for i in range(min(way.specimens, effort.of(SPECIMENS, 2)))]
        except InvalidValueError:
            rows.append(Row(case(way), way.name, 0.0, (Errors.of([float("nan")]),) * 3, note="refused"))
            continue
        maps = [each.claimed_map.rms if each.claimed_map else float("nan") for each in found]
        values = [each.force_rms for each in found], [each.point_rms for each in found], maps
        endings = ", ".join(sorted({each.run.ending.value for each in found}))
        cost = statistics.median(1.0 / each.run.real_time_factor for each in found)
        rows.append(Row(case(way), way.name, cost, tuple(map(Errors.of, values)), note=endings))
    quantities = ("force", "N"), ("points", "m"), ("map", "m")
    return Study(title, "", "time per simulated second", "s", quantities, tuple(rows))


# ----------------------------------------------------------------------------------------------------- sensors

HARDLY = NoiseEntry(force=1e-5, moment=1e-7)
"""Noise that only shows that the sensor is alive."""

IDEAL = SimulatedSensorEntry(
    preset=PresetSensor.NANO17,
    cross_talk=0.0,
    drift=DriftEntry(time_constant=1.0),
    quantisation=QuantisationEntry(),
    sample_rate=0.0,
    latency=0.0,
)
"""A Nano17 without its imperfections."""

NANO17 = SimulatedSensorEntry(preset=PresetSensor.NANO17)
STEP = NANO17_RESOLUTION[0], NANO17_RESOLUTION[3]
BIAS = BiasEntry(force=(0.05, 0.0, 0.1), moment=(0.0, 0.0, 0.0))
WARMING = DriftEntry(force=(0.03, 0.03, 0.0425), moment=(3e-4, 3e-4, 3e-4), time_constant=600.0)
LIMITS = SaturationEntry(force=(12.6, 12.6, 17.85), moment=(0.126, 0.126, 0.126))


def stage_with(
    sensor: SimulatedSensorEntry | None, noise: NoiseEntry | None, tip: float, age: float, specimen: int
) -> Robot:
    """Return the stage with another sensor, noise, radius of the tip [m] and limit of a sample's age [s]."""
    file = load_robot("stage").file
    changed = sensor and msgspec.structs.replace(sensor, specimen=specimen)
    surface = SphereEntry(radius=tip)
    finger = msgspec.structs.replace(file.fingers[0], surface=surface, noise=noise, simulated_sensor=changed)
    limits = msgspec.structs.replace(file.limits, sample_age=age)
    return Robot(msgspec.structs.replace(file, fingers=(finger,), limits=limits), (None,), {})


def sensor_way(
    config: ExploreConfig,
    name: str,
    sensor: SimulatedSensorEntry | None = None,
    noise: NoiseEntry | None = None,
    specimens: int = 1,
    *,
    tip: float = 0.008,
    age: float = 0.02,
) -> Way:
    """Return an exploration with a sensor."""
    return Way(name, config, partial(stage_with, sensor, noise, tip, age), specimens)


def sensors(effort: Effort) -> Study:
    """Explore with one imperfection at a time, then with all of them."""
    way = partial(sensor_way, PATCH if effort.quick else BASE)
    ideal, nano = (partial(msgspec.structs.replace, each) for each in (IDEAL, NANO17))
    clock = ideal(sample_rate=None, latency=None)
    half = NoiseEntry(force=STEP[0] / 2.0, moment=STEP[1] / 2.0)
    ways = [
        way("perfect"),
        way("white noise 10 mN, 0.1 mN m", None, NoiseEntry(force=0.01, moment=1e-4)),
        way("Nano17 with nothing but noise of 10 uN", IDEAL, HARDLY),
        way("  noise of one step", IDEAL, NoiseEntry(force=STEP[0], moment=STEP[1])),
        way(
            "  steps, and half of one for noise",
            ideal(quantisation=QuantisationEntry(force=STEP[0], moment=STEP[1])),
            half,
        ),
        way("  cross-talk 1 %", ideal(cross_talk=None), HARDLY, SPECIMENS),
        way("  drift 0.05 %/K on every axis, 5 K in 10 min", ideal(drift=WARMING), HARDLY),
        way("  the Net box: 7 kHz, 0.29 ms late", clock, HARDLY),
        way("  saturation at 105 %", ideal(saturation=LIMITS), HARDLY),
        way("  10 % of its samples lost", msgspec.structs.replace(clock, lost_share=0.1), HARDLY),
        way("  bandwidth 100 Hz", ideal(bandwidth=FirstOrderEntry(cutoff=100.0)), HARDLY),
        way("  10 ms late", ideal(latency=0.01), HARDLY),
        way("  bias 50, 0, 100 mN", ideal(bias=BIAS), HARDLY),
        way("  bias 50, 0, 100 mN, tared", ideal(bias=BIAS, tare=1.0), HARDLY),
        way("Nano17, all on", NANO17, None, SPECIMENS),
        way("Nano17, all on, tared", nano(tare=1.0), None, SPECIMENS),
        way("Nano17, all on, bias 50, 0, 100 mN", nano(bias=BIAS), None, SPECIMENS),
        way("Nano17, all on, bias 50, 0, 100 mN, tared", nano(bias=BIAS, tare=1.0), None, SPECIMENS),
    ]
    return study("Imperfections of a sensor", lambda _: "sphere, 20 mm/s", ways, effort)


def coarse(effort: Effort) -> Study:
    """Explore with sensors for wrists, and with noise at the limit of what is accepted."""
    config = PATCH if effort.quick else BASE
    ways = [
        sensor_way(
            config,
            f"noise of {share:g} of force times radius",
            None,
            NoiseEntry(force=0.0, moment=share * 2.0 * 0.008),
        )
        for share in (0.025, 0.05, 0.1, 0.11)
    ]
    for preset in (PresetSensor.AXIA80, PresetSensor.FT300S):
        sensor = SimulatedSensorEntry(preset=preset, tare=1.0)
        for tip, force in ((0.008, 2.0), (0.008, 8.0), (0.025, 2.0), (0.025, 4.0), (0.025, 8.0)):
            name = f"{preset}, tip of {1e3 * tip:g} mm, {force:g} N"
            pressed = replace(config, force=force)
            ways.append(sensor_way(pressed, name, sensor, None, SPECIMENS, tip=tip, age=0.03))
    ways.append(sensor_way(config, "ur5e, tip of 8 mm, 2 N", SimulatedSensorEntry(preset=PresetSensor.UR5E)))
    return study("Coarse sensors", lambda _: "sphere, 20 mm/s", ways, effort)


# --------------------------------------------------------------------------------------------- arms


def arms(effort: Effort) -> Study:
    """Explore with every arm."""
    robots = ("ur5e-sim", "panda-sim", "xarm6-sim")
    places = [(name, speed) for name in ("sphere", "ellipsoid", "bumps") for speed in (0.02, 0.05)]
    ways = []
    for name, speed in places[:1] if effort.quick else places:
        config = ExploreConfig(object=name, speed=speed, width=0.02, depth=0.02, seed=1)
        ways += [
            Way(robot, replace(config, robot=robot), lambda _, robot=robot: load_robot(robot)) for robot in robots
        ]
    return study("Arms", lambda way: f"{way.config.object}, {1e3 * way.config.speed:g} mm/s", ways, effort)


PARTS = {"sensors": sensors, "coarse": coarse, "arms": arms}

if __name__ == "__main__":
    start(__doc__, PARTS)
