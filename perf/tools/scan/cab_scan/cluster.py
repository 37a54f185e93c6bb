# mypy: allow-untyped-calls
"""Dask: the workers of a cluster that is there, and items that go to them until each has rows."""

import asyncio
import collections
import concurrent.futures
import contextlib
import itertools
import logging
import socket
import time
from typing import Any, Callable, Deque, Dict, Iterator, List, Optional, Sequence
from urllib.parse import urlsplit

from distributed import Client, Future, KilledWorker, TimeoutError, get_worker, wait

from .plan import make_tasks
from .progress import Progress
from .tasks import lost_rows, run_items
from .versions import Versions, describe, difference
from .work import ClusterError, Item, Report, Row

# Tasks that wait at a worker beside the one that runs there.
_TASKS_PER_WORKER = 3
# In which a scheduler that is there answers.
_ANSWER_SECONDS = 5
# After which workers that are gone, all of them, will not come back.
_ALONE_SECONDS = 300
# How often it is looked whether a worker that does not answer is still there.
_LOOK_SECONDS = 0.5


@contextlib.contextmanager
def workers_of(address: str) -> Iterator[Client]:
    """The workers of a scheduler. Certificates for tls:// are those of Dask's configuration."""
    _check_port(address)
    logging.getLogger("distributed").setLevel(logging.CRITICAL)  # the one line below says it
    try:
        client = Client(address, timeout=_ANSWER_SECONDS)
    except Exception as error:
        why = str(error) or "it does not answer"
        if address.startswith("tls://"):
            why += "; Dask's configuration distributed.comm.tls has the certificates"
        elif isinstance(error, (OSError, TimeoutError)):
            why = "no Dask scheduler answers there; if it wants certificates, its address begins with tls://"
        raise ClusterError(f"--scheduler {address}: {' '.join(why.split())}") from error
    with client:
        yield client


def _check_port(address: str) -> None:
    # Dask tries for many seconds, and its message does not say why.
    parts = urlsplit(address if "://" in address else f"tcp://{address}")
    try:
        host, port = parts.hostname, parts.port
        if parts.scheme not in ("tcp", "tls"):
            return  # Dask knows what it means
        if not host or not port:
            raise ClusterError(f"--scheduler {address}: tcp://HOST:PORT or tls://HOST:PORT is wanted")
        socket.create_connection((host, port), timeout=_ANSWER_SECONDS).close()
    except (OSError, ValueError) as error:
        why = getattr(error, "strerror", None) or error
        raise ClusterError(f"--scheduler {address}: {why}") from error


def check_versions(client: Client) -> None:
    """Raises ClusterError that names the workers whose cab, ABI or cab_scan is not this one's."""
    # By the name of a builtin: a worker without this package can still say so.
    call = "__import__('cab_scan.versions', fromlist=['describe']).describe()"
    answers: Dict[str, Any] = client.run(eval, call, on_error="return")
    if not answers:
        raise ClusterError("the scheduler has no workers")
    for worker, answer in sorted(answers.items()):
        if isinstance(answer, BaseException):
            raise ClusterError(f"{worker}: {answer}; its PYTHONPATH must have cab and cab_scan")
        _check_version(answer, worker)


def _check_version(versions: Versions, worker: str) -> None:
    differs = difference(describe(), versions)
    if differs:
        raise ClusterError(f"{worker} has other versions than this process: {differs}")


def _run_on_worker(task: List[Item]) -> Report:
    return run_items(task, get_worker().local_directory)


