"""Poses of one character over time, from files or from a loader of one's own."""

import hashlib
import importlib
import inspect
from typing import Any, Callable, Iterable, Iterator, Literal, NamedTuple, Optional, Tuple

import cab
import numpy as np
import numpy.typing as npt

from .work import FileOptions


class Sequence(NamedTuple):
    """A character with its poses, as `cab.Clip.add` takes them.

    body     `cab.Body`; poses, origins and order are those of `cab.Clip.add`.
    fps      frames per second, above 0.
    name     tells several sequences of one file apart.
    notes    what is doubted or was guessed, in words, for the column `notes`.
    """

    body: cab.Body
    poses: "npt.NDArray[np.float32]"
    fps: float = 30.0
    name: str = ""
    origins: "Optional[npt.NDArray[np.float64]]" = None
    order: Literal["row", "column"] = "row"
    notes: Tuple[str, ...] = ()


class Request(NamedTuple):
    """What a loader is asked for: a file, what the column `part` of a list says, and how the file is to be read."""

    path: str
    part: str
    options: FileOptions


Loader = Callable[[Request], Iterable[Sequence]]


class LoaderError(ValueError):
    """A loader that is not there, or that yields something else than sequences."""


def find_loader(name: str) -> Loader:
    """The function module:function."""
    module_name, colon, function_name = name.partition(":")
    if not colon or not module_name or not function_name:
        raise LoaderError(f"--loader {name}: module:function is wanted")
    try:
        function = getattr(importlib.import_module(module_name), function_name)
    except ModuleNotFoundError as error:
        raise LoaderError(f"--loader {name}: {error}; PYTHONPATH says where modules are looked for") from error
    except AttributeError as error:
        raise LoaderError(f"--loader {name}: the module {module_name} has no {function_name}") from error
    except (Exception, SystemExit) as error:
        raise LoaderError(f"--loader {name}: to import it fails: {type(error).__name__}: {error}") from error
    if not callable(function):
        raise LoaderError(f"--loader {name}: {function_name} is no function")
    return function  # type: ignore[no-any-return]


def loader_sha256(name: str) -> str:
    """SHA-256 of the source of the loader's module, so that a changed loader does its work anew."""
    module = importlib.import_module(find_loader(name).__module__)
    try:
        return hashlib.sha256(inspect.getsource(module).encode()).hexdigest()
    except OSError as error:
        raise LoaderError(f"--loader {name}: its source cannot be read") from error


def load(path: str, options: FileOptions, loader: str, part: str) -> Iterator[Sequence]:
    """The sequences of a file, by `cab.load_motion` or by a loader."""
    if not loader:
        yield load_file(path, options)
        return
    for sequence in find_loader(loader)(Request(path, part, options)):
        yield _checked(sequence, loader)


def load_file(path: str, options: FileOptions) -> Sequence:
    """The motion of a file, by `cab.load_motion`. A file without motion has one frame."""
    motion = cab.load_motion(
        path,
        units=options.units,
        motion=options.motion or None,
        motion_units=options.motion_units,
        animation=options.animation or None,
        fps=options.fps,
        body=options.body,
        stature=options.stature,
        thickness=options.thickness,
    )
    return Sequence(motion.body, motion.poses, motion.fps or 1.0, origins=motion.origins, notes=motion.notes)


def _checked(sequence: Any, loader: str) -> Sequence:
    if not isinstance(sequence, Sequence):
        raise LoaderError(f"{loader} yields {type(sequence).__name__}, and cab_scan.Sequence is wanted")
    if not isinstance(sequence.name, str):
        raise LoaderError(f"{loader} yields a sequence of the name {sequence.name!r}, and a text is wanted")
    if not isinstance(sequence.notes, tuple) or not all(isinstance(note, str) for note in sequence.notes):
        raise LoaderError(f"{loader} yields notes that are no tuple of texts")
    if not isinstance(sequence.poses, np.ndarray) or sequence.poses.ndim < 3:
        raise LoaderError(f"{loader}: poses of shape (frames, links, ...) are wanted")
    return sequence
