"""Hashes: of what a file holds, and of hits."""

import hashlib
import json
import os
from typing import Any, Iterable, List, Sequence
from urllib.parse import unquote

import numpy as np
import numpy.typing as npt

_OFFSET, _PRIME, _MASK = 0xCBF29CE484222325, 0x100000001B3, 0xFFFFFFFFFFFFFFFF


def file_sha256(path: str) -> str:
    """SHA-256 of the bytes of a file, in hexadecimal digits."""
    digest = hashlib.sha256()
    with open(path, "rb") as file:
        while block := file.read(1 << 20):
            digest.update(block)
    return digest.hexdigest()


def companions(path: str) -> List[str]:
    """Files that are read with a file: the skeletons of an AMC file, and the buffers that a glTF file names."""
    folder, name = os.path.split(path)
    stem, suffix = os.path.splitext(name)
    if suffix.lower() == ".amc":
        beside = [os.path.splitext(other) for other in sorted(os.listdir(folder or "."))]
        skeletons = [(other, end) for other, end in beside if end.lower() == ".asf" and stem.startswith(other)]
        return [os.path.join(folder, other + end) for other, end in skeletons]
    if suffix.lower() == ".gltf":
        return [other for other in _buffers(path, folder) if os.path.isfile(other)]
    return []


def _buffers(path: str, folder: str) -> List[str]:
    # A file that is no JSON has none: the parser refuses it.
    try:
        with open(path, encoding="utf-8") as file:
            buffers = json.load(file).get("buffers", [])
        uris = [str(buffer.get("uri", "")) for buffer in buffers]
    except (ValueError, AttributeError, TypeError, RecursionError):
        return []
    return [os.path.join(folder, unquote(uri)) for uri in uris if uri and not uri.startswith("data:")]


def content_sha256(*paths: str) -> str:
    """SHA-256 of a file; of several, or of one that others are read with, that of the list of all their hashes."""
    files = [file for path in paths if path for file in [path, *companions(path)]]
    if len(files) == 1:
        return file_sha256(files[0])
    lines = "".join(f"{file_sha256(file)}  {os.path.basename(file)}\n" for file in files)
    return hashlib.sha256(lines.encode()).hexdigest()


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
