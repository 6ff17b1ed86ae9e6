"""A headless chromium, spoken to in its own protocol: enough to open a page, look at it, and hear its errors."""

import base64
import contextlib
import json
import subprocess
import time
import urllib.request

from websockets.sync.client import connect

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
            said = json.loads(self._socket.recv(timeout=120))
            self._hear(said)
            if said.get("id") == self._next:
                assert "error" not in said, said
                return said["result"]

    def evaluate(self, expression):
        return self.call("Runtime.evaluate", expression=expression, returnByValue=True)["result"].get("value")

    def wait_for(self, expression, timeout=60.0):
        deadline = time.monotonic() + timeout
        while time.monotonic() < deadline:
            if self.evaluate(expression):
                return
            time.sleep(0.2)
        raise AssertionError(
            f"never true: {expression}; the page says: {self.evaluate('document.body.innerText')!r}"
        )

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
def page(program, folder, url):
    """Open a page; `folder` holds the browser's profile."""
    process = subprocess.Popen(
        [program, *FLAGS, f"--user-data-dir={folder}", "about:blank"],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    try:
        place = folder / "DevToolsActivePort"
        deadline = time.monotonic() + 60.0
        while not (place.exists() and place.read_text().strip()):
            assert process.poll() is None, "chromium ended at once"
            assert time.monotonic() < deadline, "chromium did not start"
            time.sleep(0.1)
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
        process.wait(30)
