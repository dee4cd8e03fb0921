# SPDX-License-Identifier: Apache-2.0
"""Opens pages in headless Chromium, for tests of what they show."""

import atexit
import functools
import json
import os
import re
import shutil
import time
import unittest
from pathlib import Path
from typing import Any

WEB = Path(__file__).resolve().parents[1] / "hotpath_report" / "web"
AXE = WEB / "node_modules" / "axe-core" / "axe.min.js"
WAIT_S = 30
MISSING = "left out: {} is missing; install it with launch_scripts/setup.sh test"
# Moves along curves with the keyboard and reads the tooltip at each position.
READ_CURVES = """
const place = document.querySelector(arguments[0]), plot = place.querySelector('.plot'), found = [];
const press = (key) => plot.dispatchEvent(new KeyboardEvent('keydown', {key, bubbles: true}));
plot.focus();
press('Home');
for (let last = null; ;) {
  const tip = place.querySelector('.tip').innerText;
  if (tip === last) return found;
  for (const row of place.querySelectorAll('.tip tr'))
    found.push([Number(row.dataset.series), row.querySelector('th').innerText, Number(row.dataset.x), row.innerText]);
  last = tip;
  press('ArrowRight');
}
"""
READ_LIST = """
return {head: document.querySelector('.outputs [role=status]').innerText,
        rows: [...document.querySelectorAll('.outputs tbody tr')].map((r) => ({...r.dataset, text: r.innerText}))};
"""
CHOOSE_RANGE = """
const [from, to] = [document.getElementById('from-ms'), document.getElementById('to-ms')];
from.value = arguments[0]; to.value = arguments[1];
from.dispatchEvent(new Event('change'));
"""
CHOOSE = """
const choice = document.getElementById(arguments[0]);
choice.value = [...choice.options].find((o) => o.text === arguments[1]).value;
choice.dispatchEvent(new Event('change'));
"""
READ_ACCOUNTS = """
return [...document.querySelectorAll('.account')].map((a) => ({
  title: a.querySelector('h4').innerText, series: Number(a.dataset.series),
  causes: Object.fromEntries([...a.querySelectorAll('li')].map((l) => [l.dataset.cause, Number(l.dataset.ns)])),
  text: a.querySelector('ul').innerText,
  parts: [...a.querySelectorAll('tbody tr')].map((row) => [...row.cells].map((c) => c.textContent))}));
"""
READ_TIMELINE = """
const t = hotpathPage.timeline;
const panel = (p) => ({label: p.series.label, rows: p.rows.map((r) => r.name), shown: p.shown});
return {view: t.view, panels: t.panels.map(panel)};
"""


