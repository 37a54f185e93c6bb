"""The table as CSV files, which appear whole or not at all."""

import contextlib
import csv
import os
import tempfile
from typing import Any, Iterable, List, Sequence

from .table import CONTACT_COLUMNS, COST_COLUMNS, KEY_COLUMNS, PAIR_COLUMNS, RESULT_COLUMNS, Table


def write_csv_files(table: Table, path: str) -> List[str]:
    """Writes the rows to a file, and contacts and pairs beside it, each if there are any. Returns their names.

    Raises OSError that names the file.
    """
    stem = path[:-4] if path.endswith(".csv") else path
    columns = (*KEY_COLUMNS, *RESULT_COLUMNS, *COST_COLUMNS)
    numbered = ((number, *row) for number, row in enumerate(table.rows(columns), 1))
    written = [_write(path, ("row", *columns), numbered)]
    for name, head, rows in (
        (f"{stem}.contacts.csv", ("row", "file", *CONTACT_COLUMNS), table.contacts()),
        (f"{stem}.pairs.csv", PAIR_COLUMNS, table.pairs()),
    ):
        written.append(_write(name, head, rows))
    return written


def _write(path: str, columns: Sequence[str], rows: Iterable[Sequence[Any]]) -> str:
    folder = os.path.dirname(path) or "."
    try:
        handle, temporary = tempfile.mkstemp(prefix=".cab-scan-", dir=folder)
        try:
            with open(handle, "w", newline="", encoding="utf-8", errors="surrogateescape") as file:
                writer = csv.writer(file, lineterminator="\n")
                writer.writerow(columns)
                writer.writerows(rows)
                file.flush()
                os.fsync(file.fileno())
            os.chmod(temporary, 0o666 & ~_umask())
            os.replace(temporary, path)
        except BaseException:
            with contextlib.suppress(OSError):
                os.remove(temporary)
            raise
    except OSError as error:
        raise OSError(error.errno, error.strerror, path) from error
    return path


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask
