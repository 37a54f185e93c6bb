"""The table: one SQLite file, which one process writes. A row is in it as soon as its task is done."""

import contextlib
import errno
import fcntl
import functools
import hashlib
import json
import os
import sqlite3
import stat
from typing import Any, ContextManager, Dict, Iterable, Iterator, List, NamedTuple, Optional, Tuple

from . import stopping
from .work import BAD, DONE, SAMPLES, STATES, Key, LinkPair, Row

# It changes with the columns below, and with a default of an option: `options` names only what is not the default.
_FORMAT = 5
_APPLICATION = 0x43414253  # "CABS", in the header of the file

KEY_COLUMNS = ("file", "other", "part", "what", "policies", "options")
RESULT_COLUMNS = (
    "sequence", "sha256", "version", "outcome", "error", "notes", "frames", "links", "masked", "hits", "hit_frames",
    "depth", "depth_frame", "depth_link_a", "depth_link_b", "hits_hash", "contacts_hash",
)
# What depends on the machine, or is not promised to be the same on all, and so is no part of the hash.
COST_COLUMNS = (
    "box_tests", "leaf_pairs", "exact_tests", "false_positives", "load_seconds", "engine_seconds", "seconds",
)
CONTACT_COLUMNS = (
    "character_a", "link_a", "character_b", "link_b", "first_frame", "last_frame", "seconds", "depth", "deepest_frame",
)
PAIR_COLUMNS = ("file", "what", "policies", "options", "link_a", "link_b", "reason", "states", "first_state")

_SCHEMA = f"""
CREATE TABLE work (id INTEGER PRIMARY KEY,
  file TEXT NOT NULL, other TEXT NOT NULL, part TEXT NOT NULL, what TEXT NOT NULL, policies TEXT NOT NULL,
  options TEXT NOT NULL, sequence TEXT NOT NULL, sha256 TEXT, version TEXT NOT NULL, outcome TEXT NOT NULL, error TEXT,
  notes TEXT, frames INTEGER, links INTEGER, masked INTEGER, hits INTEGER, hit_frames INTEGER, depth REAL,
  depth_frame INTEGER, depth_link_a TEXT, depth_link_b TEXT, hits_hash TEXT, contacts_hash TEXT, box_tests INTEGER,
  leaf_pairs INTEGER, exact_tests INTEGER, false_positives INTEGER, load_seconds REAL, engine_seconds REAL,
  seconds REAL,
  UNIQUE (file, other, part, what, policies, options, sequence)) STRICT;
CREATE TABLE contacts (work INTEGER NOT NULL REFERENCES work (id) ON DELETE CASCADE,
  character_a TEXT NOT NULL, link_a TEXT NOT NULL, character_b TEXT NOT NULL, link_b TEXT NOT NULL,
  first_frame INTEGER NOT NULL, last_frame INTEGER NOT NULL, seconds REAL NOT NULL, depth REAL,
  deepest_frame INTEGER NOT NULL) STRICT;
CREATE INDEX contacts_of ON contacts (work);
CREATE TABLE pairs (file TEXT NOT NULL, what TEXT NOT NULL, policies TEXT NOT NULL, options TEXT NOT NULL,
  link_a TEXT NOT NULL, link_b TEXT NOT NULL, reason TEXT NOT NULL, states INTEGER NOT NULL, first_state INTEGER,
  PRIMARY KEY (file, what, policies, options, link_a, link_b)) STRICT;
PRAGMA user_version = {_FORMAT};
PRAGMA application_id = {_APPLICATION};
"""

# Of a damaged file. SQLite's own words may hold bytes of it that are no UTF-8.
_ERRORS = (sqlite3.Error, UnicodeDecodeError)

_KEY_IS = " AND ".join(f"{column} = ?" for column in KEY_COLUMNS)
_ORDER = ", ".join((*KEY_COLUMNS, "sequence"))

