"""Headless Chromium for tests, driven through its DevTools pipe: no port, no network, no further package."""

from __future__ import annotations

import base64
import io
import json
import os
import select
import shutil
import subprocess
import tempfile
import time
from pathlib import Path
from types import TracebackType
from typing import Any

import numpy as np
import pytest
from PIL import Image

FLAGS = (
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--disable-extensions",
    "--enable-unsafe-swiftshader",
    # Every address is unreachable, so a page that needs the network cannot pass.
    "--proxy-server=127.0.0.1:9",
    "--host-resolver-rules=MAP * ~NOTFOUND",
    "--hide-scrollbars",
    "--remote-debugging-pipe",
)


NOT_FOUND = "Chromium not found"
INSTALL = "install the Debian package 'chromium'"
REQUIRED = "FESD_ROBOT_REQUIRE_BROWSER"
"""Variable of the environment that makes a missing browser a failure."""


def installed() -> str | None:
    """Return the browser's path; None without one."""
    return next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)


def chromium() -> str:
    """Return the browser's path; without one skip the test, or fail if a browser is required."""
    if path := installed():
        return path
    if os.environ.get(REQUIRED):
        pytest.fail(f"{NOT_FOUND}, and {REQUIRED} is set: {INSTALL}", pytrace=False)
    pytest.skip(NOT_FOUND)


class Browser:
    """One headless browser with one tab.

    Args:
        size: width and height of the tab in pixels.
        timeout: longest wait for one answer, s.
    """

    def __init__(self, size: tuple[int, int] = (1280, 720), timeout: float = 40.0) -> None:
        executable = chromium()
        self.timeout = timeout
        self.console: list[str] = []
        self.requests: list[str] = []
        self._profile = tempfile.TemporaryDirectory(prefix="chromium-", ignore_cleanup_errors=True)
        # Chromium reads commands from descriptor 3 and writes answers to descriptor 4.
        read_command, self._write = os.pipe()
        self._read, write_answer = os.pipe()
        command = [executable, *FLAGS, f"--user-data-dir={self._profile.name}", "about:blank"]
        redirected = f'exec "$@" 3<&{read_command} 4>&{write_answer}'
        self._process = subprocess.Popen(
            ["bash", "-c", redirected, "bash", *command],
            pass_fds=(read_command, write_answer),
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        os.close(read_command)
        os.close(write_answer)
        self._buffer = b""
        self._count = 0
        self._session: str | None = None
        target = self.call("Target.createTarget", url="about:blank")["targetId"]
        self._session = self.call("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Log", "Network"):
            self.call(f"{domain}.enable")
        self.resize(*size)

    def __enter__(self) -> Browser:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, traceback: TracebackType | None
    ) -> None:
        os.close(self._write)
        try:
            self._process.wait(timeout=5)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        os.close(self._read)
        self._profile.cleanup()

    def call(self, method: str, **parameters: Any) -> dict[str, Any]:
        """Send one DevTools command and return its result; events that arrive meanwhile are kept."""
        self._count += 1
        message: dict[str, Any] = {"id": self._count, "method": method, "params": parameters}
        if self._session is not None:
            message["sessionId"] = self._session
        os.write(self._write, json.dumps(message).encode() + b"\0")
        deadline = time.monotonic() + self.timeout
        while True:
            answer = self._receive(deadline, method)
            if answer.get("id") == self._count:
                assert "error" not in answer, f"{method}: {answer['error']}"
                result: dict[str, Any] = answer["result"]
                return result
            self._note(answer)

    def _receive(self, deadline: float, waiting_for: str) -> dict[str, Any]:
        while b"\0" not in self._buffer:
            remaining = deadline - time.monotonic()
            assert remaining > 0, f"Chromium did not answer {waiting_for} within {self.timeout} s"
            if select.select([self._read], [], [], remaining)[0]:
                part = os.read(self._read, 1 << 20)
                assert part, f"Chromium ended (code {self._process.poll()}) while {waiting_for} was waiting"
                self._buffer += part
        line, self._buffer = self._buffer.split(b"\0", 1)
        answer: dict[str, Any] = json.loads(line)
        return answer

    def _note(self, event: dict[str, Any]) -> None:
        parameters = event.get("params", {})
        if event.get("method") == "Runtime.consoleAPICalled" and parameters["type"] in ("error", "warning", "assert"):
            texts = [str(entry.get("value", entry.get("description"))) for entry in parameters["args"]]
            self.console.append(f"{parameters['type']}: {' '.join(texts)}")
        elif event.get("method") == "Runtime.exceptionThrown":
            details = parameters["exceptionDetails"]
            self.console.append(f"exception: {details.get('exception', {}).get('description', details['text'])}")
        elif event.get("method") == "Log.entryAdded" and parameters["entry"]["level"] == "error":
            self.console.append(f"log: {parameters['entry']['text']} {parameters['entry'].get('url', '')}")
        elif event.get("method") == "Network.requestWillBeSent":
            self.requests.append(parameters["request"]["url"])

    def resize(self, width: int, height: int) -> None:
        """Give the tab a size in pixels."""
        self.call("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=False)

    def open(self, page: Path, fragment: str = "") -> None:
        """Load a page from disk and wait until its scene stands."""
        # Coming from another page, a new fragment makes the browser load the page anew.
        self.call("Page.navigate", url="about:blank")
        self.call("Page.navigate", url=page.resolve().as_uri() + fragment)
        deadline = time.monotonic() + self.timeout
        while not self.run("document.readyState === 'complete' && Boolean(window.fesdRobot)"):
            assert time.monotonic() < deadline, f"{page} did not load"
            time.sleep(0.02)
        self.run("fesdRobot.ready.then(() => true)")

    def run(self, expression: str) -> Any:
        """Evaluate JavaScript, wait for a promise, and return its value."""
        answer = self.call("Runtime.evaluate", expression=expression, awaitPromise=True, returnByValue=True)
        assert "exceptionDetails" not in answer, f"{expression}: {answer['exceptionDetails']}"
        return answer["result"].get("value")

    def press(self, key: str, code: str) -> None:
        """Press and release one key, e.g. ``press("ArrowRight", "ArrowRight")``."""
        for kind in ("keyDown", "keyUp"):
            self.call("Input.dispatchKeyEvent", type=kind, key=key, code=code)

    def screenshot(self) -> np.ndarray:
        """Return the tab's pixels after the next frame, uint8, shape (height, width, 3)."""
        self.run("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => done(true))))")
        data = base64.b64decode(self.call("Page.captureScreenshot", format="png")["data"])
        return np.asarray(Image.open(io.BytesIO(data)).convert("RGB"))