class Dispatcher:
    """Sends items to workers, a few tasks at a time, and hands back the rows of each as soon as it is done.

    finished(rows) writes them down. A task whose worker dies is taken apart, and its items run alone, one after the
    other with nothing beside them: what kills a worker then is its own row, and nothing else is blamed. A task whose
    rows cannot be fetched is treated alike, so that none is computed again and again.
    """

    def __init__(self, client: Client, finished: Callable[[List[Row]], None], progress: Progress) -> None:
        self._client, self._finished, self._progress = client, finished, progress
        self._alone_since: Optional[float] = None  # since when there is no worker
        self._threads = self._count_threads()  # of all workers, as the scheduler said last
        self._running: Dict[Future, List[Item]] = {}
        self._suspects: Deque[Item] = collections.deque()
        self._numbers = itertools.count()

    def run(self, items: Sequence[Item]) -> None:
        """Until each item has its rows."""
        waiting = collections.deque(make_tasks(items, self._threads))
        try:
            while waiting or self._running or self._suspects:
                while waiting and len(self._running) < _TASKS_PER_WORKER * self._threads:
                    self._submit(waiting.popleft())
                if not self._running:
                    self._submit([self._suspects[0]])
                self._collect()
        finally:
            self._client.cancel(list(self._running))
            self._running.clear()

    def _submit(self, task: List[Item]) -> None:
        key = f"cab-scan-{id(self)}-{next(self._numbers)}"
        future = self._client.submit(_run_on_worker, task, key=key, pure=False)
        self._running[future] = task

    def _collect(self) -> None:
        # Waits a second at most, so that the line of progress lives.
        with contextlib.suppress(TimeoutError):
            wait(list(self._running), timeout=1, return_when="FIRST_COMPLETED")
        self._progress.draw()
        if self._client.status != "running":
            raise ClusterError("the scheduler is gone")
        self._threads = self._count_threads()
        for future in [future for future in self._running if future.done()]:
            task = self._running.pop(future)
            report = _report_of(self._client, future)
            if report is not None:
                self._take(report, task)
                continue
            self._client.cancel([future])  # else Dask computes it again
            if self._suspects and task == [self._suspects[0]]:
                self._blame(self._suspects[0])
            else:
                self._suspects.extend(task)

    def _count_threads(self) -> int:
        # 1 while there is no worker.
        workers: Dict[str, Dict[str, int]] = self._client.scheduler_info()["workers"]
        if workers:
            self._alone_since = None
            return sum(worker["nthreads"] for worker in workers.values())
        self._alone_since = self._alone_since or time.monotonic()
        if time.monotonic() - self._alone_since > _ALONE_SECONDS:
            raise ClusterError(f"there has been no worker for {_ALONE_SECONDS} s; the same command goes on")
        return 1

    def _take(self, report: Report, task: List[Item]) -> None:
        _check_version(report.versions, "a worker")
        self._finished(report.rows)
        self._progress.advance(sum(item.size for item in task))
        if self._suspects and task == [self._suspects[0]]:
            self._suspects.popleft()

    def _blame(self, item: Item) -> None:
        # The item was alone each time that its worker died.
        self._suspects.popleft()
        self._finished(lost_rows(item))
        self._progress.advance(item.size)


def dispatch(client: Client, items: Sequence[Item], finished: Callable[[List[Row]], None]) -> None:
    """Runs items to their end, with a line of progress."""
    progress = Progress(sum(item.size for item in items))
    try:
        Dispatcher(client, finished, progress).run(items)
    finally:
        progress.close()


def _report_of(client: Client, future: Future) -> Optional[Report]:
    # None if the worker died, or the task was lost with it.
    try:
        if future.status == "error":
            future.result()
        return _fetched(client, future) if future.status == "finished" else None
    except (KilledWorker, asyncio.CancelledError, concurrent.futures.CancelledError, TimeoutError, OSError):
        return None
    except Exception as error:
        raise ClusterError(f"a task failed: {error or type(error).__name__}") from error


def _fetched(client: Any, future: Future) -> Optional[Report]:
    # The rows of a finished task, which are on its worker until they are fetched; None if it does not give them. Not by
    # Future.result: without end it would have them computed again, and try for minutes to reach a worker that is dead.
    answer = asyncio.run_coroutine_threadsafe(client.scheduler.gather(keys=[future.key]), client.loop.asyncio_loop)
    while not answer.done() and future.status == "finished":  # until the scheduler knows that the worker is gone
        concurrent.futures.wait([answer], _LOOK_SECONDS)
    if not answer.done():
        answer.cancel()
        return None
    found = answer.result()
    report: Optional[Report] = found["data"][future.key] if found["status"] == "OK" else None
    return report