# What a merge takes of the table `other`: robots as a whole, unless more states of them are done here, and all other
# work, unless it got further here. A last chunk may be short, so chunks are not counted.
_KEY, _ROBOT = ", ".join(KEY_COLUMNS), "file, policies, options"
_IS_ROBOT = f"what IN ('{SAMPLES}', '{STATES}')"
_STATES_DONE = f"""(SELECT total(frames) FROM {{}}.work
   WHERE {_IS_ROBOT} AND outcome = '{DONE}' AND ({_ROBOT}) = (its.file, its.policies, its.options))"""
_PROGRESS = f"CASE {{}}.outcome WHEN '{DONE}' THEN 2 WHEN '{BAD}' THEN 1 ELSE 0 END"
_SAME_KEY = " AND ".join(f"mine.{column} = its.{column}" for column in KEY_COLUMNS)
_TAKEN_ROBOTS = f"""CREATE TEMP TABLE taken_robots AS SELECT {_ROBOT} FROM
  (SELECT {_ROBOT} FROM other.work WHERE {_IS_ROBOT} UNION SELECT {_ROBOT} FROM other.pairs) AS its
  WHERE {_STATES_DONE.format("other")} >= {_STATES_DONE.format("main")}"""
_TAKEN = f"""CREATE TEMP TABLE taken AS SELECT DISTINCT {_KEY} FROM other.work AS its WHERE
  CASE WHEN {_IS_ROBOT} THEN ({_ROBOT}) IN (SELECT {_ROBOT} FROM taken_robots)
  ELSE NOT EXISTS (SELECT 1 FROM main.work AS mine
    WHERE {_SAME_KEY} AND {_PROGRESS.format("mine")} > {_PROGRESS.format("its")}) END"""


class TableError(Exception):
    """The table cannot be opened, read or written; the message names the file and the reason."""


class Totals(NamedTuple):
    """Sums over all rows."""

    rows: int
    frames: int
    hit_frames: int
    hits: int
    load_seconds: float
    engine_seconds: float
    seconds: float


