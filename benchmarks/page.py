"""How long a page takes to open, and a picture to draw, in Chromium without graphics hardware.

    python benchmarks/page.py part.vtu [better.vtu]

A row for both meshes side by side with all cells, and one with those of the worse half only: wall and processor seconds
of all processes of the browser for each picture while the mesh turns, by samples per pixel. The page takes as many as
the machine can draw ten times a second, and those of the last column once at rest. Where other work goes on, the
processor seconds tell more.
"""

from __future__ import annotations

import argparse
import os
import shutil
import tempfile
import time
from pathlib import Path
from typing import Any

from machine import described
from playwright.sync_api import Browser, Page, sync_playwright

from hexconformal.page import volume_page

FLAGS = ["--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--no-sandbox"]
LEVELS = {0: 0.35, 2: 0.7, 3: 1, 4: 2}  # of `SAMPLES` in the page's stage.js, per pixel along each side
PICTURES = 12

_TURN = """([level, pictures]) => {
  const { stage } = window.hexconformal;
  const gl = stage.renderer.getContext();
  const axis = stage.camera.up.clone().set(0, 0, 1);
  for (let k = 0; k < pictures; k += 1) {
    stage.camera.position.applyAxisAngle(axis, 0.1);
    stage.camera.lookAt(stage.controls.target);
    stage.draw(level);
    gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4));  // waits until it is drawn
  }
}"""


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("before")
    parser.add_argument("after", nargs="?")
    given = parser.parse_args()
    print(described(os.getloadavg()))
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as driver:
        file = Path(folder) / "page.html"
        began = time.perf_counter()
        page = volume_page(given.before, given.after)
        page.write(file)
        print(f"{page}: made in {time.perf_counter() - began:.1f} s, {file.stat().st_size / 1e6:.1f} MB")
        browser = driver.chromium.launch(executable_path=shutil.which("chromium"), args=FLAGS)
        tab, opened = _opened(browser, file)
        heads = "".join(f"{f'{samples}^2 samples':>24s}" for samples in LEVELS.values())
        print(f"opened in {opened:.1f} s\n{'wall, processor':28s}{heads}")
        for name, share in (("all cells", 1.0), ("the worse half", 0.5)):
            bound = sorted(page.frames[0].cell_data[page.worst_measure].tolist())[int(share * page.cells.count) - 1]
            tab.evaluate(f"window.hexconformal.store.set({{threshold: {bound if share < 1 else 'null'}}})")
            figures = [_turned(tab, level) for level in LEVELS]
            print(f"{name:28s}" + "".join(f"{wall:>16.3f} {work:.3f} s" for wall, work in figures))
        browser.close()


def _opened(browser: Browser, file: Path) -> tuple[Page, float]:
    tab = browser.new_page(viewport={"width": 1400, "height": 860})
    began = time.perf_counter()
    tab.goto(file.as_uri())
    tab.wait_for_selector("html[data-ready=yes]", state="attached", timeout=120_000)
    tab.evaluate("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")
    return tab, time.perf_counter() - began


def _turned(tab: Any, level: int) -> tuple[float, float]:
    """Wall and processor seconds for each picture."""
    wall, work = time.perf_counter(), _processor_seconds()
    tab.evaluate(_TURN, [level, PICTURES])
    return (time.perf_counter() - wall) / PICTURES, (_processor_seconds() - work) / PICTURES


def _processor_seconds() -> float:
    """Of all processes of the browser (Linux)."""
    total = 0
    for entry in Path("/proc").iterdir():
        if not entry.name.isdigit():
            continue
        try:
            if "chromium" in (entry / "cmdline").read_text():
                fields = (entry / "stat").read_text().rpartition(")")[2].split()
                total += int(fields[11]) + int(fields[12])
        except OSError:  # it has ended meanwhile
            continue
    return total / os.sysconf("SC_CLK_TCK")


if __name__ == "__main__":
    main()
