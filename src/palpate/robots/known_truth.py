"""Which robots know what really happens: simulated ones, be it behind a wire; no real one does."""

from typing import Protocol, runtime_checkable

from palpate.errors import InvalidValueError
from palpate.runtime.protocols import Backend
from palpate.sim import Scene
from palpate.sim.contact_truth import Truth
from palpate.sim.scene_cost import SceneCost, scene_cost


@runtime_checkable
class Simulated(Backend, Protocol):
    """A back end of something simulated."""

    @property
    def scene(self) -> Scene:
        """What is simulated."""
        ...

    def truth(self) -> Truth:
        """Return what really happened at the last sample."""
        ...


def scene_of(backend: Backend) -> Scene | None:
    """Return what is simulated; None on a robot."""
    return backend.scene if isinstance(backend, Simulated) else None


def known_scene(backend: Backend) -> Scene:
    """Return what is simulated, for what makes no sense without.

    Raises:
        InvalidValueError: It is a robot.
    """
    scene = scene_of(backend)
    if scene is None:
        raise InvalidValueError("this run was on a robot: there is no scene to show; take a simulated one")
    return scene


def cost_of(backend: Backend) -> SceneCost | None:
    """Return what the simulated scene costs; None on a robot."""
    scene = scene_of(backend)
    return None if scene is None else scene_cost(scene.model)


def cost_row(cost: SceneCost | None) -> tuple[tuple[str, str], ...]:
    """Return its rows for a report's settings: none on a robot."""
    return () if cost is None else (("simulated scene", str(cost)),)


def time_name(cost: SceneCost | None) -> str:
    """Return what the duration of a run is called."""
    return "duration" if cost is None else "simulated time"
