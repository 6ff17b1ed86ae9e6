"""What the check against judging the wall clock finds, and what it leaves alone."""

import subprocess
import sys

import pytest

from support import no_wall_clock
from support.no_wall_clock import findings

HEAD = "import time\nimport time as wall\nfrom time import monotonic, perf_counter as now\nclock = monotonic\n"

FOUND = [
    "began = time.monotonic()\nwork()\nassert time.monotonic() - began < 1.0",
    "before = time.perf_counter_ns()\nwork()\ntook = time.perf_counter_ns() - before",
    "took = wall.time() - sample.time",
    "age = monotonic() - sample.time",
    "began, took = now(), 0.0\nlongest = max(took, end - began)",
    "began = clock()\ntook = -began\ntook -= began",
    "stamps = []\nstamps.append(monotonic())\nassert stamps[-1] - stamps[0] < 1.0",
    "stamps = [monotonic() for _ in range(9)]\nassert np.diff(stamps).max() < 1.0",
    "for began in [clock()]:\n    assert end - began < 1.0",
    "if (began := clock()):\n    took = end - began",
    "began: float = clock()\ndef within():\n    return end - began",
    "def within(clock=time.process_time):\n    return end - clock()",
    "class Timed:\n    def took(self):\n        return time.time_ns() - self.began",
    "time.sleep(deadline - time.monotonic())",
    "end = clock() + 3.0\nwhile not met():\n    assert clock() < end",
    "began = clock()\nwhile not met():\n    assert clock() < began + 3.0, 'never'",
    "end = clock()\nend += 3.0\nif clock() > end + 1.0:\n    pytest.fail('never')",
    "said, end = b'', clock() + 3.0\nif clock() > end:\n    raise AssertionError(said)",
]

FINE = [
    "assert sample.time <= time.monotonic()",
    "before = time.monotonic()\nsample = read()\nassert before <= sample.time <= time.monotonic()",
    "assert second.time - first.time < 0.01",
    "began = sample.time\nassert last.time - began == 1.0",
    "backend.start(time.monotonic())\nassert backend.periods - 1 == 5",
    "sample = backend.step(monotonic())\nassert sample.time - 1.0 > 0.0",
    "heading = Heading(time.time_ns())\nassert heading.start - 5 > 0",
    "def paced(clock):\n    return clock() - 1.0",
    "monkeypatch.setattr(module, 'monotonic', fake.now)\nassert fake.now() - 1.0 < 2.0",
    "until(lambda: met())",
    "end = time.monotonic() + 3.0\nwhile time.monotonic() < end:\n    work()",
]


def within(body, before="", indent="    "):
    """A module with a test that does this."""
    lines = "".join(f"{indent}{line}\n" for line in body.splitlines())
    return f"{HEAD}{before}def test_it():\n{lines}"


@pytest.mark.parametrize("body", FOUND)
def test_what_judges_a_clock_is_found_at_its_line_unless_it_is_slow(body):
    source = within(body)
    (line, message) = findings(source)[-1]
    assert line == len(source.splitlines()) - body.endswith(("('never')", "(said)"))
    assert ("waiting.py" in message) == ("3.0" in body)
    slow = "@pytest.mark.slow\n"
    in_class = "class TestIt:\n" + "".join(f"    {each}\n" for each in source[len(HEAD) :].splitlines())
    assert findings(HEAD + in_class)
    for marked in (
        within(body, slow),
        within(body, "pytestmark = [pytest.mark.skipif(0), pytest.mark.slow]\n"),
        HEAD + slow + in_class,
        HEAD + in_class.replace(":\n", ":\n    pytestmark = pytest.mark.slow\n", 1),
    ):
        assert not findings(marked)


@pytest.mark.parametrize("body", FINE)
def test_what_judges_no_clock_is_left_alone(body):
    assert not findings(within(body))


def test_it_says_where_and_what_instead_and_leaves_services_alone(tmp_path):
    tests = tmp_path / "tests"
    (tests / "support").mkdir(parents=True)
    for name in ("test_a.py", "support/waiting.py"):
        (tests / name).write_text(within(FOUND[0]))
    command = [sys.executable, no_wall_clock.__file__, "tests"]
    found = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=60)
    assert (found.returncode, found.stdout) == (1, f"tests/test_a.py:8: {no_wall_clock.DIFFERENCE}\n")
    (tests / "test_a.py").unlink()
    assert subprocess.run(command, cwd=tmp_path, timeout=60).returncode == 0
