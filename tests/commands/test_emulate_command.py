"""`palpate emulate`: devices for other software, in the foreground, on loopback unless told otherwise."""

import json
import re
import signal
import socket
import subprocess
import sys
import time
from contextlib import contextmanager, suppress

import psutil
import pytest
import serial

from palpate.cli import main
from palpate.commands.command_result import ExitCode
from palpate.commands.devices.config import (
    EmulateNetftConfig,
    EmulateUrConfig,
    version_numbers,
)
from palpate.hw.dynamixel.packets import packet
from palpate.hw.netft.rdt import HEADER, RECORD, REQUEST, RdtCommand
from support.going_on import going_on
from support.waiting import until

pytestmark = pytest.mark.wire  # it waits for real time, as the tests of devices do


@contextmanager
def emulated(*typed):
    """Run it in a process of its own; yield that, what it said first, and the address of its control.

    It is ended as a user ends it: killed, it would leave the devices that it has started.
    """
    with going_on(("emulate", *typed), "Ctrl-C") as (process, said):
        control = re.search(r"emulate fault '(\S+)' ", said)
        try:
            yield process, said, control.group(1) if control else ""
        finally:
            if process.poll() is None:
                process.send_signal(signal.SIGINT)
            with suppress(subprocess.TimeoutExpired):
                process.wait(60.0)


def listening(process):
    """Return where a process listens, TCP and UDP."""
    found = psutil.Process(process.pid).net_connections("inet")
    return {(its.laddr.ip, its.laddr.port) for its in found if its.status in ("LISTEN", "NONE") and not its.raddr}


@pytest.mark.slow
def test_an_arm_listens_where_it_says_has_its_faults_and_ends_in_good_order(capsys):
    with emulated("ur", "--address", "127.0.9.80", "--fault", "local_control", "1") as (process, said, control):
        assert "127.0.9.80" in said
        assert "drop_rst" in said
        assert listening(process) == {("127.0.9.80", its) for its in (30004, 30003, 29999)} | {
            ("127.0.0.1", int(control.split("?")[0]))
        }
        with socket.create_connection(("127.0.9.80", 29999), timeout=30.0) as dashboard:
            lines = dashboard.makefile("rw")
            assert "Dashboard" in lines.readline()
            lines.write("is in remote control\n")
            lines.flush()
            assert lines.readline().strip() == "false"
            assert main(["emulate", "fault", control, "ur", "local_control", "0"]) == 0
            lines.write("is in remote control\n")
            lines.flush()
            assert lines.readline().strip() == "true"
        assert main(["emulate", "fault", control, "ur", "nonsense"]) == ExitCode.MISTAKE
        assert "protective_stop" in capsys.readouterr().err
        process.send_signal(signal.SIGINT)
        assert process.wait(60.0) == 0
    assert main(["emulate", "fault", control, "ur", "drop_fin"]) == ExitCode.MISTAKE
    assert "no emulator is there" in capsys.readouterr().err


@pytest.mark.slow
def test_a_box_sends_records_of_its_load_and_a_second_one_is_refused():
    with emulated("netft", "--address", "127.0.9.81", "--load", "1", "0", "-5", "0", "0", "0.01") as (
        process,
        said,
        _,
    ):
        assert "49152" in said
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as client:
            client.settimeout(30.0)
            client.connect(("127.0.9.81", 49152))
            client.send(REQUEST.pack(HEADER, RdtCommand.STREAM, 3))
            records = [RECORD.unpack(client.recv(100)) for _ in range(3)]
        assert [record[3:] for record in records] == [(1_000_000, 0, -5_000_000, 0, 0, 10_000_000)] * 3
        with emulated("netft", "--address", "127.0.9.81") as (second, told, _):
            assert second.wait(60.0) == ExitCode.MISTAKE
            assert "cannot listen" in told
        process.send_signal(signal.SIGTERM)
        assert process.wait(60.0) == 0


@pytest.mark.slow
def test_servos_answer_at_the_link_which_is_gone_afterwards(tmp_path):
    link = tmp_path / "bus"
    with emulated("dynamixel", "--servos", "3", "--link", str(link)) as (process, said, _):
        assert str(link) in said
        with serial.Serial(str(link), 1_000_000, timeout=30.0) as client:
            client.write(packet(3, b"\x01"))  # a ping
            answer = client.read(14)
        assert answer[:5] == b"\xff\xff\xfd\x00\x03"
        assert int.from_bytes(answer[9:11], "little") == 1200
        process.send_signal(signal.SIGINT)
        assert process.wait(60.0) == 0
    assert not link.is_symlink()


def free_port():
    with socket.create_server(("127.0.0.1", 0)) as listener:
        return listener.getsockname()[1]


def connected(port):
    """Return a connection to a port of this computer, as soon as somebody listens there."""

    def tried():
        with suppress(ConnectionRefusedError):
            return socket.create_connection(("127.0.0.1", port), timeout=30.0)

    return until(tried)


@pytest.mark.slow
def test_a_program_chooses_the_port_of_control_and_waits_for_it_in_place_of_words(monkeypatch, capsys):
    """All of it is ready when that port is, and the answer to --json is one document all the same."""
    port, address = free_port(), "127.0.9.82"
    monkeypatch.setenv("PALPATE_CONTROL_TOKEN", "chosen-by-the-program")
    typed = ("ur", "--address", address, "--control-port", str(port), "--json")
    with subprocess.Popen(
        [sys.executable, "-m", "palpate", "emulate", *typed], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL
    ) as started:
        try:
            connected(port).close()
            assert {(address, its) for its in (30004, 30003, 29999)} <= listening(started)
            assert main(["emulate", "fault", str(port), "ur", "protective_stop"]) == 0
            assert main(["emulate", "fault", f"{port}?token=guessed", "ur", "e_stop"]) == ExitCode.MISTAKE
            with emulated("netft", "--address", address, "--control-port", str(port)) as (second, told, _):
                assert second.wait(60.0) == ExitCode.MISTAKE
                assert f"control_port = {port}: cannot listen there" in told
            connected(port).close()
            started.send_signal(signal.SIGTERM)
            said, _ = started.communicate(timeout=60.0)
        finally:
            started.kill()
    assert json.loads(said)["control_port"] == port


@pytest.mark.slow
def test_one_that_ignores_hang_ups_goes_on_when_its_terminal_is_closed():
    """As under nohup."""
    port = free_port()
    with subprocess.Popen(
        [sys.executable, "-m", "palpate", "emulate", "dynamixel", "--control-port", str(port)],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        preexec_fn=lambda: signal.signal(signal.SIGHUP, signal.SIG_IGN),
    ) as started:
        try:
            connected(port).close()
            started.send_signal(signal.SIGHUP)
            time.sleep(0.3)  # three times as long as it takes to end
            connected(port).close()
            started.send_signal(signal.SIGTERM)
            assert started.wait(60.0) == 0
        finally:
            started.kill()


@pytest.mark.parametrize("kind", [EmulateUrConfig, EmulateNetftConfig])
def test_without_being_told_nobody_else_reaches_it(kind):
    assert kind().address.startswith("127.")


def test_versions_may_be_short():
    assert version_numbers("5.14") == (5, 14, 0, 0)
    assert version_numbers("10") == (10, 0, 0, 0)
