"""A headless chromium, driven over a pipe of its debugging protocol: no port is opened.

Tests of pages use it, and the scripts that photograph the player for the documents and that measure it.
"""

import base64
import json
import os
import select
import subprocess
import tempfile
import time
from pathlib import Path
from typing import Any, Self

import pytest

from programs import program

needs_chromium = pytest.mark.needs("chromium")

_PATIENCE = 120.0
"""The limit of an answer in seconds."""

_KEYS = {" ": ("Space", 32), "Tab": ("Tab", 9), "Enter": ("Enter", 13), "Escape": ("Escape", 27)}
_KEYS |= {"ArrowLeft": ("ArrowLeft", 37), "ArrowUp": ("ArrowUp", 38), "ArrowRight": ("ArrowRight", 39)}
_KEYS |= {"ArrowDown": ("ArrowDown", 40), "Home": ("Home", 36), "End": ("End", 35)}
_KEYS |= {"PageUp": ("PageUp", 33), "PageDown": ("PageDown", 34)}
_TEXT = {"Enter": "\r"}
SHIFT = 8


class Browser:
    """A browser with one page in it, closed at the end of a ``with``. ``events`` are all its events."""

    def __init__(
        self, width: int = 1280, height: int = 800, *, dark: bool = False, still: bool = True
    ) -> None:
        """Starts one with a window of a size in pixels; ``dark`` as a reader's system may be. A page does not
        begin to play by itself where motion is unwanted (``still``)."""
        chromium = program("chromium")
        self._folder = tempfile.TemporaryDirectory(ignore_cleanup_errors=True)
        to_it, ours = os.pipe()
        theirs, from_it = os.pipe()

        def connect() -> None:
            os.dup2(to_it, 103)  # first to other numbers: either may be 3 or 4 already
            os.dup2(from_it, 104)
            os.dup2(103, 3)
            os.dup2(104, 4)

        options = ["--headless=new", "--no-sandbox", "--disable-gpu", "--hide-scrollbars"]
        options += ["--remote-debugging-pipe", "--no-first-run", "--disable-background-networking"]
        options += ["--disable-component-update", "--disable-sync", "--disable-quic"]
        options += ["--force-prefers-reduced-motion"] if still else []
        self.process = subprocess.Popen(
            [chromium, *options, f"--user-data-dir={self._folder.name}", "about:blank"],
            close_fds=False,
            preexec_fn=connect,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        os.close(to_it)
        os.close(from_it)
        self._write, self._read = ours, theirs
        self.events: list[dict[str, Any]] = []
        self._number, self._left = 0, b""
        self._session: str | None = None
        target = self.ask("Target.createTarget", url="about:blank")["targetId"]
        self._session = self.ask("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Log", "Network"):
            self.ask(f"{domain}.enable")
        size = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": width < 500}
        self.ask("Emulation.setDeviceMetricsOverride", **size)
        features = [{"name": "prefers-color-scheme", "value": "dark" if dark else "light"}]
        self.ask("Emulation.setEmulatedMedia", features=features)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.process.terminate()
        try:
            self.process.wait(10)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
        os.close(self._write)
        os.close(self._read)
        self._folder.cleanup()

    def ask(self, method: str, **params: Any) -> Any:
        """Sends a command of the protocol, and returns its result."""
        self._number += 1
        message: dict[str, Any] = {"id": self._number, "method": method, "params": params}
        if self._session:
            message["sessionId"] = self._session
        rest = json.dumps(message).encode() + b"\0"
        while rest:
            rest = rest[os.write(self._write, rest) :]
        while (found := self._next()).get("id") != self._number:
            self.events.append(found)
        assert "error" not in found, found
        return found["result"]

    def wait_for(self, method: str) -> None:
        """Reads until an event of a name has arrived since the last question."""
        while (found := self._next())["method"] != method:
            self.events.append(found)
        self.events.append(found)

    def _next(self) -> dict[str, Any]:
        """Returns the next message of the browser."""
        while b"\0" not in self._left:
            ready, _, _ = select.select([self._read], [], [], _PATIENCE)
            assert ready, f"the browser has said nothing for {_PATIENCE:g} s"
            read = os.read(self._read, 1 << 20)
            assert read, "the browser has gone"
            self._left += read
        text, _, self._left = self._left.partition(b"\0")
        found: dict[str, Any] = json.loads(text)
        return found

    def value(self, expression: str) -> Any:
        """Returns the value of an expression in the page, awaited if it is a promise."""
        found = self.ask("Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True)
        assert "exceptionDetails" not in found, found
        return found["result"].get("value")

    def visit(self, path: Path, query: str = "") -> None:
        """Opens any page from its file, with a query from "?" on, and waits until it is loaded."""
        self.ask("Page.navigate", url=path.resolve().as_uri() + query)
        while self.value("document.readyState") != "complete":
            time.sleep(0.01)

    def open(self, path: Path, link: str = "") -> None:
        """Opens a page of the player from its file, at a link from "#" on, and waits until it is there."""
        if link:  # a page that is open already would only go there
            self.visit(Path(os.devnull))
        self.ask("Page.navigate", url=path.resolve().as_uri() + link)
        if not any(each["method"] == "Page.loadEventFired" for each in self.events[-30:]):
            self.wait_for("Page.loadEventFired")
        # A saved copy of a page has the mark of a ready page from the start.
        end = time.monotonic() + 600.0
        while not self.value("window.kinetilePlayer && document.documentElement?.dataset.ready"):
            assert time.monotonic() < end, f"{path} is no page of the player: visit it"
            thrown = [each for each in self.said() if each["method"] == "Runtime.exceptionThrown"]
            assert not thrown, thrown
            time.sleep(0.01)

    def press(self, *keys: str, modifiers: int = 0) -> None:
        """Presses keys, one after the other, as a keyboard would."""
        for key in keys:
            code, number = _KEYS.get(key) or (f"Key{key.upper()}", ord(key.upper()) if key.isalnum() else 0)
            params = {"key": key, "code": code, "windowsVirtualKeyCode": number, "modifiers": modifiers}
            text = _TEXT.get(key, key if len(key) == 1 else "")
            self.ask("Input.dispatchKeyEvent", type="keyDown", **params, **({"text": text} if text else {}))
            self.ask("Input.dispatchKeyEvent", type="keyUp", **params)

    def click(self, x: float, y: float) -> None:
        """Moves the mouse to a place of the window, and clicks."""
        for kind in ("mouseMoved", "mousePressed", "mouseReleased"):
            self.ask("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", clickCount=1)
        self.settle()

    def settle(self) -> None:
        """Waits until the last change is on the screen: two frames."""
        for _ in range(2):
            self.value("new Promise((done) => requestAnimationFrame(() => done(true)))")

    def photograph(self, whole: bool = False) -> bytes:
        """Returns a picture of the window as PNG, or of the whole page."""
        self.settle()
        picture = self.ask("Page.captureScreenshot", format="png", captureBeyondViewport=whole)
        return base64.b64decode(picture["data"])

    def said(self) -> list[dict[str, Any]]:
        """Returns the messages of the console, and uncaught errors."""
        names = {"Log.entryAdded", "Runtime.consoleAPICalled", "Runtime.exceptionThrown"}
        return [each for each in self.events if each.get("method") in names]

    def asked_for(self) -> set[str]:
        """Returns the addresses that the page has requested."""
        sent = [each for each in self.events if each.get("method") == "Network.requestWillBeSent"]
        return {each["params"]["request"]["url"] for each in sent}
