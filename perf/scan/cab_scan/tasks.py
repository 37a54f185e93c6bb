"""What runs on a worker: a task of several items, each of which becomes rows, whatever happens in it."""

import os
import warnings
from typing import Iterable, List, Tuple

import cab

from .clips import clip_rows
from .hashing import content_sha256
from .recordings import CommandError, recording_rows
from .robots import robot_rows
from .versions import describe
from .work import BAD, LOST, RECORDING, Item, Report, Row


def run_items(items: Iterable[Item]) -> Report:
    """The rows of all items. What the table has already, by its content, is skipped."""
    rows: List[Row] = []
    for item in items:
        rows.extend(_run_item(item))
    return Report(describe(), rows)


def _run_item(item: Item) -> List[Row]:
    sha256 = None
    wanted = item.policies
    try:
        before = _stamp(item)
        sha256 = item.robot.sha256 if item.robot else _content(item)
        wanted = tuple(policies for policies, known in zip(item.policies, item.known) if known != sha256)
        rows = _rows(item, wanted) if wanted else []
        if not item.robot and _stamp(item) != before:
            raise OSError(f"{item.source.path}: it changed while it was read")
    except Exception as error:  # a row says what; other items go on
        outcome = LOST if isinstance(error, (OSError, MemoryError, CommandError)) else BAD
        rows = [error_row(item, policies, outcome, words_of(error)) for policies in wanted]
    for row in rows:
        row.sha256, row.version = sha256, cab.__version__
    return rows


def _rows(item: Item, policies: Tuple[str, ...]) -> List[Row]:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", cab.MaskedWarning)  # the row has their number
        if item.robot:
            return list(robot_rows(item, item.robot))
        if item.what == RECORDING:
            return list(recording_rows(item))
        rows = list(clip_rows(item, policies))
    if not rows:
        raise ValueError("the loader yields no sequence")
    if len({row.sequence for row in rows}) * len(policies) != len(rows):
        raise ValueError("the loader yields two sequences of one name")
    return rows


def _paths(item: Item) -> List[str]:
    paths = [item.source.path, item.source.options.motion]
    if item.other:
        paths += [item.other.path, item.other.options.motion]
    return [path for path in paths if path]


def _content(item: Item) -> str:
    return content_sha256(*_paths(item))


def _stamp(item: Item) -> List[Tuple[int, int]]:
    states = [os.stat(path) for path in _paths(item)]
    return [(state.st_mtime_ns, state.st_size) for state in states]


def error_row(item: Item, policies: str, outcome: str, words: str) -> Row:
    """The row of an item that has no numbers. Paths in words are those of the table."""
    for source in (item.source, item.other):
        if source:
            words = words.replace(source.path, source.name)
    return Row(item.key(policies), version=cab.__version__, outcome=outcome, error=words)


def words_of(error: Exception) -> str:
    """What a row says about an error."""
    if isinstance(error, OSError) and error.strerror and error.filename:
        return f"{error.filename}: {error.strerror}"
    if isinstance(error, MemoryError):
        return "out of memory"
    text = " ".join(str(error).split())
    known = isinstance(error, (cab.FileError, cab.Error, ValueError, OSError, CommandError))
    return text if known and text else f"{type(error).__name__}: {text}"
