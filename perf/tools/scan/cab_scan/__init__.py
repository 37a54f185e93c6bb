"""cab_scan: a corpus of clips, robots, recordings or arrays -> one table of what touches.

`cab scan --help`, or `python3 -P -m cab_scan --help`, says how to run it: without -P, of Python 3.11, modules come from
the current folder first. docs/scale.md of the project says what the tables mean. A loader of one's own (`--loader
module:function`) is a function that takes a `Request` and yields `Sequence`s.
"""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .sequences import Request, Sequence

__all__ = ["Request", "Sequence"]


def __getattr__(name: str) -> Any:
    # Late, so that `python3 -P -m cab_scan` can say which package is missing before anything needs it.
    if name in __all__:
        from . import sequences

        return getattr(sequences, name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
