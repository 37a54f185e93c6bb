"""Faults: workers and clients that are killed, bad files, full disks, other versions. What was finished stays."""

import ctypes
import functools
import json
import os
import pathlib
import resource
import shutil
import signal
import sqlite3
import subprocess
import sys
import time

import cab
import cab_scan
import pytest
from distributed import Security

from conftest import Scan, arm_bvh, long, write_corpus
from faults import children_of, kill_all, wait_for_rows, workers_of

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


def test_an_interrupt_ends_cleanly(scan, quick, loader):
    write_list(scan, ["slow"] * 40)
    words = ["self", "--list", "list.csv", "--loader", loader]
    process = scan.start(*words)
    wait_for_rows(scan, 5, process)
    os.killpg(process.pid, signal.SIGINT)  # as a terminal does: to the client and its workers
    out, error = process.communicate(timeout=60)
    assert process.returncode == 130 and "the same command goes on" in error
    assert "Traceback" not in error and "KeyboardInterrupt" not in error and out == ""
    assert children_of(process.pid) == {}
    assert not (scan.folder / "scan.sqlite.lock").exists()
    outcome = quick(*words)
    assert outcome.code == 0 and len(scan.rows()) == 40


def test_what_kills_its_worker_is_a_row_and_blames_nobody_else(scan, loader):
    parts = ["", "kill", "", "once", "eat", ""] + [""] * 6
    write_list(scan, parts)
    outcome = scan("self", "--list", "list.csv", "--loader", loader)
    assert outcome.code == 1 and "its worker died" in outcome.error and "out of memory" in outcome.error
    rows = {row["part"]: row for row in scan.rows()}
    assert len(scan.rows()) == 12
    assert rows["kill"]["outcome"] == rows["eat"]["outcome"] == "lost"
    assert rows["once"]["outcome"] == "done" and rows[""]["outcome"] == "done"
    assert sum(row["outcome"] == "done" for row in scan.rows()) == 10


def run_with_a_holding_loader(scan, loader, seconds, connect):
    """A scan whose loader lets no other thread of the worker run, while rows are to be fetched from there."""
    write_list(scan, ["", f"hold {seconds}", ""])
    scan.environment["FAULT_SECONDS"] = "0"
    if connect:
        scan.environment["DASK_DISTRIBUTED__COMM__TIMEOUTS__CONNECT"] = connect
    process = scan.start("self", "--list", "list.csv", "--loader", loader, "--workers", "1")
    try:
        out, error = process.communicate(timeout=240)
    except subprocess.TimeoutExpired:
        kill_all(process)
        raise
    assert process.returncode == 0, error
    assert [row["outcome"] for row in scan.rows()] == ["done"] * 3


def test_a_loader_may_hold_its_process_for_some_time(scan, loader):
    run_with_a_holding_loader(scan, loader, 13, "")


@long
def test_a_worker_that_falls_silent_for_too_long_is_replaced(scan, loader):
    run_with_a_holding_loader(scan, loader, 25, "1s")  # which Dask asks four times


@long
def test_a_worker_that_takes_too_long_is_replaced(scan, loader):
    write_list(scan, ["", "hold 600", ""])
    outcome = scan("self", "--list", "list.csv", "--loader", loader, "--most-seconds", 4)
    assert outcome.code == 1 and "more than --most-seconds" in outcome.error
    assert [row["outcome"] for row in scan.rows()] == ["done", "lost", "done"]


@long
def test_a_worker_that_takes_too_much_memory_is_replaced(scan, loader):
    write_list(scan, ["", "grow", ""])
    outcome = scan("self", "--list", "list.csv", "--loader", loader, "--memory", "400MB")
    assert outcome.code == 1 and "its worker died" in outcome.error
    assert [row["outcome"] for row in scan.rows()] == ["done", "lost", "done"]


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


