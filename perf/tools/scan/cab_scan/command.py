"""The command: from options to the table."""

import argparse
import contextlib
import functools
import importlib.util
import os
import sys
from typing import Iterator, List, Optional, Sequence

import cab

from . import corpus, export, local, options, outputs, plan, policies, robot_scan, stopping, summary
from .printable import tell
from .recordings import RECORDED
from .sequences import LoaderError, loader_sha256
from .table import Table, TableError, reserved
from .work import PAIRS, RECORDING, SELF, ClusterError, Dispatch, Key, TestOptions


def run(words: Optional[Sequence[str]]) -> int:
    """The exit code: 0, 1 for bad files and what else is told, 2 for wrong use, 130 when stopped."""
    chosen = options.parse(words, cab.__version__)
    try:
        return _merge(chosen) if chosen.what == "merge" else _scan(chosen)
    except outputs.OutputError as error:
        tell(f"cab scan: {error}", sys.stderr)
        return 2
    except (corpus.CorpusError, LoaderError, TableError, ClusterError, cab.FileError) as error:
        tell(f"cab scan: {error}", sys.stderr)
    except OSError as error:
        name = f"{os.fsdecode(error.filename)}: " if error.filename else ""
        tell(f"cab scan: {name}{error.strerror or error or type(error).__name__}", sys.stderr)
    except MemoryError:
        tell("cab scan: out of memory", sys.stderr)
    except KeyboardInterrupt:
        tell(f"cab scan: stopped; what is done is in {chosen.table}, and the same command goes on", sys.stderr)
        return stopping.CODE
    return 1


def _scan(chosen: argparse.Namespace) -> int:
    given = {name: getattr(chosen, name, None) or "" for name in corpus.READERS}
    for_all = corpus.with_options(plan.DEFAULT_FILE_OPTIONS, given, "")
    root = os.path.abspath(chosen.root) if chosen.root else ""
    suffixes = {"recordings": corpus.RECORDING_SUFFIXES, "robot": robot_scan.SUFFIXES}
    found = corpus.find(
        chosen.paths, chosen.lists, root, for_all, suffixes.get(chosen.what, corpus.MOTION_SUFFIXES),
    )
    entries = found.entries
    if chosen.what == "pairs":
        entries = _pairs(entries, chosen.pattern)
    elif chosen.what in ("robot", "recordings"):  # which no options of files change
        entries = list({entry.source.name: entry for entry in entries}.values())
    for problem in (*found.notes, *found.problems):
        tell(f"cab scan: {problem}", sys.stderr)
    if not entries:
        raise corpus.CorpusError("there is nothing to scan")
    if chosen.what != "recordings":
        _check_surfaces(chosen, entries)
    if chosen.shard:  # of more machines than files, some have none
        entries = entries[chosen.shard[0] - 1::chosen.shard[1]]
    written = export.csv_files(chosen.csv) if chosen.csv else []
    outputs.check(chosen.table, written, [*found.read, *chosen.lists, *_given_files(chosen)])
    stopping.raise_from_now_on()
    with contextlib.closing(Table(chosen.table)) as table:
        if chosen.what == "robot":
            (text,) = _policies(chosen, has_surface=False)
            scan = robot_scan.RobotScan(chosen, [entry.source for entry in entries], text, table)
            with _workers(chosen) as dispatch:
                scan.run(dispatch)
            keys = scan.keys()
        else:
            keys = _scan_files(chosen, entries, table)
        summary.tell_unnamed(table, keys)
        if written:
            export.write_csv_files(table, written)
        has_errors = summary.tell(table, written, chosen.what, keys)
    return 1 if has_errors or found.problems else 0


def _merge(chosen: argparse.Namespace) -> int:
    written = export.csv_files(chosen.csv) if chosen.csv else []
    outputs.check(chosen.table, written, chosen.paths)
    stopping.raise_from_now_on()
    with reserved(chosen.paths), contextlib.closing(Table(chosen.table)) as table:
        for path in chosen.paths:
            table.merge(path)
        if written:
            export.write_csv_files(table, written)
        return 1 if summary.tell(table, written, chosen.what) else 0


