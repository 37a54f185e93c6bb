"""A scan of robots: samples for the matrix, then states that are tested with it, both in chunks."""

import argparse
import os
from typing import Dict, List, Sequence, Set, Tuple

import cab

from .plan import robot_options
from .robots import FIRST_SAMPLE, RobotFile, matrix_rows, sampled_matrix
from .table import Table
from .tasks import error_row, outcome_of, words_of
from .work import BAD, DONE, SAMPLES, STATES, Dispatch, Item, Key, Links, RobotChunk, Source, TestOptions

SUFFIXES = frozenset([".urdf", ".xml", ".mjcf"])


class RobotScan:
    """Robots of one scan. They are read here, before there are workers, so that a bad file costs no time."""

    def __init__(
        self, chosen: argparse.Namespace, sources: Sequence[Source], policies: str, table: Table
    ) -> None:
        self._chosen, self._policies, self._table = chosen, policies, table
        self._packages = tuple((name, os.path.abspath(folder)) for name, folder in chosen.packages)
        self._srdf = os.path.abspath(chosen.srdf) if chosen.srdf else ""
        self._samples = 0 if chosen.srdf else chosen.samples
        self._options = robot_options(
            self._samples, chosen.seed, chosen.chunk, chosen.srdf, chosen.leave_out_missing
        )
        self._robots: List[Tuple[Source, RobotFile]] = []
        for source in sources:
            self._read(source)

    def _read(self, source: Source) -> None:
        item = Item(STATES, source, (self._policies,), self._options, TestOptions(), (None,))
        try:
            file = RobotFile(source, self._packages, self._srdf, self._chosen.leave_out_missing)
        except (OSError, MemoryError, ValueError, cab.Error) as error:
            if outcome_of(error) == BAD:  # what the machine stopped keeps its chunks
                for what in (SAMPLES, STATES):
                    self._table.forget_robot(self._key(what, source))
            self._table.add([error_row(item, self._policies, outcome_of(error), words_of(error))])
            return
        self._robots.append((source, file))

    def run(self, dispatch: Dispatch) -> None:
        """Until all chunks of all robots are in the table."""
        fixed = [file.fixed_matrix(not self._srdf) for _, file in self._robots]
        self._run_chunks(dispatch, SAMPLES, FIRST_SAMPLE, self._samples, fixed)
        sampled = list(zip(self._robots, fixed))
        self._robots, whole = [], []
        for (source, file), known in sampled:
            key = self._key(SAMPLES, source)
            if any(outcome != DONE for _, _, outcome in self._table.robot_parts(key).values()):
                continue  # its rows say why; without all samples there is no matrix
            self._robots.append((source, file))
            at_rest: Set[Tuple[int, int]] = set()
            if not self._srdf:
                at_rest = file.touching_at_rest(self._policies, known)
            matrix = sampled_matrix(file, known, at_rest, self._table.touching(key), self._samples)
            self._table.add_pairs(key, matrix_rows(file, matrix))
            whole.append(matrix)
        self._run_chunks(dispatch, STATES, 0, self._chosen.states, whole)

    def _run_chunks(
        self, dispatch: Dispatch, what: str, start: int, count: int, masks: Sequence[Dict[Tuple[int, int], str]]
    ) -> None:
        items: List[Item] = []
        for (source, file), mask in zip(self._robots, masks):
            firsts = range(0, count, self._chosen.chunk)
            chunks = [(first, min(self._chosen.chunk, count - first)) for first in firsts]
            items += self._items(what, source, file, start, chunks, tuple(sorted(mask)))
        dispatch(items, self._table.add)

    def _items(
        self, what: str, source: Source, file: RobotFile, start: int, chunks: Sequence[Tuple[int, int]], masked: Links
    ) -> List[Item]:
        key = self._key(what, source)
        parts = {_part(first, count): (first, count) for first, count in chunks}
        self._table.forget_file_error(key)  # it has been read now
        there = self._table.robot_parts(key)
        # Pairs of links are counted over all chunks, so chunks of another robot, version or length are no use.
        if self._chosen.again or any(
            part not in parts or (outcome == DONE and (sha256, version) != (file.sha256, cab.__version__))
            for part, (sha256, version, outcome) in there.items()
        ):
            self._table.forget_robot(key)
            there = {}
        done = {part for part, (_, _, outcome) in there.items() if outcome == DONE}
        return [
            Item(
                what, source, (self._policies,), self._options, TestOptions(), (None,), None, part,
                RobotChunk(
                    start + first, count, self._chosen.seed, masked, self._packages, self._srdf,
                    self._chosen.leave_out_missing, file.sha256,
                ),
            )
            for part, (first, count) in parts.items()
            if part not in done
        ]

    def _key(self, what: str, source: Source) -> Key:
        return Key(source.name, "", "", what, self._policies, self._options)


def _part(first: int, count: int) -> str:
    # With leading zeros, so that rows are sorted by states.
    return f"{first:013d}+{count}"
