"""Firefox driven over Marionette, the protocol that it speaks by itself: Debian has no geckodriver.

What: a message is ``length:JSON``; a command is ``[0, id, name, parameters]``, its answer ``[1, id, error, result]``.
The class offers what tests use of a Selenium driver, under the same names.
"""

from __future__ import annotations

import base64
import itertools
import json
import socket
import subprocess
import time
from pathlib import Path
from typing import Any

PREFERENCES = {
    "marionette.port": 0,  # any free one; written to a file of the profile
    "app.normandy.enabled": False,
    "app.update.disabledForTesting": True,
    "browser.shell.checkDefaultBrowser": False,
    "datareporting.policy.dataSubmissionEnabled": False,
    "media.autoplay.default": 0,
    "media.gmp-manager.updateEnabled": False,  # no codec is fetched: FFmpeg's decodes
    "network.captive-portal-service.enabled": False,
    "network.connectivity-service.enabled": False,
    "services.settings.server": "data:,",
    "toolkit.telemetry.enabled": False,
}
STARTS_WITHIN = 60  # s
ANSWERS_WITHIN = 150  # s


class MarionetteError(Exception):
    """A command that Firefox refused."""


class Firefox:
    """A running Firefox with a new profile in the folder given, and preferences beside `PREFERENCES`."""

    def __init__(
        self,
        program: str,
        profile: Path,
        size: tuple[int, int],
        environment: dict[str, str],
        preferences: dict[str, Any],
    ) -> None:
        profile.mkdir(parents=True, exist_ok=True)
        lines = [
            f"user_pref({json.dumps(name)}, {json.dumps(value)});\n" for name, value in (PREFERENCES | preferences).items()
        ]
        (profile / "user.js").write_text("".join(lines))
        command = [program, "--marionette", "--no-remote", "--profile", str(profile)]
        command += ["--width", str(size[0]), "--height", str(size[1])]
        self._process = subprocess.Popen(command, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        self._numbers = itertools.count()
        try:
            self._socket = self._connect(profile / "MarionetteActivePort")
            self._stream = self._socket.makefile("rb")
            self._receive()  # its greeting
            self._call("NewSession", capabilities={"alwaysMatch": {"pageLoadStrategy": "normal"}})
        except BaseException:
            self._process.kill()
            raise

    def get(self, address: str) -> None:
        """Open a page, and wait until it has loaded."""
        self._call("Navigate", url=address)

    def execute_script(self, script: str, *arguments: Any) -> Any:
        """What a script returns."""
        return self._call("ExecuteScript", script=script, args=list(arguments), sandbox=None)["value"]

    def execute_async_script(self, script: str, *arguments: Any) -> Any:
        """What a script gives to the function that is its last argument."""
        return self._call("ExecuteAsyncScript", script=script, args=list(arguments), sandbox=None)["value"]

    def set_script_timeout(self, seconds: float) -> None:
        """How long a script may run."""
        self._call("SetTimeouts", script=round(1000 * seconds))

    def get_screenshot_as_png(self) -> bytes:
        """The page as a PNG file."""
        return base64.b64decode(self._call("TakeScreenshot", full=False)["value"])

    def quit(self) -> None:
        """End the browser."""
        try:
            self._call("DeleteSession")
            self._stream.close()
            self._socket.close()
        finally:
            self._process.terminate()
            try:
                self._process.wait(20)
            except subprocess.TimeoutExpired:
                self._process.kill()

    def _connect(self, port_file: Path) -> socket.socket:
        end = time.monotonic() + STARTS_WITHIN
        while time.monotonic() < end and self._process.poll() is None:
            text = port_file.read_text() if port_file.exists() else ""
            if text.isdigit():
                try:
                    return socket.create_connection(("127.0.0.1", int(text)), ANSWERS_WITHIN)
                except OSError:
                    pass
            time.sleep(0.1)
        raise MarionetteError("Firefox does not start")

    def _call(self, name: str, **parameters: Any) -> Any:
        number = next(self._numbers)
        message = json.dumps([0, number, f"WebDriver:{name}", parameters]).encode()
        self._socket.sendall(b"%d:%s" % (len(message), message))
        _, answered, error, result = self._receive()
        if error or answered != number:
            raise MarionetteError(f"{name}: {error}")
        return result

    def _receive(self) -> Any:
        digits = b""
        while not digits.endswith(b":"):
            byte = self._stream.read(1)
            if not byte:
                raise MarionetteError("Firefox has ended")
            digits += byte
        return json.loads(self._stream.read(int(digits[:-1])))
