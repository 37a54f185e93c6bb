"""A corpus of any size from a few files: copies that begin at another frame and stand elsewhere.

    python3 -P -m cab_scan.copies FOLDER --count 2000 > list.csv
    cab scan self --list list.csv --loader cab_scan.copies:load

Each copy reads its file anew, as a corpus on disk would. The frame and the place come from the number of the copy.
"""

import argparse
import csv
import itertools
import os
import sys
from typing import Iterator

import numpy as np

from .corpus import MOTION_SUFFIXES, READERS, find, with_options
from .printable import tell
from .sequences import Request, Sequence, load_file
from .work import FileOptions

_METRES = 100.0  # a copy stands within so many metres of its original


def load(request: Request) -> Iterator[Sequence]:
    """The copy whose number is the part of the request: a loader for `cab scan`."""
    random = np.random.default_rng(int(request.part))
    original = load_file(request.path, request.options)
    shift = int(random.integers(len(original.poses)))
    offset = random.uniform(-_METRES, _METRES, 3)
    origins = None if original.origins is None else np.roll(original.origins, -shift, axis=0) + offset
    yield original._replace(poses=np.roll(original.poses, -shift, axis=0), origins=origins)


def main() -> int:
    """Writes the list of all copies to standard output."""
    parser = argparse.ArgumentParser("cab_scan.copies", description="Writes a list of copies for cab scan.")
    parser.add_argument("paths", metavar="PATH", nargs="+", help="motion files, and folders with all below them")
    parser.add_argument("--count", metavar="N", type=int, required=True, help="copies of all files together")
    parser.add_argument("--units", metavar="METRES", default="", help="length unit of files without cab-scan.csv")
    chosen = parser.parse_args()
    files = find(chosen.paths, [], "", with_options(FileOptions(), {"units": chosen.units}, ""), MOTION_SUFFIXES)
    for problem in (*files.notes, *files.problems):
        tell(f"cab_scan.copies: {problem}", sys.stderr)
    if not files.entries:
        return 1
    writer = csv.DictWriter(sys.stdout, ["path", "part", *READERS], restval="", lineterminator="\n")
    writer.writeheader()
    for number, entry in zip(range(chosen.count), itertools.cycle(files.entries)):
        options = {name: value for name, value in entry.source.options.changed().items()}
        writer.writerow({"path": os.path.abspath(entry.source.path), "part": number, **options})
    return 1 if files.problems else 0


if __name__ == "__main__":
    sys.exit(main())
