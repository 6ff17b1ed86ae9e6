"""A bus of emulated servos in a thread, with simple motors behind it."""

import queue
import select
import sys
import threading
import time
from contextlib import contextmanager

from palpate.errors import InvalidValueError
from palpate.hw.dynamixel.hand import DynamixelHand
from palpate.hw.dynamixel.registers import XL330
from palpate.hw.dynamixel.settings import HandSettings, ServoCalibration
from palpate.hw.emulators.dynamixel.bus import DynamixelBus
from palpate.hw.emulators.dynamixel.servo import EmulatedServo
from palpate.hw.emulators.host import Host
from palpate.hw.emulators.server import ServoState
from palpate.hw.emulators.simple_plant import SimplePlant, SimpleServo
from palpate.sim.hand.finger import SlideFinger
from palpate.spatial import ZERO
from support.waiting import WITHIN, until

FINGER = SlideFinger(pinion=0.02)


class EmulatedBus:
    """`DynamixelBus` and a plant, stepped by a thread that ends with the test."""

    def __init__(self, servos=None, motors=None, period=2e-3, **given):
        self.servos = servos or [EmulatedServo(XL330, i + 1) for i in range(2)]
        motors = tuple(motors or (SimpleServo() for _ in self.servos))
        self.plant = SimplePlant(servos=motors, period=period)
        self.motors = motors
        self.bus = DynamixelBus(self.servos, **given)
        self.lock = threading.RLock()
        self._asked = queue.SimpleQueue()
        self._ended = False
        self.failed = None
        self._thread = threading.Thread(target=self._run, daemon=True)

    def __enter__(self):
        self._interval = sys.getswitchinterval()
        sys.setswitchinterval(2e-4)  # two threads of one interpreter play two computers
        self.bus.take(self.plant.start())
        self._thread.start()
        return self

    def __exit__(self, *_):
        self._ended = True
        self._thread.join(WITHIN)
        sys.setswitchinterval(self._interval)
        alive = self._thread.is_alive()
        self.bus.close()
        assert not alive, "the emulator hangs"
        if self.failed is not None:
            raise self.failed

    def inject(self, fault, value=1.0):
        """Have the thread do it: a terminal that somebody waits for is not closed under his hands."""
        done = queue.SimpleQueue()
        self._asked.put((fault, value, done))
        reply = done.get(timeout=WITHIN)
        if isinstance(reply, Exception):
            raise reply
        return reply

    def _inject(self):
        while not self._asked.empty():
            fault, value, done = self._asked.get()
            try:
                done.put(self.bus.inject(fault, value))
            except InvalidValueError as error:
                done.put(error)

    def _run(self):
        try:
            self._serve()
        except BaseException as error:
            self.failed = error

    def _serve(self):
        bus, period = self.bus, self.plant.period
        step_due = time.monotonic()
        while not self._ended:
            wait = min(step_due, bus.due()) - time.monotonic()
            ready = select.select(bus.files(), [], [], max(0.0, min(wait, 0.002)))[0] if bus.files() else []
            if not bus.files():
                time.sleep(1e-3)
            with self.lock:
                self._inject()
                now = time.monotonic()
                for file in ready:
                    bus.receive(file, now)
                if now >= bus.due():
                    bus.tick(now)
                if now >= step_due:
                    bus.take(self.plant.step(ZERO, ZERO, bus.goals()))
                    step_due = max(step_due + period, now - 10 * period)


def hosted_servos():
    """Return a host of four servos, for a process of its own."""
    bus = DynamixelBus([EmulatedServo(XL330, i + 1) for i in range(4)])
    return Host(SimplePlant(servos=tuple(SimpleServo() for _ in range(4))), [bus])


def still(position=0.0, velocity=0.0, current=0.0):
    """A motor that measures this and never moves."""

    class Still(SimpleServo):
        def step(self, goal, period):
            pass

    return Still(state=ServoState(position, velocity, current))


def settings(n=2, **given):
    """Settings of n fingers on 20 mm pinions; their servos' zeros are in the middle of the turn.

    All wait longer than by default: this machine alone is silent for 0.3 s now and then.
    """
    servos = given.pop("servos", tuple(ServoCalibration(i + 1) for i in range(n)))
    patient = {"watchdog": 2.0, "reply_timeout": 0.1, "silence": 1.0}
    return HandSettings(servos, FINGER, **{"opening": 0.04, "tip_along": 0.012, **patient, **given})


def connected(emulated, **given):
    """A hand at an emulated bus."""
    return DynamixelHand(emulated.bus.address, settings(len(emulated.servos), **given))


@contextmanager
def started(emulated, **given):
    """Run a hand at an emulated bus; it is closed at the end."""
    hand = connected(emulated, **given)
    hand.start()
    try:
        yield hand
    finally:
        hand.close()


def new_sample(hand):
    """Read; None if that exchange was missed."""
    missed, sample = hand.missed, hand.read()
    return sample if hand.missed == missed else None


def read_until(hand, condition):
    """Run periods until the sample fulfils a condition."""
    return until(lambda: (sample := hand.read()) and condition(sample) and sample)
