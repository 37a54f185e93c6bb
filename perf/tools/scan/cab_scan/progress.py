"""One line on standard error that says how far a scan is, and how long it still takes."""

import math
import sys
import time

from .printable import tell

_WIDTH = 30


def time_left(done: int, total: int, seconds: float) -> str:
    """In words, if it goes on as fast as on average. Empty if it is too early to tell, or nothing is left."""
    if done >= total or seconds < 2 or done < 0.01 * total:
        return ""
    left = seconds * (total - done) / done
    if left <= 55:
        return f"about {5 * max(1, math.ceil(left / 5))} s left"
    if left <= 59 * 60:
        return f"about {math.ceil(left / 60)} min left"
    if left <= 99 * 3600:
        return f"about {math.ceil(left / 3600)} h left"
    return "over 99 h left"


class Progress:
    """The line, drawn at most once a second and removed at the end. Nothing if standard error is no terminal."""

    def __init__(self, total: int) -> None:
        self._total, self._done = max(total, 1), 0
        self._start = time.monotonic()
        self._drawn = -1.0
        self._on = sys.stderr.isatty()

    def advance(self, count: int) -> None:
        """So much more of the total is done."""
        self._done = min(self._done + count, self._total)
        self.draw()

    def draw(self) -> None:
        """Draws the line, if it is time."""
        seconds = time.monotonic() - self._start
        if not self._on or 0 <= self._drawn and seconds - self._drawn < 1:
            return
        self._drawn = seconds
        filled = _WIDTH * self._done // self._total
        bar = "#" * filled + "." * (_WIDTH - filled)
        left = time_left(self._done, self._total, seconds)
        words = f"scan [{bar}] {100 * self._done // self._total} %" + (f", {left}" if left else "")
        print(f"\r\033[K{words}", end="", file=sys.stderr, flush=True)

    def tell(self, text: str) -> None:
        """Prints a line of its own."""
        self.close()
        tell(text, sys.stderr)

    def close(self) -> None:
        """Removes the line."""
        if self._on and self._drawn >= 0:
            print("\r\033[K", end="", file=sys.stderr, flush=True)
