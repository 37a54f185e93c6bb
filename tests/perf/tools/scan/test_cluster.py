"""Dask's workers: a cluster computes the table of this machine, and what becomes of workers that are gone."""

import asyncio
import functools
import json
import os
import pathlib
import shutil
import socket
import subprocess
import sys
import threading
import time

import cab
import cab_scan
import pytest
from cab_scan import corpus, progress, tasks, work

from conftest import long, write_corpus
from test_local import write_list

distributed = pytest.importorskip("distributed", reason="scan: skipped: ./dev deps --cluster installs distributed")
from cab_scan import cluster  # noqa: E402  needs it


def items_of(folder):
    found = corpus.find([str(folder)], [], "", work.FileOptions(), corpus.MOTION_SUFFIXES)
    return [work.Item(work.SELF, entry.source, ("p",), "{}", work.TestOptions(), (None,)) for entry in found.entries]


class Cluster:
    """A Dask scheduler, whose workers have a PYTHONPATH of their own. `words` are for scheduler and workers."""

    def __init__(self, folder, *words, **environment):
        self._folder, self._file, self._words = folder, folder / "scheduler.json", words
        self._scheduler = self._start("dask_scheduler", "--port", "0", env={**os.environ, **environment})

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

    def worker(self, path, nanny="--no-nanny"):
        return self._start("dask_worker", "--nthreads", "1", nanny, env={**os.environ, "PYTHONPATH": str(path)})

    def close(self):
        self._scheduler.terminate()
        self._scheduler.wait()


def scan_when_there_are_workers(scan, address, *words):
    for _ in range(400):
        outcome = scan("self", *(words or ["corpus"]), "--scheduler", address)
        if "no workers" not in outcome.error:
            return outcome
        time.sleep(0.05)
    raise AssertionError("there are no workers")


def test_a_cluster_computes_the_same_table_if_its_workers_have_the_same_versions(scan, quick):
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
        assert outcome.hash == quick("self", "corpus", "--table", "own.sqlite").hash
    finally:
        cluster.close()
    gone = scan.here("self", "corpus", "--scheduler", cluster.address)
    assert gone.code == 1 and f"--scheduler {cluster.address}" in gone.error


def test_a_worker_that_is_killed_in_an_item_is_replaced_and_only_what_kills_it_each_time_is_lost(scan):
    parts = ["", "once", "", "kill", "", ""]
    write_list(scan, parts)
    # As often as an item may kill its worker, before Dask gives it back.
    cluster = Cluster(scan.folder, DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES="0")
    path = f"{pathlib.Path(__file__).parent}{os.pathsep}{os.environ['PYTHONPATH']}"
    worker = cluster.worker(path, "--nanny")
    try:
        words = ["--list", "list.csv", "--loader", "fault_loader:load"]
        outcome = scan_when_there_are_workers(scan.here, cluster.address, *words)
    finally:
        worker.terminate()
        worker.wait()
        cluster.close()
    assert outcome.code == 1 and outcome.error.count("its worker died") == 1, outcome.error
    assert len(list((scan.folder / "corpus").rglob("*.killed"))) == 1
    assert [row["outcome"] for row in scan.rows()] == ["lost" if part == "kill" else "done" for part in parts]


def test_a_scheduler_that_is_not_there_is_told(scan):
    write_corpus(scan.folder / "corpus", 1)
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        address = "tcp://127.0.0.1:%d" % taken.getsockname()[1]
        for wrong, told in ((address, "Connection refused"), ("tcp://127.0.0.1", "HOST:PORT is wanted"),
                            ("tcp://127.0.0.1:99999", "99999|ange"), ("nowhere.invalid:1", "not known|resol")):
            code, _, error = scan.here("self", "corpus", "--scheduler", wrong)
            assert code == 1 and error.startswith(f"cab scan: --scheduler {wrong}: ") and error.count("\n") == 1, error
            assert any(words in error for words in told.split("|")), error


@long
def test_a_scheduler_may_want_certificates(scan):
    write_corpus(scan.folder / "corpus", 2)
    made = distributed.Security.temporary()
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


class Finished:
    """A task that is finished."""

    key, status = "key", "finished"

    def done(self):
        return True


class NoCluster:
    """What a Dispatcher calls of a client, where the rows of each task are fetched as it is told."""

    status = "running"

    def __init__(self, ends):
        self.ends, self.sent, self.cancelled = list(ends), [], []

    def scheduler_info(self):
        return {"workers": {"one": {"nthreads": 1}}}

    def submit(self, _function, task, *_words, **_more):
        self.sent.append([item.source.name for item in task])
        return Finished()

    def cancel(self, futures):
        self.cancelled.extend(futures)

    def fetched(self, _future):
        end = self.ends.pop(0)
        if isinstance(end, BaseException):
            raise end
        return tasks.Report(tasks.describe(), []) if end else None


def test_a_worker_whose_rows_cannot_be_fetched_is_one_that_died(tmp_path, monkeypatch):
    monkeypatch.setattr(cluster, "wait", lambda *_, **__: None)
    monkeypatch.setattr(cluster, "_fetched", NoCluster.fetched)
    for name in "abc":
        (tmp_path / f"{name}.bvh").write_text("x")
    items = items_of(tmp_path)
    monkeypatch.setattr(cluster, "make_tasks", lambda items, _: [list(items)])
    client = NoCluster([distributed.KilledWorker("key", None, 1), True, OSError("Timed out"), None])
    told = []
    cluster.Dispatcher(client, told.extend, progress.Progress(1)).run(items)
    assert [len(names) for names in client.sent] == [3, 1, 1, 1]  # together, then each alone
    assert [(row.key.file, row.outcome) for row in told] == [(item.source.name, "lost") for item in items[1:]]
    assert len(client.cancelled) == 3  # Dask would compute them again
    with pytest.raises(cluster.ClusterError, match="a task failed: odd"):
        cluster.Dispatcher(NoCluster([ValueError("odd")]), told.extend, progress.Progress(1)).run(items)


def test_a_worker_that_dies_while_its_rows_are_fetched_is_not_waited_for():
    loop = asyncio.new_event_loop()
    threading.Thread(target=loop.run_forever, daemon=True).start()

    class Loop:
        asyncio_loop = loop

    class Scheduler:
        async def gather(self, keys):
            await asyncio.sleep(3600)

    class Client:
        loop, scheduler = Loop(), Scheduler()

    class Lost:
        key, looks = "key", 0

        @property
        def status(self):
            self.looks += 1
            return "finished" if self.looks < 3 else "lost"

    assert cluster._report_of(Client(), Lost()) is None
    asyncio.run_coroutine_threadsafe(asyncio.sleep(0.1), loop).result()  # until what was given up has ended
    loop.call_soon_threadsafe(loop.stop)


def test_workers_that_are_gone_are_not_waited_for_without_end(monkeypatch):
    class Client(NoCluster):
        now, there = 1, ["one", "two"]

        def scheduler_info(self):
            return {"workers": {name: {"nthreads": 1} for name in self.there}}

    monkeypatch.setattr(cluster, "wait", lambda *_, **__: None)
    monkeypatch.setattr(cluster.time, "monotonic", lambda: client.now)
    client = Client([])
    dispatcher = cluster.Dispatcher(client, [].extend, progress.Progress(1))
    for client.now, client.there in ((1000, []), (1299, []), (1301, ["one"]), (2000, []), (2300, [])):
        dispatcher._collect()
    client.now = 2301
    with pytest.raises(work.ClusterError, match="there has been no worker for 300 s"):
        dispatcher._collect()
