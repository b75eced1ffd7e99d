"""The package itself: installed, documented, quick to import."""

from __future__ import annotations

import doctest
import importlib
import inspect
import pkgutil
import re
import statistics
import subprocess
import sys
from importlib import metadata, resources

import pytest

import apgstmd
from apgstmd.options import Parameters
from apgstmd.run_options import RunOptions

MODULES = [name for _, name, _ in pkgutil.iter_modules(apgstmd.__path__, "apgstmd.") if name != "apgstmd.__main__"]


def test_the_installed_wheel_is_tested() -> None:
    assert "site-packages" in apgstmd.__file__
    assert metadata.version("apgstmd") == apgstmd.__version__
    assert resources.files("apgstmd").joinpath("py.typed").is_file()
    needed = [one for one in metadata.requires("apgstmd") or [] if "extra ==" not in one]
    assert needed == ["numpy>=1.26"]


@pytest.mark.parametrize("name", ["apgstmd", *MODULES])
def test_examples_in_the_documentation(name: str) -> None:
    assert doctest.testmod(importlib.import_module(name)).failed == 0


def test_there_are_examples() -> None:
    finder = doctest.DocTestFinder()
    assert sum(bool(test.examples) for name in MODULES for test in finder.find(importlib.import_module(name))) >= 4


def test_everything_public_is_documented() -> None:
    for name in apgstmd.__all__:
        thing = getattr(apgstmd, name)
        if inspect.isclass(thing) or callable(thing):
            assert inspect.getdoc(thing), name
        if inspect.isclass(thing):
            for member, value in vars(thing).items():
                if not member.startswith("_") and (callable(value) or isinstance(value, property)):
                    assert inspect.getdoc(value), f"{name}.{member}"


def test_import_is_quick_and_brings_nothing_but_numpy() -> None:
    # Time of the processor, which is that of the clock on a machine that does nothing else.
    script = """
import sys, time, numpy
before, start = set(sys.modules), time.process_time()
import apgstmd
print(time.process_time() - start, *sorted(m for m in set(sys.modules) - before if m.partition(".")[0] in
      {"matplotlib", "pandas", "PIL", "cv2", "av", "difflib", "subprocess", "asyncio"}))
"""
    runs = [
        subprocess.run([sys.executable, "-c", script], check=True, capture_output=True, text=True).stdout.split()
        for _ in range(9)
    ]
    assert statistics.median(float(run[0]) for run in runs) < 0.15
    assert runs[0][1:] == []


def test_what_is_imported_later_is_there() -> None:
    script = "import apgstmd; assert set(apgstmd.__all__) <= set(dir(apgstmd)); from apgstmd import *; print(run, Params, plot)"
    assert subprocess.run([sys.executable, "-c", script], check=True, capture_output=True, text=True).stdout
    with pytest.raises(AttributeError, match="module 'apgstmd' has no attribute 'runn'"):
        apgstmd.runn  # noqa: B018
    assert str(inspect.signature(apgstmd.run)).startswith("(input: 'Input', *, out: 'str | os.PathLike[str] | None' = None")
    assert set(inspect.signature(apgstmd.watch).parameters) == {"input", "parameters", *RunOptions.__annotations__} - set(
        Parameters.__annotations__
    )


def test_the_version_is_a_version() -> None:
    assert re.fullmatch(r"\d+\.\d+\.\d+", apgstmd.__version__)
