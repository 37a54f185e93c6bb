"""Times of `cab scan` with one worker and with two, in turns, over copies of motion files.

    PYTHONSAFEPATH=1 PYTHONPATH=build/release/engine/bindings/python:build/release/perf/scan \
      python3 perf/tools/scan/speed.py FOLDER... --units 0.0564 --count 800 --rounds 3

The machine should do nothing else. Hashes of all tables must be the same.
"""

import argparse
import os
import pathlib
import re
import statistics
import subprocess
import sys
import tempfile
import time


def scan(folder: pathlib.Path, workers: int) -> "tuple[float, str]":
    """Seconds of a scan that does everything anew, and the hash of its table."""
    words = ["self", "--list", "list.csv", "--loader", "cab_scan.copies:load", "--again", "--workers", str(workers)]
    start = time.monotonic()
    done = subprocess.run([sys.executable, "-m", "cab_scan", *words], cwd=folder, capture_output=True, text=True)
    seconds = time.monotonic() - start
    found = re.search(r"^hash +([0-9a-f]+)$", done.stdout, re.MULTILINE)
    if done.returncode != 0 or found is None:
        raise SystemExit(done.stdout + done.stderr)
    return seconds, found.group(1)


def main() -> None:
    parser = argparse.ArgumentParser(description="Times of cab scan with one worker and with two.")
    parser.add_argument("paths", metavar="FOLDER", nargs="+", help="motion files, and folders of them")
    parser.add_argument("--units", default="1", help="their length unit in metres")
    parser.add_argument("--count", default="800", help="copies of them")
    parser.add_argument("--rounds", type=int, default=3)
    chosen = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        words = [*chosen.paths, "--count", chosen.count, "--units", chosen.units]
        copies = subprocess.run([sys.executable, "-m", "cab_scan.copies", *words], stdout=subprocess.PIPE, check=True)
        (folder / "list.csv").write_bytes(copies.stdout)
        seconds: "dict[int, list[float]]" = {1: [], 2: []}
        hashes = set()
        for _ in range(chosen.rounds):
            for workers, times in seconds.items():
                spent, table = scan(folder, workers)
                times.append(spent)
                hashes.add(table)
                print(f"{workers} workers: {spent:.1f} s, load {os.getloadavg()[0]:.1f}", flush=True)
    ratio = statistics.median(seconds[1]) / statistics.median(seconds[2])
    print(f"two workers are {ratio:.2f} times as fast as one, by medians of {chosen.rounds}")
    print(f"hash of all tables: {', '.join(sorted(hashes))}")
    if len(hashes) != 1:
        raise SystemExit("the tables differ")


if __name__ == "__main__":
    main()