class Table:
    """The table of a file, which is made if it is not there."""

    def __init__(self, path: str) -> None:
        self.path = path
        self._open = contextlib.ExitStack()
        with contextlib.ExitStack() as stack:
            self._connect(stack)
            self._open = stack.pop_all()

    def _connect(self, stack: contextlib.ExitStack) -> None:
        # All names of a file mean one table, so the lock and SQLite's own files go by the one that is no link.
        path, real = self.path, os.path.realpath(self.path)
        if os.path.lexists(real) and os.lstat(real).st_nlink > 1:
            raise TableError(f"{path}: the file has two names (hard links), and SQLite's log goes by one")
        stack.enter_context(_locked(real, path))
        if sqlite3.sqlite_version_info < (3, 37):
            raise TableError(f"{path}: SQLite 3.37 is needed, and this Python has {sqlite3.sqlite_version}")
        with self._told():
            self._base = sqlite3.connect(real, isolation_level=None, timeout=60)
            stack.callback(self._base.close)
            tables = self._base.execute("SELECT count(*) FROM sqlite_master").fetchone()[0]
            if tables == 0:
                self._base.executescript(f"BEGIN IMMEDIATE; {_SCHEMA} COMMIT;")
            _check_format(self._base, path)
            self._base.execute("PRAGMA foreign_keys = ON")
            # A commit need not wait for the disk: what is killed loses nothing, and a machine that stops loses the last
            # rows at most. Where a file system has no shared memory, SQLite stays with its journal.
            self._base.execute("PRAGMA journal_mode = WAL")
            self._base.execute("PRAGMA synchronous = NORMAL")

    def close(self) -> None:
        """Closes the file. All that was committed stays."""
        with contextlib.suppress(sqlite3.Error):
            self._open.close()

    def known(self, key: Key, version: str) -> Optional[str]:
        """The content hash of finished work of this version."""
        with self._told():
            found = self._base.execute(
                f"SELECT sha256 FROM work WHERE {_KEY_IS} AND version = ? AND outcome IN (?, ?) LIMIT 1",
                (*key, version, DONE, BAD),
            ).fetchone()
        return found[0] if found else None

    def add(self, rows: Iterable[Row]) -> None:
        """Writes the rows of one task in the place of what there was of the same keys, all or nothing."""
        rows = list(rows)
        with self._transaction() as base:
            # The pairs of a chunk of states that is there are counted already.
            rows = [row for row in rows if row.key.what not in (SAMPLES, STATES) or not self._is_done(row)]
            for key in dict.fromkeys(row.key for row in rows):
                base.execute(f"DELETE FROM work WHERE {_KEY_IS}", key)
            for row in rows:
                if row.grown_from:
                    base.execute(f"DELETE FROM work WHERE {_KEY_IS}", row.key._replace(part=row.grown_from))
                self._insert(base, row)

    def _is_done(self, row: Row) -> bool:
        found = self._base.execute(
            f"SELECT sha256, version FROM work WHERE {_KEY_IS} AND outcome = ?", (*row.key, DONE)
        ).fetchone()
        if found and found != (row.sha256, row.version):
            raise TableError(f"{self.path}: {row.key.file}: the chunk {row.key.part} is there, of another robot or cab")
        return bool(found)

    def _insert(self, base: sqlite3.Connection, row: Row) -> None:
        columns = (*RESULT_COLUMNS, *COST_COLUMNS)
        values = _texts((*row.key, *(getattr(row, column) for column in columns)))
        marks = ", ".join("?" * len(values))
        work = base.execute(
            f"INSERT INTO work ({', '.join((*KEY_COLUMNS, *columns))}) VALUES ({marks})", values
        ).lastrowid
        base.executemany(
            f"INSERT INTO contacts VALUES ({', '.join('?' * (1 + len(CONTACT_COLUMNS)))})",
            ((work, *_texts(contact)) for contact in row.contacts),
        )
        self._add_pairs(base, row.key, row.pairs)

    def _add_pairs(self, base: sqlite3.Connection, key: Key, pairs: Iterable[LinkPair]) -> None:
        base.executemany(
            """INSERT INTO pairs VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?)
               ON CONFLICT DO UPDATE SET states = states + excluded.states, reason = max(reason, excluded.reason),
               first_state = CASE WHEN excluded.first_state IS NULL THEN first_state
                                  ELSE min(coalesce(first_state, excluded.first_state), excluded.first_state) END""",
            (_texts((key.file, key.what, key.policies, key.options, *pair)) for pair in pairs),
        )

    def add_pairs(self, key: Key, pairs: Iterable[LinkPair]) -> None:
        """Adds states to pairs of links, and says why pairs are masked."""
        with self._transaction() as base:
            self._add_pairs(base, key, pairs)

    def touching(self, key: Key) -> Dict[Tuple[str, str], int]:
        """In how many states each pair of links touched."""
        with self._told():
            rows = self._base.execute(
                "SELECT link_a, link_b, states FROM pairs WHERE (file, what, policies, options) = (?, ?, ?, ?)",
                (key.file, key.what, key.policies, key.options),
            ).fetchall()
        return {(link_a, link_b): states for link_a, link_b, states in rows}

    def forget_robot(self, key: Key) -> None:
        """Removes all chunks of a robot with these options, and their pairs."""
        with self._transaction() as base:
            for name in ("work", "pairs"):
                base.execute(
                    f"DELETE FROM {name} WHERE (file, what, policies, options) = (?, ?, ?, ?)",
                    (key.file, key.what, key.policies, key.options),
                )

    def forget_undone(self, key: Key, parts: Iterable[str]) -> None:
        """Removes rows of a robot without numbers but those of these chunks, among them that of its file."""
        gone = [part for part, (_, _, outcome) in self.robot_parts(key).items() if outcome != DONE]
        with self._transaction() as base:
            base.executemany(
                f"DELETE FROM work WHERE {_KEY_IS}",
                (key._replace(part=part) for part in set(gone).difference(parts)),
            )

    def robot_parts(self, key: Key) -> Dict[str, Tuple[Optional[str], str, str]]:
        """The chunks of a robot with these options: content hash, version and outcome."""
        with self._told():
            rows = self._base.execute(
                "SELECT part, sha256, version, outcome FROM work "
                "WHERE (file, what, policies, options) = (?, ?, ?, ?)",
                (key.file, key.what, key.policies, key.options),
            ).fetchall()
        return {part: (sha256, version, outcome) for part, sha256, version, outcome in rows}

    def totals(self) -> Totals:
        """Sums over all rows."""
        with self._told():
            row = self._base.execute(
                "SELECT count(*), total(frames), total(hit_frames), total(hits), total(load_seconds), "
                "total(engine_seconds), total(seconds) FROM work"
            ).fetchone()
        return Totals(*(int(value) for value in row[:4]), *row[4:])

    def policy_totals(self, keys: Iterable[Key]) -> List[Tuple[Any, ...]]:
        """By policies: seconds of tests, box tests, exact tests, false positives and hits of rows of these keys."""
        named = set(keys)
        sums: Dict[str, Tuple[Any, ...]] = {}
        columns = (*KEY_COLUMNS, "engine_seconds", "box_tests", "exact_tests", "false_positives", "hits")
        for row in self.rows(columns, "outcome = ?", (DONE,)):
            key, counts = Key(*row[:len(KEY_COLUMNS)]), row[len(KEY_COLUMNS):]
            if key in named:
                before = sums.get(key.policies, (0,) * len(counts))
                sums[key.policies] = tuple(one + (more or 0) for one, more in zip(before, counts))
        return [(policies, *sums[policies]) for policies in sorted(sums)]

    def worst(self, count: int) -> List[Tuple[Any, ...]]:
        """Of rows of clips that touch, the deepest, then those that touch in the most frames."""
        with self._told():
            return self._base.execute(
                "SELECT file, other, frames, hit_frames, depth, depth_frame, depth_link_a, depth_link_b FROM work "
                f"WHERE hits > 0 AND what NOT IN (?, ?) ORDER BY depth DESC, hit_frames DESC, {_ORDER} LIMIT ?",
                (SAMPLES, STATES, count),
            ).fetchall()

    def merge(self, path: str) -> None:
        """Takes over rows of another table, which `reserved` holds: in the place of those of the same keys.

        What is done stays, if the other has only an error of it. Robots are taken with all chunks, unless more of their
        states are done here.
        """
        columns = ", ".join((*KEY_COLUMNS, *RESULT_COLUMNS, *COST_COLUMNS))
        contacts = ", ".join(f"contact.{column}" for column in CONTACT_COLUMNS)
        with self._attached(path), self._transaction() as base:
            base.execute(_TAKEN_ROBOTS)
            base.execute(_TAKEN)
            base.execute(f"DELETE FROM work WHERE ({_KEY}) IN (SELECT {_KEY} FROM taken)")
            for name in ("work", "pairs"):
                base.execute(
                    f"DELETE FROM {name} WHERE {_IS_ROBOT} AND ({_ROBOT}) IN (SELECT {_ROBOT} FROM taken_robots)"
                )
            base.execute(
                f"INSERT INTO work ({columns}) SELECT {columns} FROM other.work "
                f"WHERE ({_KEY}) IN (SELECT {_KEY} FROM taken) ORDER BY id"
            )
            base.execute(
                f"INSERT INTO contacts SELECT mine.id, {contacts} FROM other.contacts AS contact "
                f"JOIN other.work AS its ON its.id = contact.work JOIN taken USING ({_KEY}) "
                f"JOIN work AS mine ON {_SAME_KEY} AND mine.sequence = its.sequence ORDER BY contact.rowid"
            )
            base.execute(
                f"INSERT INTO pairs SELECT * FROM other.pairs WHERE ({_ROBOT}) IN (SELECT {_ROBOT} FROM taken_robots)"
            )
            base.execute("DROP TABLE taken")
            base.execute("DROP TABLE taken_robots")

    @contextlib.contextmanager
    def _attached(self, path: str) -> Iterator[None]:
        try:
            self._base.execute("ATTACH ? AS other", (path,))
        except sqlite3.Error as error:
            raise TableError(f"{path}: {error}") from error
        try:
            yield
        finally:
            self._base.execute("DETACH other")

    def robot_totals(self) -> List[Tuple[Any, ...]]:
        """By robot: states, those with a hit, hits, pairs that touch in them, and masked pairs."""
        count = "(SELECT count(*) FROM pairs WHERE pairs.file = work.file AND pairs.options = work.options " \
                "AND pairs.policies = work.policies AND pairs.what = ? AND "
        with self._told():
            return self._base.execute(
                f"SELECT file, sum(frames), sum(hit_frames), sum(hits), {count} states > 0), {count} reason <> '') "
                "FROM work WHERE outcome = ? AND what = ? GROUP BY file, policies, options ORDER BY file",
                (STATES, SAMPLES, DONE, STATES),
            ).fetchall()

    def count_others(self, keys: Iterable[Key]) -> int:
        """How many rows have none of these keys."""
        named = set(keys)
        return sum(Key(*row) not in named for row in self.rows(KEY_COLUMNS))

    def rows(self, columns: Iterable[str], where: str = "1", values: Iterable[Any] = ()) -> Iterator[Tuple[Any, ...]]:
        """Rows of `work` in sorted order."""
        with self._told():
            # Not `yield from`, which closes the cursor where a caller stops early, maybe after the file was closed.
            for row in self._base.execute(
                f"SELECT {', '.join(columns)} FROM work WHERE {where} ORDER BY {_ORDER}", tuple(values)
            ):
                yield row

    def contacts(self) -> Iterator[Tuple[Any, ...]]:
        """Runs of frames in contact: the number of their row in sorted order, from 1 on, its file, and the rest."""
        columns = ", ".join(f"contacts.{column}" for column in CONTACT_COLUMNS)
        with self._told():
            for number, (work, file) in enumerate(
                self._base.execute(f"SELECT id, file FROM work ORDER BY {_ORDER}").fetchall(), 1
            ):
                for contact in self._base.execute(
                    f"SELECT {columns} FROM contacts WHERE work = ? ORDER BY rowid", (work,)
                ):
                    yield (number, file, *contact)

    def pairs(self) -> Iterator[Tuple[Any, ...]]:
        """Pairs of links of robots, in sorted order."""
        with self._told():
            for row in self._base.execute(
                f"SELECT {', '.join(PAIR_COLUMNS)} FROM pairs ORDER BY {', '.join(PAIR_COLUMNS[:6])}"
            ):
                yield row

    def hash(self) -> str:
        """SHA-256 of all rows in sorted order, without what depends on the machine: one line of JSON each."""
        digest = hashlib.sha256()
        for rows in (self.rows((*KEY_COLUMNS, *RESULT_COLUMNS)), self.pairs()):
            for row in rows:
                digest.update(json.dumps(row).encode() + b"\n")
        return digest.hexdigest()

    @contextlib.contextmanager
    def _transaction(self) -> Iterator[sqlite3.Connection]:
        with self._told():
            self._base.execute("BEGIN IMMEDIATE")
            try:
                yield self._base
                self._base.execute("COMMIT")
            except BaseException:
                # SQLite may have rolled back by itself, when the disk was full.
                with contextlib.suppress(sqlite3.Error):
                    self._base.execute("ROLLBACK")
                raise

    @contextlib.contextmanager
    def _told(self) -> Iterator[None]:
        try:
            yield
        except _ERRORS as error:
            raise TableError(f"{self.path}: {error}") from error


