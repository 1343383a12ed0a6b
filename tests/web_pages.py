"""Pages as tests look at them: what their file holds, decoded without the library, and a browser."""

import base64
import json
import re
import shutil
import zlib
from contextlib import contextmanager

import numpy as np

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
# Draws in software, so that it works on machines without a screen; the others keep it from calling home.
FLAGS = ("--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--no-sandbox", "--disable-sync")
FLAGS += ("--disable-background-networking", "--disable-component-update", "--no-first-run")


class PageFile:
    """The contents of a page, from its text."""

    def __init__(self, text):
        self.text = text
        self.contents = json.loads(re.search(r'id="contents">(.*?)</script>', text, re.DOTALL)[1])

    def array(self, reference):
        """The numbers of an array of the page."""
        encoded = re.search(rf'id="array-{reference["id"]}">([^<]*)<', self.text)[1]
        data = zlib.decompress(base64.b64decode(encoded))
        kind = np.dtype(reference["type"])
        planes = np.frombuffer(data, np.uint8).reshape(kind.itemsize, -1)
        return np.ascontiguousarray(planes.T).view(kind).reshape(reference["shape"])

    def frame(self, number):
        """Points, arrays on cells and arrays on points of a frame."""
        frame = self.contents["frames"][number]
        arrays = [
            {name: self.array(one) for name, one in frame[f"{place}_arrays"].items()} for place in ("cell", "point")
        ]
        return self.array(frame["points"]), *arrays


def why_no_browser():
    """What is missing for tests in a browser; None if nothing is."""
    try:
        import playwright  # noqa: F401
    except ImportError:
        return "playwright is not installed"
    return None if any(map(shutil.which, NAMES)) else f"there is no browser: none of {', '.join(NAMES)}"


@contextmanager
def browser():
    """A browser without a window."""
    from playwright.sync_api import sync_playwright

    path = next(filter(None, map(shutil.which, NAMES)))
    with sync_playwright() as driver:
        started = driver.chromium.launch(executable_path=path, args=list(FLAGS))
        yield started
        started.close()


class Opened:
    """A page in a browser, and whatever it complained of, or tried to load."""

    def __init__(self, started, path, scheme="light", width=1200, height=800):
        context = started.new_context(viewport={"width": width, "height": height}, color_scheme=scheme)
        self.tab, self.complaints, self.requests = context.new_page(), [], []
        self.tab.on("console", lambda said: self.complaints.append(said.text) if said.type == "error" else None)
        self.tab.on("pageerror", lambda problem: self.complaints.append(str(problem)))
        self.tab.on("request", lambda request: self.requests.append(request.url))
        self.tab.goto(path.resolve().as_uri())

    def ready(self):
        """Wait until it is drawn."""
        self.tab.wait_for_selector("html[data-ready=yes], .failed", state="attached", timeout=60_000)
        assert self.tab.locator(".failed").count() == 0, self.complaints
        return self

    def rest(self):
        """Wait until nothing moves, and all is drawn in full."""
        for _ in range(300):
            self.tab.wait_for_timeout(100)
            if self.ask("page.stage.flight === null && !page.stage.wanted && !page.stage.turning"):
                return self
        raise AssertionError("the page does not come to rest")

    def ask(self, script):
        """The value of an expression; `page` is the page."""
        return self.tab.evaluate(f"(() => {{ const page = window.hexconformal; return {script}; }})()")

    def set(self, changes):
        """Choose something, as its control would."""
        self.tab.evaluate(f"window.hexconformal.store.set({changes})")

    def counts(self):
        """Numbers of cells drawn before and after."""
        return self.ask("[page.views.before.count, page.views.after.count]")
