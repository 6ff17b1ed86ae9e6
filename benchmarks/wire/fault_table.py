"""Every fault that is tried on a robot on the wire, one row each: benchmark and tests use the same ones.

Rows "no. k" are the faults of ur_rtde 1.6.5 that a back end must work around, in the order of docs and tests.
"""

from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum

from palpate.spatial import ZERO
from wire.avoided import (
    a_second_client_is_refused,
    a_silent_loop_stops_the_arm,
    commands_are_not_overwritten,
    never_sent,
    nothing_is_printed,
    outputs_untouched,
    pace_is_kept,
    recovery_does_not_hang,
    short_states_tell_the_truth,
    states_are_of_one_cycle,
    threads_run_on,
    upper_registers_unused,
)
from wire.cell import ARM, BOTA, BOX, HAND, Cell, Tip
from wire.procedures import (
    Avoided,
    Borne,
    Lost,
    NotStarted,
    PowerLost,
    Procedure,
    Refused,
    Switch,
    crash_client,
    hang_client,
    kill_client,
    nothing,
    read_on,
    reboot_servo,
    recover_arm,
    start_hand,
    the_other_servo_presses,
)

NOTICED = 0.05
"""[s] asked for, unless a row says why it takes longer."""


class Safe(StrEnum):
    """What the robot does once a fault is noticed, as the emulator measures it."""

    RESTS = "arm rests, hand presses"
    PARTLY = "arm rests, the other finger presses"
    OFF = "all is off"
    STANDS = "arm has not moved, hand presses"
    GOES_ON = "goes on"


@dataclass(frozen=True, slots=True)
class Case:
    """One row.

    Attributes:
        name: Of the row.
        procedure: What is done; its class says what is looked at.
        safe: State that the robot must come to.
        says: Of the message, a regular expression with the remedy in it; the device is looked for besides. Empty:
            nothing to say.
        back: What brings it back.
        within: Time to notice it [s].
        why: What makes that longer than `NOTICED`.
        tip: Which sensor the robot has.
    """

    name: str
    procedure: Procedure
    safe: Safe
    says: str
    back: str
    within: float = NOTICED
    why: str = ""
    tip: Tip = Tip.BOX


RECOVER = "arm.recover()"

LOST = r"(connection .* was lost|no state any more|ended by signal \d+|hangs).*`palpate recover`"
"""Whichever comes first: ur_rtde may crash over a dropped connection before anybody sees that it is dropped."""

STAY_AWAY = r"(no state any more|hangs).*`palpate recover`"
"""A client process that is given no time looks like one that hangs."""
ITSELF = "nothing needed"


def _short_velocity(cell: Cell) -> None:
    cell.arm.move((0.01, 0.0), ZERO)  # type: ignore[arg-type]


def _not_finite(cell: Cell) -> None:
    cell.arm.move((float("nan"), 0.0, 0.0), ZERO)


def _too_fast(cell: Cell) -> None:
    cell.arm.move((1.0, 0.0, 0.0), ZERO)


def _missed(cell: Cell) -> int:
    return cell.servos.missed


def _harmed(cell: Cell) -> int:
    """Answers that did not go out as they should have: noise before one costs the hand nothing."""
    devices = cell.emulator.control.state()["devices"]
    return int(devices[HAND]["harmed"])  # type: ignore[index,call-overload]


def _lost(cell: Cell) -> int:
    return cell.sensor.counts.lost


def _older(cell: Cell) -> int:
    return cell.sensor.counts.older


def _refused(cell: Cell) -> int:
    return cell.sensor.counts.refused


def _restarts(cell: Cell) -> int:
    return cell.sensor.counts.restarts


def _in_start(name: str, fault: str, says: str, within: float, why: str) -> Case:
    procedure = NotStarted(Switch(ARM, fault), Switch(ARM, fault, 0.0))
    return Case(name, procedure, Safe.STANDS, says, "arm.start()", within, why)


def _avoided(name: str, look: Avoided) -> Case:
    return Case(name, look, Safe.GOES_ON, "", ITSELF)


OWN_TIME = "ur_rtde waits so long"

