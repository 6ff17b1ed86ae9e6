"""What a UR controller reports of itself: fit to run or not, what to do, and what a doctor wants to know."""

import math
from collections.abc import Iterator, Mapping

from palpate.hw.condition import DeviceCondition
from palpate.hw.finding import DeviceFinding, DeviceUse, FindingVerdict, judged
from palpate.hw.ur.exchange import UrState
from palpate.hw.ur.problems import PLAYING, RUNNING, WORDS, Problem, safety_problem
from palpate.hw.ur.version import OLDEST, Version, cycle_rate
from palpate.runtime.standstill_check import REST_SPEED

ACTIONS: Mapping[Problem, str] = {
    Problem.PROTECTIVE_STOP: "unlock its protective stop and load the control program; the arm may give a little",
    Problem.NOT_POWERED: "power it and release its brakes; the arm may sag by millimetres",
}
"""What can be undone from here."""

SLOW_SHARE = 0.9
"""Of its cycles: fewer states, and some are missing, not clocks apart."""

MOST_LOST = 1.0
"""[%] Of the states."""


def ur_condition(name: str, state: UrState) -> DeviceCondition:
    """Return whether an arm in this state is fit to run."""
    speed = math.hypot(*state.tool_velocity[:3])
    stands = f"it moves at {1e3 * speed:.3g} mm/s" if speed >= REST_SPEED else "it stands still"
    power = "powered, brakes released" if state.robot_mode == RUNNING else f"robot mode {state.robot_mode}"
    problem = safety_problem(state.robot_mode, state.safety_bits)
    if problem is Problem.NONE:
        fit = speed < REST_SPEED
        remedy = "" if fit else "another program or somebody's hand moves it: end that first"
        return DeviceCondition(name, f"{stands}, {power}, no safety stop", fit, remedy=remedy)
    words, remedy = WORDS[problem]
    action = ACTIONS.get(problem, "")
    return DeviceCondition(name, f"{stands}, {power}; {words}", False, action, "" if action else remedy)


def ur_findings(name: str, version: Version, last: UrState, use: DeviceUse) -> Iterator[DeviceFinding]:
    """Yield the findings on a controller that has been watched."""
    oldest, cycles = OLDEST.get(version[0]), cycle_rate(version)
    wanted = "" if oldest is None else f"{oldest[0]}.{oldest[1]} or newer"
    yield DeviceFinding(name, "PolyScope", ".".join(map(str, version)), "", wanted)
    network = "check cable and switch: a connection of its own between this computer and the controller"
    yield judged(name, "rate", use.rate, "Hz", f"{cycles:g}", use.rate >= SLOW_SHARE * cycles, network)
    share, note = 100.0 * last.lost / max(1, last.lost + use.exchanges), FindingVerdict.NOTE
    yield judged(name, "states lost", share, "%", f"at most {MOST_LOST:g}", share <= MOST_LOST, network, note)
    slow = use.period * cycles > 1.0 - 1e-6
    wanted, fix = f"at least {1e3 / cycles:g}, its cycle", f"write period_s: {1.0 / cycles:g}"
    yield judged(name, "control period", 1e3 * use.period, "ms", wanted, slow, fix, note)
    problem = safety_problem(last.robot_mode, last.safety_bits)
    yield judged(name, "safety", problem.name.lower(), "", "none", not problem, "see the pendant")
    powered, wanted = last.robot_mode == RUNNING, "on, brakes released"
    power = wanted if powered else f"mode {last.robot_mode}"
    yield judged(name, "power", power, "", wanted, powered, "power it on the pendant")
    plays = last.runtime_state == PLAYING
    program, fix = "plays" if plays else f"state {last.runtime_state}", "switch the pendant to remote control"
    yield judged(name, "program", program, "", "plays", plays, fix)
    full = last.speed_scaling > 0.99
    fix = "move the speed slider to 100 %, or backend.arm.speed_slider: 1.0: all velocities are scaled by it"
    yield judged(name, "speed scaling", 100.0 * last.speed_scaling, "%", "100", full, fix, note)
