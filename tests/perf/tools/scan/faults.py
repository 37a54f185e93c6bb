"""How tests kill what a scan started: by process numbers, never by name."""

import os
import pathlib
import signal
import sqlite3
import time

_MOST_SECONDS = 600


def children_of(process):
    """The processes below one, by their numbers: their parents, and their command lines."""
    parents, words = {}, {}
    for place in pathlib.Path("/proc").glob("[0-9]*"):
        try:
            fields = (place / "stat").read_text().rpartition(")")[2].split()
            words[int(place.name)] = (place / "cmdline").read_bytes().decode(errors="replace")
        except OSError:
            continue
        parents[int(place.name)] = int(fields[1])
    found = [process]
    for number in found:
        found.extend(child for child, parent in parents.items() if parent == number)
    return {number: (parents[number], words[number]) for number in found[1:]}


def workers_of(process):
    """The workers of a scan. What they have forked has their command line until it runs another program."""
    below = children_of(process.pid)
    return [number for number, (parent, words) in below.items() if parent == process.pid and "spawn_main" in words]


def wait_for_rows(scan, count, process):
    """Until the table has so many rows."""
    end = time.monotonic() + _MOST_SECONDS
    while time.monotonic() < end:
        assert process.poll() is None, process.communicate()
        try:
            if len(scan.rows("id")) >= count:
                return
        except sqlite3.OperationalError:
            pass
        time.sleep(0.02)
    raise AssertionError("the scan does not go on")


def kill_all(process):
    """SIGKILL to the client, and to what it started, which would see its end a little later."""
    numbers = list(children_of(process.pid))
    os.kill(process.pid, signal.SIGKILL)
    process.communicate()
    for number in numbers:
        try:
            os.kill(number, signal.SIGKILL)
        except ProcessLookupError:
            pass
