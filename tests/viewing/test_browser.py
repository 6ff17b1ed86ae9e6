"""What tests do where there is no browser."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from viewing.browser import MISSING

TEST = """
from viewing.browser import needs_browser, page

@needs_browser
def test_a_page_opens(tmp_path):
    with page(tmp_path, "about:blank"):
        pass
"""


@pytest.mark.parametrize(("ci", "ends"), [("", "1 skipped"), ("true", "1 failed")])
def test_without_a_browser_tests_are_skipped_but_fail_in_ci_and_say_how_to_install_it(ci, ends, tmp_path):
    (tmp_path / "test_page.py").write_text(TEST)
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-rsf", "-p", "no:cacheprovider", "test_page.py"],
        cwd=tmp_path,
        env={
            **os.environ,
            "PATH": "",
            "CI": ci,
            "PYTHONPATH": str(Path(__file__).parents[1]),
            "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1",
            "COLUMNS": "200",
        },
        capture_output=True,
        text=True,
        timeout=60,
    )
    assert ends in done.stdout
    assert MISSING in done.stdout.split("short test summary")[1]
    assert "apt-get install chromium" in MISSING
