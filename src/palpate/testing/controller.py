"""Check that a controller is a pure step function with memory."""

import builtins
import enum
import gc
import math
import pickle
import sys
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from itertools import chain
from types import BuiltinFunctionType, FunctionType, MethodType, ModuleType
from typing import Any

import numpy as np

from palpate.errors import PalpateError, shown
from palpate.runtime.data import Command, Observation, Phase
from palpate.runtime.protocols import Backend, Controller
from palpate.runtime.touch import Finger, Touch
from palpate.sensing.ft.health import HealthCheck, SampleHealth
from palpate.sensing.solver import contact_from_wrench
from palpate.spatial import norm
from palpate.surfaces.shapes import Sphere
from palpate.testing.nonconformity import Inspection
from palpate.testing.spring_plane import RADIUS, SpringPlane

MAX_OBJECTS = 5000
"""Largest number of objects examined per instance: controllers have hundreds."""

_OPAQUE = (
    *(str, bytes, int, float, complex, bool, type(None), type, enum.Enum),
    *(ModuleType, FunctionType, MethodType, BuiltinFunctionType),
)
_MUTABLE = (list, dict, set, bytearray, deque, np.ndarray)


def mutable_parts(instance: object) -> dict[str, object]:
    """Return the mutable containers reachable from an instance or its class, by their path."""
    parts: dict[str, object] = {}
    seen: set[int] = set()
    left: deque[tuple[str, object]] = deque([("", instance)])
    while left and len(seen) < MAX_OBJECTS:
        path, value = left.popleft()
        if id(value) in seen or isinstance(value, _OPAQUE):
            continue
        seen.add(id(value))
        if isinstance(value, _MUTABLE):
            parts[path] = value
        left.extend((f"{path}{step}", inner) for step, inner in _inside(value))
    return parts


def _inside(value: Any) -> Iterator[tuple[str, object]]:
    """Yield the parts of a value: items of containers; attributes of other values and of their class."""
    if isinstance(value, np.ndarray):
        return
    if isinstance(value, dict):
        yield from ((f"[{key!r}]", inner) for key, inner in list(value.items()))
    elif isinstance(value, list | tuple | set | frozenset | deque):
        yield from ((f"[{i}]", inner) for i, inner in enumerate(list(value)))
    else:
        for kind in type(value).__mro__:
            for name in getattr(kind, "__slots__", ()):
                if hasattr(value, name):
                    yield f".{name}", getattr(value, name)
            if not kind.__module__.startswith(("builtins", "typing", "enum")):
                own = ((name, inner) for name, inner in vars(kind).items() if isinstance(inner, _MUTABLE))
                yield from ((f".{name}", inner) for name, inner in own if not name.startswith("__"))
        yield from ((f".{name}", inner) for name, inner in list(getattr(value, "__dict__", {}).items()))


def fingerprint(part: object) -> str:
    """Return a text that differs if a container has changed."""
    return part.tobytes().hex() if isinstance(part, np.ndarray) else repr(part)


CLOCK_NAMES = ("time", "monotonic", "perf_counter", "process_time", "time_ns", "monotonic_ns", "perf_counter_ns")
FORBIDDEN_CALLS: tuple[tuple[ModuleType, str], ...] = (
    *((time, name) for name in CLOCK_NAMES),
    (time, "sleep"),
    *((builtins, name) for name in ("print", "open", "input")),
)
"""Module and name of each function that a controller must not call."""

CLOCK_OFFSET = 1e6
"""Offset of clocks during the check [s], so that a controller that reads one computes other commands."""


@contextmanager
def watched(calls: dict[str, str]) -> Iterator[None]:
    """Record the file and line of each forbidden call, by the name of the function; clocks are wrong meanwhile.

    Functions imported under other names are replaced, too. Modules of the standard library and other threads are
    not affected.
    """
    stand_ins = {id(getattr(owner, name)): _noting(owner, name, calls) for owner, name in FORBIDDEN_CALLS}
    places = [
        (module, name, value)
        for key, module in list(sys.modules.items())
        if not _standard(key) or module in (time, builtins)
        for name, value in list(getattr(module, "__dict__", {}).items())
        if id(value) in stand_ins
    ]
    callbacks, gc.callbacks[:] = gc.callbacks[:], []  # garbage collection calls no code of the controller
    for module, name, real in places:
        setattr(module, name, stand_ins[id(real)])
    try:
        yield
    finally:
        gc.callbacks[:] = callbacks
        for module, name, real in places:
            setattr(module, name, real)


