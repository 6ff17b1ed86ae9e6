"""The control script of ur_rtde 1.6.5 as a state machine: one command after the other, from the registers.

Its URScript is not interpreted; what each command id means is the library's own convention.
"""

from collections.abc import Callable, Mapping

from palpate.hw.emulators.ur import contact_commands as contact
from palpate.hw.emulators.ur import motion_commands as motion
from palpate.hw.emulators.ur import query_commands as query
from palpate.hw.emulators.ur.registers import DONE, READY
from palpate.hw.emulators.ur.robot import Program
from palpate.hw.emulators.ur.script import Script

STOP = 255
"""The command that ends the script."""

REAL_TIME: Mapping[int, Callable[[Script], None]] = {
    6: motion.force_mode,
    9: motion.speed_joints,
    10: motion.speed_tool,
    11: motion.servo_joints,
    24: motion.servo_tool,
    25: contact.touching,
    26: query.step_time,
    27: query.joint_history,
    38: query.joint_torques,
    58: query.flange_pose,
    66: query.not_emulated,  # directTorque
    67: query.not_emulated,  # mass matrix
    68: query.not_emulated,  # Coriolis and centrifugal torques
    69: query.not_emulated,  # target joint accelerations
    70: query.jacobian,
    71: query.not_emulated,  # its derivative
}
"""Commands that are done again in every cycle in which the register holds them."""

BLOCKING: Mapping[int, Callable[[Script], Program]] = {
    1: motion.move_joints,
    2: motion.move_joints_to_pose,
    3: motion.move_tool,
    4: motion.move_tool_to_joints,
    7: motion.force_mode_stop,
    8: query.zero_sensor,
    15: motion.stop_motion,
    16: motion.stop_motion,
    17: query.set_payload,
    18: contact.teach_mode,
    19: contact.freedrive_off,
    20: query.accepted,  # damping of force mode
    21: query.gain_scaling,
    28: query.target_waypoint,
    29: query.set_tcp,
    30: query.inverse_near,
    31: query.trigger_protective_stop,
    33: motion.stop_move,
    34: motion.stop_move,
    35: query.set_watchdog,
    36: query.has_inverse,
    37: query.joints_allowed,
    39: query.combined,
    40: query.tcp_offset,
    41: contact.jog,
    42: contact.jog_stop,
    43: query.forward,
    44: query.forward_of,
    45: motion.move_path,
    46: query.inverse,
    47: query.steady,
    51: contact.move_until_contact,
    52: contact.freedrive,
    53: contact.freedrive_off,
    54: contact.freedrive_status,
    55: query.accepted,  # external force/torque
    56: query.accepted,  # force/torque by RTDE
    57: query.accepted,  # external sensor
    59: query.set_gravity,
    60: query.has_inverse,
    61: query.has_inverse_near,
    62: contact.contact_detection,
    63: contact.contact_detection_off,
    64: contact.contact_detected,
    65: query.set_target_payload,
}
"""Commands that are done once, and are over when they say so."""


def control_script(script: Script) -> Program:
    """Run until asked to stop."""
    registers = script.registers
    registers.finish_operation()
    done = False
    while True:
        script.go_on()
        command = registers.command
        if command == STOP:
            return
        if command == 0:
            registers.state(READY)
            done = False
        elif command in REAL_TIME:
            REAL_TIME[command](script)
            registers.state(READY)
        elif not done:
            # an unknown id does nothing and is done, as in the script's chain of conditions
            for _ in BLOCKING.get(command, query.accepted)(script):
                script.go_on()
                yield
            registers.state(DONE)
            done = True
        yield
