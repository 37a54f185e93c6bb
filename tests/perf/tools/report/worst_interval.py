"""Reads the hits that `cab run --hits` wrote, and nothing else, and prints their worst interval of contact.

It shares no code with cab: it keeps a set of frames for each pair of links, and cuts it into runs.
"""
import csv
import sys


def runs(frames):
    """Yields maximal runs of consecutive numbers, as lists."""
    run = []
    for frame in sorted(frames):
        if run and frame != run[-1] + 1:
            yield run
            run = []
        run.append(frame)
    if run:
        yield run


def main():
    depths = {}
    with open(sys.argv[1], newline="", encoding="utf-8") as file:
        for row in csv.DictReader(file):
            pair = (row["character_a"], row["link_a"], row["character_b"], row["link_b"])
            depths.setdefault(pair, {})[int(row["frame"])] = float(row["depth_metres"])
    intervals = []
    for pair, by_frame in depths.items():
        for run in runs(by_frame):
            worst = max(run, key=lambda frame: (by_frame[frame], -frame))
            intervals.append((-by_frame[worst], -len(run), pair, run[0], run[-1], worst))
    depth, frames, pair, first, last, worst = min(intervals)
    print(*pair, first, last, -frames, -depth, worst, sep=",")


main()
