"""Made-up scenes with ground truth."""

from __future__ import annotations

import operator
import os
import tempfile
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, ClassVar, Literal, NamedTuple, SupportsIndex, overload

import numpy as np
from numpy.typing import NDArray

from . import _core
from .options import whole
from .table import Table


class TruthRow(NamedTuple):
    """One target in one frame.

    x, y is the upper left edge of its part inside the picture, px, pixel i lying between edge i and edge i + 1; w, h its
    size, px. The centre as an array index, comparable with a detection, is (x + w/2 - 0.5, y + h/2 - 0.5). visible: at
    least half of it can be seen. contrast: Weber contrast against the 10 px around it.
    """

    frame: int
    id: int
    x: float
    y: float
    w: float
    h: float
    visible: bool
    contrast: float


class Truth(Table):
    """Ground truth as NumPy columns of one length, frame by frame.

    frame, id: int64; x, y, w, h, contrast: float64; visible: bool; meanings and units as in `TruthRow`.
    """

    __slots__ = ("frame", "id", "x", "y", "w", "h", "visible", "contrast")
    names: ClassVar[tuple[str, ...]] = ("frame", "id", "x", "y", "w", "h", "visible", "contrast")
    row: ClassVar[Any] = TruthRow

    frame: NDArray[np.int64]
    id: NDArray[np.int64]
    x: NDArray[np.float64]
    y: NDArray[np.float64]
    w: NDArray[np.float64]
    h: NDArray[np.float64]
    visible: NDArray[np.bool_]
    contrast: NDArray[np.float64]


class Scene:
    """A scene, drawn frame by frame as it is asked for; made by `apgstmd.synth`.

    `len(scene)` is the number of frames, `scene[t]` one of them as (H, W) float32 luminance in [0, 1], `scene[a:b]` several
    as (N, H, W); iterating draws one after the other. The same scene is the same picture on every machine.
    """

    __slots__ = ("_core", "_truth", "__weakref__")
    _core: _core.Scene
    _truth: Truth | None

    def __init__(self, scene: Mapping[str, object] | tuple[str, str], frames: int | None, seed: int | None) -> None:
        self._core = _core.Scene(scene, frames, seed)
        self._truth = None

    def __len__(self) -> int:
        return self._core.frames

    @overload
    def __getitem__(self, index: SupportsIndex) -> NDArray[np.float32]: ...
    @overload
    def __getitem__(self, index: slice) -> NDArray[np.float32]: ...
    def __getitem__(self, index: SupportsIndex | slice) -> NDArray[np.float32]:
        if isinstance(index, slice):
            chosen = range(*index.indices(len(self)))
            frames = np.empty((len(chosen), *self.shape), np.float32)
            for i, t in enumerate(chosen):
                frames[i] = self._core.frame(t)
            return frames
        t = operator.index(index)
        if not -len(self) <= t < len(self):
            raise IndexError(f"frame {t} of a scene with {len(self)} frames")
        return self._core.frame(t % len(self))

    def __iter__(self) -> Iterator[NDArray[np.float32]]:
        return map(self._core.frame, range(len(self)))

    @property
    def shape(self) -> tuple[int, int]:
        """(height, width) of a frame, px."""
        return self._core.shape

    @property
    def rate(self) -> float:
        """Frames per second."""
        return self._core.rate

    @property
    def truth(self) -> Truth:
        """Where the targets are, over all frames; computed once."""
        if self._truth is None:
            columns = self._core.truth()
            self._truth = Truth(**dict(zip(Truth.names, columns, strict=True)))
        return self._truth

    @property
    def toml(self) -> str:
        """The scene file, with everything filled in: `apgstmd.synth(scene.toml)` is this scene again."""
        return self._core.toml

    def save(
        self,
        out: str | os.PathLike[str],
        *,
        bit_depth: Literal[8, 16] = 8,
        force: bool = False,
        threads: int | None = None,
        progress: bool = False,
    ) -> Path:
        """Writes out/scene_000000.png ..., truth.csv and scene.toml, as `apgstmd synth` does, and returns the folder.

        bit_depth : of the grey PNG files, 8 or 16.
        force : replace the scene that `out` already holds; other files are never replaced.
        threads : 1 to 256, all cores by default.
        progress : show a progress bar on a terminal and a summary.

        Raises ValueError for another bit depth, RuntimeError for a folder that holds something or cannot be written.
        """
        count = whole("threads", threads, 1, 256)
        with tempfile.TemporaryDirectory(prefix="apgstmd-") as scratch:
            file = Path(scratch, "scene.toml")
            file.write_text(self.toml, encoding="utf-8")
            flags = [f"--out={os.fspath(out)}", f"--bit-depth={bit_depth}"]
            flags += [] if count is None else [f"--threads={count}"]
            flags += [f"--{name}" for name, wanted in (("force", force), ("quiet", not progress)) if wanted]
            _core.run(["apgstmd", "synth", *flags, "--", str(file)])
        return Path(out)

    def __reduce__(self) -> Any:
        return Scene, (("text", self.toml), None, None)

    def __repr__(self) -> str:
        height, width = self.shape
        return f"Scene({len(self)} frames of {height} x {width}, {self.rate:g} Hz)"


def synth(
    scene: str | os.PathLike[str] | Mapping[str, object], *, frames: int | None = None, seed: int | None = None
) -> Scene:
    """A scene of small moving targets with its ground truth.

    scene : a scene file as a path, as TOML text or as a dict (None stands for a key left out), "demo" for the scene of
        `apgstmd demo`, or "paper" for the paper's default stimulus. `apgstmd synth --print` prints an example with every
        key. The picture of a panorama is looked for beside the file, or else in the current folder.
    frames : number of frames, in place of the scene's.
    seed : of background and noise, in place of the scene's.

    Raises FileNotFoundError for a missing file, ValueError for an unknown key (with its line) or a value that breaks a
    rule, TypeError for a value of a wrong type, RuntimeError for a panorama that cannot be read.

    >>> import apgstmd
    >>> scene = apgstmd.synth({
    ...     "width": 96, "height": 64, "rate": 100, "frames": 40,
    ...     "target": [{"shade": {"dark": 0.5}, "path": {"kind": "straight", "start": [20, 32], "speed": 100}}]})
    >>> len(scene), scene[7].shape, scene.truth.x[:2]
    (40, (64, 96), array([18., 19.]))
    """
    frames = whole("frames", frames, 1, 2**63 - 1)
    seed = whole("seed", seed, 0, 2**63 - 1)
    if isinstance(scene, Mapping):
        return Scene(dict(scene), frames, seed)
    if isinstance(scene, str) and scene in ("demo", "paper"):
        return Scene((scene, ""), frames, seed)
    if isinstance(scene, str) and ("=" in scene or "\n" in scene):
        return Scene(("text", scene), frames, seed)
    if isinstance(scene, (str, os.PathLike)):
        path = os.fspath(scene)
        if not os.path.exists(path):
            raise FileNotFoundError(f"there is no scene file {path!r}")
        return Scene(("file", path), frames, seed)
    raise TypeError(f"scene must be a path, TOML text, a dict, 'demo' or 'paper', not {type(scene).__name__}")
