"""Hashes: of what a file holds, and of hits."""

import hashlib
import json
import os
from typing import Any, Iterable, List, Optional, Sequence

import cab
import numpy as np
import numpy.typing as npt

from .reading import blocks_of

_OFFSET, _PRIME, _MASK = 0xCBF29CE484222325, 0x100000001B3, 0xFFFFFFFFFFFFFFFF


# What may be a glTF file, AMC or MD5: no other file is read with companions, and a child process costs 5 ms.
_HAVE_COMPANIONS = frozenset(".amc .gltf .glb .vrm .md5mesh .md5anim".split())


def file_sha256(path: str, most: Optional[int] = None) -> str:
    """SHA-256 of the bytes of a file, at most so many, in hexadecimal digits."""
    digest = hashlib.sha256()
    for block in blocks_of(path, most):
        digest.update(block)
    return digest.hexdigest()


def companions(path: str) -> List[str]:
    """Files that are there and are read with a file: the skeleton of an AMC file, the buffers of a glTF file."""
    if os.path.splitext(path)[1].lower() not in _HAVE_COMPANIONS:
        return []
    try:
        return [other for other in cab.companion_files(path) if os.path.exists(other)]
    except cab.FileError as error:
        if error.is_machine:
            raise
        return []  # whatever reads the file says what is wrong with it


def content_sha256(files: Sequence[str], most: Optional[int] = None) -> str:
    """SHA-256 of a file of at most so many bytes; of several that of the list of all their hashes."""
    if len(files) == 1:
        return file_sha256(files[0], most)
    digest = hashlib.sha256()
    for file in files:
        digest.update(file_sha256(file, most).encode() + b"  " + os.fsencode(os.path.basename(file)) + b"\n")
    return digest.hexdigest()


def contacts_sha256(contacts: Iterable[Sequence[object]]) -> str:
    """SHA-256 of contacts in their order: one line of JSON each."""
    digest = hashlib.sha256()
    for contact in contacts:
        digest.update(json.dumps(contact).encode() + b"\n")
    return digest.hexdigest()


class HitsHash:
    """FNV-1a, 64 bits, of the hashes of all frames that have hits, each with its number before it.

    The hash of a frame is FNV-1a of its hits in order: a, link a, b, link b, depth, lowest byte first.
    """

    def __init__(self) -> None:
        self._value = _OFFSET

    def add(self, hits: "npt.NDArray[np.void]") -> None:
        """Hits of frames that come after those before; `cab.CLIP_HIT`, sorted by frames."""
        frames, starts, counts = np.unique(hits["frame"], return_index=True, return_counts=True)
        values = np.full(len(frames), _OFFSET, dtype=np.uint64)
        for position in range(int(counts.max(initial=0))):
            has = np.flatnonzero(counts > position)
            rows = hits[starts[has] + position]
            for field in ("a", "link_a", "b", "link_b", "depth"):
                values[has] = _add_bytes(values[has], np.ascontiguousarray(rows[field]))
        for frame, value in zip(frames.tolist(), values.tolist()):
            self._add(frame, 4)
            self._add(value, 8)

    def _add(self, number: int, count: int) -> None:
        for byte in range(count):
            self._value = ((self._value ^ (number >> (8 * byte) & 0xFF)) * _PRIME) & _MASK

    def digits(self) -> str:
        """Sixteen hexadecimal digits."""
        return f"{self._value:016x}"


def _add_bytes(values: "npt.NDArray[np.uint64]", numbers: "npt.NDArray[Any]") -> "npt.NDArray[np.uint64]":
    little = numbers.astype(numbers.dtype.newbyteorder("<")).view(np.uint8).reshape(len(numbers), -1)
    for byte in range(little.shape[1]):
        values = (values ^ little[:, byte]) * np.uint64(_PRIME)
    return values
