"""The simulated UR5e behind emulated devices, ready to be run in a process of its own."""

from dataclasses import dataclass, replace

from palpate.hw.emulators.host import Host
from palpate.hw.emulators.netft import BoxSettings, NetFtServer
from palpate.hw.emulators.ur import UrServer
from palpate.hw.emulators.ur.arm import ArmMounting
from palpate.robots.emulated.scene_plant import ScenePlant
from palpate.robots.emulated.truth import TruthTrace
from palpate.robots.robot import Robot
from palpate.robots.task import RobotInScene, Task
from palpate.runtime.urgency import be_real_time
from palpate.sim import MujocoBackend

CYCLE = 0.002
"""[s] Of an e-Series controller, and so of the plant behind it."""

SENSOR_RATE = 1000.0
"""[1/s] Records of the emulated F/T box per second of the robot's time."""

HEADROOM = 1.5
"""Range of the F/T box over what the supervisor lets the sensor feel: the tip's weight and inertia come on top."""


@dataclass(frozen=True, slots=True, eq=False)
class EmulatedUr5e:
    """What `EmulatorProcess` takes: a UR controller and an F/T box, the simulated arm over its object behind them.

    Attributes:
        twin: The robot without wires.
        mounting: Where its arm stands in the scene.
        task: What it is to touch.
        address: Where controller and F/T box listen.
        time_scale: Seconds of the robot per second of wall time.
        process: That has made the memory for the truth.
        memory: Its descriptor there.
    """

    twin: Robot
    mounting: ArmMounting
    task: Task
    address: str
    time_scale: float
    process: int
    memory: int

    def __call__(self) -> Host:
        """Return a host that listens and is ready to run.

        Raises:
            InvalidValueError: The scene cannot be, or the address is not free.
            OSError: A port of the F/T box is not free, or nobody wants the truth any more.
        """
        be_real_time()
        limits = self.twin.file.limits
        scene = simulated(self.twin.file.backend.build(self.twin, replace(self.task, period=CYCLE)))
        trace = TruthTrace.of_process(self.process, self.memory)
        plant = ScenePlant(scene, trace)
        arm = UrServer(self.address, mounting=self.mounting)
        force, moment = HEADROOM * limits.force, HEADROOM * limits.moment
        ranges = (force, force, force, moment, moment, moment)
        settings = BoxSettings(self.address, rate=SENSOR_RATE * self.time_scale, ranges=ranges)
        try:
            box = NetFtServer(settings)
        except BaseException:
            arm.close()
            raise
        return Host(plant, [arm, box], scale=self.time_scale)


def simulated(ready: RobotInScene) -> MujocoBackend:
    """Return the back end of a simulated robot.

    Raises:
        TypeError: It is another one: whoever built it is wrong.
    """
    if not isinstance(ready.backend, MujocoBackend):
        raise TypeError(f"a {type(ready.backend).__name__} is no simulation")
    return ready.backend
