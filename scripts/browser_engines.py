"""Firefox and WebKitGTK, driven by their own protocols: no driver program of anyone else's, no download."""

import base64
import json
import os
import re
import shutil
import socket
import subprocess
import tempfile
import time
import urllib.error
import urllib.request
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Protocol

import click
from websockets.sync.client import ClientConnection, connect

WIDTH, HEIGHT = 1280, 720
HANG_S = 120.0
"""How long to wait for what must come, without a graphics card."""
_PREFERENCES = {
    "webgl.force-enabled": True,
    "webgl.disable-fail-if-major-performance-caveat": True,
    "browser.shell.checkDefaultBrowser": False,
    "browser.startup.homepage_override.mstone": "ignore",
    "browser.aboutwelcome.enabled": False,
    "datareporting.policy.dataSubmissionEnabled": False,
    "datareporting.healthreport.uploadEnabled": False,
    "toolkit.telemetry.enabled": False,
    "app.normandy.enabled": False,
    "app.update.enabled": False,
    "extensions.getAddons.cache.enabled": False,
    "network.captive-portal-service.enabled": False,
    "network.connectivity-service.enabled": False,
    "remote.active-protocols": 1,
}
_MINI_BROWSERS = ("webkit2gtk-4.1", "webkitgtk-6.0", "webkit2gtk-4.0")


class Engine(Protocol):
    """A browser with one page."""

    name: str
    complaints: list[str]
    """Errors of the console, where the driver tells them."""

    def open(self, url: str) -> None:
        """Go there."""

    def ask(self, expression: str) -> Any:
        """Return the value of a JavaScript expression, awaited."""

    def screenshot(self) -> bytes:
        """Return a PNG of the page."""


class Firefox:
    """Firefox by WebDriver BiDi, over its own socket: no driver program in between."""

    def __init__(self, link: ClientConnection) -> None:
        self.name = "Firefox"
        self.complaints: list[str] = []
        self._link = link
        self._asked = 0
        told = self._call("session.new", capabilities={})
        self.name = f"Firefox {told['capabilities']['browserVersion']}"
        (context,) = self._call("browsingContext.getTree")["contexts"]
        self._context = context["context"]
        self._call("session.subscribe", events=["log.entryAdded"])
        viewport = {"width": WIDTH, "height": HEIGHT}
        self._call("browsingContext.setViewport", context=self._context, viewport=viewport)

    def open(self, url: str) -> None:
        """Go there."""
        self._call("browsingContext.navigate", context=self._context, url=url, wait="complete")

    def ask(self, expression: str) -> Any:
        """Return the value of a JavaScript expression, awaited."""
        script = f"(async () => JSON.stringify((await ({expression})) ?? null))()"
        told = self._call("script.evaluate", expression=script, target={"context": self._context}, awaitPromise=True)
        if told["type"] != "success":
            raise AssertionError(f"{expression}: {told['exceptionDetails']['text']}")
        return json.loads(told["result"]["value"])

    def screenshot(self) -> bytes:
        """Return a PNG of the page."""
        return base64.b64decode(self._call("browsingContext.captureScreenshot", context=self._context)["data"])

    def _call(self, method: str, **params: Any) -> dict[str, Any]:
        self._asked += 1
        self._link.send(json.dumps({"id": self._asked, "method": method, "params": params}))
        while True:
            message = json.loads(self._link.recv(timeout=HANG_S))
            if message.get("method") == "log.entryAdded":
                entry = message["params"]
                if entry["level"] in ("error", "warn"):
                    self.complaints.append(f"{entry['level']}: {entry['text']}")
            if message.get("id") != self._asked:
                continue
            if message["type"] == "error":
                raise AssertionError(f"{method}: {message['message']}")
            result: dict[str, Any] = message["result"]
            return result


class WebKit:
    """WebKitGTK's MiniBrowser by WebDriver, whose console is not told."""

    def __init__(self, address: str, browser: Path) -> None:
        self.complaints: list[str] = []
        self._address = address
        options = {"binary": str(browser), "args": ["--automation"]}
        told = self._post("/session", capabilities={"alwaysMatch": {"webkitgtk:browserOptions": options}})
        self._session = f"/session/{told['sessionId']}"
        self.name = f"WebKitGTK {told['capabilities'].get('browserVersion', '')}".strip()
        self._post(f"{self._session}/window/rect", x=0, y=0, width=WIDTH, height=HEIGHT)
        self._post(f"{self._session}/timeouts", script=int(HANG_S * 1000), pageLoad=int(HANG_S * 1000))

    def open(self, url: str) -> None:
        """Go there."""
        self._post(f"{self._session}/url", url=url)

    def ask(self, expression: str) -> Any:
        """Return the value of a JavaScript expression, awaited."""
        script = (
            "const done = arguments[arguments.length - 1];"
            f"(async () => JSON.stringify((await ({expression})) ?? null))()"
            ".then(done, (error) => done('!' + error));"
        )
        text = self._post(f"{self._session}/execute/async", script=script, args=[])
        if text.startswith("!"):
            raise AssertionError(f"{expression}: {text[1:]}")
        return json.loads(text)

    def screenshot(self) -> bytes:
        """Return a PNG of the page."""
        return base64.b64decode(self._send("GET", f"{self._session}/screenshot", None))

    def close(self) -> None:
        """End the session, and with it the browser."""
        self._send("DELETE", self._session, None)

    def _post(self, path: str, **params: Any) -> Any:
        return self._send("POST", path, json.dumps(params).encode())

    def _send(self, method: str, path: str, data: bytes | None) -> Any:
        request = urllib.request.Request(self._address + path, data=data, method=method)
        request.add_header("Content-Type", "application/json")
        try:
            with urllib.request.urlopen(request, timeout=HANG_S) as answer:
                return json.load(answer)["value"]
        except urllib.error.HTTPError as error:
            raise AssertionError(f"{path}: {error.read().decode(errors='replace')[:400]}") from error


