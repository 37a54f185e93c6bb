"""Faults: workers and clients that are killed, bad files, full disks, other versions. What was finished stays."""

import ctypes
import os
import pathlib
import resource
import shutil
import signal
import sqlite3

import pytest

from conftest import Scan, arm_bvh, long, write_corpus
from faults import kill_all, wait_for_rows, workers_of

_LOADER = "fault_loader:load"


@pytest.fixture
def loader(scan):
    scan.environment["PYTHONPATH"] = f"{pathlib.Path(__file__).parent}{os.pathsep}{os.environ['PYTHONPATH']}"
    scan.environment["FAULT_SECONDS"] = "0.05"  # for each file, so that there is time to kill what runs
    return _LOADER


def write_list(scan, parts):
    write_corpus(scan.folder / "corpus", len(parts))
    files = sorted((scan.folder / "corpus").rglob("*.bvh"))
    lines = [f"{file.relative_to(scan.folder)},{part}" for file, part in zip(files, parts)]
    (scan.folder / "list.csv").write_text("\n".join(["path,part", *lines]) + "\n")


@pytest.fixture(scope="module")
def whole(tmp_path_factory, workers):
    """The hash of the table and the contacts of forty clips that nothing disturbs."""
    scan = Scan(tmp_path_factory.mktemp("whole"))
    write_list(scan, ["slow"] * 40)
    words = ["self", "--list", "list.csv", "--loader", _LOADER, "--csv", "scan.csv"]
    outcome = scan.here(*words, workers=workers)
    return outcome.hash, (scan.folder / "scan.contacts.csv").read_bytes()


def test_a_worker_that_is_killed_is_replaced_and_the_table_is_the_same(scan, loader, whole):
    write_list(scan, ["slow"] * 40)
    words = ["self", "--list", "list.csv", "--loader", loader, "--csv", "scan.csv"]
    process = scan.start(*words)
    wait_for_rows(scan, 10, process)
    os.kill(workers_of(process)[0], signal.SIGKILL)
    out, error = process.communicate(timeout=120)
    assert process.returncode == 0, error
    assert f"hash                {whole[0]}" in out
    assert (scan.folder / "scan.contacts.csv").read_bytes() == whole[1]


def test_a_client_that_is_killed_goes_on_where_it_was(scan, quick, loader, whole):
    write_list(scan, ["slow"] * 40)
    words = ["self", "--list", "list.csv", "--loader", loader]
    process = scan.start(*words)
    wait_for_rows(scan, 10, process)
    kill_all(process)
    there = {row["file"]: row["id"] for row in scan.rows()}
    assert 10 <= len(there) < 40
    outcome = quick(*words)
    assert outcome.code == 0 and outcome.hash == whole[0]
    after = {row["file"]: row["id"] for row in scan.rows()}
    assert len(after) == 40 and all(after[file] == number for file, number in there.items())


def test_bad_files_are_rows_and_told(scan, quick):
    write_corpus(scan.folder / "corpus", 4)
    (scan.folder / "corpus/bad.bvh").write_text(arm_bvh([0, 1]).replace("OFFSET 0 0.5 0", "OFFSET 0 x 0"))
    (scan.folder / "corpus/empty.bvh").write_text("")
    (scan.folder / "corpus/noise.glb").write_bytes(bytes(range(256)) * 10)
    (scan.folder / "corpus/folder.bvh").mkdir()
    (scan.folder / "corpus/gone.bvh").symlink_to("nowhere.bvh")
    (scan.folder / "void").mkdir()
    outcome = quick("self", "corpus", "void", "nothing*.bvh", "absent.bvh")
    assert outcome.code == 1
    assert "void: the folder has no file to scan in it" in outcome.error
    assert "nothing*.bvh: no file has such a name" in outcome.error and "absent.bvh: nothing is there" in outcome.error
    rows = {pathlib.Path(row["file"]).name: row for row in scan.rows()}
    assert len(rows) == 8 and sum(row["outcome"] == "done" for row in rows.values()) == 4
    assert rows["bad.bvh"]["error"].startswith("corpus/bad.bvh: line ") and rows["bad.bvh"]["outcome"] == "bad"
    assert rows["gone.bvh"]["outcome"] == "lost" and "No such file" in rows["gone.bvh"]["error"]
    again = quick("self", "corpus", "void", "nothing*.bvh", "absent.bvh")
    assert again.code == 1 and again.hash == outcome.hash
    kept = {row["file"]: row["id"] for row in scan.rows()}
    assert all(kept[row["file"]] == row["id"] for row in rows.values() if row["outcome"] != "lost")
    only = quick("self", "void", "--table", "none.sqlite")
    assert only.code == 1 and "nothing to scan" in only.error


