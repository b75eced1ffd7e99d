"""Tracks for labelling tools: MOTChallenge text, COCO JSON, and two files that CVAT takes.

    python export_cvat_mot.py sky.mp4 --out labels              --speed 1 where the speed is known
    python export_cvat_mot.py frames/ --out labels --box-size 9

writes into labels/
    tracks.txt       MOTChallenge results: frame,id,left,top,width,height,conf,-1,-1,-1
    tracks.json      COCO: images, annotations with track_id, score and the point itself
    cvat-mot.zip     for CVAT, "Upload annotations", format "MOT 1.1"
    cvat-video.xml   the same, format "CVAT 1.1": a track is one object that can be dragged and corrected
Make the CVAT task of the same frames, with one label named "target".
"""

import argparse
import zipfile
from pathlib import Path
from xml.etree import ElementTree

import apgstmd
import numpy as np


def mot_ground_truth(results):
    """MOTChallenge results as ground truth, which CVAT takes: `not ignored`, class and visibility behind the box."""
    boxes = (line.split(",")[:6] for line in results.splitlines())
    return "".join(",".join([*box, "1", "1", "1"]) + "\n" for box in boxes)


def cvat_video(tracks, side, frames):
    """CVAT's own XML of a video task: boxes of `side` px, frames from 0, x and y from the edge of the first pixel."""
    root = ElementTree.Element("annotations")
    ElementTree.SubElement(root, "version").text = "1.1"
    for number in np.unique(tracks.track):
        points = tracks[tracks.track == number]
        track = ElementTree.SubElement(root, "track", id=str(number), label="target", source="auto")
        for point in points:
            left, top = point.x + 0.5 - side / 2, point.y + 0.5 - side / 2
            box(track, point.frame, (left, top, side), occluded=point.state == "coasting", outside=False)
        if points.frame[-1] + 1 < frames:
            # Without it the last box would stay until the end of the video.
            box(track, int(points.frame[-1]) + 1, (left, top, side), occluded=False, outside=True)
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="unicode", xml_declaration=True) + "\n"


def box(track, frame, place, *, occluded, outside):
    left, top, side = place
    edges = {"xtl": left, "ytl": top, "xbr": left + side, "ybr": top + side}
    flags = {"outside": outside, "occluded": occluded, "keyframe": True}
    text = {name: f"{value:.2f}" for name, value in edges.items()} | {name: str(int(flag)) for name, flag in flags.items()}
    ElementTree.SubElement(track, "box", frame=str(frame), **text)


def export(source, out, box_size=5.0, **options):
    """Runs apgstmd over `source` and writes the four files; `options` are those of `apgstmd.run`."""
    out = Path(out)
    out.mkdir(parents=True, exist_ok=True)
    text, coco = out / "tracks.txt", out / "tracks.json"
    found = apgstmd.run(source, mot=text, coco=coco, box_size=box_size, force=True, **options)
    with zipfile.ZipFile(out / "cvat-mot.zip", "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("gt/gt.txt", mot_ground_truth(text.read_text(encoding="utf-8")))
        archive.writestr("gt/labels.txt", "target\n")
    last = found.summary["input"]["stop"]
    (out / "cvat-video.xml").write_text(cvat_video(found.tracks, box_size, last), encoding="utf-8")
    return found


def main(argv=None):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("source", help="whatever `apgstmd run` takes: a video, a folder of pictures, scene.toml")
    parser.add_argument("--out", required=True, help="folder for the four files")
    parser.add_argument("--speed", type=float, help="px/frame; a bank of detectors looks for all speeds without it")
    parser.add_argument("--box-size", type=float, default=5.0, help="side of the box around each point, px")
    args = parser.parse_args(argv)
    print(export(args.source, args.out, args.box_size, speed=args.speed))


if __name__ == "__main__":
    main()
