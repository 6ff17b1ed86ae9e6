"""A sweep on a real ray cluster of two nodes, all on the loopback device."""

import os
import signal
import subprocess
import sys
from contextlib import contextmanager
from pathlib import Path

import psutil
import pytest

from commands.test_sweep_command import LONG, PROCESS_TIMEOUT, TINY, kept, metrics, started, undisturbed, wait_for

__all__ = ["undisturbed"]

pytest.importorskip("ray")
pytestmark = [
    pytest.mark.slow,
    pytest.mark.xdist_group("ray"),  # one cluster, not one per test process
    pytest.mark.skipif(sys.platform != "linux", reason="ray nodes on the loopback device are tried on Linux"),
]
NODES = Path(__file__).parents[1] / "support" / "ray_nodes.py"


@contextmanager
def two_nodes():
    """Give the process that holds two nodes, and their address."""
    with pytest.MonkeyPatch.context() as patch:
        # everything on 127.0.0.1, here and in whatever is started here
        patch.setenv("RAY_ENABLE_WINDOWS_OR_OSX_CLUSTER", "0")
        process = subprocess.Popen(
            [sys.executable, str(NODES)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
        )
        address = process.stdout.readline().strip()
        assert address.startswith("127.0.0.1:"), "no cluster"
        yield process, address
        process.communicate(timeout=60.0)


@pytest.fixture(scope="module")
def cluster():
    """One for all tests that leave it whole."""
    with two_nodes() as found:
        yield found


def busy(nodes):
    """Processes of a cluster that do a run: ray says so in their titles."""
    found = []
    for child in psutil.Process(nodes.pid).children(recursive=True):
        try:
            if "ray::attempt" in " ".join(child.cmdline()):
                found.append(child)
        except psutil.Error:
            continue
    return found


def test_a_cluster_of_two_nodes_gives_the_numbers_of_this_computer_also_if_a_worker_is_killed(
    cluster, undisturbed, tmp_path
):
    nodes, address = cluster
    typed = LONG[: LONG.index("--jobs")]
    process = started([*typed, "--ray", address], tmp_path)
    both = wait_for(lambda: found if len(found := busy(nodes)) == 2 else None)
    assert len({worker.parent().pid for worker in both}) == 2, "on two nodes"
    wait_for(lambda: kept(tmp_path))
    victim = wait_for(lambda: busy(nodes))[0]
    os.kill(victim.pid, signal.SIGKILL)
    said, _ = process.communicate(timeout=PROCESS_TIMEOUT)
    assert process.returncode == 0, said
    assert sorted(kept(tmp_path)) == list(range(6))
    assert metrics(tmp_path) == metrics(undisturbed)


def test_a_sweep_on_a_cluster_that_is_killed_goes_on_on_this_computer(cluster, undisturbed, tmp_path):
    nodes, address = cluster
    typed = LONG[: LONG.index("--jobs")]
    process = started([*typed, "--ray", address], tmp_path)
    wait_for(lambda: len(kept(tmp_path)) >= 2)
    process.kill()
    process.communicate()
    before = kept(tmp_path)
    assert len(before) < 6
    process = started(LONG, tmp_path)
    said, _ = process.communicate(timeout=PROCESS_TIMEOUT)
    assert process.returncode == 0, said
    after = kept(tmp_path)
    assert {number: after[number] for number in before} == before
    assert metrics(tmp_path) == metrics(undisturbed)
    wait_for(lambda: not busy(nodes))


def test_a_node_that_is_lost_costs_no_run(undisturbed, tmp_path):
    with two_nodes() as (nodes, address):
        process = started([*LONG[: LONG.index("--jobs")], "--ray", address], tmp_path)
        wait_for(lambda: len(busy(nodes)) == 2)
        wait_for(lambda: kept(tmp_path))
        raylets = [
            child for child in psutil.Process(nodes.pid).children(recursive=True) if child.name() == "raylet"
        ]
        assert len(raylets) == 2
        raylets[-1].kill()  # the head's is the first
        said, _ = process.communicate(timeout=PROCESS_TIMEOUT)
        assert process.returncode == 0, said
        assert metrics(tmp_path) == metrics(undisturbed)


@pytest.mark.parametrize("how", [signal.SIGKILL, signal.SIGSTOP])
def test_when_the_head_is_lost_it_says_so_and_keeps_what_is_done(how, tmp_path):
    """Its runs take four times as long as the silence after which a head is given up."""
    longer = ["sweep", TINY, "--vary", "force=1:3:16", "--set", "time=20", "noise=0.01"]
    with two_nodes() as (nodes, address):
        process = started([*longer, "--ray", address], tmp_path)
        wait_for(lambda: kept(tmp_path))
        (head,) = [
            child for child in psutil.Process(nodes.pid).children(recursive=True) if child.name() == "gcs_server"
        ]
        head.send_signal(how)
        said, _ = process.communicate(timeout=PROCESS_TIMEOUT)
        head.kill()
        assert process.returncode == 1, said
        assert "the head of the ray cluster has not replied for 4 s" in said
        assert f"{len(kept(tmp_path))} of 16 runs are kept" in said
        assert "Traceback" not in said


def test_a_cluster_of_its_own_is_gone_afterwards(undisturbed, tmp_path):
    process = started([*LONG, "--ray", "local"], tmp_path)
    said, _ = process.communicate(timeout=PROCESS_TIMEOUT)
    assert process.returncode == 0, said
    assert metrics(tmp_path) == metrics(undisturbed)
