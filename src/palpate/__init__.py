"""palpate: hybrid force control with the sense of touch.

`import palpate as pp` gives scripts what they need, each name imported when it is first used.
"""

import pkgutil
from collections.abc import Mapping
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from palpate.version import __version__ as __version__

if TYPE_CHECKING:  # for type checkers: these names are imported when they are used
    from palpate.commands.replay.run import replay_log as replay_log
    from palpate.commands.sweep import SweepConfig as SweepConfig
    from palpate.commands.sweep import sweep as sweep
    from palpate.friction import ContactLoad as ContactLoad
    from palpate.friction import LimitSurface as LimitSurface
    from palpate.friction import Slip as Slip
    from palpate.grasp import GraspContacts as GraspContacts
    from palpate.grasp import GraspForceOptimizer as GraspForceOptimizer
    from palpate.hw.ft_stream import StreamSettings as StreamSettings
    from palpate.hw.netft import NetFt as NetFt
    from palpate.hw.netft import NetFtSettings as NetFtSettings
    from palpate.robots.values import load_named_robot as load_named_robot
    from palpate.runtime import Command as Command
    from palpate.runtime import Limits as Limits
    from palpate.runtime import Observation as Observation
    from palpate.runtime import Phase as Phase
    from palpate.runtime import Sample as Sample
    from palpate.runtime import Supervisor as Supervisor
    from palpate.runtime import Touch as Touch
    from palpate.runtime import run as run
    from palpate.runtime.log import read_log as read_log
    from palpate.sensing import Contact as Contact
    from palpate.sensing import Contacts as Contacts
    from palpate.sensing import ContactStatus as ContactStatus
    from palpate.sensing import Solver as Solver
    from palpate.sensing import contact_from_wrench as contact_from_wrench
    from palpate.sensing import contacts_from_wrenches as contacts_from_wrenches
    from palpate.sensing.uncertainty import contact_uncertainty as contact_uncertainty
    from palpate.sensing.uncertainty import white_noise as white_noise
    from palpate.sim import ContactLaw as ContactLaw
    from palpate.sim import MujocoBackend as MujocoBackend
    from palpate.sim import SphereObject as SphereObject
    from palpate.sim import Tip as Tip
    from palpate.sim import build_scene as build_scene
    from palpate.surfaces import Capsule as Capsule
    from palpate.surfaces import CompliantTip as CompliantTip
    from palpate.surfaces import Composite as Composite
    from palpate.surfaces import Cylinder as Cylinder
    from palpate.surfaces import Ellipsoid as Ellipsoid
    from palpate.surfaces import Hyperboloid as Hyperboloid
    from palpate.surfaces import ImplicitSurface as ImplicitSurface
    from palpate.surfaces import MeshSurface as MeshSurface
    from palpate.surfaces import Paraboloid as Paraboloid
    from palpate.surfaces import Patch as Patch
    from palpate.surfaces import Plane as Plane
    from palpate.surfaces import RoundedBox as RoundedBox
    from palpate.surfaces import Sphere as Sphere
    from palpate.surfaces import Superellipsoid as Superellipsoid
    from palpate.surfaces.symbolic import SymbolicSurface as SymbolicSurface

_NAMES: Mapping[str, tuple[str, ...]] = {
    "commands.replay.run": ("replay_log",),
    "commands.sweep": ("SweepConfig", "sweep"),
    "friction": ("ContactLoad", "LimitSurface", "Slip"),
    "grasp": ("GraspContacts", "GraspForceOptimizer"),
    "hw.ft_stream": ("StreamSettings",),
    "hw.netft": ("NetFt", "NetFtSettings"),
    "robots.values": ("load_named_robot",),
    "runtime": ("Command", "Limits", "Observation", "Phase", "Sample", "Supervisor", "Touch", "run"),
    "runtime.log": ("read_log",),
    "sensing": ("Contact", "ContactStatus", "Contacts", "Solver", "contact_from_wrench", "contacts_from_wrenches"),
    "sensing.uncertainty": ("contact_uncertainty", "white_noise"),
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
    if name == "__all__":  # of `from palpate import *`
        return [name for names in _NAMES.values() for name in names]
    if name.startswith("_"):  # what Python itself looks up
        raise AttributeError(f"module 'palpate' has no attribute {name!r}")
    home = _homes().get(name)
    if home is None:
        raise AttributeError(f"module 'palpate' has no attribute {name!r}; it has {', '.join(sorted(_homes()))}")
    return getattr(import_module(home), name)


def __dir__() -> list[str]:
    return sorted(_homes())
