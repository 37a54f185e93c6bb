#!/usr/bin/env python3
"""What Python adds to a frame: wall time of World.run over the engine's own time of the same call.

    PYTHONPATH=build/release/engine/bindings/python \
      /usr/bin/python3 perf/measure/python/overhead.py [CHARACTERS [FRAMES]]

A crowd of boxes with 16 links, one per square metre, default 10 000 characters and 200 frames after a warm-up. The
engine measures run_frame (FrameStats::seconds_total); the clock of Python goes around the whole call, arguments, checks
and arrays of hits included. Frames with an array of poses, and with what Batch.posed made once, go in turns. The
medians over all frames are printed.
"""

import statistics
import sys
import time

import cab
import numpy as np


def make_poses(random: np.random.Generator, count: int, links: int) -> np.ndarray:
    """Links one above the other, each turned a little about z."""
    poses = np.zeros((count, links, 7), dtype=np.float32)
    angles = random.uniform(-0.5, 0.5, (count, links))
    poses[..., 2], poses[..., 3] = np.sin(angles / 2), np.cos(angles / 2)
    poses[..., 4:6] = random.uniform(-0.2, 0.2, (count, links, 2))
    poses[..., 6] = np.linspace(0.1, 1.7, links)
    return poses


def cpu_name() -> str:
    with open("/proc/cpuinfo", encoding="utf-8") as file:
        return next((line.split(": ", 1)[1].strip() for line in file if line.startswith("model name")), "unknown CPU")


def main() -> None:
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 10_000
    frames = int(sys.argv[2]) if len(sys.argv) > 2 else 200
    links, random = 16, np.random.default_rng(1)
    body = cab.Body.from_boxes(np.arange(links) - 1, np.tile([0.15, 0.12, 0.05], (links, 1)))
    world = cab.World()
    crowd = world.add(body, count)
    poses = make_poses(random, count, links)
    origins = np.zeros((count, 3))
    origins[:, :2] = random.uniform(0, count**0.5, (count, 2))
    posed = crowd.posed(poses, origins=origins)
    calls = {
        "array of poses": lambda: world.run(poses, origins=origins),
        "posed once": lambda: world.run(posed),
    }
    engine = {name: [] for name in calls}
    added = {name: [] for name in calls}
    hits = 0
    for frame in range(frames + 20):
        origins[:, :2] += random.normal(0, 0.002, (count, 2))
        for name, call in calls.items():
            start = time.perf_counter()
            result = call()
            wall = time.perf_counter() - start
            if frame >= 20:
                engine[name].append(result.stats.seconds_total)
                added[name].append(wall - result.stats.seconds_total)
                hits = len(result.hits)
            del result
    print(f"{count} characters of {links} links, {hits} hits, {world.isa}, {cpu_name()}")
    for name in calls:
        frame_ms, added_ms = (1e3 * statistics.median(times[name]) for times in (engine, added))
        print(f"{name}: run_frame {frame_ms:.2f} ms, Python adds {added_ms:.3f} ms, {100 * added_ms / frame_ms:.1f} %")


if __name__ == "__main__":
    main()
