"""The choices that are compared, by kind of scene."""

from dataclasses import dataclass, replace
from enum import Enum

from palpate.errors import InvalidValueError
from palpate.sensing.compensation import SensorPayload
from palpate.sim import Cone, Fidelity, Integrator, SeededSensor, SensorModel, Stage
from palpate.sim.contact_law import pair_parameters
from palpate.sim.friction.law import FrictionLaw
from palpate.sim.presets import ARM, EXPLORE, GRASP
from palpate.sim.sensor.model import noisy_sensor
from palpate.sim.sensor.presets import nano17
from simulation.exploring import TIP, Touching
from simulation.grasping import Holding

PRESET = "preset"


class Group(Enum):
    """What a choice is about."""

    PRESET = "preset"
    STEP = "integrator and time step"
    CONE = "cone"
    IMPEDANCE = "impedance"
    STIFFNESS = "stiffness"
    FRICTION = "friction plant"
    COLLISIONS = "every collision"
    SENSOR = "sensor"
    IMPRATIO = "impratio"


@dataclass(frozen=True, slots=True)
class TouchChoice:
    """One way to simulate a tip on an object.

    Attributes:
        name: For table and picture.
        group: What differs from the preset.
        touching: The way.
        comparable: Whether it is the same scene, computed in another way: these compete for the front.
    """

    name: str
    group: Group
    touching: Touching
    comparable: bool = True


@dataclass(frozen=True, slots=True)
class HoldChoice:
    """One way to simulate a hand that holds an object; as `TouchChoice`."""

    name: str
    group: Group
    holding: Holding
    comparable: bool = True


STEPS = (0.1e-3, 0.25e-3, 0.5e-3, 1e-3)  # [s]
LONG = 2e-3  # [s]: with a control period as long
STIFFNESSES = ((2e3, LONG), (20e3, 1e-3), (100e3, 0.5e-3), (500e3, 0.25e-3))
"""[N/m], and about the longest step that the law allows on a stage [s]."""

REACH_STIFFNESS = 100e3
"""[N/m]: a stiff fingertip, which a scene for touching shall take without another time step,"""

REACH_FRICTIONS, REACH_FORCE, REACH_MASS = (0.05, 1.0), 0.5, 2.0
"""and friction from wet to rubber, from half a newton on, on a stage of 2 kg [-, N, kg]."""


def label(fidelity: Fidelity) -> str:
    """Return integrator and time step, as tables say them."""
    return f"{fidelity.integrator.value}, {1e3 * fidelity.time_step:g} ms"


def touch_choices(base: Touching) -> tuple[TouchChoice, ...]:
    """Return all choices around a preset, the preset first."""
    fidelity, law = base.fidelity, base.law
    found = [TouchChoice(PRESET, Group.PRESET, base)]
    for integrator in Integrator:
        for step in STEPS:
            computed = Fidelity(step, integrator)
            if computed != fidelity:
                found.append(TouchChoice(label(computed), Group.STEP, replace(base, fidelity=computed)))
    pyramid = replace(base, fidelity=replace(fidelity, cone=Cone.PYRAMIDAL))
    found.append(TouchChoice("pyramidal cone", Group.CONE, pyramid))
    for impedance in (0.005, 0.01, 0.05, 0.2, 0.5):
        other = replace(base, law=replace(law, impedance=impedance))
        found.append(TouchChoice(f"impedance {impedance:g}", Group.IMPEDANCE, other))
    for stiffness, step in STIFFNESSES:
        other = replace(
            base,
            law=replace(law, stiffness=stiffness),
            fidelity=replace(fidelity, time_step=step),
            period=max(step, base.period),
        )
        name = f"{1e-3 * stiffness:g} kN/m, {1e3 * step:g} ms"
        found.append(TouchChoice(name, Group.STIFFNESS, other, comparable=False))
    plant = FrictionLaw(law.friction, law.friction, spin_length=law.spin_length)
    found.append(TouchChoice("friction plant", Group.FRICTION, replace(base, plant=plant)))
    found.append(TouchChoice("every collision on", Group.COLLISIONS, replace(base, every_collision=True)))
    return tuple(found)


