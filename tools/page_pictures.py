#!/usr/bin/env -S PYTHONPATH=bench:bench/test /usr/bin/python3 -B
# SPDX-License-Identifier: Apache-2.0
"""Takes the pictures of the interactive pages that the documentation shows, in headless Chromium.

    tools/page_pictures.py RUN ADVICE SWEEP

RUN is the first run of README.md, ADVICE the folder of `hotpath advise autoware --cores 2
--executors default,static,events-ro,rm-ro,fp-ro`, and SWEEP that of the sweep in docs/sweeps.md.
Writes docs/pictures/page_*.png."""

import argparse
import base64
import tempfile
from pathlib import Path

from browser import Browser
from hotpath_report.hotpath_command import output_of

PICTURES = Path(__file__).resolve().parents[1] / "docs" / "pictures"
WIDTH = 1200
# The worst output under default, and the one with the same data under rm-ro.
SELECT = """
const boxes = [...document.querySelectorAll('.legend label')];
for (const box of boxes) if (!box.innerText.match(/^(default|rm-ro)\\b/)) box.querySelector('input').click();
const row = [...document.querySelectorAll('.outputs tbody tr')].find((r) => r.innerText.includes('default'));
row.querySelector('button').click();
const other = document.getElementById('other');
other.value = [...other.options].find((o) => o.text === 'rm-ro').value;
other.dispatchEvent(new Event('change'));
window.scrollTo(0, 0);
"""
# The legend of the worst case over the load, and the tooltip of a load.
READ_CURVES = """
const choice = document.getElementById('curves-of');
choice.value = [...choice.options].find((o) => o.text.startsWith('worst')).value;
choice.dispatchEvent(new Event('change'));
return new Promise((done) => requestAnimationFrame(() => {
  const plot = document.querySelector('.plots .plot');
  const press = (key) => plot.dispatchEvent(new KeyboardEvent('keydown', {key, bubbles: true}));
  plot.focus();
  press('Home');
  for (let k = 0; k < 7; ++k) press('ArrowRight');
  done();
}));
"""
# From the top of one element to the bottom of another one.
BOX = """
const [from, to] = [...arguments].map((s) => document.querySelector(s).getBoundingClientRect());
return [from.top + scrollY, to.bottom + scrollY];
"""
# By page: what to select in it, and the pictures.
PARTS = {
    "run": (SELECT, {"page_distribution": ("#explore-title", ".list"),
                     "page_timeline": (".timeline", ".timeline .causes")}),
    "advice": ("window.scrollTo(0, 0);", {"page_advice": ("#explore-title", ".timeline canvas")}),
    "sweep": (READ_CURVES, {"page_sweep": ("#explore-title", "#plot-keys")}),
}  # fmt: skip


def take(browser: Browser, name: str, first: str, last: str) -> None:
    """Writes one picture."""
    top, bottom = browser.run(BOX, first, last)
    clip = {"x": 0, "y": top - 8, "width": WIDTH, "height": bottom - top + 24, "scale": 1}
    shot = browser.command("Page.captureScreenshot", clip=clip, captureBeyondViewport=True)
    (PICTURES / f"{name}.png").write_bytes(base64.b64decode(shot["data"]))
    print(PICTURES / f"{name}.png")


def main() -> None:
    """Writes all pictures."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n\n")[0])
    for name in PARTS:
        parser.add_argument(name, metavar=name.upper(), type=Path)
    folders = vars(parser.parse_args())
    PICTURES.mkdir(exist_ok=True)
    with tempfile.TemporaryDirectory() as folder:
        output_of("report", folders["run"], "--output", folder)
        folders["run"] = Path(folder)
        for name, (select, parts) in PARTS.items():
            browser = Browser(width=WIDTH)
            browser.open(folders[name] / "report.html")
            browser.run(select)
            for picture, (first, last) in parts.items():
                take(browser, picture, first, last)
            browser.close()


if __name__ == "__main__":
    main()
