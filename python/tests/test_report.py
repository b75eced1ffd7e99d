"""The page of `--report` in a real browser: headless Chromium, driven by Playwright."""

from __future__ import annotations

import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from playwright.sync_api import Browser, Page, sync_playwright

import apgstmd
from scenes import moving_square, panned, textured_square, write_png

FRAMES = 20


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    names = ("chromium", "chromium-browser", "google-chrome")
    found = next(filter(None, map(shutil.which, names)), None)
    assert found, "these tests need Chromium: tools/chromium.sh installs it"
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=found, args=["--no-sandbox"])
        yield browser
        browser.close()


class Shown:
    """An open page, with everything that it complained of or asked the network for."""

    def __init__(self, browser: Browser, file: Path, **context: Any) -> None:
        self.context = browser.new_context(**{"viewport": {"width": 1200, "height": 900}, **context})
        self.page: Page = self.context.new_page()
        self.complaints: list[str] = []
        self.requests: list[str] = []
        self.page.on("console", lambda message: self.complaints.append(message.text))
        self.page.on("pageerror", lambda error: self.complaints.append(str(error)))
        self.page.on("dialog", lambda dialog: self.complaints.append(dialog.message))
        self.page.on("request", lambda request: self.requests.append(request.url))
        begin = time.monotonic()
        self.page.goto(file.as_uri())
        self.until(lambda: self.page.inner_text("#caption") != "")
        self.seconds = time.monotonic() - begin

    def until(self, so: Callable[[], bool]) -> None:
        """Playwright's own waiting evaluates text in the page, which the page forbids."""
        end = time.monotonic() + 10
        while not so():
            assert time.monotonic() < end
            time.sleep(0.02)

    def frame(self) -> int:
        return int(self.page.inner_text("#caption b").removeprefix("Frame "))

    def press(self, *keys: str) -> int:
        for key in keys:
            self.page.keyboard.press(key)
        return self.frame()

    def colour(self, name: str) -> str:
        return str(self.page.evaluate(f"getComputedStyle(document.body).{name}"))

    def overflow(self) -> int:
        return int(self.page.evaluate("document.documentElement.scrollWidth - innerWidth"))

    def close(self) -> None:
        self.context.close()
        assert self.complaints == []
        outside = [url for url in self.requests if not url.startswith(("file:", "data:"))]
        assert outside == []


