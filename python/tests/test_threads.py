"""Several threads and processes: the interpreter is free while a frame is computed, and one detector has one user."""

from __future__ import annotations

import signal
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


def test_two_detectors_are_at_work_at_once() -> None:
    # Each says that it is busy while the other is: neither waits for the interpreter, nor for the other.
    frame = np.random.default_rng(5).integers(0, 256, SIZE, np.uint8)
    both = [apgstmd.Detector(SIZE, speed=1.0, threads=1) for _ in range(2)]
    stop = threading.Event()

    def work(detector: apgstmd.Detector) -> None:
        while not stop.is_set():
            try:
                detector.process(frame)
            except RuntimeError:
                # This test was looking at it.
                pass

    def busy(detector: apgstmd.Detector) -> bool:
        try:
            return detector.frames < 0
        except RuntimeError:
            return True

    workers = [threading.Thread(target=work, args=(detector,)) for detector in both]
    for worker in workers:
        worker.start()
    deadline = time.monotonic() + 60
    at_once = 0
    while at_once < 20 and time.monotonic() < deadline:
        # The first one is looked at again: it was busy all the while, as far as a few microseconds tell.
        at_once += busy(both[0]) and busy(both[1]) and busy(both[0])
        time.sleep(0.001)
    stop.set()
    for worker in workers:
        worker.join()
    assert at_once == 20


def test_ctrl_c_is_heard_when_the_frame_is_done_and_the_detector_goes_on() -> None:
    # A frame of seconds; the signal comes in the middle of it. A shell's background jobs ignore SIGINT, and their children with them.
    script = """
import signal, sys, time
import numpy as np, apgstmd
signal.signal(signal.SIGINT, signal.default_int_handler)
size = (2160, 3840)
frames = [np.random.default_rng(t).integers(0, 256, size, np.uint8) for t in range(2)]
disturbed, alone = (apgstmd.Detector(size, threads=1, rejection="off") for _ in range(2))
begin = time.monotonic()
alone.process(frames[0])
took = time.monotonic() - begin
print("begun", took, flush=True)
begin = time.monotonic()
try:
    disturbed.process(frames[0])
    time.sleep(60)
except KeyboardInterrupt:
    waited = time.monotonic() - begin
same = np.array_equal(disturbed.process(frames[1]).response, alone.process(frames[1]).response)
print(waited, disturbed.frames, same)
"""
    with subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        took = float(process.stdout.readline().split()[1])
        time.sleep(took / 4)
        process.send_signal(signal.SIGINT)
        waited, frames, same = process.communicate(timeout=120)[0].split()
    # Not before the end of the frame, and not long after: machines that do other things besides take their time.
    assert (frames, same) == ("2", "True") and float(waited) < 5 * took + 1


def test_too_little_memory_is_refused_with_the_number_of_bytes() -> None:
    # Anything that is allocated after that fails, and what Rust fails to allocate ends the process.
    code = """
import re, resource
import apgstmd
there = int(open("/proc/self/statm").read().split()[0]) * resource.getpagesize()
resource.setrlimit(resource.RLIMIT_AS, (there + (1 << 29), resource.RLIM_INFINITY))
for make in (lambda: apgstmd.Detector((4096, 8192), speed=1.0, threads=1), lambda: apgstmd.Bank((2048, 4096), threads=1)):
    try:
        make()
    except MemoryError as error:
        bytes = int(re.search(r"need (\\d+) bytes of memory", str(error)).group(1))
        assert bytes > 1 << 30, bytes
    else:
        raise AssertionError("it was made")
apgstmd.Detector((96, 128), threads=1)
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
