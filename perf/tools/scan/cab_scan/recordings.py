"""Rows of recordings, on a worker, by the command: `cab replay` compares all bits, `cab report` has the intervals."""

import csv
import json
import os
import shutil
import signal
import subprocess
import tempfile
from typing import Any, Dict, Iterator, List, Optional, Tuple

import cab

from .clock import core_seconds
from .hashing import contacts_sha256
from .printable import text_of_cell
from .reading import blocks_of
from .work import Contact, Item, Row

RECORDED = "as recorded"
_MARK = b"CABREC\r\n"  # a recording's first bytes, as in engine/record/chunk.cpp
# With these signals the command was stopped from outside. With others it crashed.
_FROM_OUTSIDE = (signal.SIGKILL, signal.SIGTERM, signal.SIGINT, signal.SIGHUP, signal.SIGQUIT)


class CommandError(RuntimeError):
    """The command is not there, is of another version, or failed."""


def is_recording(path: str) -> bool:
    """Whether a file begins as a recording does."""
    return next(blocks_of(path), b"").startswith(_MARK)


def recording_rows(item: Item) -> Iterator[Row]:
    """The row of a recording. Frames that replay to other bits, or cannot be read, are an error."""
    start = core_seconds()
    row = Row(item.key(RECORDED))
    with tempfile.TemporaryDirectory(prefix="cab-scan-") as folder:
        table = os.path.join(folder, "replay.json")
        problem = _run(item, ["replay", item.source.path, "--json", table], table)
        with open(table, encoding="utf-8") as file:
            replay: Dict[str, Any] = json.load(file)
        if replay["cab_version"] != cab.__version__:
            raise CommandError(f"the command is of cab {replay['cab_version']}, and the module of {cab.__version__}")
        result = replay["results"][0]
        row.frames, row.hits, row.hits_hash = result["frames"], result["hits"], result["hash"]
        row.engine_seconds = result["run_frame_seconds"]
        intervals = os.path.join(folder, "report.csv")
        problem = _run(item, ["report", item.source.path, "--csv", intervals], intervals) or problem
        with open(intervals, newline="", encoding="utf-8") as file:
            lines = [line for line in csv.DictReader(file) if line["first_frame"]]
    if result["different_frames"]:
        raise ValueError(f"{result['different_frames']} frames replay to other bits: {result['first_difference']}")
    if problem:
        raise ValueError(problem)
    frame_seconds = max(map(_frame_seconds, lines), default=0.0)
    contacts = [_contact(line, frame_seconds) for line in lines]
    row.hit_frames = _covered((one.first_frame, one.last_frame) for one in contacts)
    deepest = max((one for one in contacts if one.depth is not None), key=lambda one: one.depth or 0.0, default=None)
    if deepest is not None:
        row.depth, row.depth_frame = deepest.depth, deepest.deepest_frame
        row.depth_link_a, row.depth_link_b = deepest.link_a, deepest.link_b
    row.contacts = sorted(contacts) if item.test.intervals else []
    row.contacts_hash = contacts_sha256(row.contacts)
    row.seconds = core_seconds() - start
    yield row


def _run(item: Item, words: List[str], wanted: str) -> Optional[str]:
    command = item.test.command or shutil.which("cab")
    if not command:
        raise CommandError("recordings are read by the command cab, which is not in PATH; CAB_COMMAND names it")
    try:
        outcome = subprocess.run([command, *words], capture_output=True, text=True, errors="replace", check=False)
    except OSError as error:
        raise CommandError(f"{command} cannot be run: {error.strerror}") from error
    told = " ".join(outcome.stderr.split()).removeprefix("cab: ")
    if -outcome.returncode in _FROM_OUTSIDE:
        raise CommandError(f"{command} {words[0]} was stopped from outside: {signal.strsignal(-outcome.returncode)}")
    if wanted in told:  # as where the disk is full: the recording has no part in it
        raise CommandError(told)
    if not os.path.exists(wanted):
        raise ValueError(told or f"{command} {words[0]} ended with {outcome.returncode}")
    return told or f"{words[0]} ended with {outcome.returncode}" if outcome.returncode else None


def _frame_seconds(line: Dict[str, str]) -> float:
    # Of a run of one frame nothing tells how long a frame is.
    frames = int(line["last_frame"]) - int(line["first_frame"])
    return (float(line["last_seconds"]) - float(line["first_seconds"])) / frames if frames else 0.0


def _contact(line: Dict[str, str], frame_seconds: float) -> Contact:
    first, last = int(line["first_frame"]), int(line["last_frame"])
    return Contact(
        text_of_cell(line["character_a"]), text_of_cell(line["link_a"]),
        text_of_cell(line["character_b"]), text_of_cell(line["link_b"]),
        first, last, (last - first + 1) * frame_seconds,
        float(line["worst_depth"]) if line["worst_depth"] else None, int(line["worst_frame"]),
    )


def _covered(spans: Iterator[Tuple[int, int]]) -> int:
    # How many frames are in any of the spans.
    count, end = 0, -1
    for first, last in sorted(spans):
        count += max(0, last - max(first, end + 1) + 1)
        end = max(end, last)
    return count