@pytest.fixture(scope="module")
def report(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("clip")
    for t, frame in enumerate(textured_square(FRAMES)):
        write_png(folder / f"f{t}.png", frame)
    file = folder / "report.html"
    found = apgstmd.run(folder, fps=25, speed=1.0, rejection="off", report=file)
    assert found.frames == FRAMES
    assert len(found.tracks) > 5
    return file


@pytest.fixture
def shown(browser: Browser, report: Path) -> Iterator[Shown]:
    shown = Shown(browser, report)
    yield shown
    shown.close()


def test_the_scrubber_by_mouse(shown: Shown) -> None:
    assert shown.frame() == 0
    shown.page.locator("#play").scroll_into_view_if_needed()
    box = shown.page.locator("#slider").bounding_box()
    assert box is not None
    middle = box["y"] + box["height"] / 2
    shown.page.mouse.click(box["x"] + box["width"] / 2, middle)
    assert shown.frame() in (9, 10)
    shown.page.mouse.down()
    shown.page.mouse.move(box["x"] + box["width"] - 1, middle, steps=5)
    shown.page.mouse.up()
    assert shown.frame() == FRAMES - 1
    line = shown.page.locator(".timeline").bounding_box()
    assert line is not None
    shown.page.mouse.click(line["x"] + 0.26 * line["width"], line["y"] + 20)
    assert shown.frame() == 5
    shown.page.click("#next")
    shown.page.click("#next")
    shown.page.click("#back")
    assert shown.frame() == 6
    assert shown.page.get_attribute("#slider", "aria-valuetext") == "frame 6, 0.24 s, 0 targets"


def test_the_scrubber_by_keyboard(shown: Shown) -> None:
    assert shown.press("ArrowRight", "ArrowRight", "ArrowRight", "ArrowLeft") == 2
    shown.page.focus("#slider")
    assert shown.press("End") == FRAMES - 1
    assert shown.press("PageDown", "PageDown") == FRAMES - 5
    assert shown.press("Home") == 0
    assert shown.press("PageUp", "ArrowUp") == 3
    assert shown.press("Shift+ArrowRight") == 13
    # Everything can be reached, and what has the focus shows it.
    shown.page.focus("#slider")
    reached = []
    for _ in range(9):
        shown.page.keyboard.press("Tab")
        reached.append(shown.page.evaluate("document.activeElement.id"))
        assert shown.page.evaluate("getComputedStyle(document.activeElement).outlineStyle") != "none"
    assert reached[:8] == ["first", "back", "play", "next", "last", "pace", "trails", "faint"]


@pytest.fixture(scope="module")
def moving(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A page of a camera that pans, cut before frame 12, with nothing to be seen in frames 20 to 23."""
    file = tmp_path_factory.mktemp("moving") / "report.html"
    frames = np.stack(list(panned(30, cut=12, blank=range(20, 24))))
    found = apgstmd.run(frames, fps=25, speed=1.0, report=file)
    assert found.summary["background"]["cuts"] == [12, 20, 24]
    return file


# Rows of pixels of a canvas that have a colour of the style sheet, column by column of as many as there are frames.
INKED = """([id, name, frames]) => {
  const canvas = document.getElementById(id);
  const pen = Object.assign(document.createElement("canvas"), { width: canvas.width, height: canvas.height })
    .getContext("2d", { willReadFrequently: true });
  pen.drawImage(canvas, 0, 0);
  const probe = document.createElement("canvas").getContext("2d");
  probe.fillStyle = getComputedStyle(document.documentElement).getPropertyValue("--" + name).trim();
  probe.fillRect(0, 0, 1, 1);
  const wanted = probe.getImageData(0, 0, 1, 1).data;
  const { width, height } = canvas;
  return [...Array(frames).keys()].map((k) => {
    const x = Math.floor((k + 0.3) * width / frames);
    const data = pen.getImageData(x, 0, 1, height).data;
    return [...Array(height).keys()].filter((y) => [0, 1, 2].every((c) => Math.abs(data[4 * y + c] - wanted[c]) < 3)).length;
  });
}"""


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_the_lane_of_the_camera(browser: Browser, moving: Path, scheme: str) -> None:
    shown = Shown(browser, moving, color_scheme=scheme)

    def inked(name: str) -> list[int]:
        rows: list[int] = shown.page.evaluate(INKED, ["camera", name, 30])
        return rows

    bars, unknown = inked("moved"), inked("unknown")
    # Nothing to compare with, another scene, nothing to be seen.
    without = {0, 12, *range(20, 25)}
    assert {k for k, rows in enumerate(bars) if rows == 0} == without
    assert all(rows > 25 for k, rows in enumerate(bars) if k not in without)
    assert {k for k, rows in enumerate(unknown) if rows > 0} == {21, 22, 23}
    assert shown.page.evaluate(INKED, ["timeline", "moved", 30]) == [0] * 30
    shown.page.focus("#slider")
    readout = shown.page.locator("#caption .moved")
    assert readout.count() == 0
    assert shown.press(*["ArrowRight"] * 5) == 5
    words = readout.inner_text()
    assert words.startswith("Camera: background moved 2.0") and "\N{RIGHTWARDS ARROW}" in words, words
    assert "background moved" in (shown.page.get_attribute("#slider", "aria-valuetext") or "")
    assert shown.press(*["ArrowRight"] * 7) == 12
    assert "cut before this frame" in readout.inner_text()
    assert shown.press("Shift+ArrowRight") == 22
    assert "does not tell" in readout.inner_text()
    lane = shown.page.locator("#camera").bounding_box()
    assert lane is not None
    shown.page.mouse.click(lane["x"] + 0.5 * lane["width"], lane["y"] + 20)
    assert shown.frame() in (14, 15)
    cursor = shown.page.locator("#cursor").bounding_box()
    assert cursor is not None
    assert cursor["y"] + cursor["height"] >= lane["y"] + lane["height"] - 1
    shown.close()


def test_the_lane_on_a_phone(browser: Browser, moving: Path) -> None:
    shown = Shown(browser, moving, viewport={"width": 360, "height": 640}, has_touch=True, is_mobile=True)
    assert shown.overflow() <= 0
    lane = shown.page.locator("#camera")
    lane.scroll_into_view_if_needed()
    box = lane.bounding_box()
    assert box is not None
    shown.page.touchscreen.tap(box["x"] + 0.99 * box["width"], box["y"] + box["height"] / 2)
    assert shown.frame() == 29
    assert shown.overflow() <= 0
    shown.close()


def test_no_lane_where_the_camera_stands_still(shown: Shown) -> None:
    assert shown.page.locator("#camera").count() == 0
    assert "Camera: not followed" in shown.page.inner_text("#still")
    assert shown.page.locator("#caption .moved").count() == 0


def test_the_border_of_the_region(browser: Browser, tmp_path: Path) -> None:
    file = tmp_path / "report.html"
    frames = np.stack(list(moving_square(30)))
    apgstmd.run(frames, speed=1.0, rejection="off", roi=[(0, 0, 96, 34), (0, 0, 30, 50)], report=file)
    shown = Shown(browser, file)
    shown.page.focus("#slider")
    shown.press("End")
    assert shown.page.locator("#marks > path").count() == 2
    lines = shown.page.locator("#marks > path").first.get_attribute("d")
    assert lines == "M30 34L96 34M0 50L30 50M30 34L30 50"
    # Where a target is there is no line.
    free = shown.page.locator("#free circle").first
    x, y = (float(free.get_attribute(name) or "nan") for name in ("cx", "cy"))
    assert abs(x - 49.5) < 4 and abs(y - 32.5) < 4
    assert "within the thin line only" in shown.page.inner_text("#viewer")
    shown.page.locator("#paths").scroll_into_view_if_needed()
    # The picture below is faint, the line is not.
    opacity = """(y) => {
      const canvas = document.getElementById("paths"), scale = canvas.width / 96;
      const pen = document.createElement("canvas").getContext("2d");
      pen.drawImage(canvas, -0.75 * canvas.width, -Math.round(y * scale));
      return pen.getImageData(0, 0, 1, 1).data[3];
    }"""
    shown.until(lambda: shown.page.evaluate(opacity, 45) > 0)
    assert shown.page.evaluate(opacity, 34) > shown.page.evaluate(opacity, 45) + 40
    assert shown.page.evaluate(opacity, 50) == shown.page.evaluate(opacity, 45)
    shown.close()


def test_playing(shown: Shown) -> None:
    shown.press(" ")
    assert shown.page.get_attribute("#play", "aria-pressed") == "true"
    # 25 frames a second: it ends by itself.
    shown.until(lambda: shown.page.inner_text("#play") == "Play")
    assert shown.frame() == FRAMES - 1
    shown.page.select_option("#pace", "0.1")
    shown.page.click("#play")
    shown.until(lambda: shown.frame() == 1)
    shown.page.click("#play")
    stopped = shown.frame()
    time.sleep(0.6)
    assert shown.frame() == stopped < 5


def test_targets_are_marked_where_they_are(shown: Shown) -> None:
    shown.page.focus("#slider")
    shown.press("End")
    circles = "[...document.querySelectorAll('#marks circle')].map(c => [Number(c.getAttribute('cx')), Number(c.getAttribute('cy'))])"
    marked = shown.page.evaluate(circles)
    x, y = 20 + FRAMES - 1 + 0.5, 32.5
    assert any(abs(cx - x) < 3 and abs(cy - y) < 3 for cx, cy in marked)
    cells = shown.page.locator("#list tr").first.locator("td").all_inner_texts()
    assert cells[0].isdigit()
    assert abs(float(cells[2]) - x) < 3
    assert abs(float(cells[3]) - y) < 3
    assert cells[4] == "\N{RIGHTWARDS ARROW}"
    shown.page.uncheck("#trails")
    shown.page.uncheck("#faint")
    assert len(shown.page.evaluate(circles)) <= len(marked)
    assert shown.page.locator("#marks polyline").count() == 0
    assert shown.page.evaluate("document.getElementById('image').naturalWidth") == 96
    shown.page.click("#tracks button")
    assert 0 < shown.frame() < FRAMES - 1


def test_dark_and_light(browser: Browser, report: Path) -> None:
    grounds = []
    for scheme in ("light", "dark"):
        shown = Shown(browser, report, color_scheme=scheme)
        ground, ink = shown.colour("backgroundColor"), shown.colour("color")
        levels = [sum(map(int, colour.removeprefix("rgb(").rstrip(")").split(","))) for colour in (ground, ink)]
        assert abs(levels[0] - levels[1]) > 500
        # Charts are pixels: they are drawn again.
        shown.page.emulate_media(color_scheme="dark" if scheme == "light" else "light")
        assert shown.colour("backgroundColor") != ground
        grounds.append(ground)
        shown.close()
    assert grounds[0] != grounds[1]


@pytest.mark.parametrize("width", [320, 375, 800])
def test_on_a_phone(browser: Browser, report: Path, width: int) -> None:
    shown = Shown(browser, report, viewport={"width": width, "height": 640}, has_touch=True, is_mobile=width < 400)
    assert shown.overflow() <= 0
    shown.page.tap("#next")
    assert shown.frame() == 1
    shown.page.locator("summary").tap()
    assert shown.overflow() <= 0
    assert shown.page.evaluate("innerWidth") == width
    shown.close()


def test_little_motion(browser: Browser, report: Path) -> None:
    shown = Shown(browser, report, reduced_motion="reduce")
    shown.press(" ")
    time.sleep(0.3)
    assert shown.frame() == 0
    shown.until(lambda: shown.frame() != 0)
    assert shown.frame() > 8
    shown.press(" ")
    shown.close()


def test_names_stay_text(browser: Browser, tmp_path: Path) -> None:
    name = "<script>alert(1)<!-- \"'&amp;<img src=x onerror=alert(2)>"
    folder = tmp_path / name.replace("/", "")
    folder.mkdir()
    for t, frame in enumerate(textured_square(3)):
        write_png(folder / f"</script><b>{t}.png".replace("/", "\u2215"), frame)
    apgstmd.run(folder, speed=1.0, report=tmp_path / "report.html")
    shown = Shown(browser, tmp_path / "report.html")
    assert shown.page.inner_text("h1").endswith(folder.name)
    assert shown.page.title().startswith(str(folder))
    assert "<b>0.png" in shown.page.inner_text("#caption")
    assert shown.page.locator("b:has-text('png')").count() == 0
    assert shown.page.locator("script").count() == 2
    assert not any(url.endswith("/x") for url in shown.requests)
    shown.close()


def test_twenty_thousand_frames(browser: Browser, tmp_path: Path) -> None:
    # The camera goes up and down, 1 px a frame.
    frames = (np.roll(frame, abs(t - 20), axis=0) for t, frame in enumerate(textured_square(40)))
    pictures = b"".join(frame[8:56, 16:80].tobytes() for frame in frames)
    flags = ["--raw=64x48", "--fps=60", "--speed=1", "--rejection=motion", "--quiet", f"--out={tmp_path / 'out'}"]
    file = tmp_path / "report.html"
    command = [sys.executable, "-m", "apgstmd", "run", "-", f"--report={file}", *flags]
    subprocess.run(command, input=pictures * 500, check=True)
    assert file.stat().st_size < 20e6
    shown = Shown(browser, file)
    assert shown.seconds < 3
    assert shown.page.get_attribute("#slider", "max") == "19999"
    shown.page.focus("#slider")
    assert shown.press("End") == 19_999
    begin = time.monotonic()
    assert shown.press(*["ArrowLeft"] * 20) == 19_979
    assert time.monotonic() - begin < 2
    # There are some hundred pictures: another frame's is named.
    assert "picture of frame 19968, 11 frames earlier" in shown.page.inner_text("#caption")
    assert shown.page.locator("#marks circle").count() > 0
    assert "Camera: background moved 1.0" in shown.page.inner_text("#caption")
    # A bar stands for 32 frames.
    assert min(shown.page.evaluate(INKED, ["camera", "moved", 600])) > 30
    widths = shown.page.evaluate("[...document.querySelectorAll('canvas')].map(c => c.width)")
    assert min(widths) > 100
    shown.close()


def test_a_video_beside_it(report: Path, tmp_path: Path) -> None:
    file = tmp_path / "found.mp4"
    apgstmd.run(report.parent / "f*.png", fps=25, speed=1.0, video=file, video_response=True, stop=5)
    assert file.read_bytes()[4:8] == b"ftyp"
    assert [path.name for path in tmp_path.iterdir()] == ["found.mp4"]
    with pytest.raises(RuntimeError, match="is there already"):
        apgstmd.run(report.parent / "f*.png", speed=1.0, video=file)


def test_nothing_found(browser: Browser, tmp_path: Path) -> None:
    for t in range(4):
        write_png(tmp_path / f"{t}.png", np.full((32, 48), 120, np.uint8))
    apgstmd.run(str(tmp_path / "*.png"), speed=1.0, report=tmp_path / "report.html")
    shown = Shown(browser, tmp_path / "report.html")
    assert "Nothing was found" in shown.page.inner_text("body")
    assert "No track was confirmed" in shown.page.inner_text("body")
    assert shown.press("ArrowRight") == 1
    assert "identical to the one before" in shown.page.inner_text(".warnings")
    shown.close()