ARM_CASES = (
    Case(
        "no. 1: RTDE closed (FIN)",
        Lost(Switch(ARM, "drop_fin"), recover_arm, client_ends=True),
        Safe.RESTS,
        LOST,
        RECOVER,
    ),
    Case(
        "RTDE reset (RST)",
        Lost(Switch(ARM, "drop_rst"), recover_arm, client_ends=True),
        Safe.RESTS,
        LOST,
        RECOVER,
    ),
    Case(
        "no. 2: states stay away",
        Lost(Switch(ARM, "stall_stream"), recover_arm, Switch(ARM, "stall_stream", 0.0)),
        Safe.RESTS,
        STAY_AWAY,
        RECOVER,
    ),
    Case(
        "states stay away until the client ends",
        Lost(Switch(ARM, "stall_stream"), recover_arm, Switch(ARM, "stall_stream", 0.0), client_ends=True),
        Safe.RESTS,
        STAY_AWAY,
        RECOVER,
    ),
    _avoided("states a byte too short", Avoided(short_states_tell_the_truth)),
    _avoided("no. 3: recovering while connected", Avoided(recovery_does_not_hang)),
    _avoided("no. 4: getters with old registers", Avoided(never_sent(25, 26, 27, 38, 58))),
    Case(
        "no. 5: velocity of two numbers",
        Refused(_short_velocity),
        Safe.GOES_ON,
        "velocity_base_tip",
        ITSELF,
    ),
    Case("velocity not a number", Refused(_not_finite), Safe.GOES_ON, "velocity_base_tip", ITSELF),
    Case("velocity above the limit", Refused(_too_fast), Safe.GOES_ON, "UrSettings.speed", ITSELF),
    _avoided("no. 6: kinematics with an old tool", Avoided(never_sent(30, 43, 44, 46, 60, 61))),
    _avoided("no. 7: external wrench of a wrong length", Avoided(never_sent(55, 56, 57))),
    _avoided("no. 8: upper registers", Avoided(upper_registers_unused)),
    _avoided("no. 9: analog outputs", Avoided(outputs_untouched)),
    _avoided("no. 10: stopL and stopJ mixed up", Avoided(never_sent(33, 34))),
    _avoided("no. 11: states of two cycles", Avoided(states_are_of_one_cycle)),
    _avoided("no. 12: a second client", Avoided(a_second_client_is_refused)),
    _avoided("no. 13: other threads stopped", Avoided(threads_run_on)),
    _avoided("no. 14: periods of whole milliseconds", Avoided(pace_is_kept)),
    _avoided("no. 15: prints", Avoided(nothing_is_printed)),
    _in_start("no. 16: start refused", "reject_start", "refused to send", 4.0, OWN_TIME + ", 2.5 s"),
    _avoided("no. 17: servoC", Avoided(never_sent(12))),
    _avoided("no. 18: commands overwritten", Avoided(commands_are_not_overwritten)),
    _in_start("RTDE version refused", "refuse_version", "RTDE version 2; update PolyScope", 0.5, "a connection"),
    _in_start("dashboard without greeting", "withhold_greeting", "does not greet", 4.0, "a greeting has 2 s"),
    _in_start("local control", "local_control", "Remote Control", 4.0, "a new process, 1 s"),
    Case(
        "script starts late, 1.5 s",
        Lost(kill_client, recover_arm, Switch(ARM, "late_start", 1.5)),
        Safe.RESTS,
        r"signal 9.*`palpate recover`",
        RECOVER,
    ),
    Case(
        "protective stop",
        Lost(Switch(ARM, "protective_stop"), recover_arm),
        Safe.RESTS,
        r"protective stop; clear whatever it ran into, then `palpate recover`",
        RECOVER,
    ),
    Case(
        "emergency stop",
        Lost(Switch(ARM, "e_stop"), recover_arm, Switch(ARM, "e_stop", 0.0)),
        Safe.RESTS,
        r"emergency stop is pressed; make the cell safe, release it, then `palpate recover`",
        "released, arm.recover()",
    ),
    Case(
        "program stopped at the pendant",
        Lost(Switch(ARM, "kill_program"), recover_arm),
        Safe.RESTS,
        r"program was stopped.*pendant's log, then `palpate recover`",
        RECOVER,
    ),
    Case(
        "client process killed",
        Lost(kill_client, recover_arm),
        Safe.RESTS,
        r"ended by signal 9; the controller's watchdog.*`palpate recover`",
        RECOVER,
        0.02,
    ),
    Case(
        "client process crashes",
        Lost(crash_client, recover_arm),
        Safe.RESTS,
        r"ended by signal 11; the controller's watchdog.*`palpate recover`",
        RECOVER,
    ),
    Case(
        "client process hangs",
        Lost(hang_client, recover_arm),
        Safe.RESTS,
        STAY_AWAY,
        RECOVER,
    ),
    _avoided("our own loop stands still", Avoided(a_silent_loop_stops_the_arm)),
    Case("everything loses its power", PowerLost(), Safe.OFF, r"\S; \S", "on again: recover(), start()"),
)

START = "hand.start()"


def _bus(name: str, fault: str, value: float, says: str, off: float = 0.0) -> Case:
    procedure = Lost(Switch(HAND, fault, value), start_hand, Switch(HAND, fault, off))
    return Case(name, procedure, Safe.RESTS, says, START)


