"""A real browser on the real page: Debian's chromium, driven by playwright, against `sidestep live` as a process.

Runs where SIDESTEP_BROWSER is set (`make test-browser` does so); pictures and measurements go to results/browser.
"""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
import urllib.request
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
RESULTS = ROOT / "results" / "browser"


def pytest_ignore_collect(collection_path, config):
    """Nothing here is even imported where no browser is wanted."""
    return True if "SIDESTEP_BROWSER" not in os.environ and collection_path.name.startswith("test_") else None


class Server:
    """`sidestep live` as its users start it."""

    def __init__(self, *arguments):
        command = [sys.executable, "-m", "sidestep", "live", "--port", "0", "--no-show", *map(str, arguments)]
        environment = {k: v for k, v in os.environ.items() if not k.startswith("PYTEST")} | {"NUMBA_NUM_THREADS": "1"}
        self.process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True, env=environment)
        self.said = ""
        for line in self.process.stderr:
            self.said += line
            found = re.search(r"http://\S+", line)
            if found:
                self.address = found.group()
                return
        self.process.communicate()
        raise AssertionError(f"the server did not start:\n{self.said}")

    def state(self):
        with urllib.request.urlopen(f"{self.address}/live/state", timeout=20) as answer:
            return json.load(answer)

    def stop(self):
        self.process.terminate()
        rest = self.process.communicate(timeout=30)[1]
        return self.said + rest


@pytest.fixture(scope="session")
def server():
    running = Server()
    yield running
    said = running.stop()
    assert "Traceback" not in said, said


@pytest.fixture(scope="session")
def browser():
    path = shutil.which("chromium")
    if path is None:
        pytest.skip("no chromium: run tools/install-browser.sh as root")
    from playwright.sync_api import sync_playwright

    with sync_playwright() as driver:
        running = driver.chromium.launch(executable_path=path, args=["--no-sandbox"])
        yield running
        running.close()


class Visit:
    """One tab, and what the page itself says of the world in it."""

    def __init__(self, context, address):
        self.problems = []
        self.requests = []
        self.page = context.new_page()
        self.page.on("pageerror", lambda error: self.problems.append(str(error)))
        self.page.on("console", self._heard)
        self.page.on("request", lambda request: self.requests.append(request.url))
        self.page.goto(address)
        self.page.wait_for_function("window.sidestep && window.sidestep.latest", timeout=120_000)

    def _heard(self, message):
        if message.type == "error":
            self.problems.append(message.text)

    def panel(self, index=0):
        return self.page.evaluate("i => window.sidestep.latest.panels[i]", index)

    def panels(self):
        """All panels of one and the same message."""
        return self.page.evaluate("window.sidestep.latest.panels")

    def time(self):
        return self.page.evaluate("window.sidestep.latest.time")

    def charts(self, panel=0):
        return self.page.evaluate("i => window.sidestep.charts.series[i]", panel)

    def until(self, condition, seconds=60):
        """Wait for a condition on the latest frame `f` and its first panel `p`."""
        self.page.wait_for_function(
            f"() => {{ const f = window.sidestep.latest, p = f.panels[0]; return {condition}; }}",
            timeout=1000 * seconds,
            polling=20,
        )

    def on_screen(self, x, y, panel=0):
        """Page coordinates of a place in the world."""
        u, v = self.page.evaluate("([i, x, y]) => window.sidestep.scene.views[i].view.point(x, y)", [panel, x, y])
        box = self.page.locator("#scene").bounding_box()
        return box["x"] + u, box["y"] + v

    def picture(self, name):
        RESULTS.mkdir(parents=True, exist_ok=True)
        self.page.screenshot(path=RESULTS / f"{name}.png")

    def report(self):
        return self.page.evaluate("window.sidestep.measure.report()")


@pytest.fixture
def visit(browser, server):
    """Open a tab: visit(width=…, height=…, scheme="dark", touch=True)."""
    contexts, visits = [], []

    def open_tab(*, address=None, width=1360, height=850, scheme="light", touch=False, **more):
        context = browser.new_context(
            viewport={"width": width, "height": height},
            color_scheme=scheme,
            has_touch=touch,
            is_mobile=touch,
            device_scale_factor=2 if touch else 1,
            accept_downloads=True,
            **more,
        )
        contexts.append(context)
        visits.append(Visit(context, address or server.address))
        return visits[-1]

    yield open_tab
    for context in contexts:
        context.close()
    for tab in visits:
        assert tab.problems == []


@pytest.fixture(scope="session")
def measured():
    """Name → figures; written beside the pictures at the end, and printed."""
    figures = {}
    yield figures
    RESULTS.mkdir(parents=True, exist_ok=True)
    (RESULTS / "measured.json").write_text(json.dumps(figures, indent=1))
    for name, values in figures.items():
        print(f"\n{name}: " + ", ".join(f"{k} {v:.3g}" for k, v in values.items() if v is not None), end="")
