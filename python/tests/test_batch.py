"""Many videos, here and on the workers of a Dask cluster, of which one is killed in the middle."""

from __future__ import annotations

import contextlib
import json
import os
import runpy
import shutil
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

import distributed
import numpy as np
import pytest
from playwright.sync_api import sync_playwright

import apgstmd
from scenes import HEIGHT, WIDTH, textured_square, write_png

TABLES = ("detections.csv", "tracks.csv")
CLIPS = 6
# They have no types.
Client: Any = distributed.Client
LocalCluster: Any = distributed.LocalCluster
# Three detectors: a clip takes half a second, time enough to kill who does it.
BANK: dict[str, Any] = {"speeds": [0.5, 1, 2], "sizes": [5]}
EXAMPLE = Path(__file__).parents[2] / "examples" / "slurm_batch.py"


@pytest.fixture(scope="module")
def videos(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """Folders of pictures, each another clip."""
    place = tmp_path_factory.mktemp("videos")
    folders = [place / f"cam{n}" for n in range(CLIPS)]
    for n, folder in enumerate(folders):
        folder.mkdir()
        for t, frame in enumerate(textured_square(40 + n)):
            write_png(folder / f"f{t}.png", frame)
    return folders


@pytest.fixture(scope="module")
def undisturbed(videos: list[Path], tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("undisturbed") / "out"
    clips = apgstmd.batch(videos, out, jobs=2, **BANK)
    assert [clip.name for clip in clips] == [video.name for video in videos]
    assert all(clip.done and clip.error is None for clip in clips)
    return out


def assert_same(out: Path, undisturbed: Path) -> None:
    """Each clip once, in the folders and in the manifest, with the same bytes in its tables."""
    manifest = json.loads((out / "manifest.json").read_text(encoding="utf-8"))
    names = [clip["name"] for clip in manifest["clips"]]
    assert names == [f"cam{n}" for n in range(CLIPS)]
    assert (manifest["done"], manifest["failed"], manifest["waiting"]) == (CLIPS, 0, 0)
    assert sorted(folder.name for folder in (out / "clips").iterdir()) == names
    assert list((out / "failed").iterdir()) == []
    assert not (out / "part").exists()
    for clip in manifest["clips"]:
        assert clip == json.loads((out / clip["folder"] / "clip.json").read_text(encoding="utf-8"))
        for table in TABLES:
            assert (out / clip["folder"] / table).read_bytes() == (undisturbed / clip["folder"] / table).read_bytes()


def test_one_clip_is_as_run_alone(videos: list[Path], undisturbed: Path, tmp_path: Path) -> None:
    assert_same(undisturbed, undisturbed)
    alone = apgstmd.run(videos[3], out=tmp_path / "alone", **BANK)
    for table in TABLES:
        assert (tmp_path / "alone" / table).read_bytes() == (undisturbed / "clips" / "cam3" / table).read_bytes()
    record = json.loads((undisturbed / "clips" / "cam3" / "clip.json").read_text(encoding="utf-8"))
    assert record["frames"] == alone.frames == 43
    assert record["detections"] == len(alone.detections)


def test_options_and_failures(videos: list[Path], tmp_path: Path) -> None:
    bad = tmp_path / "bad.mp4"
    bad.write_bytes(b"no video")
    options: dict[str, Any] = {"speed": 1.0, "rejection": "off", "report": True, "formats": ["jsonl"], "tracks": False}
    out = tmp_path / "out"
    some: list[str | os.PathLike[str]] = [videos[1], bad, str(videos[0] / "*.png"), videos[1]]
    clips = apgstmd.batch(some, out, detection_max_peaks=5, stop=10, **options)
    assert [(clip.name, clip.done, clip.frames) for clip in clips] == [
        ("cam1", True, 10),
        ("bad", False, None),
        ("cam0", True, 10),
    ]
    assert "as video" in str(clips[1].error)
    first = clips[0]
    assert first.folder is not None
    assert {"report.html", "detections.jsonl"} <= {file.name for file in first.folder.iterdir()}
    assert not (first.folder / "tracks.csv").exists()
    run = json.loads((first.folder / "run.json").read_text(encoding="utf-8"))
    assert run["params"]["detection"]["max_peaks"] == 5
    assert run["params"]["rejection"]["mode"] == "off"
    with pytest.raises(RuntimeError, match="is there already from an earlier batch"):
        apgstmd.batch(some, out, detection_max_peaks=5, stop=10, **options)
    before = first.record["wall_seconds"]
    again = apgstmd.batch(some, out, detection_max_peaks=5, stop=10, resume=True, **options)
    assert again[0].record["wall_seconds"] == before
    other = apgstmd.batch(some[:1], out, detection_max_peaks=6, stop=10, resume=True, **options)
    assert other[0].record["wall_seconds"] != before
    with pytest.raises(ValueError, match="must be between"):
        apgstmd.batch(videos, tmp_path / "no", bit_depth=40)
    with pytest.raises(TypeError, match="roi must be"):
        apgstmd.batch(videos, tmp_path / "no", roi=(1, 2, 3))  # type: ignore[arg-type]
    with pytest.raises(TypeError, match="there is no parameter 'oevrlay': did you mean 'overlay'"):
        apgstmd.batch(videos, tmp_path / "no", oevrlay=True)  # type: ignore[call-arg]
    with pytest.raises(RuntimeError, match="nothing matches"):
        apgstmd.batch(str(tmp_path / "*.avi"), tmp_path / "no")
    with pytest.raises(TypeError, match=r"must be a synchronous distributed\.Client, not str"):
        apgstmd.batch(videos, tmp_path / "no", client="tcp://somewhere")
    with pytest.raises(TypeError, match="jobs is for this machine"):
        apgstmd.batch(videos, tmp_path / "no", client=object(), jobs=2)


def test_regions_reach_every_clip(videos: list[Path], tmp_path: Path) -> None:
    mask = np.zeros((HEIGHT, WIDTH), np.uint8)
    mask[:, 40:] = 255
    write_png(tmp_path / "mask.png", mask)
    region: dict[str, Any] = {"roi": [(0, 0, 10, 10), (40, 20, 30, 30)], "mask": tmp_path / "mask.png"}
    clips = apgstmd.batch(videos[:2], tmp_path / "out", speed=1.0, largest_frame=1, **region)
    alone = apgstmd.run(videos[1], out=tmp_path / "alone", speed=1.0, largest_frame=1, **region)
    assert alone.summary["region"]["roi"] == ["10x10+0+0", "30x30+40+20"]
    assert alone.summary["region"]["share"] == 30 * 30 / (HEIGHT * WIDTH)
    for clip in clips:
        assert clip.done and clip.folder is not None
        run = json.loads((clip.folder / "run.json").read_text(encoding="utf-8"))
        assert run["region"] == alone.summary["region"]
    for table in TABLES:
        assert (tmp_path / "alone" / table).read_bytes() == (tmp_path / "out" / "clips" / "cam1" / table).read_bytes()
    assert len(alone.detections) and alone.detections.x.min() >= 39.5


def test_without_distributed(videos: list[Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(ImportError, match=r"pip install 'apgstmd\[batch\]'"):
        apgstmd.batch(videos, tmp_path / "no", client=object())


def test_the_console_script_starts_itself(videos: list[Path], undisturbed: Path, tmp_path: Path) -> None:
    # Modules in the current folder are not ours.
    (tmp_path / "numpy.py").write_text("raise RuntimeError('not this one')")
    command = [sys.executable, "-P", "-m", "apgstmd", "batch", "--speeds=0.5,1,2", "--sizes=5", str(videos[0]), "--out", "out"]
    ran = subprocess.run(command, cwd=tmp_path, check=True, capture_output=True, text=True)
    assert "1/1 cam0: 40 frames of 96 x 64 in " in ran.stderr
    for table in TABLES:
        assert (tmp_path / "out" / "clips" / "cam0" / table).read_bytes() == (undisturbed / "clips" / "cam0" / table).read_bytes()


@pytest.fixture(scope="module")
def cluster() -> Iterator[distributed.LocalCluster]:
    with LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None
    ) as cluster:
        yield cluster


def children(parent: int) -> dict[int, list[str]]:
    """Processes that a process started, with their words."""
    found = {}
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            status = (folder / "stat").read_text()
            # The name before it, in brackets, may hold anything.
            if int(status.rpartition(")")[2].split()[1]) == parent:
                found[int(folder.name)] = (folder / "cmdline").read_text().split("\0")
        except OSError:
            # It has ended.
            continue
    return found


def ended(process: int) -> bool:
    """Also where nobody has asked yet how: what ended its parent leaves it to a process that may never ask."""
    try:
        return Path("/proc", str(process), "stat").read_text().rpartition(")")[2].split()[0] == "Z"
    except OSError:
        return True


def test_a_worker_is_killed_in_the_middle(
    videos: list[Path], undisturbed: Path, cluster: distributed.LocalCluster, tmp_path: Path
) -> None:
    out = tmp_path / "out"
    with Client(cluster) as client:
        workers = list(client.run(os.getpid).values())
        assert len(workers) == 2
        killed: list[tuple[int, list[int]]] = []
        done: list[Path] = []

        def kill_one() -> None:
            """As soon as one clip is done and a worker's child is in the middle of another."""
            end = time.monotonic() + 60
            while time.monotonic() < end and not killed:
                done[:] = (out / "clips").glob("*")
                begun = list((out / "part").glob("*/detections.csv"))
                busy = {worker: children(worker) for worker in workers}
                worker = next((worker for worker in workers if any("run" in words for words in busy[worker].values())), None)
                if done and begun and worker is not None:
                    os.kill(worker, signal.SIGKILL)
                    killed.append((worker, list(busy[worker])))
                time.sleep(0.005)

        watcher = threading.Thread(target=kill_one)
        watcher.start()
        clips = apgstmd.batch(videos, out, client=client, **BANK)
        watcher.join()
        assert len(killed) == 1
        assert 0 < len(done) < CLIPS
        assert [clip.name for clip in clips] == [video.name for video in videos]
        assert all(clip.done for clip in clips)
        # It was not left to the other one alone: the cluster has two again.
        client.wait_for_workers(2, timeout=30)
        worker, begun = killed[0]
        assert worker not in client.run(os.getpid).values()
        # What it had begun did not outlive it for long: it notices at its next frame.
        late = time.monotonic() + 10
        while not all(map(ended, begun)) and time.monotonic() < late:
            time.sleep(0.01)
        assert all(map(ended, begun))
    assert_same(out, undisturbed)


def test_what_is_done_is_not_done_again(
    videos: list[Path], undisturbed: Path, cluster: distributed.LocalCluster, tmp_path: Path
) -> None:
    out = tmp_path / "out"
    with Client(cluster) as client:
        # The same list half done here goes on there; a job that comes twice gives what stands there.
        first = apgstmd.batch(videos[:3], out, jobs=2, **BANK)
        clips = apgstmd.batch(videos, out, client=client, resume=True, **BANK)
        assert [clip.record for clip in clips[:3]] == [clip.record for clip in first]
        assert_same(out, undisturbed)


def test_the_example_for_slurm(
    videos: list[Path],
    cluster: distributed.LocalCluster,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    asked: dict[str, Any] = {}

    @contextlib.contextmanager
    def substitute(**settings: Any) -> Iterator[distributed.LocalCluster]:
        asked.update(settings)
        yield cluster

    monkeypatch.setattr(cluster, "adapt", lambda **limits: asked.update(limits))
    jobqueue = ModuleType("dask_jobqueue")
    jobqueue.SLURMCluster = substitute  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "dask_jobqueue", jobqueue)
    out = tmp_path / "out"
    flags = ["--workers", "7", "--partition", "short", "--speed", "1"]
    words = ["slurm_batch.py", str(videos[0].parent / "cam*"), "--out", str(out), *flags]
    monkeypatch.setattr(sys, "argv", words)
    with pytest.raises(SystemExit) as ended:
        runpy.run_path(str(EXAMPLE), run_name="__main__")
    assert ended.value.code == 0
    assert (asked["queue"], asked["cores"], asked["job_cpu"], asked["maximum"]) == ("short", 1, 2, 7)
    assert "6 of 6 clips are done" in capsys.readouterr().out
    assert len(list((out / "clips").glob("cam*/detections.csv"))) == CLIPS


def test_the_page_over_all(videos: list[Path], tmp_path: Path) -> None:
    hostile = tmp_path / "<img src=x onerror=alert(1)>"
    hostile.symlink_to(videos[0])
    bad = tmp_path / "<script>alert(2)<\u2215script>.mp4"
    bad.write_bytes(b"no video")
    out = tmp_path / "out"
    apgstmd.batch([videos[2], hostile, videos[1], bad], out, speed=1.0, rejection="off", report=True)
    found = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
    assert found, "these tests need Chromium: tools/chromium.sh installs it"
    complaints: list[str] = []
    requests: list[str] = []
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=found, args=["--no-sandbox"])
        for width, scheme in ((375, "dark"), (1200, "light")):
            page = browser.new_page(viewport={"width": width, "height": 800}, color_scheme=scheme)  # type: ignore[arg-type]
            page.on("console", lambda message: complaints.append(message.text))
            page.on("pageerror", lambda error: complaints.append(str(error)))
            page.on("dialog", lambda dialog: complaints.append(dialog.message))
            page.on("request", lambda request: requests.append(request.url))
            page.goto((out / "index.html").as_uri())
            assert page.evaluate("document.documentElement.scrollWidth - innerWidth") <= 0
            light = page.evaluate("getComputedStyle(document.body).backgroundColor") == "rgb(255, 255, 255)"
            assert light == (scheme == "light")
        names = page.locator("#clips tbody th a span")
        assert names.all_inner_texts() == ["_img src_x onerror_alert_1__", "cam1", "cam2"]
        assert page.locator("#clips img").count() == 3
        assert page.evaluate("[...document.images].every(image => image.naturalWidth > 50)")
        assert str(bad) in page.inner_text(".warnings")
        assert "as video" in page.inner_text(".warnings")
        page.click("#clips button:has-text('frames')")
        assert names.all_inner_texts() == ["cam2", "cam1", "_img src_x onerror_alert_1__"]
        assert page.get_attribute("#clips th:nth-child(2)", "aria-sort") == "descending"
        page.click("#clips button:has-text('clip')")
        assert names.all_inner_texts()[2] == "cam2"
        assert all(url.startswith(("file:", "data:")) and not url.endswith("/x") for url in requests)
        # Links with blanks and marks in them lead somewhere.
        page.click("#clips tbody tr:first-child a")
        page.wait_for_load_state()
        assert page.title().endswith("what moves")
        browser.close()
    assert complaints == []
