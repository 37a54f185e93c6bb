"""Ctrl-C and SIGTERM, from the first moment on: the scan ends within two seconds, whatever it does."""

import contextlib
import functools
import os
import signal
import sys
import threading
import time
from types import FrameType
from typing import Any, Callable, Iterator, List, NoReturn, Optional, TypeVar

CODE = 130
SIGNALS = (signal.SIGINT, signal.SIGTERM)
# So long the scan has to end by itself.
_GRACE_SECONDS = 1.2

_cleaners: List[Callable[[], None]] = []
_at_once = True  # nothing is there yet that must be put away
_is_held = False  # an interrupt waits
_is_waiting = False  # there is one

_Made = TypeVar("_Made")


def begin() -> None:
    """Takes both signals, which the command cab holds back until here."""
    reading, writing = os.pipe()
    os.set_blocking(writing, False)
    signal.set_wakeup_fd(writing, warn_on_full_buffer=False)
    for number in SIGNALS:
        signal.signal(number, _stop)
    sys.unraisablehook = _unraisable
    # Python's handlers wait until a call of C++ is done, such as the reading of a robot. The bytes in the pipe do not.
    without_interrupts(threading.Thread(target=_watch, args=(reading,), daemon=True).start)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, SIGNALS)


def raise_from_now_on() -> None:
    """From here on a signal is a KeyboardInterrupt, so that what is open is closed. Before, the process just ends."""
    global _at_once
    _at_once = False


@contextlib.contextmanager
def cleaning(make: Callable[[], _Made], put_away: Callable[[_Made], None]) -> Iterator[_Made]:
    """What must be put away even if the scan does not end by itself, which happens once, here or by `end`.

    An interrupt comes before it is made, or when it is known here, or after it is put away.
    """
    cleaner = None
    try:
        with held():
            made = make()
            cleaner = functools.partial(put_away, made)
            _cleaners.append(cleaner)
        yield made
    finally:
        with held():
            if cleaner and _takes_back(cleaner):
                cleaner()


@contextlib.contextmanager
def held() -> Iterator[None]:
    """An interrupt within the block is raised at its end."""
    global _is_held
    _is_held = True
    try:
        yield
    finally:
        _let_through()


def _takes_back(cleaner: Callable[[], None]) -> bool:
    with contextlib.suppress(ValueError):  # `end`, in its own thread, may have it
        _cleaners.remove(cleaner)
        return True
    return False


def _let_through() -> None:
    global _is_held, _is_waiting
    _is_held = False
    if _is_waiting:
        _is_waiting = False
        raise KeyboardInterrupt


def ignore() -> None:
    """The scan is done, and its process ends: there is nothing to stop any more."""
    for number in SIGNALS:
        signal.signal(number, signal.SIG_IGN)


def without_interrupts(start: Callable[[], Any]) -> Any:
    """What starts threads: they, and the processes that they start, leave Ctrl-C of the terminal to this thread."""
    before = signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGINT])
    try:
        return start()
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def end() -> NoReturn:
    """Ends this process, and with the pool those that it started."""
    while _cleaners:
        with contextlib.suppress(Exception):
            _cleaners.pop()()
    for stream in (sys.stdout, sys.stderr):
        with contextlib.suppress(Exception):
            stream.flush()
    os._exit(CODE)


def _stop(_number: int, _frame: Optional[FrameType]) -> None:
    global _is_waiting
    ignore()
    if _at_once:
        os.write(2, b"cab scan: stopped\n")
        os._exit(CODE)
    if not _is_held:
        raise KeyboardInterrupt
    _is_waiting = True


def _watch(reading: int) -> None:
    while os.read(reading, 1)[0] not in SIGNALS:
        pass
    time.sleep(_GRACE_SECONDS)
    os.write(2, b"cab scan: stopped; what is done is in the table, and the same command goes on\n")
    end()


def _unraisable(unraisable: "sys.UnraisableHookArgs") -> None:
    # Where an interrupt cannot be raised, the thread that watches ends the process.
    if unraisable.exc_type is not KeyboardInterrupt:
        sys.__unraisablehook__(unraisable)
