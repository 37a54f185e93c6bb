"""Workers of this machine: processes that take tasks through pipes, and items that go to them."""

import collections
import contextlib
import functools
import multiprocessing
import os
import resource
import shutil
import signal
import socket
import struct
import tempfile
import time
from multiprocessing import connection, resource_tracker
from multiprocessing.connection import Connection
from typing import Callable, Deque, Iterator, List, Optional, Sequence, Union

from . import stopping
from .plan import make_tasks
from .progress import Progress
from .tasks import lost_rows, run_items
from .work import Item, Report, Row

# A worker that says nothing for so many seconds beyond --most-seconds is killed. Its start counts, too.
_SURPLUS_SECONDS = 30
_SUFFIXES = {"k": 10**3, "M": 10**6, "G": 10**9, "ki": 1 << 10, "Mi": 1 << 20, "Gi": 1 << 30}


def bytes_of(size: str) -> int:
    """The number of bytes of a size with its unit, such as 2GB or 800MiB: at most what a limit of a process can be."""
    number = size.rstrip("kMGiB")
    return int(min(float(number) * _SUFFIXES[size[len(number):].strip().rstrip("B")], (1 << 63) - 1))


class _Worker:
    """A process, and the task that it does."""

    def __init__(self, memory: int, most_seconds: float, parent: str) -> None:
        self._folder = tempfile.mkdtemp(dir=parent)
        # A new Python, which has no file of this one open, such as the lock of the table.
        context = multiprocessing.get_context("spawn")
        self._most_seconds = most_seconds + _SURPLUS_SECONDS
        self._last = 0.0  # when it was given the task, or began an item of it
        self.pipe, other = context.Pipe()
        _bound(self.pipe)
        self.process = context.Process(target=_work, args=(other, memory, most_seconds, self._folder))
        stopping.without_interrupts(self.process.start)
        other.close()
        self.task: List[Item] = []  # none: it is idle
        self.item: Item  # of its task, that it does

    def give(self, task: List[Item]) -> None:
        self.task, self.item, self._last = task, task[0], time.monotonic()
        with contextlib.suppress(OSError):  # a worker that is dead is found by its pipe
            self.pipe.send(task)

    def take(self) -> Optional[Report]:
        """What it made of the task, or None when it begins an item. Else EOFError or OSError: it died or stopped."""
        message: Union[int, Report] = self.pipe.recv()
        if isinstance(message, Report):
            return message
        self.item, self._last = self.task[message], time.monotonic()
        return None

    def is_silent(self) -> bool:
        """True if its item had its time and more: it cannot have ended itself, as when it is stopped."""
        return time.monotonic() - self._last > self._most_seconds and not self.pipe.poll()

    def end(self) -> None:
        """Ends it and the processes that it started, and removes its temporary files."""
        if self.process.pid:
            with contextlib.suppress(ProcessLookupError):  # it may have made no group yet
                os.killpg(self.process.pid, signal.SIGKILL)
        self.process.kill()
        self.process.join()
        self.pipe.close()
        shutil.rmtree(self._folder, ignore_errors=True)


def _bound(pipe: Connection) -> None:
    # A worker may be stopped within a message: its other part is not waited for without end.
    with socket.socket(fileno=os.dup(pipe.fileno())) as end:
        for option in (socket.SO_RCVTIMEO, socket.SO_SNDTIMEO):
            end.setsockopt(socket.SOL_SOCKET, option, struct.pack("@ll", _SURPLUS_SECONDS, 0))


def _work(pipe: Connection, memory: int, most_seconds: float, folder: str) -> None:
    os.setpgid(0, 0)  # a group of its own, in which the processes that it starts are
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the scan's own process ends this one
    hard = resource.getrlimit(resource.RLIMIT_DATA)[1]
    most = memory if hard == resource.RLIM_INFINITY else min(memory, hard)
    resource.setrlimit(resource.RLIMIT_DATA, (most, most))
    with contextlib.suppress(EOFError, OSError):
        while True:
            pipe.send(run_items(_told(pipe, pipe.recv()), folder, most_seconds))