def _given_files(chosen: argparse.Namespace) -> List[str]:
    return [path for path in (getattr(chosen, "srdf", ""), getattr(chosen, "motion", "")) if path]


def _policies(chosen: argparse.Namespace, has_surface: bool) -> List[str]:
    """Those of files with surfaces, or of others, as texts: the exact test is theirs if no words name one."""
    exact = "surface" if has_surface else "convex"
    made = [policies.choose_policies(words, exact) for words in options.policy_words(chosen)]
    return list(dict.fromkeys(map(policies.policies_text, made)))


def _check_surfaces(chosen: argparse.Namespace, entries: Sequence[corpus.Entry]) -> None:
    """Raises CorpusError if a file is a surface that the options would not test, or they test surfaces and none is."""
    for entry in entries:
        if entry.has_surface:
            try:
                options.check_tests(chosen, has_surface=True)
            except ValueError as error:
                raise corpus.CorpusError(f"{entry.source.name}, a surface: {error}") from error
            return
    if any("exact=surface" in text.split() for text in _policies(chosen, has_surface=False)):
        raise corpus.CorpusError("exact=surface tests triangles, and no file is one of bodies with them")


def _pairs(entries: List[corpus.Entry], pattern: Optional[str]) -> List[corpus.Entry]:
    named = [entry for entry in entries if entry.other]
    rest = [entry for entry in entries if not entry.other]
    if rest and not pattern:
        name = rest[0].source.name
        raise corpus.CorpusError(f"{name}: with whom? --pattern, or the column other of a list, says it")
    if not pattern:
        return named
    pairs = named + corpus.pair_up(rest, pattern)
    paired = {source.name for entry in pairs for source in (entry.source, entry.other) if source}
    alone = [entry.source.name for entry in rest if entry.source.name not in paired]
    if alone:
        files = "1 file is" if len(alone) == 1 else f"{len(alone)} files are"
        tell(f"cab scan: --pattern: {files} in no pair; the first is {alone[0]}", sys.stderr)
    return pairs


def _scan_files(chosen: argparse.Namespace, entries: Sequence[corpus.Entry], table: Table) -> List[Key]:
    """Until all work is in the table. Returns its keys."""
    if chosen.what == "recordings":
        what, texts = RECORDING, dict.fromkeys((False, True), [RECORDED])
        test = TestOptions(intervals=not chosen.no_contacts, command=os.environ.get("CAB_COMMAND", ""))
    else:
        what, texts = PAIRS if chosen.what == "pairs" else SELF, {has: _policies(chosen, has) for has in (False, True)}
        test = TestOptions(
            chosen.min_depth, chosen.gap, getattr(chosen, "hops", TestOptions.hops), not chosen.no_contacts,
            chosen.loader, loader_sha256(chosen.loader) if chosen.loader else "",
        )
    items = plan.make_items(entries, what, [texts[entry.has_surface] for entry in entries], test, table, chosen.again)
    with _workers(chosen) as dispatch:
        dispatch(items, table.add)
    return [item.key(text) for item in items for text in item.policies]


@contextlib.contextmanager
def _workers(chosen: argparse.Namespace) -> Iterator[Dispatch]:
    if not chosen.scheduler:
        with local.pool(chosen.workers, chosen.memory, chosen.most_seconds) as pool:
            yield pool.dispatch
        return
    if any(importlib.util.find_spec(name) is None for name in ("dask", "distributed")):
        raise ClusterError(
            "--scheduler: Python has no module distributed (Debian: python3-distributed; `./dev deps --cluster` in the "
            "sources of cab installs it)"
        )
    from . import cluster  # late, since it needs Dask

    with cluster.workers_of(chosen.scheduler) as client:
        cluster.check_versions(client)
        yield functools.partial(cluster.dispatch, client)
