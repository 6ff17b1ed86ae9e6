"""Datagrams that wait are taken without another thread having Python in between."""

import socket
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from palpate.hw.netft.net_ft import NOTHING, Datagrams
from support.waiting import WITHIN, until


@pytest.fixture
def pair() -> Iterator[tuple[socket.socket, socket.socket]]:
    with (
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as receiver,
    ):
        receiver.bind(("127.0.0.1", 0))
        sender.connect(receiver.getsockname())
        receiver.connect(sender.getsockname())
        yield sender, receiver


@contextmanager
def counting_thread() -> Iterator[list[int]]:
    """A thread that counts whenever it has the interpreter, which it gives back at once."""
    count, ending = [0], threading.Event()

    def run() -> None:
        while not ending.is_set():
            count[0] += 1
            time.sleep(0.0)

    thread = threading.Thread(target=run)
    before = sys.getswitchinterval()
    thread.start()
    sys.setswitchinterval(30.0)  # nobody takes the interpreter: it must be given
    try:
        until(lambda: count[0] > 0)
        yield count
    finally:
        sys.setswitchinterval(before)
        ending.set()
        thread.join()


def test_no_other_thread_runs_while_datagrams_are_taken(pair):
    sender, receiver = pair
    datagrams = Datagrams(receiver, 8)
    for _ in range(100):
        sender.send(b"abcd")
    with counting_thread() as count:
        before = count[0]
        sizes = [datagrams.take() for _ in range(101)]
        after = count[0]
    assert before > 0, "the other thread never ran: this shows nothing"
    assert after == before
    assert sizes == [4] * 100 + [NOTHING]


def test_an_ordinary_socket_lets_it_run(pair):
    """Otherwise the test above could not fail."""
    sender, receiver = pair
    receiver.setblocking(False)
    with counting_thread() as count:
        for _ in range(100_000):  # a call may end before a busy machine has run the other thread: ask again
            before = count[0]
            sender.send(b"abcd")
            receiver.recv(8)
            if count[0] > before:
                return
    pytest.fail("the other thread never ran")


def test_what_is_there_is_waited_for_and_taken_in_order(pair):
    sender, receiver = pair
    datagrams = Datagrams(receiver, 8)
    assert not datagrams.wait(0.0)
    assert datagrams.take() == NOTHING
    for word in (b"first", b"second", b""):
        sender.send(word)
    assert datagrams.wait(WITHIN)
    taken = [bytes(datagrams.data[: datagrams.take()]) for _ in range(3)]
    assert [len(word) for word in taken] == [5, 6, 0]
    assert datagrams.take() == NOTHING


def test_what_is_too_long_is_cut_and_says_so_by_its_size(pair):
    sender, receiver = pair
    datagrams = Datagrams(receiver, 5)
    sender.send(b"0123456789")
    assert datagrams.take() == 5
    assert bytes(datagrams.data) == b"01234"


def test_nobody_there_is_refused_as_a_socket_does(pair):
    sender, receiver = pair
    datagrams = Datagrams(receiver, 8)
    sender.close()
    receiver.send(b"hello")
    assert datagrams.wait(WITHIN)
    with pytest.raises(ConnectionRefusedError):
        datagrams.take()


def test_a_closed_socket_is_an_error_not_a_crash(pair):
    _, receiver = pair
    datagrams = Datagrams(receiver, 8)
    receiver.close()
    with pytest.raises(OSError, match="Bad file descriptor"):
        datagrams.take()
