"""Targets in what a camera sees, drawn as they are found.

    pip install apgstmd opencv-python
    python webcam_opencv.py                                        the first camera in a window; q ends
    python webcam_opencv.py 1 --speed 2                            another one, targets of about 2 px/frame: a tenth of the work
    python webcam_opencv.py clip.mp4 --speed 1 --out marked.avi    a file into a file, without a window
"""

import argparse
import math

import apgstmd
import cv2

RING = 10
COLOUR = (0, 220, 255)


def draw(picture, found):
    """Rings that leave the target visible, each with a tick where it is heading."""
    for target in found:
        # Directions are counter-clockwise on the screen, and rows go down.
        across, up = math.cos(target.direction), math.sin(target.direction)
        edge = (round(target.x + RING * across), round(target.y - RING * up))
        tip = (round(target.x + 2 * RING * across), round(target.y - 2 * RING * up))
        cv2.circle(picture, (round(target.x), round(target.y)), RING, COLOUR, 1, cv2.LINE_AA)
        cv2.line(picture, edge, tip, COLOUR, 1, cv2.LINE_AA)
    return picture


def main(argv=None):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("source", nargs="?", default="0", help="number of a camera, or a file")
    parser.add_argument("--speed", type=float, help="px/frame; without it a bank of detectors looks for all speeds")
    parser.add_argument("--most", type=int, default=5, help="most rings in a frame, strongest first")
    parser.add_argument("--out", help="write this video (.avi) instead of opening a window")
    args = parser.parse_args(argv)

    camera = cv2.VideoCapture(int(args.source) if args.source.isdigit() else args.source)
    # A camera that waits in a queue shows what was seconds ago.
    camera.set(cv2.CAP_PROP_BUFFERSIZE, 1)
    there, picture = camera.read()
    if not there:
        parser.error(f"nothing comes from {args.source!r}: give the number of a camera or the name of a video file")

    size = picture.shape[:2]
    detector = apgstmd.Bank(size) if args.speed is None else apgstmd.Detector(size, speed=args.speed)
    rate = camera.get(cv2.CAP_PROP_FPS) or 25.0
    video = cv2.VideoWriter(args.out, cv2.VideoWriter.fourcc(*"MJPG"), rate, size[::-1]) if args.out else None
    found = 0
    while there:
        # OpenCV has blue first; grey is all that the model needs.
        out = detector.process(cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY))
        found += len(out.detections)
        draw(picture, out.detections[: args.most])
        if video is not None:
            video.write(picture)
        else:
            cv2.imshow("apgstmd", picture)
            if cv2.waitKey(1) == ord("q"):
                break
        there, picture = camera.read()
    camera.release()
    if video is not None:
        video.release()
    print(f"{detector.frames} frames, {found} detections")


if __name__ == "__main__":
    main()
