"""The table as CSV files, which appear whole or not at all."""

import contextlib
import csv
import os
import tempfile
from typing import Any, Iterable, List, Sequence

from .printable import csv_cell
from .table import CONTACT_COLUMNS, COST_COLUMNS, KEY_COLUMNS, PAIR_COLUMNS, RESULT_COLUMNS, Table


def csv_files(path: str) -> List[str]:
    """The names of the three files, by that of the rows: for rows, contacts and pairs."""
    stem = path[:-4] if path.endswith(".csv") else path
    return [path, f"{stem}.contacts.csv", f"{stem}.pairs.csv"]


def write_csv_files(table: Table, paths: Sequence[str]) -> None:
    """Writes rows, contacts and pairs. Raises OSError that names the file."""
    columns = (*KEY_COLUMNS, *RESULT_COLUMNS, *COST_COLUMNS)
    _write(paths[0], ("row", *columns), ((number, *row) for number, row in enumerate(table.rows(columns), 1)))
    _write(paths[1], ("row", "file", *CONTACT_COLUMNS), table.contacts())
    _write(paths[2], PAIR_COLUMNS, table.pairs())


def _write(path: str, columns: Sequence[str], rows: Iterable[Sequence[Any]]) -> None:
    real = os.path.realpath(path)  # a link stays one, and what it leads to is replaced
    try:
        handle, temporary = tempfile.mkstemp(prefix=".cab-scan-", dir=os.path.dirname(real))
        try:
            with open(handle, "w", newline="", encoding="utf-8", errors="surrogateescape") as file:
                writer = csv.writer(file, lineterminator="\n")
                writer.writerow(columns)
                writer.writerows(map(csv_cell, row) for row in rows)
                file.flush()
                os.fsync(file.fileno())
            os.chmod(temporary, 0o666 & ~_umask())
            os.replace(temporary, real)
        except BaseException:
            with contextlib.suppress(OSError):
                os.remove(temporary)
            raise
    except OSError as error:
        raise OSError(error.errno, error.strerror, path) from error


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask
