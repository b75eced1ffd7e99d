"""Several threads and processes: the interpreter is free while a frame is computed, and one detector has one user."""

from __future__ import annotations

import subprocess
import sys
import threading
import time

import numpy as np
import pytest

import apgstmd

SIZE = (240, 320)


def test_a_busy_detector_says_so_and_is_not_disturbed() -> None:
    # That this thread can find the detector busy at all proves that the GIL is released inside.
    frames = np.random.default_rng(3).integers(0, 256, (30, *SIZE), np.uint8)
    shared, alone = (apgstmd.Detector(SIZE, speed=1.0, threads=1) for _ in range(2))
    responses = []

    def work() -> None:
        for frame in frames:
            while True:
                try:
                    responses.append(shared.process(frame).response)
                    break
                except RuntimeError:
                    time.sleep(0)

    worker = threading.Thread(target=work)
    worker.start()
    refusals = 0
    while worker.is_alive():
        try:
            assert shared.frames <= len(frames)
        except RuntimeError as error:
            assert "at work in another thread: make one detector for each stream" in str(error)
            refusals += 1
        time.sleep(0.0005)
    worker.join()
    assert refusals > 0
    for frame, response in zip(frames, responses, strict=True):
        assert np.array_equal(alone.process(frame).response, response)


def test_detectors_side_by_side_do_not_disturb_each_other() -> None:
    frames = np.random.default_rng(4).integers(0, 256, (8, *SIZE), np.uint8)
    alone = apgstmd.Detector(SIZE, speed=1.0, threads=1)
    wanted = [alone.process(frame).response for frame in frames]
    failures: list[str] = []

    def work() -> None:
        own = apgstmd.Detector(SIZE, speed=1.0, threads=2)
        for frame, response in zip(frames, wanted, strict=True):
            if not np.array_equal(own.process(frame).response, response):
                failures.append("another result")

    workers = [threading.Thread(target=work) for _ in range(3)]
    for worker in workers:
        worker.start()
    for worker in workers:
        worker.join()
    assert not failures


def test_a_detector_does_not_survive_a_fork() -> None:
    # In a process of its own: forking this one would take the test runner along.
    script = """
import os, numpy as np, apgstmd
detector = apgstmd.Detector((32, 32), threads=2)
detector.process(np.zeros((32, 32), np.uint8))
child = os.fork()
if child == 0:
    try:
        detector.process(np.zeros((32, 32), np.uint8))
    except RuntimeError as error:
        ok = "made before a fork" in str(error)
        apgstmd.Detector((32, 32), threads=2).process(np.zeros((32, 32), np.uint8))
        os._exit(0 if ok else 3)
    os._exit(4)
assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0
"""
    subprocess.run([sys.executable, "-W", "ignore", "-c", script], check=True, timeout=60)