@contextlib.contextmanager
def reserved(paths: Iterable[str]) -> Iterator[None]:
    """Holds tables that are to be merged, so that no scan writes them. TableError if one is none, or a scan has it."""
    with contextlib.ExitStack() as stack:
        for real, path in {os.path.realpath(path): path for path in paths}.items():
            if not os.path.isfile(real):
                raise TableError(f"{path}: there is no such table")
            stack.enter_context(_locked(real, path))
            try:
                with contextlib.closing(sqlite3.connect(real)) as base:
                    _check_format(base, path)
            except _ERRORS as error:
                raise TableError(f"{path}: {error}") from error
        yield


def _check_format(base: sqlite3.Connection, path: str) -> None:
    if base.execute("PRAGMA application_id").fetchone()[0] != _APPLICATION:
        raise TableError(f"{path}: it is no table of cab scan")
    found = base.execute("PRAGMA user_version").fetchone()[0]
    if found != _FORMAT:
        raise TableError(f"{path}: it has format {found}, and this cab scan writes format {_FORMAT}")
    made = _made(base)
    for name, text in _wanted().items():
        if made.get(name) != text:
            raise TableError(f"{path}: {name} is not as cab scan makes it")
    # This reads the whole table, as the hash at the end does. It finds values that are not of their columns' types too.
    (damage,) = base.execute("PRAGMA integrity_check(1)").fetchone()
    if damage != "ok":
        raise TableError(f"{path}: it is damaged: {damage.splitlines()[-1]}")


