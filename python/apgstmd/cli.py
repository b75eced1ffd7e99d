"""The console script `apgstmd`: the same program as the Rust one."""

from __future__ import annotations

import sys

from . import _core


def main() -> None:
    sys.exit(_core.run_cli(["apgstmd", *sys.argv[1:]]))
