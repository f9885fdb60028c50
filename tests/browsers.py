"""The browsers that tests drive, without a screen, and a server for the pages that they open.

Chromium and WebKitGTK are driven by their WebDrivers, Firefox by `marionette`. All but Chromium need an X
display, which Xvfb is: without one, Firefox has no WebGL.
"""

from __future__ import annotations

import contextlib
import functools
import http.server
import os
import shutil
import subprocess
import threading
import time
import warnings
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from marionette import Firefox

CHROMIUM_FLAGS = [
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--enable-unsafe-swiftshader",  # WebGL on the processor
    "--disable-dev-shm-usage",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
]
NEEDS = {"chromium": ("chromium", "chromedriver"), "firefox": ("firefox-esr", "Xvfb"), "webkit": ("WebKitWebDriver", "Xvfb")}
PACKAGES = {
    "chromium": "chromium chromium-driver",
    "firefox": "firefox-esr xvfb",
    "webkit": "webkit2gtk-driver gstreamer1.0-libav gstreamer1.0-plugins-good gstreamer1.0-plugins-bad xvfb",
}
NO_FFMPEG = {"media.ffmpeg.enabled": False, "media.rdd-ffmpeg.enabled": False, "media.gmp-gmpopenh264.enabled": False}
NO_GSTREAMER_DECODERS = {"GST_PLUGIN_FEATURE_RANK": "avdec_h264:NONE,openh264dec:NONE,vah264dec:NONE,vaapih264dec:NONE"}
# Kernels stay in WebKit's interpreter. Its compilers stop other threads by signals; on Linux, compiled kernels then lose values
# now and then. In WebKitGTK 2.50, 1 of 100 loads failed like that.
INTERPRETED = {
    f"JSC_thresholdFor{tier}Optimize{when}": "1000000000" for tier in ("BBQ", "OMG") for when in ("AfterWarmUp", "Soon")
}
MINI_BROWSERS = "*/webkit2gtk-4.1/MiniBrowser"  # below /usr/lib
SCRIPT_SECONDS = 120


def missing(name: str = "chromium") -> str:
    """Why a browser of `NEEDS` cannot be driven, "" if it can."""
    if find_spec("selenium") is None and name != "firefox":
        return "no selenium; pip install -e '.[dev]'"
    absent = [need for need in NEEDS[name] if _program(need) is None]
    if name == "webkit" and not _mini_browser():
        absent.append("MiniBrowser")
    return f"no {' and no '.join(absent)}; on Debian: apt-get install {PACKAGES[name]}" if absent else ""


@contextlib.contextmanager
def sound_server(folder: Path) -> Iterator[dict[str, str]]:
    """Environment variables that let Firefox play sound which nobody hears; none without PulseAudio."""
    program = shutil.which("pulseaudio")
    if program is None:
        yield {}
        return
    socket = folder / "pulse"
    modules = ["--load=module-null-sink", f"--load=module-native-protocol-unix auth-anonymous=1 socket={socket}"]
    options = ["-n", "--daemonize=no", "--use-pid-file=no", "--exit-idle-time=-1", "--disallow-exit", *modules]
    home = {**os.environ, "HOME": str(folder), "XDG_RUNTIME_DIR": str(folder), "PULSE_RUNTIME_PATH": str(folder)}
    process = subprocess.Popen([program, *options], env=home, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        for _ in range(100):
            if socket.exists():
                break
            time.sleep(0.05)
        yield {"PULSE_SERVER": f"unix:{socket}"}
    finally:
        process.terminate()
        process.wait()


@contextlib.contextmanager
def browser(
    name: str,
    profile: Path,
    size: tuple[int, int] = (700, 700),
    h264: bool = True,
    compiles: bool = False,
    more: dict[str, str] | None = None,
) -> Iterator[Any]:
    """A running browser of `NEEDS` with a new profile in the folder given: a Selenium driver, or what `Firefox` has of one.

    Args:
        size: of its window, pixels.
        h264: whether it may decode H.264; all but Chromium can do without.
        more: environment variables, such as those of a `sound_server`; not for Chromium.
        compiles: whether WebKit may compile WebAssembly, for measures of time.
    """
    with contextlib.nullcontext("") if name == "chromium" else _display(size) as display:
        environment = {**os.environ, "DISPLAY": display, **(more or {})}
        if name == "chromium":
            driver = _chromium(profile, size)
        elif name == "firefox":
            driver = Firefox(str(_program("firefox-esr")), profile, size, environment, {} if h264 else NO_FFMPEG)
        else:
            special = ({} if h264 else NO_GSTREAMER_DECODERS) | ({} if compiles else INTERPRETED)
            driver = _webkit(profile, size, environment | special)
        try:
            driver.set_script_timeout(SCRIPT_SECONDS)
            yield driver
        finally:
            driver.quit()


def _chromium(profile: Path, size: tuple[int, int]) -> Any:
    from selenium import webdriver
    from selenium.webdriver.chrome.service import Service

    options = webdriver.ChromeOptions()
    options.binary_location = str(_program("chromium"))
    for flag in (*CHROMIUM_FLAGS, f"--user-data-dir={profile}", f"--window-size={size[0]},{size[1]}"):
        options.add_argument(flag)
    return webdriver.Chrome(options=options, service=Service(str(_program("chromedriver"))))


def _webkit(profile: Path, size: tuple[int, int], environment: dict[str, str]) -> Any:
    from selenium import webdriver
    from selenium.webdriver.webkitgtk.service import Service

    options = webdriver.WebKitGTKOptions()
    options.binary_location = _mini_browser()
    options.add_argument("--automation")
    home = {"HOME": str(profile), "XDG_RUNTIME_DIR": str(profile)}
    service = Service(str(_program("WebKitWebDriver")), env={**environment, **home})
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)  # Selenium's own: it calls itself in an old way
        driver = webdriver.WebKitGTK(options=options, service=service)
    driver.set_window_size(*size)
    return driver


@contextlib.contextmanager
def _display(size: tuple[int, int]) -> Iterator[str]:
    """An X display on no screen, a little larger than a window of that size."""
    reading, writing = os.pipe()
    screen = f"{size[0] + 200}x{size[1] + 300}x24"
    command = ["Xvfb", "-displayfd", str(writing), "-screen", "0", screen, "-nolisten", "tcp"]
    process = subprocess.Popen(command, pass_fds=[writing], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    os.close(writing)
    try:
        with os.fdopen(reading) as numbers:
            yield f":{numbers.readline().strip()}"  # waits until it is there
    finally:
        process.terminate()
        process.wait()


def _program(name: str) -> str | None:
    return shutil.which(name) or (shutil.which("firefox") if name == "firefox-esr" else None)


def _mini_browser() -> str:
    return str(next(Path("/usr/lib").glob(MINI_BROWSERS), ""))


@contextlib.contextmanager
def served(folder: Path) -> Iterator[str]:
    """The address under which the files of a folder are served."""
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(_Quiet, directory=str(folder)))
    thread = threading.Thread(target=server.serve_forever)
    thread.start()
    try:
        yield f"http://127.0.0.1:{server.server_port}"
    finally:
        server.shutdown()
        thread.join()
        server.server_close()


class _Quiet(http.server.SimpleHTTPRequestHandler):
    extensions_map = {**http.server.SimpleHTTPRequestHandler.extensions_map, ".js": "text/javascript"}  # noqa: RUF012

    def end_headers(self) -> None:
        """Keep the browser from answering from its cache: tests write one name many times."""
        self.send_header("Cache-Control", "no-store")
        super().end_headers()

    def log_message(self, *arguments: object) -> None:
        """Say nothing."""
