"""Versions of what computes, which must be those of the client on every worker."""

import functools
import hashlib
import pathlib
from typing import Tuple

import cab

Versions = Tuple[Tuple[str, str], ...]


@functools.lru_cache(maxsize=None)
def describe() -> Versions:
    """The versions of this process: of cab, of its ABI, and the hash of this package's sources."""
    digest = hashlib.sha256()
    for path in sorted(pathlib.Path(__file__).parent.glob("*.py")):
        digest.update(path.read_bytes())
    return (("cab", cab.__version__), ("ABI", str(cab.abi_version())), ("cab_scan", digest.hexdigest()[:16]))


def difference(mine: Versions, theirs: Versions) -> str:
    """In words, what differs; empty if nothing does."""
    return ", ".join(
        f"{name} {other} there and {own} here" for (name, own), (_, other) in zip(mine, theirs) if own != other
    )
