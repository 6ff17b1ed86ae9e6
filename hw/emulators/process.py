"""Emulator in a process of its own: constructors of ur_rtde let no other thread of Python run."""

import gc
import multiprocessing
import signal
from collections.abc import Callable
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from types import TracebackType
from typing import Self

from palpate.hw.devices import DeviceError
from palpate.hw.emulators.control import EmulatorControl
from palpate.hw.emulators.host import Host
from palpate.interruption import SIGNALS

_READY_WITHIN = 60.0
"""[s] for a new interpreter to import and compile what it needs on a busy machine."""

_ENDS_WITHIN = 5.0
"""[s]; then it is killed."""


class EmulatorProcess:
    """Runs a host as long as a `with` block lasts, or as its parent lives."""

    def __init__(self, factory: Callable[[], Host]) -> None:
        """Take the factory of the host: importable and picklable, since it is called in another process."""
        self._factory = factory
        self._process: BaseProcess | None = None
        self._lifeline: Connection | None = None
        self._control: EmulatorControl | None = None
        self._addresses: dict[str, str] = {}

    def __enter__(self) -> Self:
        """Start it and wait until it listens.

        Raises:
            DeviceError: If it did not start; the message gives the reason.
        """
        context = multiprocessing.get_context("spawn")
        self._lifeline, theirs = context.Pipe()
        self._process = context.Process(target=_serve, args=(self._factory, theirs), daemon=True)
        try:
            self._process.start()
            theirs.close()
            control, self._addresses = self._first_message(self._lifeline)
            self._control = EmulatorControl(control)
        except BaseException:
            self.__exit__(None, None, None)
            raise
        return self

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        """End it."""
        if self._control is not None:
            self._control.close()
        if self._lifeline is not None:
            self._lifeline.close()
        process = self._process
        if process is not None and process.pid is not None:
            process.join(_ENDS_WITHIN)
            if process.is_alive():
                process.kill()
                process.join(_ENDS_WITHIN)
            process.close()
        self._control = self._lifeline = self._process = None

    @property
    def control(self) -> EmulatorControl:
        """Control socket, for faults and state.

        Raises:
            DeviceError: If it is not running.
        """
        if self._control is None:
            raise DeviceError("emulator", "not running", "use it within its `with` block")
        return self._control

    @property
    def addresses(self) -> dict[str, str]:
        """Address of each device by its name."""
        return self._addresses

    def kill(self) -> None:
        """Kill it as a crash would."""
        if self._process is not None:
            self._process.kill()
            self._process.join(_ENDS_WITHIN)

    def _first_message(self, lifeline: Connection) -> tuple[str, dict[str, str]]:
        """Return the addresses of its control and of its devices, once it listens.

        Raises:
            DeviceError: If it did not start.
        """
        try:
            reply = lifeline.recv() if lifeline.poll(_READY_WITHIN) else f"silent for {_READY_WITHIN:g} s"
        except EOFError:
            reply = "it ended at once; its own messages say why"
        if isinstance(reply, str):
            raise DeviceError("emulator", f"did not start: {reply}", "see that its address is free")
        control, addresses = reply
        return control, addresses


def _serve(factory: Callable[[], Host], lifeline: Connection) -> None:
    """Run the child: it ends when its parent closes the pipe, or dies."""
    # Ctrl-C in a terminal, and its closing, reach all processes: the parent stops its robot first
    for number in SIGNALS:
        signal.signal(number, signal.SIG_IGN)
    try:
        host = factory()
    except Exception as error:
        # any error is for the process that waits for this one
        lifeline.send(f"{type(error).__name__}: {error}")
        return
    # garbage collection over all imports would hold up the loop for several periods
    gc.collect()
    gc.freeze()
    try:
        lifeline.send((host.control_address, host.addresses))
    except OSError:  # the parent is gone
        host.close()
        return
    host.run(lifeline.fileno())
