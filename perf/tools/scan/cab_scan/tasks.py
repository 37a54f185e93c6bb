"""What runs on a worker: a task of several items, each of which becomes rows, whatever happens in it."""

import contextlib
import faulthandler
import os
import tempfile
import warnings
from typing import Iterable, Iterator, List, Optional, Sequence, Tuple

import cab

from .clips import clip_rows
from .hashing import companions, content_sha256
from .notes import with_names
from .recordings import CommandError, is_recording, recording_rows
from .robots import robot_rows
from .versions import describe
from .work import BAD, LOST, RECORDING, Item, Report, Row


def run_items(items: Iterable[Item], folder: str, most_seconds: Optional[float] = None) -> Report:
    """The rows of all items. What the table has already, by its content, is skipped.

    folder        the worker's own for temporary files, which goes even when the worker is killed
    most_seconds  after which an item ends this process; None: never, where others run in it too
    """
    rows: List[Row] = []
    before, tempfile.tempdir = tempfile.tempdir, folder
    try:
        for item in items:
            rows.extend(_run_item(item, most_seconds))
    finally:
        tempfile.tempdir = before
    return Report(describe(), rows)


@contextlib.contextmanager
def _limited(most_seconds: Optional[float]) -> Iterator[None]:
    if most_seconds is None:
        yield
        return
    with open(os.devnull, "w", encoding="utf-8") as nowhere:
        try:
            # Its thread is none of Python's, and so goes on when a loader keeps Python's lock.
            faulthandler.dump_traceback_later(most_seconds, exit=True, file=nowhere)
        except RuntimeError as error:  # there is no room for a thread
            raise MemoryError from error
        try:
            yield
        finally:
            faulthandler.cancel_dump_traceback_later()


def _run_item(item: Item, most_seconds: Optional[float]) -> List[Row]:
    sha256 = None
    wanted = item.policies
    try:
        with _limited(most_seconds):
            files = _files(item)
            before = _stamp(files)
            sha256 = item.robot.sha256 if item.robot else _content(item, files)
            # Without a hash nothing is known.
            there = [sha256 is not None and known == sha256 for known in item.known]
            wanted = tuple(policies for policies, is_there in zip(item.policies, there) if not is_there)
            rows = _rows(item, wanted) if wanted else []
            if _stamp(files) != before:
                raise OSError(f"{item.source.path}: it changed while it was read")
    except (Exception, SystemExit, KeyboardInterrupt) as error:  # a row says what; other items go on
        rows = [error_row(item, policies, outcome_of(error), words_of(error)) for policies in wanted]
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


def _files(item: Item) -> List[str]:
    # All files that the rows are of. A robot has its own hash, by which it is compared when it is read.
    if item.robot:
        return []
    if item.what == RECORDING:
        return [item.source.path]
    paths = [item.source.path, item.source.options.motion]
    if item.other:
        paths += [item.other.path, item.other.options.motion]
    return [file for path in paths if path for file in [path, *companions(path)]]


def _content(item: Item, files: Sequence[str]) -> Optional[str]:
    if item.what == RECORDING and not is_recording(item.source.path):
        return None  # the command refuses it at once, however many bytes it has
    # How large files of arrays may be is the loader's matter, and recordings have no limit.
    most = None if item.what == RECORDING or item.test.loader else cab.MAX_FILE_BYTES
    return content_sha256(files, most)


def _stamp(files: Sequence[str]) -> List[Tuple[int, int]]:
    states = [os.stat(path) for path in files]
    return [(state.st_mtime_ns, state.st_size) for state in states]


def outcome_of(error: BaseException) -> str:
    """Of the row of an error: whether the same bytes give it again, or another try may succeed."""
    if isinstance(error, cab.FileError):
        return LOST if error.is_machine else BAD
    return LOST if isinstance(error, (OSError, MemoryError, CommandError, KeyboardInterrupt)) else BAD


def error_row(item: Item, policies: str, outcome: str, words: str) -> Row:
    """The row of an item that has no numbers. Its words are one line, in which paths are those of the table."""
    return Row(item.key(policies), version=cab.__version__, outcome=outcome, error=with_names(words, item))


def lost_rows(item: Item) -> List[Row]:
    """The rows of an item that was alone when its worker died."""
    words = (
        "its worker died or fell silent each time: out of memory, a crash, more than --most-seconds, or a loader that "
        "ended or held it"
    )
    return [error_row(item, policies, LOST, words) for policies in item.policies]


def words_of(error: BaseException) -> str:
    """What a row says about an error."""
    if isinstance(error, OSError) and error.strerror and error.filename:
        return f"{os.fsdecode(error.filename)}: {error.strerror}"
    if isinstance(error, MemoryError):
        return "out of memory"
    if isinstance(error, SystemExit):
        return f"the loader ended its process: sys.exit({'' if error.code is None else repr(error.code)})"
    text = " ".join(str(error).split())
    known = isinstance(error, (cab.FileError, cab.Error, ValueError, OSError, CommandError))
    return text if known and text else f"{type(error).__name__}: {text}"
