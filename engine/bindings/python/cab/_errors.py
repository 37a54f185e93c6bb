"""Statuses of the engine as exceptions, and warnings."""

from ._status import Status


class Error(Exception):
    """A call that the engine refused. `status` says why, and the message says it in words."""

    status: Status

    def __init__(self, status: Status, message: str) -> None:
        super().__init__(message)
        self.status = status


class InputError(Error, ValueError):
    """What was given is wrong: a number out of range, a body without boxes, a batch that is not there."""


class OutOfMemory(Error, MemoryError):
    """An allocation failed. Nothing has changed."""


class BusyError(Error, RuntimeError):
    """Another thread is in a call on the same world. Nothing has changed."""


class UnsupportedError(Error, NotImplementedError):
    """This CPU or this build of cab lacks what was asked for."""


class FileError(ValueError):
    """A file that cannot be read, or is no character. The message names the file, the line or element, the reason.

    is_machine  whether the machine was at fault and not the file: it had no memory, or the process that read the file
                was killed or waited too long. Another try may succeed.
    """

    is_machine: bool

    def __init__(self, message: str = "", is_machine: bool = False) -> None:
        super().__init__(message)
        self.is_machine = is_machine


class MaskedWarning(UserWarning):
    """Some characters took no part in a call, since their poses are no numbers or no rigid motions."""


_CLASSES: "dict[Status, type[Error]]" = {
    Status.OUT_OF_MEMORY: OutOfMemory,
    Status.BUSY: BusyError,
    Status.ISA_NOT_AVAILABLE: UnsupportedError,
    Status.EXACT_NOT_BUILT: UnsupportedError,
    Status.BAD_ABI_VERSION: UnsupportedError,
}


def make_error(status: int, message: str) -> Error:
    """The exception for a status other than OK. The extension module raises what this returns."""
    known = Status(status)
    return _CLASSES.get(known, InputError)(known, message)
