#!/usr/bin/env -S PYTHONPATH=bench:bench/test /usr/bin/python3 -B
# SPDX-License-Identifier: Apache-2.0
"""Measures a page of `hotpath report` in headless Chromium: its size, how long it takes to open, and
the script time of a step of the timeline.

    tools/page_speed.py PAGE/report.html

results/bench/README.md has the results."""

import argparse
import statistics
from pathlib import Path

from browser import Browser

OPENINGS = 5
# Zooms into the whole repetition and back, and pans at each zoom; returns the script time of each
# step in ms. draw() reports the drawing, the rest is the time until the step's call returns.
STEPS = """
const t = hotpathPage.timeline, times = [];
document.getElementById('rows-of').value = arguments[0];
document.getElementById('rows-of').dispatchEvent(new Event('change'));
const step = (act) => { const begin = performance.now(); act(); t.draw(); times.push(performance.now() - begin); };
t.toAll();
for (let zoom = 0; zoom < 16; ++zoom) {
  for (let k = 0; k < 6; ++k) step(() => t.pan(k < 3 ? 0.15 : -0.15));
  step(() => t.zoom(0.6));
}
for (let zoom = 0; zoom < 16; ++zoom) step(() => t.zoom(1 / 0.6));
return times;
"""
OPENED = """
const read = performance.getEntriesByType('navigation')[0];
return [read.domInteractive, performance.getEntriesByName('hotpath-started')[0].startTime];
"""


def main() -> None:
    """Prints the measurements."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n\n")[0])
    parser.add_argument("page", type=Path, metavar="PAGE/report.html")
    page = parser.parse_args().page
    print(f"file: {page.stat().st_size / 1e6:.2f} MB")
    openings = []
    for _ in range(OPENINGS):
        browser = Browser()
        browser.command("Performance.enable", timeDomain="threadTicks")  # CPU time of the page's thread
        browser.open(page)
        metrics = {m["name"]: m["value"] for m in browser.command("Performance.getMetrics")["metrics"]}
        openings.append([*browser.run(OPENED), 1e3 * metrics["TaskDuration"]])
        version = browser.driver.capabilities["browserVersion"]
        if len(openings) < OPENINGS:
            browser.close()
    print(f"Chromium {version}, {OPENINGS} openings")
    print(f"page parsed: median {statistics.median(o[0] for o in openings):.0f} ms")
    print(f"first drawing done: median {statistics.median(o[1] for o in openings):.0f} ms")
    print(f"CPU time of the page's thread: median {statistics.median(o[2] for o in openings):.0f} ms")
    jobs = browser.run("return hotpathPage.timeline.panels.map((p) => p.jobs.size)")
    print(f"jobs in the timeline's executors: {jobs}")
    for rows in ("tasks", "threads"):
        times = sorted(browser.run(STEPS, rows))
        worst = times[-1]
        print(
            f"step, rows of {rows}: median {statistics.median(times):.2f} ms, worst of {len(times)} {worst:.2f} ms"
        )
    browser.close()


if __name__ == "__main__":
    main()
