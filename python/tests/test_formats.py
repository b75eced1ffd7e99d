"""docs/formats.md beside the files themselves: columns, keys and versions."""

from __future__ import annotations

import csv
import json
import re
from pathlib import Path
from typing import Any

import apgstmd
import pytest

PAGE = Path(__file__).parents[2] / "docs" / "formats.md"


def section(title: str) -> str:
    return PAGE.read_text(encoding="utf-8").split(f"\n## {title}\n", 1)[1].split("\n## ", 1)[0]


def first_cells(title: str) -> list[str]:
    """What stands between backticks in the first column of the section's table."""
    rows = [line for line in section(title).splitlines() if line.startswith("| `")]
    return [name for row in rows for name in re.findall(r"`(\w+)`", row.split("|")[1])]


def header(path: Path) -> list[str]:
    with path.open(encoding="utf-8", newline="") as file:
        return next(csv.reader(file))


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("formats")
    scene = apgstmd.synth("demo", frames=40)
    scene.save(folder / "scene")
    mot, coco, report = folder / "t.txt", folder / "t.json", folder / "t.html"
    apgstmd.run(scene, out=folder / "one", speed=1.0, formats=["jsonl"], mot=mot, coco=coco, report=report)
    apgstmd.run(scene, out=folder / "bank", speeds=[1, 2])
    return folder


def load(path: Path) -> Any:
    return json.loads(path.read_text(encoding="utf-8"))


def test_tables(written: Path) -> None:
    assert header(written / "one" / "detections.csv") == first_cells("detections.csv, detections.jsonl")
    assert header(written / "one" / "tracks.csv") == first_cells("tracks.csv")
    assert header(written / "one" / "camera.csv") == first_cells("camera.csv")
    assert header(written / "scene" / "truth.csv") == first_cells("truth.csv, and boxes of yours")
    with (written / "one" / "detections.jsonl").open(encoding="utf-8") as file:
        assert list(json.loads(file.readline())) == first_cells("detections.csv, detections.jsonl")


def test_run_json(written: Path) -> None:
    told = set(first_cells("run.json"))
    one, bank = load(written / "one" / "run.json"), load(written / "bank" / "run.json")
    assert set(one) == told
    sometimes = section("run.json").split("Only where it applies:", 1)[1]
    assert set(bank) - told <= set(re.findall(r"`(\w+)`", sometimes)) and {"bank", "threshold"} <= set(bank)


def test_coco_and_mot(written: Path) -> None:
    data = load(written / "t.json")
    text = section("COCO JSON")
    names = {*data, *data["images"][0], *data["annotations"][0]} - {"id"}
    assert all(f"`{name}`" in text for name in names), [name for name in names if f"`{name}`" not in text]
    fields = (written / "t.txt").read_text(encoding="utf-8").splitlines()[0].split(",")
    assert len(fields) == 10 and fields[7:] == ["-1", "-1", "-1"]


def test_manifest(written: Path) -> None:
    scene = written / "short.toml"
    scene.write_text(apgstmd.synth("demo", frames=3).toml)
    apgstmd.batch(scene, written / "all", speed=1.0)
    page = (PAGE.parent / "many-videos.md").read_text(encoding="utf-8").split("\n## The manifest\n", 1)[1].split("\n## ", 1)[0]
    told = set(re.findall(r"`(\w+)`", page))
    manifest = load(written / "all" / "manifest.json")
    (clip,) = manifest["clips"]
    assert load(written / "all" / clip["folder"] / "clip.json") == clip
    keys = {*manifest, *clip, *clip["input"], *clip["size"], *clip["files"]["run.json"]}
    assert keys <= told, keys - told
    assert f"`schema_version` {manifest['schema_version']};" in page and clip["schema_version"] == manifest["schema_version"]
    versions = re.search(r"^\| manifest.json and clip.json .*\| (\d+) \|$", PAGE.read_text(encoding="utf-8"), re.MULTILINE)
    assert versions and int(versions.group(1)) == manifest["schema_version"]


def test_versions(written: Path) -> None:
    page = re.search(r'<script type="application/json" id="data">(.*?)</script>', (written / "t.html").read_text(), re.DOTALL)
    assert page
    state = apgstmd.Detector((32, 32)).state_dict()
    versions = {
        "run.json": load(written / "one" / "run.json")["schema_version"],
        "COCO": load(written / "t.json")["info"]["schema_version"],
        "page": json.loads(page.group(1))["schema_version"],
        "state": state["format"],
    }
    table = {line.split("|")[1]: int(line.split("|")[2]) for line in PAGE.read_text().splitlines() if re.match(r"^\|.*\| \d+ \|$", line)}
    for what, version in versions.items():
        told = [number for name, number in table.items() if what in name]
        assert told == [version], (what, told, version)


def test_parameter_sections() -> None:
    text = section("Parameters, TOML")
    assert set(re.findall(r"`\[(\w+)\]`", text)) == {parameter.section for parameter in apgstmd.parameters()} | {"bank"}
