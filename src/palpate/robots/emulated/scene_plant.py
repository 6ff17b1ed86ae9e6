"""MuJoCo scenes as plants behind emulated devices."""

from dataclasses import replace
from typing import Protocol

from palpate.hw.emulators.server import PlantState, ServoGoal, ServoState
from palpate.robots.emulated.truth import TruthTrace
from palpate.runtime.data import Command, Phase, Sample
from palpate.runtime.protocols import Backend
from palpate.runtime.truth import TruthSource
from palpate.spatial import Vector

STILL = Command()


class Servos(Protocol):
    """Motors of a hand in a scene."""

    def take(self, goals: tuple[ServoGoal, ...]) -> None:
        """Take what the bus asks of them."""
        ...

    def states(self) -> tuple[ServoState, ...]:
        """Return what they measure of themselves."""
        ...


class SceneBackend(Backend, TruthSource, Protocol):
    """A back end that knows what really happens."""


class ScenePlant:
    """A scene, as emulated devices move and measure it. A `Plant`.

    Until the trace starts it, it stands as it started, and only its clock runs: what moves in a scene by a
    schedule, as a surface that leaves or a pull that grows, begins when the robot does, not while it is still
    connected to.
    """

    def __init__(
        self, backend: SceneBackend, trace: TruthTrace | None = None, servos: Servos | None = None
    ) -> None:
        """Take a scene.

        Args:
            backend: Of the scene, as fast as it can be computed: the emulators' host keeps the time.
            trace: Where to; None: nobody wants to know, and it begins at once.
            servos: Of its hand; None if it has none.
        """
        self._backend, self._trace, self._servos = backend, trace, servos
        self._time = self._stood = 0.0
        self._sample: Sample | None = None

    @property
    def period(self) -> float:
        """From one step to the next [s]."""
        return self._backend.period

    def start(self) -> PlantState:
        """See `Plant`."""
        self._time = self._stood = 0.0
        return self._state(self._backend.start())

    def step(
        self, velocity_base_tip: Vector, angular_velocity_base_tip: Vector, servos: tuple[ServoGoal, ...]
    ) -> PlantState:
        """See `Plant`; without servos, goals are of no consequence.

        Raises:
            SimulationDivergedError: The simulation diverged.
            InvalidValueError: A motion that the scene's carrier cannot do.
        """
        self._time += self.period
        if self._servos is not None:
            self._servos.take(servos)
        if self._sample is not None and self._trace is not None and not self._trace.begun:
            self._stood = self._time
            return self._state(self._sample)
        command = Command(velocity_base_tip, Phase.HOLD, angular_velocity_base_tip=angular_velocity_base_tip)
        return self._state(self._backend.step(command))

    def close(self) -> None:
        """See `Plant`."""
        self._backend.close()
        if self._trace is not None:
            self._trace.close()

    def _state(self, sample: Sample) -> PlantState:
        self._sample = sample
        if self._trace is not None:
            self._trace.write(self._backend.truth_row())
        stood = self._stood
        arm = replace(sample.arm, time=sample.arm.time + stood)
        wrenches = tuple(replace(wrench, time=wrench.time + stood) for wrench in sample.wrenches)
        states = () if self._servos is None else self._servos.states()
        return PlantState(self._time, arm, wrenches, states)
