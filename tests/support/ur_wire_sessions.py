"""Sessions of the real clients of a UR controller, each in a process of its own that may be killed.

ur_rtde may wait for minutes, or end its process, where a connection is lost.
"""

import multiprocessing
import os
import time
from collections.abc import Callable
from multiprocessing.connection import Connection
from typing import Any

from support.waiting import until

Session = Callable[..., Any]


def own_address(number: int) -> str:
    """Return a loopback address that no other test process uses: ports of controllers are fixed."""
    process = os.getpid()
    return f"127.{100 + number}.{process >> 8 & 255}.{process & 255 or 1}"


class ClientProcess:
    """Session of a client under way."""

    def __init__(self, session: Session, *arguments: object) -> None:
        """Start it; it is given a connection for results, then the arguments."""
        context = multiprocessing.get_context("spawn")
        self._ours, theirs = context.Pipe()
        self.process = context.Process(target=_run, args=(session, theirs, arguments))
        self.process.start()
        theirs.close()

    def result(self, within: float = 30.0) -> Any:
        """Return the next result of the session; its exceptions are raised here."""
        if not self._ours.poll(within):
            raise TimeoutError(f"the client has sent nothing for {within} s")
        result = self._ours.recv()
        if isinstance(result, Exception):
            raise result
        return result

    def end(self, within: float = 10.0) -> None:
        """Wait for its end, or kill it."""
        self._ours.close()
        self.process.join(within)
        if self.process.is_alive():
            self.process.kill()
            self.process.join(within)
        self.process.close()


def session_result(session: Session, *arguments: object) -> Any:
    """Return the result of a session."""
    client = ClientProcess(session, *arguments)
    try:
        return client.result()
    finally:
        client.end()


def _run(session: Session, pipe: Connection, arguments: tuple[object, ...]) -> None:
    try:
        result = session(pipe, *arguments)
    except Exception as error:
        result = RuntimeError(f"{type(error).__name__}: {error}")
    pipe.send(result)
    # destructors of ur_rtde take half a second each, or crash
    pipe.close()
    os._exit(0)


