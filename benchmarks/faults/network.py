"""What a network does to a rig while it holds a force: through a real proxy between clients and devices."""

import threading
from dataclasses import dataclass, replace
from time import monotonic, sleep

from faults.cell import FORCE_LIMIT, EmulatedCell, own_address
from faults.command import REST_WITHIN, next_run
from faults.kind import Domain, Kind, Moment, Verdict, Workshop
from faults.on_the_loop import FORCE_EXCESS, contradiction, reported_rest
from faults.proxy import Proxy, Weather
from palpate.experiments.kit.recorded_run import RecordedRun
from palpate.robots.robot import load_robot
from palpate.runtime.data import Sample
from palpate.runtime.rest import RestState
from support.regulate_runs import planned

RTDE, SCRIPT, DASHBOARD, CALIBRATION, RDT = 30004, 30003, 29999, 49151, 49152
"""Ports of the arm, and of the F/T box (calibration by TCP, records by UDP)."""

RUNS = 1.5
"""[s] that a force is held."""

STARTS_WITHIN = 22.0
"""[s] that a start on a wire may take until it is refused: the arm's 15, and 6 to end a client that hangs."""

REPEATS = 3
"""Runs until one comes to its fault."""


def proxied(workshop: Workshop) -> tuple[EmulatedCell, Proxy]:
    """Return a cell behind a proxy; both are shared."""
    front, back = workshop.shared(_Addresses(), "addresses")
    tcp, udp = (RTDE, SCRIPT, DASHBOARD, CALIBRATION), (RDT,)
    cell = workshop.shared(EmulatedCell(workshop.folder, seen_at=front, emulated_at=back), "proxied cell")
    return cell, workshop.shared(Proxy(front, back, tcp, udp), "proxy")


class _Addresses:
    def __enter__(self) -> tuple[str, str]:
        return own_address(), own_address()

    def __exit__(self, *raised: object) -> None:
        pass


@dataclass(frozen=True, slots=True)
class InTheRun:
    """The weather changes while a force is held.

    Attributes:
        weather: Into what.
        ends: Whether the run must not end well: nobody can hold a force so.
    """

    weather: Weather
    ends: bool = True

    def __call__(self, moment: Moment, workshop: Workshop) -> Verdict:
        """See `Trial`; a run that ends before its fault, on a busy computer, is no try and repeated."""
        for _ in range(REPEATS):
            verdict = self._tried(moment, workshop)
            if verdict is not None:
                return verdict
        return Verdict("", (f"{REPEATS} runs ended before the fault",))

    def _tried(self, moment: Moment, workshop: Workshop) -> Verdict | None:
        cell, proxy = proxied(workshop)
        proxy.turn(Weather())
        cell.well()
        plan = planned(robot=str(cell.path), duration=RUNS, assumed_stiffness=2000.0)
        run, turned = RecordedRun(plan), list[float]()
        at = 0.05 + 0.7 * moment.share * plan.expected_duration

        def spoil(sample: Sample, now: object, command: object) -> None:
            if not turned and sample.time >= at:
                turned.append(sample.time)
                proxy.turn(self.weather, moment.seed)

        with _Watched(cell) as watched:
            result = run.run((spoil,))
            rest = cell.rest_within(REST_WITHIN)
        proxy.turn(Weather())
        if not turned:
            return None
        problems = [*contradiction(reported_rest(result), rest)]
        if rest is not RestState.AT_REST:
            problems.append("the arm moves after the end")
        if watched.hardest > FORCE_EXCESS * FORCE_LIMIT:
            problems.append(f"true force {watched.hardest:.1f} N at a limit of {FORCE_LIMIT:g} N")
        if self.ends and result.ending.value == "done":
            problems.append("ended as if nothing had been")
        sleep(0.1)
        return Verdict(result.why[:80] or result.ending.value, (*problems, *next_run(cell)))


class _Watched:
    """Asks the emulator again and again for the largest force."""

    def __init__(self, cell: EmulatedCell) -> None:
        self._cell, self._ending, self.hardest = cell, threading.Event(), 0.0
        self._thread = threading.Thread(target=self._watch)

    def __enter__(self) -> "_Watched":
        self._thread.start()
        return self

    def __exit__(self, *raised: object) -> None:
        self._ending.set()
        self._thread.join()

    def _watch(self) -> None:
        while not self._ending.wait(0.02):
            self.hardest = max(self.hardest, self._cell.state()[1])


