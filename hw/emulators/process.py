"""An emulator in a process of its own, as ur_rtde needs it: its constructors let no other thread of Python run."""

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
        """Take what makes the host: importable, and picklable, since it is called in another process."""
        self._factory = factory
        self._process: BaseProcess | None = None
        self._lifeline: Connection | None = None
        self._control: EmulatorControl | None = None
        self._addresses: dict[str, str] = {}

    def __enter__(self) -> Self:
        """Start it and wait until it listens.

        Raises:
            DeviceError: It did not come up; the message says why.
        """
        context = multiprocessing.get_context("spawn")
        self._lifeline, theirs = context.Pipe()
        self._process = context.Process(target=_serve, args=(self._factory, theirs), daemon=True)
        try:
            self._process.start()
            theirs.close()
            control, self._addresses = self._heard(self._lifeline)
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
        """For faults and state.

        Raises:
            DeviceError: It is not running.
        """
        if self._control is None:
            raise DeviceError("emulator", "not running", "use it within its `with` block")
        return self._control

    @property
    def addresses(self) -> dict[str, str]:
        """Where clients find each device."""
        return self._addresses

    def kill(self) -> None:
        """Kill it as a crash would, with no chance to say goodbye."""
        if self._process is not None:
            self._process.kill()
            self._process.join(_ENDS_WITHIN)

    def _heard(self, lifeline: Connection) -> tuple[str, dict[str, str]]:
        """Return what it says once it listens: the address of its control, and where its devices are.

        Raises:
            DeviceError: It did not come up.
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
    """The child: ends when its parent closes the pipe, which its death does too."""
    # Ctrl-C in a terminal, and its closing, reach all processes: the parent brings its robot to rest first
    for number in SIGNALS:
        signal.signal(number, signal.SIG_IGN)
    try:
        host = factory()
    except Exception as error:
        # whatever it is, who waits for this process is to read it
        lifeline.send(f"{type(error).__name__}: {error}")
        return
    # a collection of all that was imported would hold up the loop for several periods
    gc.collect()
    gc.freeze()
    try:
        lifeline.send((host.control_address, host.addresses))
    except OSError:  # whoever waited for it is gone
        host.close()
        return
    host.run(lifeline.fileno())
