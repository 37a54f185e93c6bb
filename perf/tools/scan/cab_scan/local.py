"""Workers of this machine: processes that take tasks through pipes, and items that go to them."""

import collections
import contextlib
import functools
import multiprocessing
import os
import resource
import shutil
import signal
import tempfile
from multiprocessing import connection, resource_tracker
from multiprocessing.connection import Connection
from typing import Callable, Deque, Iterator, List, Optional, Sequence

from . import stopping
from .plan import make_tasks
from .progress import Progress
from .tasks import lost_rows, run_items
from .work import Item, Report, Row

_SUFFIXES = {"k": 10**3, "M": 10**6, "G": 10**9, "ki": 1 << 10, "Mi": 1 << 20, "Gi": 1 << 30}


def bytes_of(size: str) -> int:
    """The number of bytes of a size with its unit, such as 2GB or 800MiB."""
    number = size.rstrip("kMGiB")
    return int(float(number) * _SUFFIXES[size[len(number):].strip().rstrip("B")])


class _Worker:
    """A process, and the task that it does."""

    def __init__(self, memory: int, most_seconds: float, parent: str) -> None:
        self._folder = tempfile.mkdtemp(dir=parent)
        # A new Python, which has no file of this one open, such as the lock of the table.
        context = multiprocessing.get_context("spawn")
        self.pipe, other = context.Pipe()
        self.process = context.Process(target=_work, args=(other, memory, most_seconds, self._folder))
        stopping.without_interrupts(self.process.start)
        other.close()
        self.task: Optional[List[Item]] = None

    def give(self, task: List[Item]) -> None:
        self.task = task
        with contextlib.suppress(OSError):  # a worker that is dead is found by its pipe
            self.pipe.send(task)

    def take(self) -> Optional[Report]:
        """What it made of the task; None if it died."""
        with contextlib.suppress(EOFError, OSError):
            report: Report = self.pipe.recv()
            return report
        return None

    def end(self) -> None:
        """Ends it and the processes that it started, and removes its temporary files."""
        if self.process.pid:
            with contextlib.suppress(ProcessLookupError):  # it may have made no group yet
                os.killpg(self.process.pid, signal.SIGKILL)
        self.process.kill()
        self.process.join()
        self.pipe.close()
        shutil.rmtree(self._folder, ignore_errors=True)


def _work(pipe: Connection, memory: int, most_seconds: float, folder: str) -> None:
    os.setpgid(0, 0)  # a group of its own, in which the processes that it starts are
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the scan's own process ends this one
    hard = resource.getrlimit(resource.RLIMIT_DATA)[1]
    most = memory if hard == resource.RLIM_INFINITY else min(memory, hard)
    resource.setrlimit(resource.RLIMIT_DATA, (most, most))
    with contextlib.suppress(EOFError, OSError):
        while True:
            pipe.send(run_items(pipe.recv(), folder, most_seconds))


class Pool:
    """So many processes, each with bounded memory and, for each item, time. One that dies is replaced.

    A task whose worker dies is taken apart, and its items run alone, one after the other with nothing beside them: what
    kills a worker then is its own row, and nothing else is blamed.
    """

    def __init__(self, count: int, memory: int, most_seconds: float) -> None:
        self._folder = tempfile.mkdtemp(prefix="cab-scan-")
        self._new_worker = functools.partial(_Worker, memory, most_seconds, self._folder)
        self._workers = [self._new_worker() for _ in range(count)]
        self._suspects: Deque[Item] = collections.deque()

    def close(self) -> None:
        """Ends all processes, and removes their temporary files."""
        for worker in self._workers:
            worker.end()
        shutil.rmtree(self._folder, ignore_errors=True)

    def dispatch(self, items: Sequence[Item], finished: Callable[[List[Row]], None]) -> None:
        """Runs items to their end, with a line of progress. finished(rows) writes down the rows of each task."""
        progress = Progress(sum(item.size for item in items))
        waiting = collections.deque(make_tasks(items, len(self._workers)))
        try:
            while waiting or self._suspects or any(worker.task for worker in self._workers):
                for worker in self._workers:
                    if waiting and not worker.task:
                        worker.give(waiting.popleft())
                if not any(worker.task for worker in self._workers):
                    self._workers[0].give([self._suspects[0]])
                # Waits a second at most, so that the line of progress lives.
                ready = connection.wait([worker.pipe for worker in self._workers if worker.task], timeout=1)
                for place, worker in enumerate(self._workers):
                    if worker.pipe in ready:
                        self._collect(place, finished, progress)
                progress.draw()
        finally:
            progress.close()

    def _collect(self, place: int, finished: Callable[[List[Row]], None], progress: Progress) -> None:
        worker = self._workers[place]
        task, worker.task = worker.task or [], None
        report = worker.take()
        is_suspect = bool(self._suspects) and task == [self._suspects[0]]
        if report is None:
            worker.end()
            self._workers[place] = self._new_worker()
            if not is_suspect:
                self._suspects.extend(task)
                return
        finished(report.rows if report else lost_rows(task[0]))
        progress.advance(sum(item.size for item in task))
        if is_suspect:
            self._suspects.popleft()


@contextlib.contextmanager
def pool(count: int, memory: str, most_seconds: float) -> Iterator[Pool]:
    """A pool, which is closed whatever happens."""
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ.setdefault(name, "1")  # threads of NumPy's libraries take memory and cores
    resource_tracker.ensure_running()  # it lets interrupts through to the thread that starts it
    with stopping.cleaning(lambda: Pool(count, bytes_of(memory), most_seconds), Pool.close) as made:
        yield made