def _bus_share(name: str, fault: str, share: float, count: Callable[[Cell], int]) -> Case:
    procedure = Borne(Switch(HAND, fault, share), count, Switch(HAND, fault, 0.0))
    return Case(name, procedure, Safe.GOES_ON, "", ITSELF, 0.4, "a share of exchanges: until the first is hit")


DAMAGED = r"servo [12] (sends damaged replies|does not reply).*check (the bus|its cable)"

HAND_CASES = (
    _bus("a servo is silent", "silent", 2, "servo 2 does not reply .* check its cable and its power", -1),
    _bus("the wire back is broken", "mute", 1, "servo 1 does not reply"),
    _bus("every checksum wrong", "wrong_checksum", 1.0, DAMAGED),
    _bus("every answer lacks a byte", "lost_bytes", 1.0, DAMAGED),
    _bus("answers 20 ms late", "late", 0.02, DAMAGED),
    _bus_share("a third of answers behind noise", "noise", 0.3, _harmed),
    _bus_share("a tenth of checksums wrong", "wrong_checksum", 0.1, _missed),
    Case(
        "a servo shuts down (overload)",
        Lost(Switch(HAND, "overload", 2), reboot_servo, presses=the_other_servo_presses),
        Safe.PARTLY,
        r"servo 2 reports overload; .*`palpate recover`",
        "hand.reboot(2), start()",
    ),
    Case(
        "a servo loses its power for a moment",
        Lost(Switch(HAND, "brown_out", 2), start_hand, presses=the_other_servo_presses),
        Safe.PARTLY,
        r"servo 2 .*(lost its power|does not reply|watchdog).*`palpate (recover|doctor)`",
        START,
    ),
    Case(
        "adapter unplugged",
        Lost(Switch(HAND, "unplugged"), start_hand, Switch(HAND, "unplugged", 0.0)),
        Safe.RESTS,
        r"the port was lost.*plug the adapter in, then `palpate recover`",
        "plugged in, hand.start()",
    ),
)

READ = "the next read()"


def _sensor(name: str, device: str, fault: str, says: str, tip: Tip) -> Case:
    return Case(
        name,
        Lost(Switch(device, fault), read_on, Switch(device, fault, 0.0)),
        Safe.RESTS,
        says,
        READ,
        tip=tip,
    )


SILENT = "silent for .*; check"

SENSOR_CASES = (
    _sensor("F/T box silent", BOX, "silent", SILENT, Tip.BOX),
    _sensor("F/T out of range", BOX, "out_of_range", "saturated|range", Tip.BOX),
    Case("F/T box restarted", Lost(Switch(BOX, "rebooted"), read_on), Safe.RESTS, SILENT, READ),
    _sensor("Bota silent", BOTA, "silent", SILENT, Tip.BOTA),
    _sensor("Bota out of range", BOTA, "out_of_range", "range", Tip.BOTA),
    Case(
        "Bota restarted",
        Lost(Switch(BOTA, "rebooted"), read_on),
        Safe.RESTS,
        SILENT,
        READ,
        tip=Tip.BOTA,
    ),
    _sensor("Bota unplugged", BOTA, "unplugged", "silent for .*check", Tip.BOTA),
)


def _borne(name: str, device: str, fault: str, value: float, count: str, tip: Tip = Tip.BOX) -> Case:
    counts = {"lost": _lost, "older": _older, "refused": _refused, "restarts": _restarts}
    mend = Switch(device, fault, 0.0) if fault not in ("gap", "restarted") else nothing
    return Case(name, Borne(Switch(device, fault, value), counts[count], mend), Safe.GOES_ON, "", ITSELF, tip=tip)


RECORD_CASES = (
    _borne("gap of 5 records", BOX, "gap", 5, "lost"),
    _borne("every 3rd record lost", BOX, "dropped", 3, "lost"),
    _borne("records swapped", BOX, "reordered", 3, "older"),
    _borne("records twice", BOX, "repeated", 3, "older"),
    _borne("records of wrong lengths", BOX, "wrong_length", 3, "refused"),
    _borne("counters begin anew", BOX, "restarted", 1, "restarts"),
    _borne("Bota frames damaged", BOTA, "damaged", 4, "lost", Tip.BOTA),
    _borne("Bota frames lack a byte", BOTA, "lost_byte", 4, "lost", Tip.BOTA),
    _borne("noise between Bota frames", BOTA, "noise", 4, "refused", Tip.BOTA),
)

CASES = (*ARM_CASES, *HAND_CASES, *SENSOR_CASES, *RECORD_CASES)
