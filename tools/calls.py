"""Lets every system call of a run that has to do with files fail in turn, and kills the program at each. After that each file must be
valid to its last whole row, and the same line, said again, must end with the files of a run that was never disturbed.

    python3 tools/calls.py PROGRAM    # needs strace

A line for each kind of call: how many there are, and how often the program ended well, with an error, or killed. Names what
went wrong, and fails.
"""

import json
import re
import shutil
import subprocess
import sys
import tempfile
from collections import Counter
from pathlib import Path

CALLS = "openat read statx lseek getdents64 mkdir write fsync fdatasync ftruncate rename unlink".split()
FAULTS = {"openat": ["EACCES", "EMFILE"], "write": ["ENOSPC", "EIO"]}
SCENE = """width = 80
height = 64
rate = 100.0
frames = 40
seed = 5
[background]
kind = 'natural'
velocity = [-30.0, 0.0]
[[target]]
path = { kind = 'straight', start = [10.0, 20.0], speed = 60.0 }
[[target]]
path = { kind = 'straight', start = [10.0, 32.0], speed = 100.0 }
"""
RUN = "--out {out} --speed 1 --threads 1 --resume"
LINES = {
    "tables, checkpoints": f"run {{frames}} {RUN} --format csv,jsonl --mot {{out}}/tracks.mot --checkpoint 8",
    "COCO, page, pictures": f"run {{scene}} {RUN} --coco {{out}}/coco.json --report {{out}}/page.html --overlay",
}
TABLES = (".csv", ".jsonl", ".mot")
# Of run.json, what is not the same each time.
TIMES = {"seconds", "processor_seconds", "seconds_per_frame", "stage_seconds_per_frame", "resumed_after"}


def files(out: Path) -> dict[str, bytes]:
    """Every file by its name, without what is not the same each time."""
    found = {}
    for path in (path for path in out.rglob("*") if path.is_file()):
        content = path.read_bytes()
        if path.name == "run.json":
            content = repr({key: value for key, value in json.loads(content).items() if key not in TIMES}).encode()
        elif path.suffix == ".html":
            content = content.rstrip()[-7:]
        found[str(path.relative_to(out))] = content
    return found


def wrong(out: Path, killed: bool, truth: dict[str, bytes]) -> str:
    """What is not as it should be after a fault."""
    for path in (path for path in out.rglob("*") if path.is_file()):
        name, content = str(path.relative_to(out)), path.read_bytes()
        if path.suffix in TABLES:
            rows = content[: content.rfind(b"\n") + 1]
            if rows != content and not killed:
                return f"{name} ends with a part of a row"
            if not truth[name].startswith(rows):
                return f"{name} is not the beginning of what it will be"
        elif path.suffix == ".json":
            try:
                json.loads(content)
            except ValueError:
                return f"{name} is no JSON"
        elif path.suffix == ".html" and not content.rstrip().endswith(b"</html>"):
            return f"{name} is cut off"
        elif path.suffix == ".png" and not content.endswith(b"IEND\xaeB`\x82"):
            return f"{name} is cut off"
        elif path.suffix == ".part" and not killed:
            return f"{name} was left"
    return ""


class Runs:
    def __init__(self, program: str, line: str, folder: Path) -> None:
        self.out, frames, scene = folder / "out", folder / "frames", folder / "scene.toml"
        scene.write_text(SCENE)
        subprocess.run([program, "synth", str(scene), "--out", str(frames), "--quiet"], check=True)
        self.line = [program, *(word.format(out=self.out, frames=frames, scene=scene) for word in line.split())]
        self.log = folder / "calls"
        self.clear()
        assert self.go()[0] == 0, "the run that nothing disturbs"
        self.truth = files(self.out)

    def clear(self) -> None:
        shutil.rmtree(self.out, ignore_errors=True)

    def go(self, *strace: str) -> tuple[int, str]:
        traced = ["strace", "-f", "-o", str(self.log), *strace] if strace else []
        ran = subprocess.run([*traced, *self.line], capture_output=True, text=True, timeout=120, stdin=subprocess.DEVNULL)
        return ran.returncode, ran.stderr

    def counts(self) -> dict[str, int]:
        """How often each is called, by the thread that calls it most."""
        self.clear()
        self.go("-e", "trace=" + ",".join(CALLS))
        called = Counter(re.findall(r"^(\d+) +(\w+)\(", self.log.read_text(), re.MULTILINE))
        return {call: max((n for (_, name), n in called.items() if name == call), default=0) for call in CALLS}

    def disturb(self, call: str, fault: str, at: int) -> tuple[str, str]:
        """How the run ended, and what was wrong with it or with the next."""
        self.clear()
        killed = fault == "signal=KILL"
        try:
            code, said = self.go("-e", f"trace={call}", "-e", f"inject={call}:{fault}:when={at}")
        except subprocess.TimeoutExpired:
            return "hung", "no end after two minutes"
        end = {0: "well", 1: "error"}.get(code, "killed" if killed else f"status {code}")
        problem = wrong(self.out, killed, self.truth)
        # Before the program begins, the system's own loader says it.
        if end.startswith("status") and "error while loading" not in said or "panicked" in said:
            problem = said
        elif code == 0 and files(self.out) != self.truth:
            problem = "it says that all is well"
        elif code == 1 and "error: " not in said and call != "write":
            # A write that fails may be that of the message.
            problem = "an error without a word"
        again, said = self.go()
        after = files(self.out)
        if not problem and (again != 0 or after != self.truth):
            names = sorted(name for name in {*after, *self.truth} if after.get(name) != self.truth.get(name))
            problem = f"then {', '.join(names)} differ: {said}"
        return end, problem


def main() -> None:
    failed = False
    for what, line in LINES.items():
        with tempfile.TemporaryDirectory() as folder:
            runs = Runs(str(Path(sys.argv[1]).resolve()), line, Path(folder))
            for call, times in runs.counts().items():
                for fault in [*(f"error={name}" for name in FAULTS.get(call, ["EIO"])), "signal=KILL"]:
                    ends: Counter[str] = Counter()
                    for at in range(1, times + 1):
                        end, problem = runs.disturb(call, fault, at)
                        ends[end] += 1
                        if problem:
                            failed = True
                            print(f"{what}: {call} {at}, {fault}: {problem}", flush=True)
                    if times:
                        told = ", ".join(f"{n} {end}" for end, n in sorted(ends.items()))
                        print(f"{what} | {call} | {fault} | {times} | {told}", flush=True)
    sys.exit(failed)


if len(sys.argv) != 2:
    sys.exit(__doc__)
main()
