"""A robot in a process of its own, behind a UDP socket on loopback, with its own watchdog.

It moves as commanded, at 1 kHz by its own clock, which begins at 0 when it starts, and replies every command with
its state. When no command has come for `WATCHDOG` it stops by itself. It counts ticks: while a busy machine keeps
it from running, its clock stands. What it did, it tells on standard output, one line each:

    port N                  listening
    stopped COMMANDS TICKS  the watchdog has stopped it: how many commands have come, and ticks since the last
    final SPEED MOVED       on SIGTERM, once no command keeps it moving: its speed, and how far it has moved since
                            the watchdog stopped it last
"""

import contextlib
import math
import select
import signal
import socket
import struct
import sys
import time

WATCHDOG = 0.05
"""[s]; robot controllers take 20 to 100 ms."""
TICK = 1e-3
"""[s]"""
LAG = 0.01
"""Of the drives [s]."""
STATE = struct.Struct("<7d")
"""time, position, velocity"""
COMMAND = struct.Struct("<Q3d")
"""number, velocity"""
REST = (0.0, 0.0, 0.0)


class Device:
    """Position and velocity, and when somebody last cared."""

    def __init__(self, now: float) -> None:
        self.born = self.moved_at = now
        self.position = self.velocity = self.wanted = REST
        self.moving = False
        self.commands = self.waited = 0
        self.moved_after_stop = 0.0
        self.was_stopped = False

    def receive(self, payload: bytes, now: float) -> bytes:
        _, *velocity = COMMAND.unpack(payload)
        self.wanted = tuple(velocity)
        self.moving = self.moving or self.wanted != REST
        self.commands, self.waited = self.commands + 1, 0
        return STATE.pack(now - self.born, *self.position, *self.velocity)

    def tick(self, now: float) -> None:
        """Move on to a time [s]."""
        elapsed = now - self.moved_at
        self.moved_at = now
        self.waited += 1
        dt = min(elapsed, 5.0 * TICK)  # drives do not run on while their controller stands still
        share = 1.0 - math.exp(-dt / LAG)
        self.velocity = tuple(v + share * (w - v) for v, w in zip(self.velocity, self.wanted, strict=True))
        step = math.dist(REST, self.velocity) * dt
        self.moved_after_stop += step if self.was_stopped else 0.0
        self.position = tuple(x + v * dt for x, v in zip(self.position, self.velocity, strict=True))
        if self.moving and self.waited > WATCHDOG / TICK:
            self.wanted = self.velocity = REST  # the brakes
            self.moving, self.was_stopped, self.moved_after_stop = False, True, 0.0
            say(f"stopped {self.commands} {self.waited}")


def say(line: str) -> None:
    with contextlib.suppress(BrokenPipeError):
        sys.stdout.write(f"{line}\n")
        sys.stdout.flush()


def main() -> None:
    port = int(sys.argv[1]) if len(sys.argv) > 1 else 0
    ended = []
    signal.signal(signal.SIGTERM, lambda *_: ended.append(True))
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the one who commands
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as link:
        link.bind(("127.0.0.1", port))
        link.setblocking(False)
        say(f"port {link.getsockname()[1]}")
        device, next_tick = Device(time.monotonic()), time.monotonic() + TICK
        while not ended or device.moving:
            select.select([link], [], [], max(0.0, next_tick - time.monotonic()))
            with contextlib.suppress(BlockingIOError, ConnectionError):
                while True:
                    payload, sender = link.recvfrom(256)
                    link.sendto(device.receive(payload, time.monotonic()), sender)
            now = time.monotonic()
            if now >= next_tick:
                device.tick(now)
                next_tick = max(next_tick + TICK, now)
        say(f"final {math.dist(REST, device.velocity)!r} {device.moved_after_stop!r}")


if __name__ == "__main__":
    main()
