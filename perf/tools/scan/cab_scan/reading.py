"""How files of others are opened here: regular ones alone, and no more bytes than they are said to have."""

import os
import stat
from typing import Iterator, Optional


class RefusedError(ValueError):
    """A file that is not read whatever it holds. The message names it."""


def blocks_of(path: str, most: Optional[int] = None) -> Iterator[bytes]:
    """The bytes of a regular file, in blocks. Raises OSError, and RefusedError if it is larger than `most`.

    Nothing waits: not for a pipe that nobody writes to. What grows while it is read, or has no end, is not read on.
    """
    # First by name: to open a device may do something.
    _check(path, os.stat(path), most)
    descriptor = os.open(path, os.O_RDONLY | os.O_CLOEXEC | os.O_NONBLOCK | os.O_NOCTTY)
    with open(descriptor, "rb", buffering=0) as file:
        state = os.fstat(descriptor)
        _check(path, state, most)
        left = state.st_size
        while left > 0 and (block := file.read(min(left, 1 << 20))):
            left -= len(block)
            yield block


def bytes_of(path: str, most: int) -> bytes:
    """All bytes of a regular file, of which there are at most so many."""
    return b"".join(blocks_of(path, most))


def _check(path: str, state: os.stat_result, most: Optional[int]) -> None:
    if not stat.S_ISREG(state.st_mode):
        kind = "a directory, not a file" if stat.S_ISDIR(state.st_mode) else "not a regular file"
        raise RefusedError(f"{path}: is {kind}")
    if most is not None and state.st_size > most:
        raise RefusedError(f"{path}: the file is larger than {most >> 20} MiB")
