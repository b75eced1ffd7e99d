"""The compiled part: private, thin. Its users are the modules beside it; see `apgstmd.Detector` for the manual."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Final, Self, TypeAlias, final

import numpy as np
from numpy.typing import NDArray

_Map: TypeAlias = NDArray[np.float32]
_Columns: TypeAlias = tuple[
    NDArray[np.float32], NDArray[np.float32], NDArray[np.float32], NDArray[np.float32], NDArray[np.int64]
]

_Out: TypeAlias = tuple[_Map | None, _Map | None]
# An array and its seconds.
_Frames: TypeAlias = Iterator[tuple[NDArray[Any], float | None]]

_Whole: TypeAlias = NDArray[np.int64]
_Real: TypeAlias = NDArray[np.float64]
_Flag: TypeAlias = NDArray[np.bool_]

__all__ = ["MODELS", "STAGES", "Bank", "Batch", "Detector", "Running", "Scene", "__version__", "batch", "clip", "evaluate", "fields", "kernels", "resolve", "run", "run_cli"]

__version__: Final[str]
MODELS: Final[tuple[str, ...]]
STAGES: Final[tuple[str, ...]]

@final
class Bank:
    """One stream's state. Every method releases the GIL; RuntimeError when another thread is inside."""

    def __new__(
        cls,
        height: int,
        width: int,
        params: str,
        file: str | None,
        speeds: Sequence[float] | None,
        sizes: Sequence[float] | None,
        contrast: float | None,
        threads: int | None,
        bit_depth: int | None,
    ) -> Bank:
        """`params` is what the members have in common (TOML), `file` a parameter file whose section `[bank]` names members.

        ValueError: a size, parameter, count or depth out of range."""

    @property
    def params(self) -> str:
        """The parameter file it was made from."""

    @property
    def file(self) -> str:
        """All of its parameters, as a file with the section `[bank]`."""

    @property
    def threads(self) -> int: ...
    @property
    def latency(self) -> int:
        """Frames from the onset of a target to its complete response, the longest of a member."""

    @property
    def bit_depth(self) -> int | None:
        """Significant bits of integer frames, where it was told."""

    def state(self) -> dict[str, Any]:
        """`format`, `version`, `of`, `height`, `width`, `parameters`, and `arrays` by name."""

    def look_in(self, mask: NDArray[np.bool_] | None) -> None:
        """Where targets are looked for, (H, W). ValueError: another size, or nothing is true."""

    def restore(self, given: dict[str, Any]) -> None:
        """Takes up what `state` gave. ValueError: of another version, kind, size or parameters. TypeError: no such dict."""

    @property
    def members(self) -> list[tuple[float, float]]:
        """Speed, px/frame, and size, px, of each."""

    def process(
        self, frame: NDArray[Any], out: _Out | None = None
    ) -> tuple[
        _Map,
        _Map,
        tuple[list[NDArray[np.float32]], NDArray[np.int64]],
        tuple[float, float],
        tuple[float, float, float, bool],
        bool,
    ]:
        """(H, W) contrast, (H, W) direction, columns x, y, score, direction, speed, size, contrast and trace, then as
        `Detector.process`.
        """

    def reset(self) -> None: ...
    def frames(self) -> int:
        """Frames since construction or the last reset."""

@final
class Detector:
    """One stream's state. Every method releases the GIL; RuntimeError when another thread is inside."""

    def __new__(
        cls, height: int, width: int, params: str, threads: int | None, bit_depth: int | None
    ) -> Detector:
        """`params` is a full parameter file (TOML). ValueError: a size, parameter, thread count or depth out of range."""

    @property
    def params(self) -> str:
        """The parameter file it was made from."""

    @property
    def threads(self) -> int: ...
    @property
    def latency(self) -> int:
        """Frames from the onset of a target to its complete response."""

    @property
    def bit_depth(self) -> int | None:
        """Significant bits of integer frames, where it was told."""

    def state(self) -> dict[str, Any]:
        """`format`, `version`, `of`, `height`, `width`, `parameters`, and `arrays` by name."""

    def look_in(self, mask: NDArray[np.bool_] | None) -> None:
        """Where targets are looked for, (H, W). ValueError: another size, or nothing is true."""

    def restore(self, given: dict[str, Any]) -> None:
        """Takes up what `state` gave. ValueError: of another version, kind, size or parameters. TypeError: no such dict."""

    @property
    def lag(self) -> float:
        """How far the response trails the target, px."""

    @property
    def model(self) -> str: ...
    @property
    def stages(self) -> tuple[str, ...]:
        """The stages that its model has."""

    def process(
        self, frame: NDArray[Any], out: _Out | None = None
    ) -> tuple[_Map, _Map, _Columns, tuple[float, float], tuple[float, float, float, bool], bool]:
        """(H, W) response, (H, W) direction, columns x, y, score, direction, trace, background shift (x, y) in px,
        (rotation, zoom, residual, unexplained) of the background, whether the scene was cut before this frame.

        `out` holds arrays for response and direction, (H, W), C-contiguous; they are then what comes back.
        """

    def stage(self, name: str) -> NDArray[np.float32]:
        """A copy of a stage of the last frame: (H, W), (4, H, W) for C, (8, H, W) for D, E, Ep, F, Q.

        ValueError: a stage that the model has not.
        """

    def reset(self) -> None: ...
    def frames(self) -> int:
        """Frames since construction or the last reset."""

