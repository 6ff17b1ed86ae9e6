"""How well a contact is sensed on the turntable, beside the figures of the project's first measurements."""

from collections.abc import Callable
from dataclasses import dataclass, replace

from palpate.sim import Fidelity, Integrator
from palpate.sim.friction.law import FrictionLaw
from palpate.sim.presets import EXPLORE
from simulation.accuracy import Accuracy, accuracy
from simulation.choices import sensors
from simulation.turntable import FRICTION, LAW, OWN_FINDER, SPIN_LENGTH, Ride, ride

STEPS = {2e3: 2e-3, 20e3: 0.5e-3, 100e3: 0.5e-3, 500e3: 0.2e-3}
"""Time step for each contact stiffness: [N/m] -> [s]."""

SOFT = 20e3  # [N/m]: of the rows that do not name one
NOISY = range(8)  # seeds of a sensor with noise


@dataclass(frozen=True, slots=True)
class Known:
    """Figures of the first measurements: median, and 99th percentile where there is one [mm, mm, mNm]."""

    to_contact: float
    on_surface: tuple[float, float]
    spin_torque: tuple[float, float]


FACTS = {
    "2 kN/m": Known(1.13, (0.49, 0.59), (0.121, 0.127)),
    "20 kN/m": Known(0.115, (0.050, 0.057), (0.014, 0.016)),
    "100 kN/m": Known(0.023, (0.010, 0.011), (0.003, 0.003)),
    "500 kN/m": Known(0.005, (0.002, 0.002), (0.001, 0.001)),
    "weight and inertia left in": Known(0.130, (0.078, 0.095), (0.140, 0.233)),
    "noise 10 mN, 0.1 mNm": Known(0.136, (0.087, 0.215), (0.17, 0.60)),
    "noise 50 mN, 1 mNm": Known(0.443, (0.43, 1.07), (1.04, 3.87)),
    "wrench-axis method": Known(0.339, (0.325, 0.347), (0.81, 0.87)),
}
"""Ellipsoid on a plane, 5.3 N, mu 0.5, 20 mm/s and 1 rad/s, MuJoCo 4.0. What the tip weighed, and where, is
not known: the row with its weight left in depends on that."""

STIFFNESS_ROWS = ("2 kN/m", "20 kN/m", "100 kN/m", "500 kN/m")


@dataclass(frozen=True, slots=True)
class Row:
    """A row of the table."""

    name: str
    found: Accuracy

    @property
    def beaten(self) -> bool:
        """Whether every figure is the first measurements', or better; the last digit counts half."""
        known = FACTS[self.name]
        pairs = [(1e3 * self.found.to_contact[0], known.to_contact)]
        pairs += zip((1e3 * x for x in self.found.on_surface), known.on_surface, strict=True)
        pairs += zip((1e3 * x for x in self.found.spin_torque), known.spin_torque, strict=True)
        return all(got <= asked + 0.0005 for got, asked in pairs)


def sensed_rows(done: Callable[[], None] = lambda: None) -> list[Row]:
    """Measure the whole table; about ten seconds."""
    rows: list[Row] = []

    def keep(name: str, found: Accuracy) -> None:
        rows.append(Row(name, found))
        done()

    for stiffness, step in STEPS.items():
        fidelity, law = replace(EXPLORE.fidelity, time_step=step), replace(LAW, stiffness=stiffness)
        ridden = ride(fidelity, law)
        name = f"{1e-3 * stiffness:g} kN/m"
        keep(name, accuracy(ridden, stiffness))
        keep(f"{name}, MuJoCo's own contact finder", accuracy(ride(fidelity, law, finder=OWN_FINDER), stiffness))
        keep(f"{name}, tip not shrunk", accuracy(ridden, stiffness, shrunk=False))
    preset = ride()
    keep("weight and inertia left in", accuracy(preset, SOFT, compensated=False))
    for name, model in sensors()[1:]:
        keep(name, accuracy(preset, SOFT, model, seeds=NOISY))
    for step in (0.1e-3, 0.5e-3, 1e-3):
        for integrator in (Integrator.IMPLICITFAST, Integrator.RK4):
            name = f"{integrator.value}, {1e3 * step:g} ms"
            keep(name, accuracy(ride(Fidelity(step, integrator)), SOFT))
    keep("friction plant", accuracy(_with_plant(), SOFT))
    keep("wrench-axis method", accuracy(preset, SOFT, hard=True))
    return rows


def _with_plant() -> Ride:
    return ride(plant=FrictionLaw(FRICTION, FRICTION, spin_length=SPIN_LENGTH))
