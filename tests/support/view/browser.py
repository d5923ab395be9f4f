"""A page in headless Chromium: what it tells its console, what its script finds, its picture."""

from __future__ import annotations

import base64
import itertools
import json
import shutil
import subprocess
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from urllib.request import urlopen

PROGRAM = shutil.which("chromium") or shutil.which("google-chrome")

_FLAGS = (
    "--headless=new", "--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
    "--remote-debugging-port=0", "--no-first-run", "--host-resolver-rules=MAP * ~NOTFOUND",
)  # fmt: skip


class Page:
    """A page that has been opened; `console` are the errors that it has told so far."""

    def __init__(self, socket: Any) -> None:
        self._socket, self._numbers = socket, itertools.count(1)
        self.console: list[str] = []

    def ask(self, method: str, **given: Any) -> dict[str, Any]:
        number = next(self._numbers)
        self._socket.send(json.dumps({"id": number, "method": method, "params": given}))
        while True:
            answer = json.loads(self._socket.recv(timeout=60))
            self._note(answer)
            if answer.get("id") == number:
                return dict(answer.get("result", {}))

    def _note(self, answer: dict[str, Any]) -> None:
        said = answer.get("params", {})
        if answer.get("method") == "Runtime.exceptionThrown":
            self.console.append(str(said["exceptionDetails"]))
        if answer.get("method") == "Runtime.consoleAPICalled" and said.get("type") == "error":
            self.console.append(str(said["args"]))

    def value(self, expression: str) -> Any:
        """What an expression of JavaScript is."""
        answer = self.ask("Runtime.evaluate", expression=expression, returnByValue=True)
        return answer["result"].get("value")

    def wait(self, expression: str, seconds: float = 60.0) -> Any:
        """The first value of an expression that counts as true; None if there is none in time."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            found = self.value(expression)
            if found:
                return found
            time.sleep(0.1)
        return None

    def wait_for_picture(self, fits: Callable[[bytes], bool], seconds: float = 60.0) -> bool:
        """Whether a picture of the page fits within some seconds."""
        end = time.monotonic() + seconds
        while not fits(self.picture()):
            if time.monotonic() > end:
                return False
            time.sleep(0.3)
        return True

    def picture(self) -> bytes:
        """A PNG of what is seen."""
        return base64.b64decode(self.ask("Page.captureScreenshot", format="png")["data"])


@contextmanager
def open_page(path: Path, size: tuple[int, int] = (900, 600), dark: bool = False) -> Iterator[Page]:
    """The file in a browser that finds no network."""
    from websockets.sync.client import connect

    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:  # others still write
        program = subprocess.Popen(
            [str(PROGRAM), *_FLAGS, f"--user-data-dir={profile}",
             f"--window-size={size[0]},{size[1]}", "about:blank"],
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        )  # fmt: skip
        try:
            with connect(_address(Path(profile)), max_size=None) as socket:
                page = Page(socket)
                for domain in ("Page", "Runtime"):
                    page.ask(f"{domain}.enable")
                if dark:
                    scheme = [{"name": "prefers-color-scheme", "value": "dark"}]
                    page.ask("Emulation.setEmulatedMedia", features=scheme)
                page.ask("Page.navigate", url=path.absolute().as_uri())
                yield page
        finally:
            program.kill()
            program.wait()


def _address(profile: Path) -> str:
    """Where the browser listens for its first page."""
    port_file = profile / "DevToolsActivePort"
    for _ in range(600):
        if port_file.is_file() and len(port_file.read_text().splitlines()) >= 2:
            port = int(port_file.read_text().splitlines()[0])
            with urlopen(f"http://127.0.0.1:{port}/json/list") as answer:
                pages = [one for one in json.load(answer) if one["type"] == "page"]
            if pages:
                return str(pages[0]["webSocketDebuggerUrl"])
        time.sleep(0.1)
    raise RuntimeError("Chromium did not start within a minute")
