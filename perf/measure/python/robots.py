#!/usr/bin/env python3
"""What the calls for robots take from Python: the figures of docs/robots_in_python.md and docs/robots.md.

    PYTHONPATH=build/release/engine/bindings/python \
      /usr/bin/python3 perf/measure/python/robots.py URDF [SRDF [PACKAGE=FOLDER]]

Random states, points of a wall at x = 0.6 m, and a box of 6 by 6 by 20 cm before the last link. One thread; wall time,
medians of rounds in which all calls take turns, each round with other states.
"""

import statistics
import sys
import time
from typing import Callable, Dict, List

import cab
import numpy as np
from overhead import cpu_name

ROUNDS = 9


def points(count: int) -> np.ndarray:
    """A rough wall before the robot."""
    random = np.random.default_rng(count)
    return np.stack(
        (random.normal(0.6, 0.02, count), random.uniform(-1, 1, count), random.uniform(0, 2, count)), axis=1
    ).astype(np.float32)


def seconds(call: Callable[[], object]) -> float:
    start = time.perf_counter()
    call()
    return time.perf_counter() - start


def main() -> None:
    folders = dict([sys.argv[3].split("=", 1)]) if len(sys.argv) > 3 else {}
    robot = cab.Robot(sys.argv[1], srdf=sys.argv[2] if len(sys.argv) > 2 else None, packages=folders)
    allowed = robot.allowed_collisions()
    ignored = np.stack((allowed["a"], allowed["b"]), axis=1)
    table = cab.Body.from_boxes(parents=[-1], half=[[2, 2, 0.05]], names=["table"])
    names = robot.body.names
    box = cab.Body.from_boxes(parents=[-1], half=[[0.03, 0.03, 0.1]], names=["box"])
    held = cab.Attached(names[-1], box, pose=[0, 0, 0, 1, 0, 0, 0.15])

    def checker(**options: object) -> cab.CollisionChecker:
        made = cab.CollisionChecker(robot, ignored=ignored, **options)
        made.add_fixed(table, [[0, 0, 0, 1, 0, 0, -0.2]])
        return made

    unmasked = cab.Robot(sys.argv[1], packages=folders)  # without an SRDF file: each checker samples the matrix
    cloud = points(100_000)
    own = cab.CollisionChecker(robot, ignored=ignored)
    beside, holding = checker(), checker(attached=[held])
    among = {count: cab.CollisionChecker(robot, ignored=ignored) for count in (1_000, 10_000, 100_000)}
    for count, made in among.items():
        made.add_points(points(count), 0.01)

    times: Dict[str, List[float]] = {}

    def take(name: str, per: int, call: Callable[[], object]) -> None:
        times.setdefault(name, []).append(1e6 * seconds(call) / per)

    motions: Dict[str, List[float]] = {"free": [], "too close": []}
    singles: List[float] = []
    for turn in range(ROUNDS):
        many = robot.random_states(100_000, seed=1 + turn)
        some, few = many[:20_000], many[:50]
        take("collides, 100 000 states", len(many), lambda: own.collides(many))
        take("collides, one state per call", len(few), lambda: [own.collides(state) for state in few])
        for most in (0.02, 0.1, 1.0):
            take(f"distances, most = {most}", len(some), lambda: own.distances(some, most))
            take(f"distances, most = {most}, gradients", len(some), lambda: own.distances(some, most, gradients=True))
        for count, made in among.items():
            name = f"collides among {count} points"
            take(name, len(some), lambda: made.collides(some))
            take(f"{name}, one state per call", len(few), lambda: [made.collides(state) for state in few])
        take("collides beside a table", len(many), lambda: beside.collides(many))
        take("the same with an object in the hand", len(many), lambda: holding.collides(many))
        take("make a checker", 1, checker)
        take("make a checker with an object", 1, lambda: checker(attached=[held]))
        take("make a checker with padding", 1, lambda: checker(padding=0.01))
        take("sample the matrix and make a checker", 1, lambda: cab.CollisionChecker(unmasked))
        bare = checker()
        take("add_points, 100 000 points", 1, lambda: bare.add_points(cloud, 0.01))

        # Motions of one radian between free states.
        random = np.random.default_rng(turn)
        starts = some[~own.collides(some)]
        steps = random.normal(size=starts.shape)
        ends = starts + steps / np.linalg.norm(steps, axis=1, keepdims=True)
        ends = np.clip(ends, [v.lower for v in robot.variables], [v.upper for v in robot.variables])
        is_free = ~own.collides(ends)
        starts, ends = starts[is_free][:8000], ends[is_free][:8000]
        take("edges, 8 000 in a call", len(starts), lambda: own.edges(starts, ends))
        found = own.edges(starts, ends)
        motions["free"].append(found["free"].mean())
        motions["too close"].append((~found["free"] & ~found["colliding"]).mean())
        free = np.flatnonzero(found["free"])[:500]
        for row in free:
            singles.append(1e6 * seconds(lambda: own.edges(starts[row : row + 1], ends[row : row + 1])))

    print(f"{len(names)} links, {names[0]} to {names[-1]}, {own.isa}, {cpu_name()}, one thread")
    checkers = {"alone": own, "beside the table": beside, "with the object": holding}
    checkers.update({f"among {count} points": made for count, made in among.items()})
    for name, made in checkers.items():
        print(f"states that collide, {name}: {100 * made.collides(some).mean():.2f} %")
    for name, values in times.items():
        print(f"{name}: {statistics.median(values):.3g} us")
    print(f"edges, one free motion per call: {np.median(singles):.3g} us, 99 % {np.percentile(singles, 99):.3g}")
    free, close = (100 * np.mean(motions[what]) for what in ("free", "too close"))
    print(f"motions: {free:.2f} % free, {close:.3f} % too close")


if __name__ == "__main__":
    main()
