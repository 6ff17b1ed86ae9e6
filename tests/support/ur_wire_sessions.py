"""What the real clients of a UR controller do in the tests, each in a process of its own that may be killed.

In a process of its own because ur_rtde may wait for minutes, or end it, where a connection is lost.
"""

import multiprocessing
import os
import time
from collections.abc import Callable
from multiprocessing.connection import Connection
from typing import Any

from support.waiting import until

Numbers = list[float]
Session = Callable[..., Any]


def own_address(number: int) -> str:
    """Return a loopback address that no other test process uses: ports of controllers are fixed."""
    process = os.getpid()
    return f"127.{100 + number}.{process >> 8 & 255}.{process & 255 or 1}"


class ClientProcess:
    """A session of a client under way."""

    def __init__(self, session: Session, *arguments: object) -> None:
        """Start it; it is handed a connection to tell things, then the arguments."""
        context = multiprocessing.get_context("spawn")
        self._ours, theirs = context.Pipe()
        self.process = context.Process(target=_run, args=(session, theirs, arguments))
        self.process.start()
        theirs.close()

    def hear(self, within: float = 30.0) -> Any:
        """Return what the session tells next; its exceptions are raised here."""
        if not self._ours.poll(within):
            raise TimeoutError(f"the client has sent nothing for {within} s")
        result = self._ours.recv()
        if isinstance(result, Exception):
            raise result
        return result

    def go_on(self) -> None:
        """Tell the session to go on."""
        self._ours.send("go on")

    def end(self, within: float = 10.0) -> None:
        """Wait for its end, or kill it."""
        self._ours.close()
        self.process.join(within)
        if self.process.is_alive():
            self.process.kill()
            self.process.join(within)
        self.process.close()


def session_result(session: Session, *arguments: object, within: float = 30.0) -> Any:
    """Return what a session returns."""
    client = ClientProcess(session, *arguments)
    try:
        return client.hear(within)
    finally:
        client.end()


def _run(session: Session, pipe: Connection, arguments: tuple[object, ...]) -> None:
    try:
        result = session(pipe, *arguments)
    except Exception as error:
        result = RuntimeError(f"{type(error).__name__}: {error}")
    pipe.send(result)
    # destructors of ur_rtde take half a second each, or crash: nothing is left to lose
    pipe.close()
    os._exit(0)


def _later(ask: Callable[[], Any]) -> Any:
    """Ask twice, many cycles apart: real-time getters give what the registers held before."""
    ask()
    time.sleep(0.2)
    return ask()


def moves(pipe: Connection, address: str) -> dict[str, Any]:
    """Try all kinds of moves."""
    import rtde_control
    import rtde_receive

    receive = rtde_receive.RTDEReceiveInterface(address)
    control = rtde_control.RTDEControlInterface(address)
    pose, joints = receive.getActualTCPPose(), receive.getActualQ()
    there = [pose[0] + 0.02, pose[1], pose[2] - 0.03, *pose[3:]]
    turned = [joints[0] + 0.1, *joints[1:5], joints[5] - 0.1]
    result: dict[str, Any] = {"pose": pose, "there": there, "joints": joints, "turned": turned, "ok": []}
    result["ok"].append(control.moveL(there, 0.25, 1.2))
    result["moveL"] = receive.getActualTCPPose()
    result["ok"].append(control.moveJ(turned, 1.05, 1.4))
    result["moveJ"] = receive.getActualQ()
    result["ok"].append(control.moveL_FK(joints, 0.25, 1.2))
    result["moveL_FK"] = receive.getActualTCPPose()
    result["ok"].append(control.moveJ_IK(there, 1.05, 1.4))
    result["moveJ_IK"] = receive.getActualTCPPose()
    result["ok"].append(control.moveL([[*pose, 0.25, 1.2, 0.0], [*there, 0.25, 1.2, 0.0]]))
    result["path"] = receive.getActualTCPPose()
    result["ok"].append(control.moveL(pose, 0.02, 1.2, True))
    time.sleep(0.1)
    result["running"] = control.getAsyncOperationProgressEx().isAsyncOperationRunning()
    control.stopL(10.0)
    time.sleep(0.05)
    result["after stop"] = control.getAsyncOperationProgressEx().isAsyncOperationRunning()
    result["stopped"] = receive.getActualTCPPose()
    for i in range(100):
        height = pose[2] + 0.0001 * i
        result["ok"].append(control.servoL([*pose[:2], height, *pose[3:]], 0.1, 0.1, 0.002, 0.03, 300))
        time.sleep(0.003)
    time.sleep(0.3)
    result["servoL"] = receive.getActualTCPPose()
    result["ok"].append(control.servoStop(10.0))
    result["ok"].append(control.speedJ([0.1, 0.0, 0.0, 0.0, 0.0, 0.0], 1.0, 0.0))
    time.sleep(0.3)
    result["speedJ"] = receive.getActualQd()
    result["ok"].append(control.speedStop(10.0))
    control.stopScript()
    return result