@final
class Running:
    """`apgstmd run` at work, to be taken frame by frame."""

    def __new__(cls, argv: Sequence[str], frames: _Frames | None, bit_depth: int | None, tables: bool) -> Running:
        """As `run`; without `tables` it writes none. RuntimeError: no thread could be started."""

    def next(
        self,
    ) -> (
        tuple[
            int,
            str,
            float | None,
            tuple[list[NDArray[np.float32]], NDArray[np.int64]],
            tuple[list[_Whole], list[_Real], NDArray[np.float32], list[str]],
            tuple[float, float],
            tuple[float, float, float, bool],
            bool,
        ]
        | None
    ):
        """The next frame that is through, None at the end: number, name, seconds, detections as `Bank.process` has them, tracks
        (frame, track, age; time, x, y, vx, vy; score; state), background shift, camera, cut. Raises what `run` raises.
        """

    def close(self) -> None:
        """Ends it after the frame in work; its files are complete up to there."""

@final
class Scene:
    """A scene ready to be drawn. Nothing in it changes: any thread may ask for any frame."""

    def __new__(
        cls, scene: Mapping[str, object] | tuple[str, str], frames: int | None, seed: int | None
    ) -> Scene:
        """A dict, or ("text", TOML), ("file", path), ("demo", ""), ("paper", "").

        ValueError for what breaks a rule, RuntimeError for files that cannot be read, TypeError for a wrong type.
        """

    @property
    def toml(self) -> str:
        """The scene file, with everything filled in."""

    @property
    def shape(self) -> tuple[int, int]:
        """(height, width), px."""

    @property
    def rate(self) -> float:
        """Frames per second."""

    @property
    def frames(self) -> int: ...
    def frame(self, index: int) -> _Map:
        """(H, W), luminance in [0, 1]; releases the GIL."""

    def truth(self) -> tuple[_Whole, _Whole, _Real, _Real, _Real, _Real, _Flag, _Real]:
        """Columns frame, id, x, y, w, h, visible, contrast over all frames."""

def evaluate(
    detections: str | tuple[_Whole, _Real, _Real, _Real, _Real, str | None],
    tracks: tuple[_Whole, _Whole, _Real, _Real] | None,
    truth: str | tuple[_Whole, _Whole | None, _Real, _Real, _Real, _Real, _Flag, _Flag],
    frames: int | None,
    start: int,
    stop: int | None,
    radius: float,
    margin: float,
    html: str | None,
) -> str:
    """What `apgstmd eval --json` prints, and the page where `html` names a file.

    Columns: frame, x, y, score, direction (NaN: unknown) and the text of run.json; frame, track, x, y; frame, id, x, y, w, h, visible,
    ignore. ValueError for what cannot be judged, RuntimeError for files that cannot be read or written.
    """

def fields() -> list[tuple[str, str, str, str]]:
    """Every parameter in file order: section, name, documentation, rule."""

def kernels(
    params: str,
) -> tuple[
    list[tuple[float, float, _Real]], list[tuple[float, _Real]], _Real, list[tuple[str, _Real]]
]:
    """Of a full parameter file: attention as (scale, orientation, map), prediction as (direction, map), lateral inhibition of the
    lobula as a map, the gamma kernels over time as (name, taps).
    """

def resolve(
    model: str | None,
    preset: str | None,
    file: str | None,
    table: Mapping[str, Mapping[str, object] | str] | None,
    speed: float | None,
    overrides: Mapping[str, Mapping[str, object]],
) -> str:
    """The full parameter file, tuned to `speed`, with `overrides` put in last.

    It starts from `file` (TOML), from `table` or from `model` and `preset`. What a file or a table leaves out is as the
    model that it names has it.
    """

_Job: TypeAlias = tuple[str, str, str, list[str], dict[str, str], int]

@final
class Batch:
    """A folder of results of `apgstmd batch`, and what is to be done in it. Nobody else can have it meanwhile."""

    def __new__(cls, argv: Sequence[str]) -> Self:
        """Checks the arguments, spells out the list, makes the folder."""
    @property
    def jobs(self) -> list[_Job]:
        """For `clip`, in the order given: name, input, folder of the batch, flags, sums of the files they name, threads."""
    def add(self, record: str) -> None:
        """Takes note of what `clip` returned, in the manifest too."""
    def lost(self, name: str, why: str) -> None:
        """Takes note that nothing came back of a job."""
    def finish(self, interrupted: bool) -> list[str]:
        """Writes manifest and page, and returns the records of the jobs, in their order."""

def clip(job: _Job) -> str:
    """Does one video in a process of its own, unless its folder is whole already, and returns its record as JSON."""

def batch(argv: Sequence[str]) -> list[str]:
    """`apgstmd batch`, `argv` with the program's name first; returns the records of the jobs, in their order."""

def run_cli(argv: Sequence[str]) -> int:
    """Runs the command line, `argv` with the program's name first, and returns its exit code.

    It owns the process meanwhile: it prints, and listens for Ctrl-C itself.
    """

def run(argv: Sequence[str], frames: _Frames | None = None, bit_depth: int | None = None) -> None:
    """The same for a process that goes on afterwards: failures are exceptions, Ctrl-C is Python's.

    With `frames`, the command `run` takes these in place of its INPUT. They are fetched by the calling thread, and what they
    raise is raised.

    ValueError for what is wrong in `argv`, RuntimeError for all else, KeyboardInterrupt when the frame in work is done.
    """