class Browser:
    """Chromium with a page of `hotpath report`. Logs requests and messages of the console."""

    def __init__(self, **options: Any) -> None:
        """`options`: as emulate(). Raises unittest.SkipTest if Chromium, its driver or selenium is missing."""
        try:
            from selenium import webdriver  # pylint: disable=import-outside-toplevel
            from selenium.webdriver.chrome.service import Service  # pylint: disable=import-outside-toplevel
        except ImportError:
            raise unittest.SkipTest(MISSING.format("python3-selenium")) from None
        driver = shutil.which("chromedriver")
        if driver is None or shutil.which("chromium") is None:
            raise unittest.SkipTest(MISSING.format("chromium-driver"))
        of_chrome = webdriver.ChromeOptions()
        words = ["--headless=new", "--disable-gpu", "--disable-dev-shm-usage", "--hide-scrollbars"]
        for word in [*words, *(["--no-sandbox"] if os.geteuid() == 0 else [])]:
            of_chrome.add_argument(word)
        of_chrome.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
        self.driver: Any = webdriver.Chrome(service=Service(driver), options=of_chrome)
        self.emulate(**options)

    def emulate(self, dark: bool = False, width: int = 1280, height: int = 1000) -> None:
        """The theme and the size of the window for the pages that are opened from now on."""
        scheme = {"name": "prefers-color-scheme", "value": "dark" if dark else "light"}
        self.command("Emulation.setEmulatedMedia", features=[scheme])
        metrics = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": False}
        self.command("Emulation.setDeviceMetricsOverride", **metrics)

    def command(self, name: str, **parameters: Any) -> Any:
        """A command of the DevTools protocol."""
        return self.driver.execute_cdp_cmd(name, parameters)

    def run(self, script: str, *arguments: Any) -> Any:
        """The result of a function's body in the page, after the next frame."""
        frame = "const done = arguments[arguments.length - 1]; const all = [...arguments].slice(0, -1);"
        body = f"const result = (function () {{ {script} }}).apply(null, all);"
        then = "Promise.resolve(result).then((r) => requestAnimationFrame(() => requestAnimationFrame(() => done(r))));"
        return self.driver.execute_async_script(frame + body + then, *arguments)

    def open(self, page: Path, started: bool = True) -> None:
        """Opens a page, and waits until its script has started."""
        self.driver.get(page.resolve().as_uri())
        limit = time.monotonic() + WAIT_S
        while started and not self.driver.execute_script("return 'hotpathPage' in window"):
            if time.monotonic() > limit:
                raise AssertionError(f"the page's script did not start: {self.messages()}")
            time.sleep(0.05)

    def drag(self, selector: str, *places: tuple[float, float]) -> None:
        """Moves the mouse to the first place, given as shares of an element's width and height, and
        with a pressed button along the others; with one place, only moves."""
        box = self.run(
            "const e = document.querySelector(arguments[0]); e.scrollIntoView({block: 'center', behavior: 'instant'});"
            "return e.getBoundingClientRect().toJSON()",
            selector,
        )
        for number, (x, y) in enumerate(places):
            at = {"x": box["left"] + x * box["width"], "y": box["top"] + y * box["height"]}
            pressed = {"button": "left", "buttons": 1, "clickCount": 1}
            self.command("Input.dispatchMouseEvent", type="mouseMoved", **at, **(pressed if number else {}))
            if len(places) > 1 and number in (0, len(places) - 1):
                kind = "mouseReleased" if number else "mousePressed"
                self.command("Input.dispatchMouseEvent", type=kind, **at, **pressed)
        self.run("return 0")  # after the next frame

    def choose(self, choice: str, option: str) -> None:
        """Chooses an option, by its text, of the element with this id."""
        self.run(CHOOSE, choice, option)

    def choose_range(self, low: Any, high: Any) -> None:
        """Lists only the outputs with these latencies in ms."""
        self.run(CHOOSE_RANGE, low, high)

    def text(self, selector: str) -> Any:
        """The text of the first of these elements."""
        return self.run("return document.querySelector(arguments[0]).innerText", selector)

    def texts(self, selector: str) -> Any:
        """The texts of all of these elements."""
        read = "return [...document.querySelectorAll(arguments[0])].map((e) => e.innerText)"
        return self.run(read, selector)

    def listed(self) -> Any:
        """The list of outputs."""
        return self.run(READ_LIST)

    def accounts(self) -> Any:
        """The causes of the chosen outputs."""
        return self.run(READ_ACCOUNTS)

    def timeline(self) -> Any:
        """What the timeline shows."""
        return self.run(READ_TIMELINE)

    def tooltips(self, selector: str) -> Any:
        """[number of the series, label, position, text] at each position of the curves in an element."""
        return self.run(READ_CURVES, selector)

    def curves(self) -> list[tuple[Any, float, float]]:
        """(series, probability, ms) at each step along the distributions."""
        series = self.run("return hotpathPage.store.document.series")
        found = []
        for number, _, q, text in self.tooltips(".ecdf"):
            value = re.search(r"([\d.]+) ms", text)
            assert value is not None, text
            found.append((series[number], q, float(value[1])))
        return found

    def messages(self) -> list[str]:
        """Messages of the console since the last call."""
        return [entry["message"] for entry in self.driver.get_log("browser")]

    def requests(self) -> list[str]:
        """Addresses requested since the last call."""
        events = (json.loads(entry["message"])["message"] for entry in self.driver.get_log("performance"))
        return [e["params"]["request"]["url"] for e in events if e["method"] == "Network.requestWillBeSent"]

    def violations(self) -> list[str]:
        """What axe-core finds serious or critical. Raises unittest.SkipTest without axe-core."""
        if not AXE.exists():
            raise unittest.SkipTest(MISSING.format("axe-core (`npm ci` in bench/hotpath_report/web)"))
        self.driver.execute_script(AXE.read_text(encoding="utf-8"))
        found = self.run("return axe.run(document, {resultTypes: ['violations']}).then((r) => r.violations)")
        return [
            f"{v['id']}: {node['html'][:200]} {node['failureSummary'][:300]}"
            for v in found
            if v["impact"] in ("serious", "critical")
            for node in v["nodes"]
        ]

    def close(self) -> None:
        """Ends the browser."""
        self.driver.quit()


@functools.cache
def browser() -> Browser:
    """The browser of this process: its start takes longer than most tests. Raises unittest.SkipTest."""
    started = Browser()
    atexit.register(started.close)
    return started


def opened(
    test: unittest.TestCase, page: Path, started: bool = True, before: str = "", **options: Any
) -> Browser:
    """The browser with a page; the test fails at its end if the page made a request or wrote to the
    console. `started`: as open(). `before`: a script that runs before the page's own. `options`: as
    emulate()."""
    shown = browser()
    shown.emulate(**options)
    shown.driver.get("about:blank")
    _ = shown.messages(), shown.requests()  # of the page before
    script = shown.command("Page.addScriptToEvaluateOnNewDocument", source=before)["identifier"]
    shown.open(page, started)
    shown.command("Page.removeScriptToEvaluateOnNewDocument", identifier=script)

    def check() -> None:
        test.assertEqual(shown.messages(), [])
        made = [address for address in shown.requests() if not address.startswith("data:")]
        test.assertEqual(made, [page.resolve().as_uri()])

    test.addCleanup(check)
    return shown
