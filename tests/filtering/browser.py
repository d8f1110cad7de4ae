"""Headless Chromium, driven through a pipe by the Chrome DevTools protocol.

https://chromedevtools.github.io/devtools-protocol/
"""

import base64
import json
import os
import shutil
import subprocess
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
"""Programs that understand the protocol."""
FLAGS = (
    *("--headless=new", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", "--mute-audio"),
    *("--no-first-run", "--disable-extensions", "--disable-background-networking"),
    *("--remote-debugging-pipe", "--hide-scrollbars", "--autoplay-policy=no-user-gesture-required"),
)
STORE = """(() => {
    const kept = new Map(Object.entries(ITEMS));
    const store = {
        getItem: (name) => kept.get(name) ?? null,
        setItem: (name, text) => kept.set(name, String(text)),
        items: () => Object.fromEntries(kept),
    };
    Object.defineProperty(window, "localStorage", { value: store, configurable: true });
})()"""
"""Gives a page a store that holds ITEMS."""
SETTINGS = ("PATH", "HOME", "LANG", "TMPDIR")
"""Variables of the environment that the browser gets."""
PATIENCE = 60.0
"""Longest wait for an answer [s]; a machine may be busy."""


def find_chromium() -> str | None:
    """Path of a browser, None where there is none."""
    return next(filter(None, map(shutil.which, NAMES)), None)


class Browser:
    """A browser with one tab; `other_tab` opens a second one for a while."""

    def __init__(self, process: subprocess.Popen[bytes], read: int, write: int) -> None:
        self._process, self._read, self._write = process, read, write
        self._buffer, self._count = b"", 0
        self._session: str | None = None
        self._context: str | None = None
        self.errors: list[str] = []
        self.forget()

    def forget(self) -> None:
        """Go on in a new tab, which knows nothing that pages of the former one have stored."""
        former = self._context
        self._context = self.send("Target.createBrowserContext")["browserContextId"]
        self._new_tab()
        if former:
            self.send("Target.disposeBrowserContext", browserContextId=former)

    @contextmanager
    def other_tab(self) -> Iterator[None]:
        """Go on in a second tab beside the first; it is closed with the block."""
        first = self._session
        target = self._new_tab()
        try:
            yield
        finally:
            self.send("Target.closeTarget", targetId=target)
            self._session = first

    def _new_tab(self) -> str:
        context = {"browserContextId": self._context}
        target = str(self.send("Target.createTarget", url="about:blank", **context)["targetId"])
        attached = self.send("Target.attachToTarget", targetId=target, flatten=True)
        self._session = attached["sessionId"]
        for domain in ("Page", "Runtime", "Log", "Network"):
            self.send(f"{domain}.enable")
        self.store({})
        return target

    def send(self, method: str, **parameters: Any) -> dict[str, Any]:
        """Call a method of the protocol, of the browser in the domain Target, else of the tab."""
        self._count += 1
        message = {"id": self._count, "method": method, "params": parameters}
        if not method.startswith("Target."):
            message["sessionId"] = self._session
        os.write(self._write, json.dumps(message).encode() + b"\0")
        while True:
            answer = self._next()
            if answer.get("id") == self._count:
                assert "error" not in answer, answer
                return dict(answer["result"])

    def open(self, path: Path) -> None:
        """Open a page and wait until its script has run and it has been drawn.

        What `content-visibility` leaves to be drawn when needed has no text before the first frame.
        """
        self.errors.clear()
        self.send("Page.navigate", url=path.resolve().as_uri())
        self._drawn()

    def reload(self) -> None:
        """Load the page again, with what it has stored."""
        self.store(self.stored())
        self.run("delete document.documentElement.dataset.ready")
        self.send("Page.reload")
        self._drawn()

    def store(self, items: Mapping[str, str]) -> None:
        """Give the next page of this tab a store that holds `items`.

        It stands in for Chromium's own, which late in a long run did not hand what one page had
        stored to the next. Scripts run in the order in which they were added; the last one counts.
        """
        source = STORE.replace("ITEMS", json.dumps(dict(items)))
        self.send("Page.addScriptToEvaluateOnNewDocument", source=source)

    def stored(self) -> dict[str, str]:
        """Return what is in the store of the page."""
        return dict(self.run("localStorage.items()"))

    def _drawn(self) -> None:
        self.wait("document.documentElement?.dataset.ready !== undefined")
        self.run("new Promise(drawn => requestAnimationFrame(() => requestAnimationFrame(drawn)))")

    def run(self, script: str) -> Any:
        """The value of a JavaScript expression."""
        found = self.send(
            "Runtime.evaluate", expression=script, returnByValue=True, awaitPromise=True
        )
        assert "exceptionDetails" not in found, found
        return found["result"].get("value")

    def wait(self, condition: str) -> None:
        """Wait until an expression is true."""
        self.until(lambda: bool(self.run(condition)), condition)

    def until(self, condition: Callable[[], bool], what: str) -> None:
        began = time.monotonic()
        while not condition():
            assert time.monotonic() - began < PATIENCE, f"never: {what}"
            time.sleep(0.05)

    def look(self, width: int, height: int, *, dark: bool = False) -> None:
        """Set the size of the window and the scheme of colours."""
        self.send(
            "Emulation.setDeviceMetricsOverride",
            **{"width": width, "height": height, "deviceScaleFactor": 1, "mobile": False},
        )
        scheme = {"name": "prefers-color-scheme", "value": "dark" if dark else "light"}
        self.send("Emulation.setEmulatedMedia", features=[scheme])

    def picture(self, path: Path) -> None:
        """Save what the window shows as PNG."""
        path.write_bytes(base64.b64decode(self.send("Page.captureScreenshot")["data"]))

    def _next(self) -> dict[str, Any]:
        while b"\0" not in self._buffer:
            part = os.read(self._read, 1 << 20)
            assert part, f"the browser ended with code {self._process.wait()}"
            self._buffer += part
        message, _, self._buffer = self._buffer.partition(b"\0")
        found = dict(json.loads(message))
        self._note(found.get("method"), found.get("params", {}))
        return found

    def _note(self, method: str | None, event: dict[str, Any]) -> None:
        if method == "Runtime.exceptionThrown":
            self.errors.append(json.dumps(event["exceptionDetails"]))
        elif method == "Runtime.consoleAPICalled" and event["type"] in ("error", "warning"):
            self.errors.append(json.dumps(event["args"]))
        elif method == "Log.entryAdded" and event["entry"]["level"] in ("error", "warning"):
            self.errors.append(json.dumps(event["entry"]))


@contextmanager
def browser(program: str, profile: Path) -> Iterator[Browser]:
    """A browser with a profile of its own; it ends with the block."""
    (child_in, write), (read, child_out) = os.pipe(), os.pipe()
    # The protocol's pipes are the descriptors 3 and 4. The browser gets nothing else that this
    # process has opened or that tests have set.
    process = subprocess.Popen(
        [
            *("bash", "-c", f'exec "$0" "$@" 3<&{child_in} 4>&{child_out}', program, *FLAGS),
            f"--user-data-dir={profile}",
        ],
        pass_fds=(child_in, child_out),
        env={name: os.environ[name] for name in SETTINGS if name in os.environ},
        cwd=profile,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    os.close(child_in)
    os.close(child_out)
    try:
        yield Browser(process, read, write)
    finally:
        os.close(write)
        os.close(read)
        process.terminate()
        process.wait()
