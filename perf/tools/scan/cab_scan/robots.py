"""Robots: random states in chunks on workers, and the allowed-collision matrix of all chunks together."""

import collections
import functools
import hashlib
from typing import Dict, Iterable, Iterator, List, Sequence, Set, Tuple

import cab
import numpy as np

from .clock import core_seconds
from .contacts import Summary, chunk_frames
from .hashing import file_sha256
from .notes import notes_text
from .policies import policies_of
from .work import Item, LinkPair, Links, RobotChunk, Row, Source

# The first sampled state, and the share of states from which on a pair always touches: those of
# scenes/robot/matrix.cpp.
FIRST_SAMPLE = 1 << 63
ALWAYS_SHARE = 0.95


class RobotFile:
    """A robot as read from its file: `packages` are folders by name, `srdf` a file or nothing."""

    def __init__(
        self, source: Source, packages: Tuple[Tuple[str, str], ...], srdf: str, leave_out_missing: bool
    ) -> None:
        self.robot = cab.Robot(
            source.path, packages=dict(packages), srdf=srdf or None, leave_out_missing=leave_out_missing
        )
        body = self.robot.body
        digest = hashlib.sha256(file_sha256(source.path, cab.MAX_FILE_BYTES).encode())
        digest.update(body.sha256().encode())
        digest.update(self.robot.poses(self.robot.random_states(4)).tobytes())
        self.sha256 = digest.hexdigest()
        self.shaped = sorted(set(body.box_links.tolist()))
        self.listed = {_sorted(pair) for pair in self.robot.listed_pairs.tolist()}

    def fixed_matrix(self, derives: bool) -> Dict[Tuple[int, int], str]:
        """The pairs that the file excludes or welds and, if they are derived, adjacent ones."""
        robot = self.robot
        known: Dict[Tuple[int, int], str] = {}
        for pair in robot.body.ignored_pairs.tolist():
            known.setdefault(_sorted(pair), "file")
        for pair in robot.welded_pairs.tolist():
            known.setdefault(_sorted(pair), "welded")
        if derives:
            for pair in robot.adjacent_pairs.tolist():
                known.setdefault(_sorted(pair), "adjacent")
        shaped = set(self.shaped)
        return {
            pair: why
            for pair, why in known.items()
            if pair[0] != pair[1] and shaped.issuperset(pair) and pair not in self.listed
        }

    def touching_at_rest(self, policies: str, masked: Iterable[Tuple[int, int]]) -> Set[Tuple[int, int]]:
        """The pairs that touch at rest, without masked ones."""
        body = self.robot.body.ignoring(pairs=list(masked) or None)
        with cab.Clip(body, self.robot.poses([self.robot.rest()])) as clip:
            hits = clip.hits(policies=policies_of(policies), exact=policies_of(policies).exact, depths=False)
        return {_sorted(pair) for pair in zip(hits["link_a"].tolist(), hits["link_b"].tolist())}


def _sorted(pair: Sequence[int]) -> Tuple[int, int]:
    return (min(pair), max(pair))


def sampled_matrix(
    file: RobotFile,
    fixed: Dict[Tuple[int, int], str],
    at_rest: Set[Tuple[int, int]],
    touching: Dict[Tuple[str, str], int],
    samples: int,
) -> Dict[Tuple[int, int], str]:
    """The fixed matrix with the pairs that touch never or always in the samples, by how often each touched."""
    matrix = dict(fixed)
    names = file.robot.body.names
    for k, a in enumerate(file.shaped):
        for b in file.shaped[k + 1 :]:
            times = touching.get((names[a], names[b]), 0)
            if (a, b) in matrix or (a, b) in file.listed or samples == 0:
                continue
            if times >= ALWAYS_SHARE * samples:
                matrix[a, b] = "default" if (a, b) in at_rest else "always"
            elif times == 0 and (a, b) not in at_rest:
                matrix[a, b] = "never"
    return matrix


def matrix_rows(file: RobotFile, matrix: Dict[Tuple[int, int], str]) -> List[LinkPair]:
    """The matrix with the names of links."""
    names = file.robot.body.names
    return [LinkPair(names[a], names[b], why, 0, None) for (a, b), why in sorted(matrix.items())]


@functools.lru_cache(maxsize=4)
def _robot(source: Source, packages: Tuple[Tuple[str, str], ...], srdf: str, leave_out: bool, _: str) -> RobotFile:
    return RobotFile(source, packages, srdf, leave_out)


@functools.lru_cache(maxsize=4)
def _masked_body(file: RobotFile, masked: Links) -> cab.Body:
    return file.robot.body.ignoring(pairs=list(masked) or None)


def part_of(first: int, count: int) -> str:
    """The name of a chunk in the table: with leading zeros, so that rows are sorted by states."""
    return f"{first:013d}+{count}"


def robot_rows(item: Item, chunk: RobotChunk) -> Iterator[Row]:
    """The row of a chunk of states, with the pairs of links that touch in it."""
    start = core_seconds()
    file = _robot(item.source, chunk.packages, chunk.srdf, chunk.leave_out_missing, chunk.sha256)
    if file.sha256 != chunk.sha256:
        raise OSError(f"{item.source.path}: it is not the robot that the scan began with")
    body = _masked_body(file, chunk.masked)
    load_seconds = core_seconds() - start
    row = Row(item.key(item.policies[0]), notes=notes_text(item, file.robot.notes))
    summary = Summary(1.0, 0, False)
    states: Dict[Tuple[int, int], int] = collections.defaultdict(int)
    firsts: Dict[Tuple[int, int], int] = {}
    step = chunk_frames(body.link_count)
    policies = policies_of(item.policies[0])
    for first in range(0, chunk.count, step):
        count = min(step, chunk.count - first)
        poses = file.robot.poses(file.robot.random_states(count, chunk.seed, chunk.first + first))
        with cab.Clip(body, poses) as clip:
            hits = clip.hits(policies=policies, exact=policies.exact, depths=False)
            hits["frame"] += np.uint32(first)
            summary.add(hits, clip.stats)
        hits = hits[hits["frame"] >= chunk.counted]
        numbers = hits["link_a"].astype(np.int64) * body.link_count + hits["link_b"]
        pairs, where, counts = np.unique(numbers, return_index=True, return_counts=True)
        for number, index, times in zip(pairs.tolist(), where.tolist(), counts.tolist()):
            pair = divmod(number, body.link_count)
            firsts.setdefault(pair, int(hits["frame"][index]))
            states[pair] += times
    row.frames, row.links = chunk.count, body.link_count
    summary.fill(row, lambda _, link: ("", body.names[link]))
    first_state = chunk.first % FIRST_SAMPLE
    row.grown_from = part_of(first_state, chunk.counted) if chunk.counted else ""
    row.pairs = [
        LinkPair(body.names[a], body.names[b], "", states[a, b], first_state + firsts[a, b])
        for a, b in sorted(firsts)
    ]
    row.load_seconds = load_seconds
    row.seconds = core_seconds() - start - load_seconds
    yield row
