"""From hits of some frames at a time to the numbers of a row, in bounded memory."""

from typing import Callable, List, Optional, Sequence, Tuple

import cab
import numpy as np
import numpy.typing as npt

from .hashing import HitsHash, contacts_sha256
from .work import Contact, Row

Hits = npt.NDArray[np.void]

# Of a chunk: its frames, its links over all frames, and the pairs of links that may touch in it at most. Together they
# take some 150 MB for the largest bodies.
_MOST_FRAMES, _LEAST_FRAMES, _MOST_POSES, _MOST_PAIRS = 4096, 16, 1 << 20, 1 << 22


def chunk_frames(links: int) -> int:
    """How many frames are tested at a time: a multiple of sixteen, by the number of links of all characters."""
    pairs = max(links * (links - 1) // 2, 1)
    frames = min(_MOST_POSES // max(links, 1), _MOST_PAIRS // pairs, _MOST_FRAMES)
    return max(frames // 16 * 16, _LEAST_FRAMES)


class Summary:
    """What is known of the hits of the frames so far.

    names(a, link_a, b, link_b) gives the characters' and links' names.
    """

    def __init__(self, fps: float, gap: int, keeps_intervals: bool) -> None:
        self._fps, self._gap, self._keeps = fps, gap, keeps_intervals
        self._hash = HitsHash()
        self._hits = self._hit_frames = self._masked = 0
        self._deepest: Optional[Tuple[float, int, Tuple[int, int, int, int]]] = None
        self._runs: List[Hits] = []
        self._counts = [0, 0, 0, 0]
        self._engine_seconds = 0.0

    def add(self, hits: Hits, stats: "Optional[cab._cab.FrameStats]") -> None:
        """The next frames: their hits, whose frames count from the first one, and what they cost."""
        self._hash.add(hits)
        self._hits += len(hits)
        self._hit_frames += len(np.unique(hits["frame"]))
        known = np.flatnonzero(~np.isnan(hits["depth"]))
        if len(known):
            row = hits[known[int(np.argmax(hits["depth"][known]))]]
            if self._deepest is None or float(row["depth"]) > self._deepest[0]:
                links = (int(row["a"]), int(row["link_a"]), int(row["b"]), int(row["link_b"]))
                self._deepest = (float(row["depth"]), int(row["frame"]), links)
        if self._keeps and len(hits):
            self._runs.append(cab.intervals_of(hits, self._fps, self._gap))
        if stats is not None:
            counts = (stats.box_tests, stats.leaf_pairs, stats.exact_tests, stats.false_positives)
            self._counts = [one + more for one, more in zip(self._counts, counts)]
            self._masked += stats.instances_masked
            self._engine_seconds += stats.seconds_total

    def fill(self, row: Row, names: Callable[[int, int], Tuple[str, str]]) -> None:
        """Writes all numbers into a row. names(character, link) gives both names."""
        row.masked, row.hits, row.hit_frames = self._masked, self._hits, self._hit_frames
        row.hits_hash = self._hash.digits()
        row.box_tests, row.leaf_pairs, row.exact_tests, row.false_positives = self._counts
        row.engine_seconds = self._engine_seconds
        if self._deepest is not None:
            row.depth, row.depth_frame, (a, link_a, b, link_b) = self._deepest
            row.depth_link_a, row.depth_link_b = names(a, link_a)[1], names(b, link_b)[1]
        row.contacts = [_contact(run, names) for run in merge_runs(self._runs, self._fps, self._gap)]
        row.contacts_hash = contacts_sha256(row.contacts)


def _contact(run: np.void, names: Callable[[int, int], Tuple[str, str]]) -> Contact:
    character_a, link_a = names(int(run["a"]), int(run["link_a"]))
    character_b, link_b = names(int(run["b"]), int(run["link_b"]))
    depth = float(run["depth"])
    first, last, deepest = int(run["first"]), int(run["last"]), int(run["deepest"])
    return Contact(
        character_a, link_a, character_b, link_b, first, last, float(run["seconds"]),
        None if np.isnan(depth) else depth, deepest,
    )


def merge_runs(parts: Sequence[Hits], fps: float, gap: int) -> Hits:
    """The runs of chunks that follow each other, where a run that goes on over a border is one."""
    if not parts:
        return np.empty(0, dtype=cab.INTERVAL)
    runs = np.concatenate(parts)
    runs = runs[np.lexsort((runs["first"], runs["link_b"], runs["link_a"], runs["b"], runs["a"]))]
    goes_on = np.ones(len(runs) - 1, dtype=bool)
    for key in ("a", "b", "link_a", "link_b"):
        goes_on &= runs[key][1:] == runs[key][:-1]
    goes_on &= runs["first"][1:].astype(np.int64) - runs["last"][:-1] <= gap + 1
    starts = np.append(0, np.flatnonzero(~goes_on) + 1)
    ends = np.append(starts[1:], len(runs))
    merged: Hits = runs[starts].copy()
    merged["last"] = runs["last"][ends - 1]
    merged["seconds"] = (merged["last"].astype(np.int64) - merged["first"] + 1) / fps
    merged["depth"] = np.fmax.reduceat(runs["depth"], starts)
    number = np.repeat(np.arange(len(starts)), ends - starts)
    merged["deepest"] = runs["deepest"][np.lexsort((runs["first"], -runs["depth"], number))[starts]]
    return merged
