"""Prints the fault table with what is measured now, as Markdown: `python tests/faults/render_fault_table.py`."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from faults.fault_checks import periods_until_safe
from faults.fault_rig import carry_out
from faults.fault_table import ANYWHERE, ON_A_SENSOR, WITH_A_HAND, Fault
from faults.stage_rig import AT, away, plain_finger, sensor_finger, stage_rig

from faults.test_faults_while_holding import AT as HELD_AT
from faults.test_faults_while_holding import GRIP, holding_rig

HEAD = """| fault | noticed after | the trip says | what is done | safe after | what is held falls |
|---|---|---|---|---|---|"""


def stage_line(fault: Fault, finger) -> tuple[str, int, int]:
    rig = stage_rig(finger)
    fault.injection.into(rig, AT)
    outcome = carry_out(rig)
    safe = periods_until_safe(outcome, fault, AT, lambda index: away(rig, index))
    return outcome_text(outcome), outcome.tripped_at(AT) - AT, safe


def held_line(fault: Fault) -> tuple[str, int, int, float]:
    rig = holding_rig()
    fault.injection.into(rig, HELD_AT)
    outcome = carry_out(rig)
    safe = periods_until_safe(outcome, fault, HELD_AT, lambda index: (0.0, 0.0, 0.0), (GRIP, GRIP))
    rig.backend.sound.coast(1.0)
    return outcome_text(outcome), outcome.tripped_at(HELD_AT) - HELD_AT, safe, 1e3 * rig.backend.sound.fallen


def outcome_text(outcome) -> str:
    trip = outcome.result.trip
    return outcome.result.ending.value if trip is None else f"{trip.measure} was {trip.value}; limit {trip.limit}"


def line(fault: Fault, words: str, noticed: int, safe: int, fallen: str) -> str:
    return f"| {fault.name} | {noticed} | {words} | {fault.reaction.value} | {safe} | {fallen} |"


def main() -> None:
    lines = [HEAD]
    for fault in ANYWHERE:
        *found, fallen = held_line(fault)
        lines.append(line(fault, *stage_line(fault, plain_finger()), f"{fallen:.3f} mm"))
    lines += [line(fault, *stage_line(fault, sensor_finger()), "") for fault in ON_A_SENSOR]
    for fault in WITH_A_HAND:
        *found, fallen = held_line(fault)
        lines.append(line(fault, *found, f"{fallen:.3f} mm"))
    sys.stdout.write("\n".join(lines) + "\n\nPeriods of 1 ms, counted from the sample that shows the fault.\n")


if __name__ == "__main__":
    main()