def questions(pipe: Connection, address: str) -> dict[str, Any]:
    """Ask and set what does not move the arm."""
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
    result: dict[str, Any] = {"pose": pose, "joints": joints}
    result["inverse"] = control.getInverseKinematics(pose)
    result["inverse near"] = control.getInverseKinematics(pose, joints)
    result["has"] = control.getInverseKinematicsHasSolution(pose)
    result["has not"] = control.getInverseKinematicsHasSolution([3.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    result["safe"] = control.isPoseWithinSafetyLimits(pose), control.isJointsWithinSafetyLimits(joints)
    result["unsafe"] = control.isJointsWithinSafetyLimits([7.0] * 6)
    result["forward"] = control.getForwardKinematics(joints, [0.0, 0.0, 0.1, 0.0, 0.0, 0.0])
    result["trans"] = control.poseTrans(pose, [0.0, 0.0, 0.1, 0.0, 0.0, 0.0])
    result["step"] = _later(control.getStepTime)
    result["flange"] = _later(control.getActualToolFlangePose)
    result["history"] = _later(lambda: control.getActualJointPositionsHistory(5))
    result["steady"] = control.isSteady()
    result["tcp set"] = control.setTcp([0.0, 0.0, 0.1, 0.0, 0.0, 0.0])
    time.sleep(0.02)
    result["tcp"], result["moved tcp"] = control.getTCPOffset(), receive.getActualTCPPose()
    result["payload set"] = control.setPayload(1.2, [0.0, 0.0, 0.05])
    time.sleep(0.02)
    result["payload"], result["weight"] = receive.getPayload(), receive.getActualTCPForce()
    result["zeroed"] = control.zeroFtSensor()
    time.sleep(0.02)
    result["force"] = receive.getActualTCPForce()
    result["freedrive"] = control.freedriveMode(), control.getFreedriveStatus()
    result["driven"] = control.endFreedriveMode(), control.getFreedriveStatus()
    result["teach"] = control.teachMode(), control.endTeachMode()
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
    # what outlives a program
    control.setTcp([0.0] * 6)
    control.setPayload(0.0, [0.0, 0.0, 0.0])
    control.zeroFtSensor()
    io.setSpeedSlider(1.0)
    dashboard.loadURP("/programs/x.urp")
    control.stopScript()
    dashboard.play()
    dashboard.pause()
    dashboard.stop()
    return result


def stream_speed(pipe: Connection, address: str, frequency: float, speed: float) -> None:
    """Set the watchdog, move downwards for ever; say so after a while."""
    import rtde_control

    control = rtde_control.RTDEControlInterface(address)
    if frequency > 0.0 and not control.setWatchdog(frequency):
        raise RuntimeError("no watchdog")
    for i in range(7500):
        control.speedL([0.0, 0.0, -speed, 0.0, 0.0, 0.0], 1.0, 0.0)
        time.sleep(0.004)
        if i == 75:
            pipe.send("moving")


def press(pipe: Connection, address: str, force: float) -> dict[str, Any]:
    """Press downwards in force mode."""
    import rtde_control
    import rtde_receive

    receive = rtde_receive.RTDEReceiveInterface(address)
    control = rtde_control.RTDEControlInterface(address)
    control.forceMode([0.0] * 6, [0, 0, 1, 0, 0, 0], [0.0, 0.0, -force, 0.0, 0.0, 0.0], 2, [0.1] * 6)
    time.sleep(2.0)
    result = {"force": receive.getActualTCPForce(), "pose": receive.getActualTCPPose()}
    result["left"] = control.forceModeStop()
    return result


def connect(pipe: Connection, address: str, rate: float) -> dict[str, Any]:
    """Connect and do next to nothing."""
    import rtde_control
    import rtde_receive

    receive = rtde_receive.RTDEReceiveInterface(address, rate)
    alive = receive.isConnected()
    control = rtde_control.RTDEControlInterface(address, rate)
    begun = time.monotonic()
    seen = {receive.getTimestamp()}
    while time.monotonic() < begun + 0.5:
        seen.add(receive.getTimestamp())
        time.sleep(0.0005)
    return {
        "alive": alive,
        "steady": control.isSteady(),
        "states": len(seen),
        "pose": receive.getActualTCPPose(),
    }


def hold(pipe: Connection, address: str) -> str:
    """Connect, say so, and keep the control interface until asked to go on; then report whether it still works."""
    import rtde_control

    control = rtde_control.RTDEControlInterface(address)
    pipe.send("connected")
    pipe.poll(20.0)
    return "works" if control.isSteady() else "does not work"


def protective_stop(pipe: Connection, address: str) -> dict[str, Any]:
    """Move until stopped by somebody else; then recover."""
    import dashboard_client
    import rtde_control
    import rtde_receive

    receive = rtde_receive.RTDEReceiveInterface(address)
    control = rtde_control.RTDEControlInterface(address)
    pose = receive.getActualTCPPose()
    pipe.send("moving")
    result: dict[str, Any] = {"moved": control.moveL([*pose[:2], pose[2] - 0.2, *pose[3:]], 0.05, 1.2)}
    result["stopped"] = receive.isProtectiveStopped(), receive.getRuntimeState(), receive.isEmergencyStopped()
    result["at"] = receive.getActualTCPPose()
    dashboard = dashboard_client.DashboardClient(address)
    dashboard.connect()
    dashboard.unlockProtectiveStop()
    result["uploaded"] = control.reuploadScript()
    until(control.isProgramRunning)
    result["still"] = receive.getActualTCPPose()
    result["again"] = control.moveL(pose, 0.25, 1.2)
    result["back"] = receive.getActualTCPPose()
    result["pose"] = pose
    return result