def _standard(name: str) -> bool:
    return name.partition(".")[0] in sys.stdlib_module_names and name != "__main__"


def _noting(owner: ModuleType, name: str, calls: dict[str, str]) -> Callable[..., Any]:
    real, here = getattr(owner, name), threading.get_ident()
    ahead = CLOCK_OFFSET * (1e9 if name.endswith("_ns") else 1.0) if name in CLOCK_NAMES else 0.0

    def stand_in(*given: Any, **named: Any) -> Any:
        caller = sys._getframe(1)
        value = real(*given, **named)
        if threading.get_ident() != here or _standard(caller.f_globals.get("__name__", "")):
            return value
        calls.setdefault(f"{owner.__name__}.{name}", f"{caller.f_code.co_filename}:{caller.f_lineno}")
        return type(value)(value + ahead) if ahead else value

    return stand_in


MAX_SPEED, MAX_TURN_RATE = 2.0, 2.0 * math.pi
"""Largest speeds [m/s, rad/s]: twice those of tool and joints of a UR5e (data sheet: 1 m/s, 180 deg/s)."""

MAX_PERIODS = 3000
"""Longest run [periods]: at 1 kHz enough to land, press, and slide."""


def on_plane() -> tuple[Backend, Touch]:
    """Return a ball over a plane that yields like a spring, and the touch of this ball."""
    return SpringPlane(), Touch(Finger(Sphere(RADIUS)))


def check_controller(
    make: Callable[[], Controller],
    world: Callable[[], tuple[Backend, Touch]] = on_plane,
    periods: int = MAX_PERIODS,
) -> None:
    """Check a controller: it runs once, then receives the recorded observations again, as in a replay.

    Args:
        make: Function that returns a new controller.
        world: Function that returns a simulated back end and its touch, in which the controller can do its task;
            by default `on_plane`.
        periods: Longest run [periods].

    Raises:
        ConformanceError: If the controller breaks a rule.
    """
    controller = make()
    with Inspection(type(controller).__name__) as inspection:
        observations: list[Observation] = []
        commands: list[str] = []
        with inspection.part("a run"):
            _run(inspection, controller, world, periods, observations, commands)
        if not commands:
            return
        with inspection.part("a replay"):
            _examine_replay(inspection, make, observations, commands)
        with inspection.part("beside another instance"):
            _examine_neighbours(inspection, make, observations, commands)
        with inspection.part("a finger whose readings are no numbers"):
            _examine_broken_sensor(inspection, make, observations)


def _run(
    inspection: Inspection,
    controller: Controller,
    world: Callable[[], tuple[Backend, Touch]],
    periods: int,
    observations: list[Observation],
    commands: list[str],
) -> None:
    backend, touch = world()
    kept = []
    with backend:
        now = touch.sense(backend.start())
        observations.append(now)
        controller.start(now)
        for _ in range(periods):
            kept.append(pickle.dumps(now))
            command = controller.step(now)
            commands.append(repr(command))
            if not _examine_command(inspection, command, now) or command.phase.is_final:
                break
            now = touch.sense(backend.step(command))
            observations.append(now)
    del observations[len(commands) :]
    changed = [now.time for now, before in zip(observations, kept, strict=False) if pickle.dumps(now) != before]
    inspection.require(
        not changed,
        "inputs",
        f"{len(changed)} observations have changed",
        "observations as they were",
        "copy what is to be changed: others read the same observation",
    )


def _examine_command(inspection: Inspection, command: Command, now: Observation) -> bool:
    """Examine types, numbers and units of a command; return whether it can be carried out."""
    kind = isinstance(command, Command) and isinstance(getattr(command, "phase", None), Phase)
    if not inspection.require(
        kind,
        "command",
        f"step returned {shown(command)}",
        "a Command with a Phase",
        "return Command(velocity, phase)",
    ):
        return False
    vectors = (command.velocity_base_tip, command.angular_velocity_base_tip)
    fingers = (velocity for velocity in command.finger_velocity or () if velocity is not None)
    numbers = (*vectors[0], *vectors[1], *(command.grip_force or ()), *chain.from_iterable(fingers))
    if not inspection.require(
        all(isinstance(vector, tuple) and len(vector) == 3 for vector in vectors)
        and all(map(math.isfinite, numbers)),
        "numbers",
        f"{shown(command, 200)} at t = {now.time:.3f} s",
        "finite numbers",
        "look for a division by zero, and for the NaN normal of no contact: ask `finger.believed` first",
    ):
        return False
    speed, rate = norm(command.velocity_base_tip), norm(command.angular_velocity_base_tip)
    return inspection.require(
        speed <= MAX_SPEED and rate <= MAX_TURN_RATE,
        "units",
        f"commanded {speed:.3g} m/s and {rate:.3g} rad/s at t = {now.time:.3f} s",
        f"at most {MAX_SPEED:g} m/s and {MAX_TURN_RATE:.2f} rad/s",
        "velocities are in m/s and rad/s, not in mm/s and degrees/s; gains are in m/s per newton",
    )