class Cluster:
    """A Dask scheduler, whose workers have a PYTHONPATH of their own. `words` are for scheduler and workers."""

    def __init__(self, folder, *words):
        self._folder, self._file, self._words = folder, folder / "scheduler.json", words
        self._scheduler = self._start("dask_scheduler", "--port", "0")

    @functools.cached_property
    def address(self):
        while not self._file.exists():
            assert self._scheduler.poll() is None
            time.sleep(0.05)
        return json.loads(self._file.read_text())["address"]

    def _start(self, program, *words, **more):
        return subprocess.Popen(
            [sys.executable, "-m", f"distributed.cli.{program}", "--scheduler-file", str(self._file),
             "--no-dashboard", *self._words, *words],
            cwd=self._folder, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, **more,
        )

    def worker(self, path):
        return self._start("dask_worker", "--nthreads", "1", "--no-nanny", env={**os.environ, "PYTHONPATH": str(path)})

    def close(self):
        self._scheduler.terminate()
        self._scheduler.wait()


def scan_when_there_are_workers(scan, address):
    for _ in range(400):
        outcome = scan("self", "corpus", "--scheduler", address)
        if "no workers" not in outcome.error:
            return outcome
        time.sleep(0.05)
    raise AssertionError("there are no workers")


def test_a_cluster_computes_if_its_workers_have_the_same_versions(scan):
    write_corpus(scan.folder / "corpus", 2)
    other = scan.folder / "other"
    for package in (cab, cab_scan):
        shutil.copytree(pathlib.Path(package.__file__).parent, other / package.__name__)
    init = other / "cab/__init__.py"
    init.write_text(init.read_text().replace("__version__ = _cab.version()", '__version__ = "0.9.9"'))
    cluster = Cluster(scan.folder)
    try:
        for path, code, told in (
            (other, 1, "other versions than this process: cab 0.9.9 there and"),
            (scan.folder, 1, "its PYTHONPATH must have cab and cab_scan"),
            (os.environ["PYTHONPATH"], 0, ""),
        ):
            worker = cluster.worker(path)
            try:
                outcome = scan_when_there_are_workers(scan.here, cluster.address)
            finally:
                worker.terminate()
                worker.wait()
            assert outcome.code == code and told in outcome.error, outcome.error
            assert len(scan.rows()) == (0 if code else 2)
    finally:
        cluster.close()
    gone = scan.here("self", "corpus", "--scheduler", cluster.address)
    assert gone.code == 1 and f"--scheduler {cluster.address}" in gone.error


@long
def test_a_scheduler_may_want_certificates(scan):
    write_corpus(scan.folder / "corpus", 2)
    made = Security.temporary()
    for name, text in (("ca", made.tls_ca_file), ("cert", made.tls_client_cert), ("key", made.tls_client_key)):
        (scan.folder / f"{name}.pem").write_text(text)
    files = [word for name in ("ca-file", "cert", "key") for word in (f"--tls-{name}", f"{name.split('-')[0]}.pem")]
    cluster = Cluster(scan.folder, "--protocol", "tls", *files)
    worker = cluster.worker(os.environ["PYTHONPATH"])
    try:
        assert cluster.address.startswith("tls://")
        plain = scan("self", "corpus", "--scheduler", cluster.address)
        assert plain.code == 1 and "distributed.comm.tls has the certificates" in plain.error
        wrong = scan("self", "corpus", "--scheduler", cluster.address.replace("tls://", "tcp://"))
        assert wrong.code == 1 and "begins with tls://" in wrong.error
        assert plain.error.count("\n") == wrong.error.count("\n") == 1
        start = "DASK_DISTRIBUTED__COMM__TLS__"
        for name, file in (("CA_FILE", "ca"), ("CLIENT__CERT", "cert"), ("CLIENT__KEY", "key")):
            scan.environment[start + name] = str(scan.folder / f"{file}.pem")
        assert scan_when_there_are_workers(scan, cluster.address).code == 0 and len(scan.rows()) == 2
    finally:
        worker.terminate()
        worker.wait()
        cluster.close()


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
