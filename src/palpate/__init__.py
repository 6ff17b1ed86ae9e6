"""palpate: hybrid force control with the sense of touch.

`import palpate as pp` gives scripts what they need, each name imported when it is first used.
"""

import pkgutil
from collections.abc import Mapping
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from palpate.commands.replay.run import replay_log
    from palpate.commands.sweep.config import SweepConfig
    from palpate.commands.sweep.run import sweep
    from palpate.friction import ContactLoad, LimitSurface, Slip
    from palpate.grasp import GraspContacts, GraspForceOptimizer
    from palpate.robots.values import load_named_robot
    from palpate.runtime import Command, Limits, Observation, Phase, Sample, Supervisor, Touch, run
    from palpate.runtime.log import read_log
    from palpate.sensing import Contact, Contacts, ContactStatus, contact_from_wrench, contacts_from_wrenches
    from palpate.sim import ContactLaw, MujocoBackend, SphereObject, Tip, build_scene
    from palpate.surfaces import (
        Capsule,
        CompliantTip,
        Composite,
        Cylinder,
        Ellipsoid,
        Hyperboloid,
        ImplicitSurface,
        MeshSurface,
        Paraboloid,
        Patch,
        Plane,
        RoundedBox,
        Sphere,
        Superellipsoid,
    )
    from palpate.surfaces.symbolic import SymbolicSurface

__version__ = "0.2.0"

_NAMES: Mapping[str, tuple[str, ...]] = {
    "commands.replay.run": ("replay_log",),
    "commands.sweep.config": ("SweepConfig",),
    "commands.sweep.run": ("sweep",),
    "friction": ("ContactLoad", "LimitSurface", "Slip"),
    "grasp": ("GraspContacts", "GraspForceOptimizer"),
    "robots.values": ("load_named_robot",),
    "runtime": ("Command", "Limits", "Observation", "Phase", "Sample", "Supervisor", "Touch", "run"),
    "runtime.log": ("read_log",),
    "sensing": ("Contact", "ContactStatus", "Contacts", "contact_from_wrench", "contacts_from_wrenches"),
    "sim": ("ContactLaw", "MujocoBackend", "SphereObject", "Tip", "build_scene"),
    "surfaces": (
        "Capsule",
        "CompliantTip",
        "Composite",
        "Cylinder",
        "Ellipsoid",
        "Hyperboloid",
        "ImplicitSurface",
        "MeshSurface",
        "Paraboloid",
        "Patch",
        "Plane",
        "RoundedBox",
        "Sphere",
        "Superellipsoid",
    ),
    "surfaces.symbolic": ("SymbolicSurface",),
}
"""What scripts need, by the module that has it. Every experiment adds what its package offers."""

__all__ = [name for names in _NAMES.values() for name in names]


@cache
def _homes() -> dict[str, str]:
    """By name, the module that has it."""
    homes = {name: f"palpate.{module}" for module, names in _NAMES.items() for name in names}
    folder = Path(__file__).parent / "experiments"
    for package in pkgutil.iter_modules([str(folder)]):
        module = f"palpate.experiments.{package.name}"
        if package.ispkg and package.name != "kit":
            homes |= dict.fromkeys(import_module(module).__all__, module)
    return homes


def __getattr__(name: str) -> Any:
    # Imported when first used: numba alone takes longer to import than everything else together.
    if name.startswith("_"):  # what Python itself asks for
        raise AttributeError(f"module 'palpate' has no attribute {name!r}")
    home = _homes().get(name)
    if home is None:
        raise AttributeError(f"module 'palpate' has no attribute {name!r}; it has {', '.join(sorted(_homes()))}")
    return getattr(import_module(home), name)


def __dir__() -> list[str]:
    return sorted(_homes())