def _told(pipe: Connection, task: Sequence[Item]) -> Iterator[Item]:
    # Tells the scan which item begins, so that the scan can time it.
    for number, item in enumerate(task):
        pipe.send(number)
        yield item


class Pool:
    """At most so many processes, each with bounded memory and, for each item, time. One that dies is replaced.

    A task whose worker dies is taken apart, and its items run alone, one after the other with nothing beside them: what
    kills a worker then is its own row, and nothing else is blamed.
    """

    def __init__(self, count: int, memory: int, most_seconds: float) -> None:
        self._count = count
        self._folder = tempfile.mkdtemp(prefix="cab-scan-")
        self._new_worker = functools.partial(_Worker, memory, most_seconds, self._folder)
        self._workers: List[_Worker] = []
        self._suspects: Deque[Item] = collections.deque()

    def close(self) -> None:
        """Ends all processes, and removes their temporary files."""
        for worker in list(self._workers):  # stopping.end may call it beside _end, in a thread of its own
            worker.end()
        shutil.rmtree(self._folder, ignore_errors=True)

    def dispatch(self, items: Sequence[Item], finished: Callable[[List[Row]], None]) -> None:
        """Runs items to their end, with a line of progress. finished(rows) writes down the rows of each task.

        If it raises, what runs is ended, and no other call gets its rows.
        """
        progress = Progress(sum(item.size for item in items))
        waiting = collections.deque(make_tasks(items, self._count))
        try:
            while waiting or self._suspects or self._busy():
                while waiting and len(self._busy()) < self._count:
                    self._give(waiting.popleft())
                if not self._busy():
                    self._give([self._suspects[0]])
                # Waits a second at most, so that the line of progress lives.
                ready = connection.wait([worker.pipe for worker in self._busy()], timeout=1)
                for worker in self._busy():
                    if worker.pipe in ready:
                        self._collect(worker, finished, progress)
                    elif worker.is_silent():
                        progress.tell(_silence(worker.item))
                        self._lose(worker, finished, progress)
                progress.draw()
        finally:
            progress.close()
            self._suspects.clear()
            for worker in self._busy():
                self._end(worker)

    def _busy(self) -> List[_Worker]:
        return [worker for worker in self._workers if worker.task]

    def _give(self, task: List[Item]) -> None:
        idle = [worker for worker in self._workers if not worker.task]
        with stopping.held():
            if not idle:
                idle = [self._new_worker()]
                self._workers += idle
        idle[0].give(task)

    def _end(self, worker: _Worker) -> None:
        with stopping.held():
            worker.end()
            self._workers.remove(worker)

    def _collect(self, worker: _Worker, finished: Callable[[List[Row]], None], progress: Progress) -> None:
        try:
            report = worker.take()
        except (EOFError, OSError):
            self._lose(worker, finished, progress)
            return
        if report is not None:
            task, worker.task = worker.task, []
            self._finish(task, report.rows, finished, progress)

    def _lose(self, worker: _Worker, finished: Callable[[List[Row]], None], progress: Progress) -> None:
        self._end(worker)
        if self._is_suspect(worker.task):
            self._finish(worker.task, lost_rows(worker.task[0]), finished, progress)
        else:
            self._suspects.extend(worker.task)

    def _finish(
        self, task: List[Item], rows: List[Row], finished: Callable[[List[Row]], None], progress: Progress
    ) -> None:
        finished(rows)
        progress.advance(sum(item.size for item in task))
        if self._is_suspect(task):
            self._suspects.popleft()

    def _is_suspect(self, task: List[Item]) -> bool:
        return bool(self._suspects) and task == [self._suspects[0]]


def _silence(item: Item) -> str:
    name = " ".join(filter(None, (item.source.name, item.part)))
    return f"cab scan: {name}: its worker is silent after --most-seconds, and is killed"


@contextlib.contextmanager
def pool(count: int, memory: str, most_seconds: float) -> Iterator[Pool]:
    """A pool, which is closed whatever happens."""
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ.setdefault(name, "1")  # threads of NumPy's libraries take memory and cores
    resource_tracker.ensure_running()  # it lets interrupts through to the thread that starts it
    with stopping.cleaning(lambda: Pool(count, bytes_of(memory), most_seconds), Pool.close) as made:
        yield made
