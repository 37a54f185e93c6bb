"""What a scan says at its end."""

import sys
from typing import List, Sequence

from .notes import told_notes
from .printable import printable, tell as tell_line
from .table import Table
from .work import DONE, Key

_MOST_TOLD = 20
# The most clips of the table at the end, which fits on a screen.
_MOST_WORST = 10


def tell(table: Table, written: Sequence[str], what: str, keys: Sequence[Key] = ()) -> bool:
    """Prints what the table has, and errors on standard error. Returns whether there are errors.

    keys  the work of this scan: policies are compared over it alone, so that each has the same files
    """
    errors = 0
    for file, part, error in table.rows(("file", "part", "error"), "outcome <> ?", (DONE,)):
        errors += 1
        if errors <= _MOST_TOLD:
            tell_line(f"cab scan: {_named(file, part, error or '')}", sys.stderr)
    if errors > _MOST_TOLD:
        print(f"cab scan: and {errors - _MOST_TOLD} more; the column error has all", file=sys.stderr)
    for line in told_notes(table.rows(("file", "other", "notes"), "notes IS NOT NULL"), _MOST_TOLD):
        tell_line(f"cab scan: {line}", sys.stderr)
    totals = table.totals()
    # The engine's seconds are by the wall clock, all of them are of CPU: they may be fewer.
    counting = max(0.0, totals.seconds - totals.engine_seconds)
    lines = [
        ("rows", f"{totals.rows}, {errors} with an error"),
        ("frames", f"{totals.frames}, {totals.hit_frames} with a hit"),
        ("hits", f"{totals.hits}"),
        ("seconds of workers", f"{totals.load_seconds:.1f} reading, {totals.engine_seconds:.1f} testing, "
                               f"{counting:.1f} counting"),
    ]
    lines += [("table", table.path), *(("CSV", name) for name in written), ("hash", table.hash())]
    _print_lines(lines)
    if what == "policies":
        print()
        _print_policies(table, keys)
    elif what == "robot" or table.robot_totals():
        print()
        _print_robots(table)
    if what != "policies":
        _print_worst(table)
    return errors > 0


def _named(file: str, part: str, words: str) -> str:
    # The message of a file begins with its name already.
    if words.startswith(printable(file)):
        return words
    return f"{file}{' ' + part if part else ''}: {words}"


def tell_unnamed(table: Table, keys: Sequence[Key]) -> None:
    """Says how many rows are of work that this scan did not name: of files that are gone, or of other options."""
    count = table.count_others(keys)
    if count:
        tell_line(f"cab scan: {count} rows of {table.path} are of files or options that this scan did not name",
                  sys.stderr)


def _print_lines(lines: Sequence[Sequence[str]]) -> None:
    widths = [max(len(line[column]) for line in lines) for column in range(len(lines[0]))]
    for line in lines:
        tell_line("  ".join(word.ljust(width) for word, width in zip(line, widths)).rstrip(), sys.stdout)


def _print_worst(table: Table) -> None:
    worst = table.worst(_MOST_WORST)
    if not worst:
        return
    lines: List[Sequence[str]] = [("the worst", "frames that touch", "deepest cm", "in frame", "links")]
    for file, other, frames, hit_frames, depth, frame, link_a, link_b in worst:
        known = depth is not None
        lines.append((
            f"{file} - {other}" if other else file, f"{hit_frames} of {frames}", f"{100 * depth:.1f}" if known else "",
            str(frame) if known else "", f"{link_a} - {link_b}" if known else "",
        ))
    print()
    _print_lines(lines)


def _print_policies(table: Table, keys: Sequence[Key]) -> None:
    lines: List[Sequence[str]] = [("policies", "ms", "box tests", "exact tests", "false positives", "hits")]
    for policies, seconds, *counts in table.policy_totals(keys):
        lines.append((policies, f"{1000 * seconds:.1f}", *(str(count) for count in counts)))
    _print_lines(lines)


def _print_robots(table: Table) -> None:
    lines: List[Sequence[str]] = [("robot", "states", "in self-collision", "hits", "pairs that touch", "masked")]
    lines += [[str(word) for word in line] for line in table.robot_totals()]
    _print_lines(lines)
