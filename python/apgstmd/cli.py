"""The console script `apgstmd`: the same program as the Rust one."""

from __future__ import annotations

import sys

from . import _core


def main() -> None:
    try:
        sys.exit(_core.run_cli(["apgstmd", *sys.argv[1:]]))
    except KeyboardInterrupt:
        # The frame in work is done and the files are closed: as the Rust program, no traceback.
        sys.exit(130)
