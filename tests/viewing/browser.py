"""A headless chromium, spoken to in its own protocol: enough to open a page, look at it, and hear its errors."""

import base64
import contextlib
import json
import os
import shutil
import subprocess
import urllib.request

import pytest
from websockets.sync.client import connect

from support.waiting import until

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")

MISSING = "there is no browser: apt-get install chromium"

needs_browser = pytest.mark.skipif(CHROMIUM is None and not os.environ.get("CI"), reason=MISSING)
"""Without a browser a test is skipped; in continuous integration, where CI is set, it fails at its first page."""

WITHIN = 300.0
"""[s] for a reply or a drawing on a busy machine: the browser computes 3-D pictures in software."""

FLAGS = (
    "--headless=new",
    "--no-sandbox",
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--ignore-gpu-blocklist",
    "--hide-scrollbars",
    "--no-first-run",
    "--disable-dev-shm-usage",
    "--remote-debugging-port=0",
    "--window-size=1280,800",
)


class Page:
    def __init__(self, socket):
        self._socket, self._next = socket, 0
        self.errors, self.complaints, self.requests = [], [], []

    def call(self, method, **parameters):
        self._next += 1
        self._socket.send(json.dumps({"id": self._next, "method": method, "params": parameters}))
        while True:
            try:
                said = json.loads(self._socket.recv(timeout=WITHIN))
            except TimeoutError:
                raise AssertionError(
                    f"the browser did not answer within {WITHIN} s: {method} {parameters}"
                ) from None
            self._hear(said)
            if said.get("id") == self._next:
                assert "error" not in said, said
                return said["result"]

    def evaluate(self, expression):
        return self.call("Runtime.evaluate", expression=expression, returnByValue=True)["result"].get("value")

    def wait_for(self, expression):
        """Wait until an expression of JavaScript is true."""
        try:
            until(lambda: self.evaluate(expression), WITHIN)
        except AssertionError:
            text = self.evaluate("document.body.innerText")
            raise AssertionError(f"not true within {WITHIN} s: {expression}; the page shows: {text!r}") from None

    def screenshot(self):
        return base64.b64decode(self.call("Page.captureScreenshot", format="png")["data"])

    def _hear(self, said):
        if said.get("method") == "Runtime.exceptionThrown":
            self.errors.append(said["params"]["exceptionDetails"])
        if said.get("method") == "Log.entryAdded" and said["params"]["entry"]["level"] == "error":
            self.complaints.append(said["params"]["entry"]["text"])
        if said.get("method") == "Network.requestWillBeSent":
            self.requests.append(said["params"]["request"]["url"])


@contextlib.contextmanager
def page(folder, url):
    """Open a page; `folder` holds the browser's profile."""
    assert CHROMIUM is not None, MISSING
    process = subprocess.Popen(
        [CHROMIUM, *FLAGS, f"--user-data-dir={folder}", "about:blank"],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    try:
        place = folder / "DevToolsActivePort"
        until(lambda: process.poll() is not None or (place.exists() and place.read_text().strip()), WITHIN)
        assert process.poll() is None, "chromium ended at once"
        port = place.read_text().split()[0]
        with urllib.request.urlopen(f"http://127.0.0.1:{port}/json/list") as answer:
            target = next(one for one in json.load(answer) if one["type"] == "page")
        with connect(target["webSocketDebuggerUrl"], max_size=None, compression=None) as socket:
            opened = Page(socket)
            opened.call("Runtime.enable")
            opened.call("Page.enable")
            opened.call("Page.navigate", url=url)
            yield opened
    finally:
        process.terminate()
        process.wait(60)
