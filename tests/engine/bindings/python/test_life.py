"""Long lives: worlds come and go without a leak. CAB_TEST_ROUNDS=10 runs ten thousand worlds."""

import gc
import resource

import numpy as np

import cab
from conftest import make_chain, random_poses, rounds

# What allocators keep from round to round: measured 0 to 1.1 MB between the two halves, of 1 000 and of 10 000 worlds.
SPREAD_BYTES = 4_000_000


def resident_bytes() -> int:
    with open("/proc/self/statm", encoding="ascii") as file:
        return int(file.read().split()[1]) * resource.getpagesize()


def live_once(rng, poses, body) -> int:
    """Everything that a program does with a world, errors included."""
    found = 0
    with cab.World() as world:
        crowd = world.add(body, 20)
        found += len(world.run(poses[:20], origins=rng.uniform(-3, 3, (20, 3)), within=True, exact="convex").hits)
        crowd.grow(30)
        history = world.add_history(crowd, 2)
        history.record(0.0, poses)
        found += len(world.query(cab.rays([[0, 0, -9]], [0, 0, 1], want="all"), poses).hits)
        found += len(world.query(cab.points([[0, 0, 0]], time=0), [], histories=[history]).hits)
        world.add_static([[1, 1, 1]])
        try:
            world.run(poses.astype("f8"))
        except TypeError:
            pass
        try:
            world.run(poses, margin=-1)
        except cab.InputError:
            pass
    clip = cab.Clip(body, poses)
    found += len(clip.intervals())
    return found


def test_worlds_leave_no_memory_behind(rng):
    count = rounds(1000)
    poses = random_poses(rng, 30, 8)
    found = 0
    sizes = []
    for half in range(3):
        for _ in range(count // 2 if half else max(50, count // 10)):
            body = make_chain(8, names=[f"bone {k}" for k in range(8)])
            found += live_once(rng, poses, body)
        gc.collect()
        sizes.append(resident_bytes())
    print("resident bytes:", sizes, "hits:", found)
    assert found > count
    assert sizes[2] - sizes[1] < SPREAD_BYTES


def test_results_outlive_their_world(rng, chain):
    poses = random_poses(rng, 20, 8)
    world = cab.World()
    world.add(chain, 20)
    frame = world.run(poses, exact="convex")
    hits, contacts = frame.hits.copy(), frame.contacts.copy()
    world.close()
    del world
    gc.collect()
    for _ in range(20):
        np.ones(100_000)
    assert np.array_equal(frame.hits, hits) and np.array_equal(frame.contacts, contacts)
    assert frame.stats.candidates > 0