def _fed(controller: Controller, observations: Sequence[Observation]) -> list[str]:
    controller.start(observations[0])
    return [repr(controller.step(now)) for now in observations]


def _examine_replay(
    inspection: Inspection,
    make: Callable[[], Controller],
    observations: Sequence[Observation],
    commands: list[str],
) -> None:
    """Equal observations must give equal commands under a wrong clock, and no other effect."""
    calls: dict[str, str] = {}
    controller = make()
    with watched(calls):
        again = _fed(controller, observations)
    for what, where in calls.items():
        inspection.require(
            False,
            "clock" if what.startswith("time.") else "input and output",
            f"step asks {what} ({where})",
            "no clock, no input or output",
            "take the time from the observation (now.time), and leave files and printing to observers of the run",
        )
    differs = _first_difference(commands, again)
    inspection.require(
        differs is None or calls,
        "purity",
        f"fed the same observations twice, it commands {_pair(commands, again, differs)}",
        "the same commands bit for bit",
        "chance without a seed, or state that is kept outside of the instance, as in a class or a module",
    )


def _examine_neighbours(
    inspection: Inspection,
    make: Callable[[], Controller],
    observations: Sequence[Observation],
    commands: list[str],
) -> None:
    """Two instances, one half a run behind the other, must not affect one another or share mutable state."""
    one, other = make(), make()
    if not inspection.require(
        one is not other,
        "shared state",
        "make returns one object twice",
        "a new controller",
        "construct it in make, not outside",
    ):
        return
    others = {id(part) for part in mutable_parts(other).values()}
    shared = {path: part for path, part in mutable_parts(one).items() if id(part) in others}
    before = {path: fingerprint(part) for path, part in shared.items()}
    behind = len(observations) // 2
    one.start(observations[0])
    found = []
    for k, now in enumerate(observations):
        found.append(repr(one.step(now)))
        if k == behind:
            other.start(observations[0])
        if k >= behind:
            other.step(observations[k - behind])
    changed = [path for path, part in shared.items() if fingerprint(part) != before[path]]
    differs = _first_difference(commands, found)
    inspection.require(
        not changed and differs is None,
        "shared state",
        f"{', '.join(f'`{path}`' for path in changed)} is one object in two controllers, and changes"
        if changed
        else f"beside another one it commands {_pair(commands, found, differs)}",
        "controllers that do not disturb one another",
        "make what changes in start, for each instance: no default argument, attribute of the class or global",
    )


def _examine_broken_sensor(
    inspection: Inspection, make: Callable[[], Controller], observations: Sequence[Observation]
) -> None:
    """A finger that gives no numbers from the middle of a run on must not lead to a NaN command."""
    middle = (
        max((k for k, now in enumerate(observations) if now.fingers and now.fingers[0].touching), default=0) // 2
    )
    now = observations[middle]
    if not now.fingers:
        return
    controller = make()
    _fed(controller, observations[:middle] or observations[:1])
    wrench, finger = (math.nan,) * 6, now.fingers[0]
    contact, health = (
        contact_from_wrench(Sphere(RADIUS), wrench),
        SampleHealth(HealthCheck.NON_FINITE, "Fx", math.nan),
    )
    broken = replace(finger, wrench=wrench, contact=contact, touching=False, health=health)
    try:
        command = controller.step(replace(now, fingers=(broken, *now.fingers[1:])))
    except PalpateError:
        return
    _examine_command(inspection, command, now)


def _first_difference(one: Sequence[str], other: Sequence[str]) -> int | None:
    return next((k for k, pair in enumerate(zip(one, other, strict=True)) if pair[0] != pair[1]), None)


def _pair(one: Sequence[str], other: Sequence[str], k: int | None) -> str:
    return "" if k is None else f"{shown(one[k], 90)}, then {shown(other[k], 90)} in period {k}"