def sensor_choices() -> tuple[TouchChoice, ...]:
    """Return the sensors that a stage may carry, and the lack of compensation."""
    base = Touching()
    uncompensated = replace(base, payload=SensorPayload())
    return (
        *(
            TouchChoice(name, Group.SENSOR, replace(base, sensor=SeededSensor(model)), False)
            for name, model in sensors()
        ),
        TouchChoice("weight and inertia left in", Group.SENSOR, uncompensated, False),
    )


def sensors() -> tuple[tuple[str, SensorModel], ...]:
    """Return sensors by name: perfect, two noises, the Nano17 and each of its imperfections alone."""
    whole = nano17()
    part = SensorModel(name="part of a Nano17", source=whole.source, rated=whole.rated)
    return (
        ("perfect", SensorModel()),
        ("noise 10 mN, 0.1 mNm", noisy_sensor(10e-3, 0.1e-3)),
        ("noise 50 mN, 1 mNm", noisy_sensor(50e-3, 1e-3)),
        ("nano17", whole),
        ("nano17: cross-talk", replace(part, cross_talk=whole.cross_talk)),
        ("nano17: drift", replace(part, thermal_drift=whole.thermal_drift)),
        ("nano17: noise", replace(part, noise=whole.noise)),
        ("nano17: steps", replace(part, quantisation=whole.quantisation)),
        ("nano17: saturation", replace(part, saturation=whole.saturation)),
        ("nano17: clock, latency", replace(part, clock=whole.clock, latency=whole.latency)),
    )


def hold_choices() -> tuple[HoldChoice, ...]:
    """Return all choices around the preset of a grasp, the preset first."""
    base = Holding()
    fidelity = base.fidelity
    found = [HoldChoice(PRESET, Group.PRESET, base)]
    for integrator in Integrator:
        for step in (0.25e-3, 0.5e-3, 1e-3):
            computed = Fidelity(step, integrator)
            if computed != fidelity:
                found.append(HoldChoice(label(computed), Group.STEP, replace(base, fidelity=computed)))
    pyramid = replace(base, fidelity=replace(fidelity, cone=Cone.PYRAMIDAL))
    found.append(HoldChoice("pyramidal cone", Group.CONE, pyramid))
    found += [
        HoldChoice(f"impedance {impedance:g}", Group.IMPEDANCE, replace(base, impedance=impedance))
        for impedance in (0.05, 0.2, 0.9)
    ]
    found += [
        HoldChoice(f"impratio {impratio:g}", Group.IMPRATIO, replace(base, impratio=impratio))
        for impratio in (1.0, 10.0, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7)
        if impratio != base.impratio
    ]
    for stiffness in (2e3, 40e3):
        other = replace(base, law=replace(base.law, stiffness=stiffness))
        found.append(HoldChoice(f"{1e-3 * stiffness:g} kN/m", Group.STIFFNESS, other, comparable=False))
    found.append(HoldChoice("every collision on", Group.COLLISIONS, replace(base, every_collision=True)))
    return tuple(found)


def reaches(touching: Touching) -> str:
    """Return what a scene like this could not be built for, of what it shall do without another time step."""
    law, step = touching.law, touching.fidelity.time_step
    stage = 1.0 / (EXPLORE.carrier.mass + TIP.mass) if isinstance(EXPLORE.carrier, Stage) else 0.2
    light = 1.0 / (REACH_MASS + TIP.mass)
    try:
        pair_parameters(replace(law, stiffness=REACH_STIFFNESS), stage, step)
    except InvalidValueError:
        return f"no {1e-3 * REACH_STIFFNESS:g} kN/m"
    for friction in REACH_FRICTIONS:
        try:
            pair_parameters(replace(law, friction=friction, smallest_force=REACH_FORCE), light, step)
        except InvalidValueError:
            return f"no mu {friction:g} on {REACH_MASS:g} kg"
    return ""


STAGE_BASE, ARM_BASE, GRASP_BASE = (
    Touching(),
    Touching(ARM.fidelity, ARM.law, ARM.carrier),
    Holding(GRASP.fidelity),
)