def tour(pipe: Connection, address: str) -> dict[str, Any]:
    """Use every emulated command, the outputs and the dashboard once."""
    import dashboard_client
    import rtde_control
    import rtde_io
    import rtde_receive

    receive = rtde_receive.RTDEReceiveInterface(address)
    control = rtde_control.RTDEControlInterface(address)
    io = rtde_io.RTDEIOInterface(address)
    dashboard = dashboard_client.DashboardClient(address)
    dashboard.connect()
    pose, joints = receive.getActualTCPPose(), receive.getActualQ()
    there = [pose[0] + 0.02, pose[1], pose[2] - 0.03, *pose[3:]]
    turned = [joints[0] + 0.1, *joints[1:5], joints[5] - 0.1]
    result: dict[str, Any] = {"pose": pose, "there": there, "joints": joints, "turned": turned, "ok": []}
    accept = result["ok"].append

    def accept_and_keep(name: str, accepted: bool, read: Callable[[], Any] = receive.getActualTCPPose) -> None:
        accept(accepted)
        result[name] = read()

    accept_and_keep("moveL", control.moveL(there, 0.25, 1.2))
    accept_and_keep("moveJ", control.moveJ(turned, 1.05, 1.4), receive.getActualQ)
    accept_and_keep("moveL_FK", control.moveL_FK(joints, 0.25, 1.2))
    accept_and_keep("moveJ_IK", control.moveJ_IK(there, 1.05, 1.4))
    accept_and_keep("path", control.moveL([[*pose, 0.25, 1.2, 0.0], [*there, 0.25, 1.2, 0.0]]))
    accept(control.moveL(pose, 0.02, 1.2, True))
    time.sleep(0.1)
    result["running"] = control.getAsyncOperationProgressEx().isAsyncOperationRunning()
    control.stopL(10.0)
    time.sleep(0.05)
    result["after stop"] = control.getAsyncOperationProgressEx().isAsyncOperationRunning()
    result["stopped"] = receive.getActualTCPPose()
    accept(control.moveJ(joints, 1.05, 1.4))
    goal = [joints[0] + 0.01, *joints[1:]]
    for _ in range(100):
        accept(control.servoJ(goal, 0.1, 0.1, 0.002, 0.03, 300))
        time.sleep(0.003)
    until(lambda: abs(receive.getActualQ()[0] - goal[0]) < 1e-4)
    accept(control.servoStop(10.0))
    accept(control.speedJ([0.1, 0.0, 0.0, 0.0, 0.0, 0.0], 1.0, 0.0))
    until(lambda: abs(receive.getActualQd()[0] - 0.1) < 2e-3)
    accept(control.speedStop(10.0))
    accept(control.jogStart([0.0, 0.0, 0.01, 0.0, 0.0, 0.0], rtde_control.RTDEControlInterface.FEATURE_TOOL))
    until(lambda: abs(receive.getActualTCPSpeed()[2] + 0.01) < 1e-4)
    accept(control.jogStop())
    until(control.isSteady)
    accept(control.startContactDetection())
    result["contact"] = control.readContactDetection(), control.stopContactDetection()
    accept(control.forceMode([0.0] * 6, [0, 0, 1, 0, 0, 0], [0.0, 0.0, -8.0, 0.0, 0.0, 0.0], 2, [0.1] * 6))
    until(lambda: abs(receive.getActualTCPForce()[2] - 8.0) < 0.05)
    result["pressed"] = receive.getActualTCPPose()
    accept(control.forceModeStop())
    accept(control.moveL(pose, 0.25, 1.2))
    accept(control.moveUntilContact([0.0, 0.0, -0.02, 0.0, 0.0, 0.0]))
    result["touched"] = receive.getActualTCPForce()
    accept(control.moveL(pose, 0.25, 1.2))
    accept(control.setTcp([0.0, 0.0, 0.1, 0.0, 0.0, 0.0]))
    time.sleep(0.02)
    result["tcp"], result["moved tcp"] = control.getTCPOffset(), receive.getActualTCPPose()
    accept(control.setTcp([0.0] * 6))
    accept(control.setPayload(1.2, [0.0, 0.0, 0.05]))
    time.sleep(0.02)
    result["payload"], result["weight"] = receive.getPayload(), receive.getActualTCPForce()
    accept(control.zeroFtSensor())
    time.sleep(0.02)
    result["force"] = receive.getActualTCPForce()
    control.getActualJointPositionsHistory(5)
    time.sleep(0.2)  # real-time getters return what the registers held before
    result["history"] = receive.getActualQ(), control.getActualJointPositionsHistory(5)
    io.setStandardDigitalOut(3, True)
    io.setConfigurableDigitalOut(2, True)
    io.setToolDigitalOut(1, True)
    io.setSpeedSlider(0.5)
    io.setAnalogOutputVoltage(0, 0.5)
    time.sleep(0.05)
    result["digital"], result["analog"] = receive.getActualDigitalOutputBits(), receive.getStandardAnalogOutput0()
    result["fraction"] = receive.getTargetSpeedFraction()
    result["custom"] = control.sendCustomScriptFunction("hello", 'textmsg("x")\nsleep(0.1)\n')
    result["again"] = control.isSteady()
    result["dashboard"] = [
        dashboard.polyscopeVersion(),
        dashboard.robotmode(),
        dashboard.safetymode(),
        dashboard.running(),
        dashboard.isInRemoteControl(),
        dashboard.isProgramSaved(),
        dashboard.getSerialNumber(),
    ]
    # settings outlive a program
    control.setPayload(0.0, [0.0, 0.0, 0.0])
    control.zeroFtSensor()
    io.setSpeedSlider(1.0)
    dashboard.loadURP("/programs/x.urp")
    control.stopScript()
    dashboard.play()
    dashboard.pause()
    dashboard.stop()
    return result


def connect(pipe: Connection, address: str) -> str:
    """Connect the control interface."""
    import rtde_control

    return "connected" if rtde_control.RTDEControlInterface(address).isConnected() else "not connected"