def _made(base: sqlite3.Connection) -> Dict[str, str]:
    # How tables and indexes were made. Users may have added others.
    return {
        name: " ".join(text.split())
        for name, text in base.execute("SELECT name, sql FROM sqlite_master WHERE typeof(sql) = 'text'")
    }


@functools.lru_cache(maxsize=None)
def _wanted() -> Dict[str, str]:
    with contextlib.closing(sqlite3.connect(":memory:")) as base:
        base.executescript(_SCHEMA)
        return _made(base)


def _texts(values: Iterable[Any]) -> Tuple[Any, ...]:
    # Halves of surrogate pairs, as a loader's names may have them, are no UTF-8.
    return tuple(
        value.encode("utf-8", "backslashreplace").decode() if isinstance(value, str) else value for value in values
    )


class _Lock:
    """The file TABLE.lock, by which one process at a time has a table. It goes when the table is closed.

    It is beside the table: to close another descriptor of the table itself would drop SQLite's own locks. What is there
    under its name and is no lock stays as it is.
    """

    _MARK = b"cab scan\n"

    def __init__(self, table: str, told: str) -> None:
        self._path = f"{table}.lock"
        flags = os.O_RDWR | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC
        try:
            try:
                self._file = os.open(self._path, flags | os.O_CREAT | os.O_EXCL, 0o666)
                self._mark()
            except FileExistsError:
                self._file = os.open(self._path, flags)
        except OSError as error:
            name = told if error.errno == errno.ENOENT else f"{told}.lock"
            words = "it is a link" if error.errno == errno.ELOOP else error.strerror
            raise TableError(f"{name}: {words}") from error
        try:
            self._take(told)
        except BaseException:
            os.close(self._file)
            raise

    def _mark(self) -> None:
        try:
            if os.write(self._file, self._MARK) < len(self._MARK):
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        except OSError:
            with contextlib.suppress(OSError):  # another scan may have it by now
                fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
                os.remove(self._path)
            os.close(self._file)
            raise

    def _take(self, told: str) -> None:
        state = os.fstat(self._file)
        if not stat.S_ISREG(state.st_mode) or os.pread(self._file, 16, 0) not in (b"", self._MARK):
            raise TableError(f"{told}.lock: it is no lock of cab scan; remove it, or name another table")
        try:
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            if state.st_ino != os.stat(self._path, follow_symlinks=False).st_ino:
                raise OSError("the file was removed by the one that had the lock")
        except OSError as error:
            raise TableError(f"{told}: another cab scan writes it") from error

    def close(self) -> None:
        """Gives the table free."""
        with contextlib.suppress(OSError):
            if os.pread(self._file, 16, 0):  # else it was there, empty
                os.remove(self._path)
        os.close(self._file)


def _locked(table: str, told: str) -> ContextManager[_Lock]:
    return stopping.cleaning(lambda: _Lock(table, told), _Lock.close)