@dataclass(frozen=True, slots=True)
class AtTheStart:
    """The weather is so from the beginning: refused in time, by name, and nothing is left.

    Attributes:
        weather: What it is like.
        names: What the message must name.
    """

    weather: Weather
    names: str

    def __call__(self, moment: Moment, workshop: Workshop) -> Verdict:
        """See `Trial`."""
        from palpate.hw.rig import FreshlyTared
        from palpate.robots.rig import assembled

        cell, proxy = proxied(workshop)
        cell.well()
        proxy.turn(replace(self.weather, rate=self.weather.rate * (0.5 + moment.share)), moment.seed)
        robot = load_robot(str(cell.path))
        begun, reported = monotonic(), "started"
        try:
            with FreshlyTared(assembled(robot, robot.file.period)) as rig:
                rig.start()
        except OSError as error:
            reported = str(error)
        took = monotonic() - begun
        proxy.turn(Weather())
        problems = []
        if took > STARTS_WITHIN:
            problems.append(f"took {took:.1f} s: a start has {STARTS_WITHIN:g} s")
        if reported != "started" and not (self.names in reported and proxy.front in reported):
            problems.append(f"does not name {self.names} at {proxy.front}: {reported}")
        if cell.rest_within(REST_WITHIN) is not RestState.AT_REST:
            problems.append("the arm moves after the end")
        return Verdict(f"{reported[:90]} ({took:.1f} s)", (*problems, *next_run(cell)))


UR, BOX = (RTDE, SCRIPT, DASHBOARD), (CALIBRATION, RDT)
ARM, SENSOR = "UR arm", "F/T sensor"


def _network(name: str, weather: Weather, *, ends: bool = True) -> Kind:
    return Kind(name, Domain.NETWORK, InTheRun(weather, ends))


def _protocol(name: str, weather: Weather, *, ends: bool = True) -> Kind:
    return Kind(name, Domain.PROTOCOL, InTheRun(weather, ends))


def _start(name: str, weather: Weather, names: str) -> Kind:
    return Kind(name, Domain.PROTOCOL, AtTheStart(weather, names))


KINDS = (
    _network("all is late by 5 ms", Weather(delay=0.005), ends=False),
    _network("all is late by 100 ms", Weather(delay=0.1), ends=False),
    _network("all is late by 2 s", Weather(delay=2.0)),
    _network("delay creeps by 100 ms/s", Weather(creep=0.1), ends=False),
    _network("delay creeps by 2 s/s", Weather(creep=2.0), ends=False),
    _network("jitter of 20 ms", Weather(jitter=0.02), ends=False),
    _network("jitter of 200 ms", Weather(jitter=0.2), ends=False),
    _network("a third of datagrams lost", Weather(loss=0.3), ends=False),
    _network("nearly all datagrams lost", Weather(loss=0.999), ends=False),
    _network("datagrams doubled and swapped", Weather(doubled=0.3, swapped=0.3), ends=False),
    _network("partition", Weather(cut_off=True)),
    _network("partition of the arm alone", Weather(cut_off=True, ports=UR)),
    _network("partition of the sensor alone", Weather(cut_off=True, ports=BOX)),
    _network("partition of one direction", Weather(back_only=True)),
    _network("the arm's connections are reset", Weather(reset=True, ports=UR)),
    _network("all connections are closed and refused", Weather(closed=True)),
    _network("the arm's states trickle at 20 kB/s", Weather(rate=2e4, ports=(RTDE,)), ends=False),
    _protocol("RTDE bytes damaged", Weather(damaged=0.02, ports=(RTDE,)), ends=False),
    _protocol("RTDE packets cut", Weather(cut=0.02, ports=(RTDE,)), ends=False),
    _protocol("NetFT datagrams damaged", Weather(damaged=0.02, ports=(RDT,)), ends=False),
    _protocol("all NetFT datagrams damaged", Weather(damaged=1.0, ports=(RDT,)), ends=False),
    _protocol("NetFT datagrams cut", Weather(cut=0.3, ports=(RDT,)), ends=False),
    _protocol("RTDE connection closed", Weather(closed=True, ports=(RTDE,))),
    _protocol("script connection closed", Weather(closed=True, ports=(SCRIPT,)), ends=False),
    _protocol("dashboard connection closed", Weather(closed=True, ports=(DASHBOARD,)), ends=False),
    _start("RTDE greeting at 1 byte/s", Weather(rate=1.0, ports=(RTDE,)), ARM),
    _start("RTDE greeting at 100 byte/s", Weather(rate=100.0, ports=(RTDE,)), ARM),
    _start("dashboard greeting at 1 byte/s", Weather(rate=1.0, ports=(DASHBOARD,)), ARM),
    _start("NetFT calibration at 1 byte/s", Weather(rate=1.0, ports=(CALIBRATION,)), SENSOR),
    _start("RTDE silent", Weather(back_only=True, ports=(RTDE,)), ARM),
    _start("dashboard silent", Weather(back_only=True, ports=(DASHBOARD,)), ARM),
    _start("NetFT calibration silent", Weather(back_only=True, ports=(CALIBRATION,)), SENSOR),
    _start("NetFT records silent", Weather(back_only=True, ports=(RDT,)), SENSOR),
    _start("RTDE refused", Weather(closed=True, ports=(RTDE,)), ARM),
    _start("dashboard refused", Weather(closed=True, ports=(DASHBOARD,)), ARM),
    _start("script port refused", Weather(closed=True, ports=(SCRIPT,)), ARM),
    _start("NetFT calibration refused", Weather(closed=True, ports=(CALIBRATION,)), SENSOR),
    _start("RTDE bytes damaged from the beginning", Weather(damaged=0.5, ports=(RTDE,)), ARM),
    _start("NetFT bytes damaged from the beginning", Weather(damaged=0.5, ports=BOX), SENSOR),
)
