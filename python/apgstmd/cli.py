"""The console script `apgstmd`: the same program as the Rust one."""

from __future__ import annotations

import signal
import sys

from . import _core


def main() -> None:
    # Python would only note a Ctrl-C and wait for the program to return; the program knows better what to do.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    sys.exit(_core.run_cli(["apgstmd", *sys.argv[1:]]))
