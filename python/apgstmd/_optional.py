"""Packages that only some functions need."""

from __future__ import annotations

import importlib
from typing import Any


def need(package: str, extra: str, what: str) -> Any:
    """The package, or an ImportError that says how to get it."""
    try:
        return importlib.import_module(package)
    except ImportError as error:
        raise ImportError(
            f"{what} needs the package {package}: pip install 'apgstmd[{extra}]'", name=package
        ) from error