def test_changed_files_are_done_anew_and_others_are_not(scan, quick):
    write_corpus(scan.folder / "corpus", 5)
    first = quick("self", "corpus")
    before = {row["file"]: row["id"] for row in scan.rows()}
    changed = sorted((scan.folder / "corpus").rglob("*.bvh"))[2]
    old = changed.read_text()
    changed.write_text(arm_bvh([5.5 * frame % 130 for frame in range(30)]))
    second = quick("self", "corpus")
    after = {row["file"]: row["id"] for row in scan.rows()}
    assert len(after) == 5 and second.hash != first.hash
    assert [file for file in after if after[file] != before[file]] == [str(changed.relative_to(scan.folder))]
    changed.write_text(old)
    assert quick("self", "corpus").hash == first.hash
    ids = {row["id"] for row in scan.rows()}
    assert quick("self", "corpus", "--again").hash == first.hash
    assert ids.isdisjoint(row["id"] for row in scan.rows())
    base = sqlite3.connect(scan.folder / "scan.sqlite")
    base.execute("UPDATE work SET version = '0.1', hits = 0 WHERE file LIKE '%0001%'")
    base.commit()
    base.close()
    assert quick("self", "corpus").hash == first.hash  # what another version made is made anew
    shutil.rmtree(scan.folder / "corpus/left")
    assert "2 rows of scan.sqlite are of files or options that this scan did not name" in quick("self", "corpus").error


def limit_files():
    resource.setrlimit(resource.RLIMIT_FSIZE, (80_000, 80_000))


@long
def test_a_file_that_may_grow_no_more_keeps_what_is_in_it(scan):
    write_corpus(scan.folder / "corpus", 100)
    outcome = scan("self", "corpus", "--table", "out/scan.sqlite")
    assert outcome.code == 1 and "out/scan.sqlite: No such file or directory" in outcome.error
    outcome = scan("self", "corpus", "--csv", "scan.csv", preexec_fn=limit_files)
    assert outcome.code == 1
    assert "scan.sqlite: database or disk is full" in outcome.error or "disk I/O error" in outcome.error
    there = len(scan.rows())
    assert 0 < there < 100
    base = sqlite3.connect(scan.folder / "scan.sqlite")
    assert base.execute("PRAGMA integrity_check").fetchone() == ("ok",)
    base.close()
    assert not (scan.folder / "scan.csv").exists()
    assert scan("self", "corpus").code == 0 and len(scan.rows()) == 100


def test_a_full_disk_is_told(scan, quick):
    place = scan.folder / "small"
    place.mkdir()
    libc = ctypes.CDLL(None, use_errno=True)
    if libc.mount(b"tmpfs", os.fsencode(place), b"tmpfs", 0, b"size=300k") != 0:
        pytest.skip(f"no tmpfs can be mounted: {os.strerror(ctypes.get_errno())}")
    try:
        write_corpus(scan.folder / "corpus", 100)
        outcome = quick("self", "corpus", "--table", "small/scan.sqlite", "--csv", "scan.csv")
        assert outcome.code == 1 and "small/scan.sqlite: database or disk is full" in outcome.error
        there = len(scan.rows(table="small/scan.sqlite"))
        assert 0 < there < 100
        for file in place.glob("scan.sqlite*"):
            shutil.copy(file, scan.folder / file.name)
    finally:
        libc.umount2(os.fsencode(place), 2)
    assert quick("self", "corpus").code == 0 and len(scan.rows()) == 100


@long
def test_one_scan_at_a_time_writes_a_table_and_only_a_table(scan, loader):
    write_list(scan, ["slow"] * 30)
    process = scan.start("self", "--list", "list.csv", "--loader", loader)
    wait_for_rows(scan, 1, process)
    outcome = scan("self", "corpus")
    assert outcome.code == 1 and "another cab scan writes it" in outcome.error
    assert process.wait(timeout=60) == 0
    process.communicate()
    (scan.folder / "text.sqlite").write_text("no database " * 100)
    assert "text.sqlite: file is not a database" in scan("self", "corpus", "--table", "text.sqlite").error
    base = sqlite3.connect(scan.folder / "other.sqlite")
    base.execute("CREATE TABLE a (b)")
    base.close()
    assert "it is no table of cab scan" in scan("self", "corpus", "--table", "other.sqlite").error
