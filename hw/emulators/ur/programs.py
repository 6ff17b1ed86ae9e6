"""From an uploaded program to what runs."""

from palpate.hw.emulators.ur.control_script import control_script
from palpate.hw.emulators.ur.registers import Registers
from palpate.hw.emulators.ur.robot import EmulatedController, Program
from palpate.hw.emulators.ur.script import Script
from palpate.hw.emulators.ur.script_text import ProgramKind, UploadedProgram


def program_of(uploaded: UploadedProgram, robot: EmulatedController) -> Program:
    """Return what an uploaded program does, one `yield` per cycle."""
    if uploaded.kind is ProgramKind.CONTROL:
        registers = Registers(robot.inputs, robot.outputs, uploaded.int_offset, uploaded.double_offset)
        return control_script(Script(robot, registers, uploaded.path))
    return _statements(uploaded, robot)


def _statements(uploaded: UploadedProgram, robot: EmulatedController) -> Program:
    """Write registers and sleep; a cycle for each line."""
    for statement in uploaded.statements:
        if statement.register:
            value = statement.value
            whole = "_int_" in statement.register
            robot.outputs[statement.register] = (max(-(2**31), min(2**31 - 1, round(value))) if whole else value,)
            yield
        else:
            begun = robot.time
            while robot.time - begun < statement.value:
                yield


def loaded_program() -> Program:
    """Return a program that does nothing until it is stopped: what was loaded from the controller's disk."""
    while True:
        yield
