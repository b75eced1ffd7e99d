"""Everything public is typed, as pyright sees the installed package."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path


def pyright(*arguments: str, folder: Path) -> tuple[int, str]:
    # It asks the first Python there is where packages are.
    here = {**os.environ, "PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"}
    command = [sys.executable, "-m", "pyright", *arguments]
    done = subprocess.run(command, cwd=folder, env=here, capture_output=True, text=True)
    return done.returncode, done.stdout


def test_every_public_symbol_has_a_known_type(tmp_path: Path) -> None:
    _, text = pyright("--verifytypes", "apgstmd", "--ignoreexternal", "--outputjson", folder=tmp_path)
    report = json.loads(text)["typeCompleteness"]
    unknown = [symbol["name"] for symbol in report["symbols"] if symbol["isExported"] and not symbol["isTypeKnown"]]
    assert unknown == []
    assert report["completenessScore"] == 1
    assert report["exportedSymbolCounts"]["withKnownType"] > 200


def test_users_get_the_right_types(tmp_path: Path) -> None:
    (tmp_path / "user.py").write_text("""
from typing import assert_type
import numpy as np
import apgstmd
from apgstmd import Params, Run, RunFrame

frames = [np.zeros((32, 48), np.uint8)]
assert_type(apgstmd.run(frames, speed=1.0), Run)
assert_type(next(apgstmd.watch(iter(frames), attention_alpha=0.5)), RunFrame)
assert_type(Params.preset("practical").attention.alpha, float)
assert_type(Params().rejection.max_missed, int)
apgstmd.Detector((32, 48), params=Params()).process(frames[0], out=(np.zeros((32, 48), np.float32), None))
apgstmd.run(frames, spede=1.0)  # error
apgstmd.Detector((32, 48), attention_alfa=0.5)  # error
Params().attention.alfa.x  # any name may be asked for
""")
    code, text = pyright("--outputjson", "user.py", folder=tmp_path)
    errors = [item for item in json.loads(text)["generalDiagnostics"] if item["severity"] == "error"]
    assert code == 1 and {item["range"]["start"]["line"] for item in errors} == {12, 13}, errors
