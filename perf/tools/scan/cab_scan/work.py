"""What goes to workers and what comes back: plain data."""

import dataclasses
from typing import Callable, Dict, List, Literal, NamedTuple, Optional, Sequence, Tuple, Union

from .printable import table_text

SELF, PAIRS, RECORDING, SAMPLES, STATES = "self", "pairs", "recording", "robot samples", "robot states"

DONE = "done"  # the row has numbers
BAD = "bad"  # the file is refused: the same bytes give the same answer
LOST = "lost"  # unreadable, out of memory, or the worker died: another run tries again

Links = Tuple[Tuple[int, int], ...]


class ClusterError(Exception):
    """There are no workers, or they are not those that are wanted."""


@dataclasses.dataclass(frozen=True)
class FileOptions:
    """How one file is read: what `cab.load_motion` takes."""

    units: Union[float, str, None] = None
    motion: str = ""
    motion_units: float = 0.0
    animation: str = ""
    fps: float = 0.0
    body: Literal["skeleton", "skin", "surface"] = "skeleton"
    stature: float = 0.0
    thickness: float = 1.0

    def changed(self) -> Dict[str, object]:
        """The options that are not the default, for a row."""
        return {
            field.name: getattr(self, field.name)
            for field in dataclasses.fields(self)
            if getattr(self, field.name) != field.default
        }


class Source(NamedTuple):
    """A file of the corpus: `name` as in the table, `path` to open it by, bytes at listing."""

    name: str
    path: str
    options: FileOptions
    size: int


@dataclasses.dataclass(frozen=True)
class TestOptions:
    """What counts as a hit, and what is written down. `loader` is module:function; empty: `cab.load_motion`."""

    min_depth: float = 0.0
    gap: int = 0
    hops: int = 2
    intervals: bool = True
    loader: str = ""
    loader_sha256: str = ""
    command: str = ""


@dataclasses.dataclass(frozen=True)
class RobotChunk:
    """Random states `first` to `first` + `count` - 1 of a seed, and links that are not tested with each other.

    counted  so many of its states are in the table as a smaller chunk, with pairs of links, which are not counted twice
    """

    first: int
    count: int
    seed: int
    masked: Links
    packages: Tuple[Tuple[str, str], ...]
    srdf: str
    leave_out_missing: bool
    sha256: str
    counted: int = 0


@dataclasses.dataclass(frozen=True)
class Item:
    """A unit of work, whose rows become finished together. The key names it in the table.

    known  per policies the content hash of the rows that are there; what has it is not done again.
    """

    what: str
    source: Source
    policies: Tuple[str, ...]
    options: str
    test: TestOptions
    known: Tuple[Optional[str], ...]
    other: Optional[Source] = None
    part: str = ""
    robot: Optional[RobotChunk] = None

    @property
    def other_name(self) -> str:
        """The second file of a pair, or nothing."""
        return self.other.name if self.other else ""

    @property
    def size(self) -> int:
        """About how much work it is: bytes to read, or for states their number by a factor."""
        if self.robot:
            return self.robot.count * 64
        return self.source.size + (self.other.size if self.other else 0) + 4096

    def key(self, policies: str) -> "Key":
        """The name of its rows with these policies."""
        return Key(self.source.name, self.other_name, table_text(self.part), self.what, policies, self.options)


class Key(NamedTuple):
    """What names finished work."""

    file: str
    other: str
    part: str
    what: str
    policies: str
    options: str


class Contact(NamedTuple):
    """A run of frames in which two links touch."""

    character_a: str
    link_a: str
    character_b: str
    link_b: str
    first_frame: int
    last_frame: int
    seconds: float
    depth: Optional[float]
    deepest_frame: int


class LinkPair(NamedTuple):
    """In how many states two links of a robot touch, and in which first."""

    link_a: str
    link_b: str
    reason: str
    states: int
    first_state: Optional[int]


@dataclasses.dataclass
class Row:
    """A row of the table. `sequence` tells several of one file apart. Seconds are no part of the table's hash.

    `notes` is what `notes.notes_text` makes of the notes of what was read. `grown_from` is the part of a smaller chunk
    whose place it takes.
    """

    key: Key
    sequence: str = ""
    sha256: Optional[str] = None
    version: str = ""
    outcome: str = DONE
    error: Optional[str] = None
    notes: Optional[str] = None
    frames: Optional[int] = None
    links: Optional[int] = None
    masked: Optional[int] = None
    hits: Optional[int] = None
    hit_frames: Optional[int] = None
    depth: Optional[float] = None
    depth_frame: Optional[int] = None
    depth_link_a: Optional[str] = None
    depth_link_b: Optional[str] = None
    hits_hash: Optional[str] = None
    contacts_hash: Optional[str] = None
    box_tests: Optional[int] = None
    leaf_pairs: Optional[int] = None
    exact_tests: Optional[int] = None
    false_positives: Optional[int] = None
    load_seconds: Optional[float] = None
    engine_seconds: Optional[float] = None
    seconds: Optional[float] = None
    contacts: List[Contact] = dataclasses.field(default_factory=list)
    pairs: List[LinkPair] = dataclasses.field(default_factory=list)
    grown_from: str = ""


class Report(NamedTuple):
    """What a task gives back: the worker's versions, and the rows of each key that was done anew."""

    versions: Tuple[Tuple[str, str], ...]
    rows: List[Row]


# Runs items on workers until each has its rows, which the function given to it writes down.
Dispatch = Callable[[Sequence[Item], Callable[[List[Row]], None]], None]
