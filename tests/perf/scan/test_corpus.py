"""A corpus of thousands: copies of all motion that is there, killed, restarted, and with one and two workers."""

import os
import pathlib
import subprocess
import sys
import time

import pytest

from conftest import data_folder, long
from faults import kill_all, wait_for_rows

_UNITS = "0.0564"
_LOADER = ["--loader", "cab_scan.copies:load"]
_LEAST_SPEEDUP = 1.8
_ROUNDS = 2


@pytest.fixture
def copies(scan):
    """A function that writes the list of so many copies."""
    files = sorted(pathlib.Path("/usr/share/assimp").rglob("*.bvh"))
    if data_folder():
        files += [data_folder() / name for name in ("bvh", "pairs", "asfamc")]
    if not files:
        pytest.skip("neither assimp-testmodels nor CAB_DATA_DIR has motion")

    def write(count):
        words = [sys.executable, "-m", "cab_scan.copies", *map(str, files), "--count", str(count), "--units", _UNITS]
        (scan.folder / "list.csv").write_text(subprocess.run(words, capture_output=True, text=True, check=True).stdout)
        return ["self", "--list", "list.csv", *_LOADER]

    return write


@long
def test_a_corpus_that_is_killed_again_and_again_ends_with_the_same_table(scan, copies):
    words = copies(2000)
    whole = scan(*words, "--table", "whole.sqlite")
    assert whole.code == 0, whole.error
    for share in (400, 900, 1500):
        process = scan.start(*words)
        wait_for_rows(scan, share, process)
        kill_all(process)
    outcome = scan(*words)
    assert outcome.code == 0 and outcome.hash == whole.hash
    assert len(scan.rows("id")) == 2000


@long
def test_two_workers_are_nearly_twice_as_fast_as_one(scan, copies):
    if os.cpu_count() < 2 or os.getloadavg()[0] > 0.5:
        pytest.skip(f"it needs two quiet cores: {os.cpu_count()} cores, load {os.getloadavg()[0]}")
    words = copies(2000)
    seconds = {1: [], 2: []}
    for _ in range(_ROUNDS):
        for workers, times in seconds.items():
            start = time.monotonic()
            assert scan(*words, "--workers", workers, "--again").code == 0
            times.append(time.monotonic() - start)
    print(seconds)
    assert min(seconds[1]) / min(seconds[2]) >= _LEAST_SPEEDUP
