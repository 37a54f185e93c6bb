"""A corpus of thousands: copies of all motion that is there, killed and restarted."""

import pathlib
import subprocess
import sys

import pytest

from conftest import data_folder, long
from faults import kill_all, wait_for_rows

_UNITS = "0.0564"
_LOADER = ["--loader", "cab_scan.copies:load"]


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
