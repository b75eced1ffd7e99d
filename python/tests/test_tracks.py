"""Tracks of a run, and their evaluation against an independent evaluator."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import apgstmd
from scenes import textured_square, write_png
from test_scene import small

RADIUS = 5.0
_Ids = list[NDArray[np.int64]]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("frames")
    for t, frame in enumerate(textured_square(50)):
        write_png(path / f"f{t}.png", frame)
    return path


def test_tracks_of_a_run(folder: Path, tmp_path: Path) -> None:
    mot, coco = tmp_path / "t.txt", tmp_path / "t.json"
    run = apgstmd.run(folder, speed=1.0, mot=mot, coco=coco, box_size=6)
    tracks = run.tracks
    assert list(tracks.columns) == ["frame", "time", "track", "x", "y", "vx", "vy", "score", "state", "age"]
    assert [column.dtype.kind for column in tracks.columns.values()] == list("ififffffUi")
    assert repr(run) == f"Run(50 frames, {len(run.detections)} detections, 1 track)"
    assert np.all(np.diff(tracks.frame) >= 0) and np.all(np.isnan(tracks.time))
    # The square moves by 1 px a frame; the strongest track is on it.
    best = tracks[tracks.track == tracks.track[np.argmax(tracks.score)]]
    assert best.frame[-1] == 49 and np.all(np.diff(best.frame) == 1)
    # The first detections, with little of the target seen, are several px off.
    assert np.all(np.hypot(best.x - 20 - best.frame, best.y - 32)[3:] < 2)
    assert abs(best.vx[-1] - 1) < 0.3 and set(best.state) <= {"confirmed", "coasting"}
    assert isinstance(best[0], apgstmd.TrackPoint) and best[0].age == 0
    assert len(mot.read_text().splitlines()) == len(tracks)
    assert [a["track_id"] for a in json.loads(coco.read_text())["annotations"]] == tracks.track.tolist()
    assert len(apgstmd.run(folder, speed=1.0, tracks=False).tracks) == 0
    with pytest.raises(ValueError, match="--box-size is -1"):
        apgstmd.run(folder, mot=tmp_path / "u.txt", box_size=-1)
    none = apgstmd.run(folder, speed=1.0, tracking_birth_hits=60, tracking_birth_window=60)
    assert len(none.tracks) == 0 and len(none.detections) == len(run.detections)


def test_a_target_behind_something_keeps_its_id(tmp_path: Path) -> None:
    """Hidden for some 20 frames by what looks like the background; prediction says where it goes on."""
    dice = np.random.default_rng(3)
    noise = dice.normal(0, 1, (84, 164))
    texture = np.sum([noise[i : i + 80, j : j + 160] for i in range(5) for j in range(5)], axis=0)
    background = np.clip(170 + 5 * texture, 100, 255).astype(np.uint8)
    for t in range(120):
        frame = background.copy()
        frame[38:43, 18 + t : 23 + t] = 20
        frame[:, 80:100] = background[:, 80:100]
        write_png(tmp_path / f"{t:03}.png", frame)
    tracks = apgstmd.run(tmp_path, speed=1.0).tracks
    best = tracks[tracks.track == tracks.track[np.argmax(tracks.score)]]
    off = np.hypot(best.x - 20 - best.frame, best.y - 40)
    hidden = best.state == "coasting"
    assert best.frame[-1] == 119 and len(best) > 100
    assert hidden.sum() > 10 and np.all(best.score[hidden] > 0), "the response guides it"
    assert np.all(off[5:] < 5), off
    blind = apgstmd.run(tmp_path, speed=1.0, tracking_guide=False).tracks
    off_blind = np.hypot(blind.x - 20 - blind.frame, blind.y - 40)[blind.state == "coasting"]
    assert off_blind.max() > 1.5 * off[hidden].max()


def test_every_form_of_tracks_is_judged_the_same(tmp_path: Path) -> None:
    scene = small()
    out = tmp_path / "out"
    run = apgstmd.run(scene, speed=1.0, out=out, mot=tmp_path / "t.txt")
    expected = apgstmd.evaluate(run, scene).tracks
    assert expected is not None and expected.matched > 5
    assert repr(expected).startswith(f"TrackEvaluation({expected.tracks} tracks, {expected.identities} targets, mota=")
    forms: list[Any] = [out, out / "tracks.csv", tmp_path / "t.txt", run.tracks, run.tracks.columns]
    for found in forms:
        got = apgstmd.evaluate(found, scene, frames=40).tracks
        assert got is not None
        assert (got.matched, got.id_switches) == (expected.matched, expected.id_switches)
        # Places in MOTChallenge text are rounded.
        assert got.hota == pytest.approx(expected.hota, abs=0.01)
    assert apgstmd.evaluate(run.detections, scene).tracks is None
    assert apgstmd.evaluate(out / "detections.csv", scene).tracks is None
    truth = {name: np.concatenate([column, column]) for name, column in scene.truth.columns.items() if name != "id"}
    unknown = apgstmd.evaluate(run, truth)
    assert unknown.tracks is None and "several targets without id" in " ".join(unknown.notes)


class Scenario:
    """Targets that wander, and tracks of them with gaps, switches, noise and false alarms."""

    def __init__(self, seed: int) -> None:
        dice = np.random.default_rng(seed)
        self.frames = int(dice.integers(1, 40))
        targets, span = int(dice.integers(0, 5)), float(dice.choice([12.0, 40.0]))
        truth: list[tuple[int, int, float, float]] = []
        found: list[tuple[int, int, float, float]] = []
        for target in range(targets):
            first, last = sorted(dice.integers(0, self.frames + 1, 2))
            place, step = dice.uniform(0, span, 2), dice.normal(0, 0.5, 2)
            track = 10 * target
            for t in range(first, last):
                place = place + step
                truth.append((t, target + 3, *place))
                if dice.random() < 0.1:
                    track += 1
                if dice.random() < 0.8:
                    found.append((t, track, *(place + dice.normal(0, 1.5, 2))))
        for t in range(self.frames):
            found += [(t, 900 + k, *dice.uniform(0, span, 2)) for k in range(dice.integers(0, 3))]
        names = ("frame", "id", "x", "y")
        self.truth = {name: np.array([row[i] for row in truth]) for i, name in enumerate(names)}
        self.found = {name: np.array([row[i] for row in found]) for i, name in enumerate(names)}

    def ours(self) -> apgstmd.TrackEvaluation:
        found: dict[str, Any] = {"frame": self.found["frame"], "track": self.found["id"], "x": self.found["x"]}
        found |= {"y": self.found["y"], "score": np.ones(len(self.found["frame"]))}
        # Boxes without extent: what matches is the disc.
        side = np.zeros(len(self.truth["frame"]))
        truth = {"frame": self.truth["frame"], "id": self.truth["id"], "w": side, "h": side}
        truth |= {name: self.truth[name] + 0.5 for name in ("x", "y")}
        judged = apgstmd.evaluate(found, truth, frames=self.frames, radius=RADIUS).tracks
        assert judged is not None
        return judged

    def theirs(self) -> tuple[dict[str, Any], dict[str, Any], dict[str, Any]]:
        """CLEAR, Identity and HOTA of TrackEval. The first two match from a similarity of 0.5 on: half of ours is added."""
        from trackeval.metrics import CLEAR, HOTA, Identity

        targets, target_ids = self._numbered(self.truth)
        tracks, track_ids = self._numbered(self.found)
        similarity = []
        for t in range(self.frames):
            here, there = (
                np.stack([table[name][table["frame"] == t] for name in ("x", "y")], axis=1)
                for table in (self.truth, self.found)
            )
            distance = np.linalg.norm(here[:, None] - there[None], axis=2)
            similarity.append(np.maximum(0, 1 - distance / RADIUS))
        data: dict[str, Any] = {
            "num_timesteps": self.frames,
            "num_gt_ids": targets,
            "num_tracker_ids": tracks,
            "num_gt_dets": len(self.truth["frame"]),
            "num_tracker_dets": len(self.found["frame"]),
            "gt_ids": target_ids,
            "tracker_ids": track_ids,
            "similarity_scores": similarity,
        }
        halved = data | {"similarity_scores": [np.where(s > 0, 0.5 + 0.5 * s, 0) for s in similarity]}
        quiet = {"PRINT_CONFIG": False}
        clear, identity = CLEAR(quiet).eval_sequence(halved), Identity(quiet).eval_sequence(halved)
        return clear, identity, HOTA().eval_sequence(data)

    def _numbered(self, table: dict[str, NDArray[Any]]) -> tuple[int, _Ids]:
        names, numbers = np.unique(table["id"], return_inverse=True)
        return len(names), [numbers[table["frame"] == t] for t in range(self.frames)]


# matplotlib and its like, which TrackEval brings, are not what is tested.
@pytest.mark.filterwarnings("ignore")
def test_metrics_agree_with_trackeval() -> None:
    switches = 0
    for seed in range(200):
        scenario = Scenario(seed)
        ours = scenario.ours()
        clear, identity, hota = scenario.theirs()
        counted = {
            "CLR_TP": ours.matched, "CLR_FN": ours.misses, "CLR_FP": ours.false_positives, "IDSW": ours.id_switches,
            "Frag": ours.fragmentations, "MT": ours.mostly_tracked, "PT": ours.partly_tracked, "ML": ours.mostly_lost,
        }
        assert counted == {name: clear[name] for name in counted}, seed
        counted = {"IDTP": ours.id_true, "IDFN": ours.id_missed, "IDFP": ours.id_false}
        assert counted == {name: identity[name] for name in counted}, seed
        pairs = [(ours.mota, clear["MOTA"]), (ours.idf1, identity["IDF1"])]
        if ours.motp is not None:
            pairs.append((ours.motp, 2 * RADIUS * (1 - clear["MOTP"])))
        for name, key in (("hota", "HOTA"), ("det_a", "DetA"), ("ass_a", "AssA")):
            pairs += zip(getattr(ours.hota_at, name), hota[key], strict=True)
            pairs.append((getattr(ours, name), hota[key].mean()))
        # Sums of the same numbers in another order.
        ours_told, theirs_told = np.array(pairs).T
        np.testing.assert_allclose(ours_told, theirs_told, rtol=1e-9, atol=1e-9, err_msg=str(seed))
        switches += ours.id_switches
    assert switches > 100, "the scenes must be hard enough"