@contextmanager
def firefox(environment: Mapping[str, str]) -> Iterator[Engine | None]:
    """Give a Firefox with a profile of its own; None where there is none.

    Not `--headless`: that one has no WebGL without a graphics card.
    """
    program = shutil.which("firefox-esr") or shutil.which("firefox")
    if program is None:
        yield None
        return
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
        lines = (f'user_pref("{name}", {json.dumps(value)});' for name, value in _PREFERENCES.items())
        (Path(profile) / "user.js").write_text("\n".join(lines), encoding="utf-8")
        command = [program, "--no-remote", "--profile", profile, "--remote-debugging-port", "0"]
        with (
            started(command, r"WebDriver BiDi listening on (ws://\S+)", environment) as address,
            connect(f"{address}/session", max_size=None, compression=None) as link,
        ):
            yield Firefox(link)


@contextmanager
def webkit(environment: Mapping[str, str]) -> Iterator[Engine | None]:
    """Give WebKitGTK's MiniBrowser; None where there is none."""
    driver = shutil.which("WebKitWebDriver")
    found = [path for each in _MINI_BROWSERS for path in Path("/usr/lib").glob(f"*/{each}/MiniBrowser")]
    if driver is None or not found:
        yield None
        return
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as home:
        own = dict.fromkeys(("XDG_CACHE_HOME", "XDG_DATA_HOME", "XDG_CONFIG_HOME"), home)
        port = free_port()
        command = [driver, f"--port={port}"]
        process = subprocess.Popen(command, env={**environment, **own}, stdout=subprocess.DEVNULL)
        try:
            wait_for_port(port)
            engine = WebKit(f"http://127.0.0.1:{port}", found[0])
            yield engine
            engine.close()
        finally:
            end(process)


@contextmanager
def screen() -> Iterator[Mapping[str, str]]:
    """Give the environment of programs whose windows are on a screen in memory."""
    program = shutil.which("Xvfb")
    if program is None:
        raise click.ClickException("there is no Xvfb here: apt-get install xvfb")
    command = [program, "-displayfd", "1", "-screen", "0", "1600x1000x24"]
    with started(command, r"^(\d+)$", os.environ) as number:
        yield {**os.environ, "DISPLAY": f":{number}", "GDK_BACKEND": "x11", "LIBGL_ALWAYS_SOFTWARE": "1"}


@contextmanager
def started(command: list[str], says: str, environment: Mapping[str, str]) -> Iterator[str]:
    """Start a program, give what it says that matches, and end it afterwards."""
    with tempfile.TemporaryFile("w+", encoding="utf-8") as log:
        known = {**environment, "PYTHONUNBUFFERED": "1"}
        process = subprocess.Popen(command, stdout=log, stderr=subprocess.STDOUT, env=known)
        try:
            deadline = time.monotonic() + HANG_S
            while True:
                log.seek(0)
                text = log.read()
                if match := re.search(says, text, re.MULTILINE):
                    break
                if process.poll() is not None or time.monotonic() > deadline:
                    raise click.ClickException(f"{command[0]} has not started:\n{text[-2000:]}")
                time.sleep(0.2)
            yield match[1]
        finally:
            end(process)


def end(process: "subprocess.Popen[Any]") -> None:
    """End a program, by force when it does not."""
    process.terminate()
    try:
        process.wait(10.0)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()


def free_port() -> int:
    """Return a port that nobody listens on."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        port: int = server.getsockname()[1]
        return port


def wait_for_port(port: int) -> None:
    """Wait until somebody listens there."""
    deadline = time.monotonic() + HANG_S
    while time.monotonic() < deadline:
        try:
            socket.create_connection(("127.0.0.1", port), timeout=1.0).close()
            return
        except OSError:
            time.sleep(0.1)
    raise click.ClickException(f"nothing listens on port {port}")
