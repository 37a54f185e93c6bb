"""Files to write, which must not be files to read: compared as files, whatever their names."""

import contextlib
import os
import stat
from typing import Dict, Iterable, Sequence, Tuple, Union

from .hashing import companions

# An output that is there and ends otherwise may be what an input is read with.
_USUAL = (".csv", ".sqlite", ".sqlite3", ".db", ".lock", "-wal", "-shm", "-journal")


class OutputError(ValueError):
    """An output that is an input, or another output."""


def check(table: str, csv: Sequence[str], read: Iterable[str]) -> None:
    """Raises OutputError unless the table and the CSV files are files of their own, which nothing reads."""
    if table in ("", ":memory:", "-"):
        raise OutputError("--table: the name of a file is wanted")
    if "-" in csv:
        raise OutputError("--csv: the name of a file is wanted")
    # SQLite writes beside a table too.
    real = os.path.realpath(table)
    wanted = [("--table", table), *(("--table", real + end) for end in (".lock", "-wal", "-shm", "-journal"))]
    wanted += [("--csv", path) for path in csv]
    outputs: Dict[_Identity, Tuple[str, str]] = {}
    for option, path in wanted:
        _check_kind(option, path)
        other, other_path = outputs.setdefault(_identity(path), (option, path))
        if other_path != path or other != option:
            raise OutputError(f"{other} {other_path} and {option} {path} are the same file; give two")
    is_odd = any(os.path.exists(path) and not path.endswith(_USUAL) for _, path in wanted)
    for path in read:
        for file in [path, *companions(path)] if is_odd else [path]:
            found = outputs.get(_identity(file))
            if found:
                raise OutputError(f"{found[0]}: {found[1]} is an input; write the output to another file")


_Identity = Union[str, Tuple[int, int]]


def _identity(path: str) -> _Identity:
    try:
        state = os.stat(path)
    except (OSError, ValueError):
        return os.path.realpath(path) if "\0" not in path else path
    return state.st_dev, state.st_ino


def _check_kind(option: str, path: str) -> None:
    # A CSV file takes the place of what has its name: a device must keep it, and a report would be lost.
    try:
        state = os.stat(path)
    except (OSError, ValueError):
        return
    if not stat.S_ISREG(state.st_mode):
        kind = "a directory" if stat.S_ISDIR(state.st_mode) else "not a regular file"
        raise OutputError(f"{option}: {path} is {kind}")
    with contextlib.suppress(OSError):  # which may be closed
        if os.path.samestat(state, os.fstat(1)):
            raise OutputError(f"{option}: {path} is standard output, which has the report")
