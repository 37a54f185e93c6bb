"""A scan of robots: samples for the matrix, then states that are tested with it, both in chunks."""

import argparse
import os
import sys
from typing import Dict, List, Optional, Sequence, Set, Tuple

import cab

from .plan import robot_options
from .printable import tell
from .robots import FIRST_SAMPLE, RobotFile, matrix_rows, part_of, sampled_matrix
from .table import Table, TableError
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
        self._sources = sources
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
        self._check_states()
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

    def keys(self) -> List[Key]:
        """All rows of these robots."""
        keys = [self._key(what, source) for source in self._sources for what in (SAMPLES, STATES)]
        return [key._replace(part=part) for key in keys for part in self._table.robot_parts(key)]

    def _run_chunks(
        self, dispatch: Dispatch, what: str, start: int, count: int, masks: Sequence[Dict[Tuple[int, int], str]]
    ) -> None:
        items: List[Item] = []
        for (source, file), mask in zip(self._robots, masks):
            items += self._items(what, source, file, start, count, tuple(sorted(mask)))
        dispatch(items, self._table.add)

    def _items(
        self, what: str, source: Source, file: RobotFile, start: int, count: int, masked: Links
    ) -> List[Item]:
        key = self._key(what, source)
        done = self._done(what, source, file)
        # Pairs of links are counted over all chunks, so chunks of another robot or version are no use.
        if self._chosen.again or None in done.values():
            self._table.forget_robot(key)
            if not self._chosen.again:
                chunks = "1 chunk" if len(done) == 1 else f"{len(done)} chunks"
                tell(f"cab scan: {source.name}: {what} begin anew: {chunks} of another robot or version of cab",
                     sys.stderr)
            done = {}
        sizes = {first: min(self._chosen.chunk, count - first) for first in range(0, count, self._chosen.chunk)}
        # What could not be read or tested before is read now, or not wanted any more.
        self._table.forget_undone(key, {part_of(first, size) for first, size in sizes.items()})
        return [
            Item(
                what, source, (self._policies,), self._options, TestOptions(), (None,), None, part_of(first, size),
                RobotChunk(
                    start + first, size, self._chosen.seed, masked, self._packages, self._srdf,
                    self._chosen.leave_out_missing, file.sha256, done.get(first) or 0,
                ),
            )
            for first, size in sizes.items()
            if done.get(first) != size
        ]

    def _done(self, what: str, source: Source, file: RobotFile) -> Dict[int, Optional[int]]:
        """The chunks that are done: their first states, and how many each has; None: of another robot or version."""
        done: Dict[int, Optional[int]] = {}
        for part, (sha256, version, outcome) in self._table.robot_parts(self._key(what, source)).items():
            if outcome == DONE:
                first, size = _states_of(part, self._table)
                done[first] = size if (sha256, version) == (file.sha256, cab.__version__) else None
        return done

    def _check_states(self) -> None:
        """Raises TableError if there are states that are done and not wanted: they are not forgotten unasked."""
        for source, file in self._robots if not self._chosen.again else ():
            done = self._done(STATES, source, file)
            if done and None not in done.values():
                states = max(first + (size or 0) for first, size in done.items())
                if states > self._chosen.states:
                    raise TableError(
                        f"{self._table.path}: {source.name}: chunks are done up to state {states}, and --states "
                        f"{self._chosen.states} has fewer; --again forgets them, another --table keeps them"
                    )

    def _key(self, what: str, source: Source) -> Key:
        return Key(source.name, "", "", what, self._policies, self._options)


def _states_of(part: str, table: Table) -> Tuple[int, int]:
    try:
        first, count = map(int, part.split("+"))
    except ValueError as error:
        raise TableError(f"{table.path}: {part!r} is no chunk of states") from error
    return first, count
