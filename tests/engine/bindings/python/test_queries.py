"""Queries: what rays, shapes, points and regions meet, now and in the past."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

import cab
from conftest import make_chain, matrices_of, random_poses


@pytest.fixture
def balls():
    """Ten balls of radius 0.5 in a row along x, two apart, one link each."""
    world = cab.World()
    crowd = world.add(cab.Body.from_boxes([-1], [[0.5] * 3], shapes=[cab.Shape.sphere(0.5)]), 10)
    poses = np.zeros((10, 1, 7), dtype=np.float32)
    poses[..., 3] = 1
    poses[:, 0, 4] = 2 * np.arange(10)
    return world, crowd, poses


def test_rays_find_the_first_link_all_or_whether_there_is_one(balls):
    world, crowd, poses = balls
    queries = cab.rays([[-5, 0, 0], [4, 0, 9], [1, 0, 9]], [[1, 0, 0], [0, 0, -1], [0, 0, -1]])
    answers = world.query(queries, poses, exact="convex")
    assert answers.found.tolist() == [True, True, False]
    assert answers.hits["query"].tolist() == [0, 1]
    assert answers.hits["instance"].tolist() == [0, 2]
    assert answers.hits["distance"] == pytest.approx([4.5, 8.5], abs=1e-5)
    assert answers.hits["normal"][1] == pytest.approx([0, 0, 1], abs=1e-5)
    assert set(answers.hits["batch"].tolist()) == {crowd.slot}
    every = world.query(cab.rays([[-5, 0, 0]], [1, 0, 0], want="all"), exact="convex")  # the last frame's poses
    assert len(every.hits) == 0  # there was no frame
    world.run(poses)
    every = world.query(cab.rays([[-5, 0, 0]], [1, 0, 0], want="all"), exact="convex", reuse_bounds=True)
    assert every.hits["instance"].tolist() == list(range(10))
    few = world.query(cab.rays([[-5, 0, 0]], [1, 0, 0], want="all", max_hits=3, length=12))
    assert few.hits["instance"].tolist() == [0, 1, 2]
    some = world.query(cab.rays([[-5, 0, 0]], [1, 0, 0], want="any"))
    assert some.found.tolist() == [True] and len(some.hits) == 0
    thick = world.query(cab.rays([[1, 0, 9]], [0, 0, -1], radius=0.6, want="all"), exact="convex")
    assert thick.hits["instance"].tolist() == [0, 1]
    assert world.query(cab.rays([[-5, 0, 0]], [1, 0, 0]).without(crowd, 0)).hits["instance"].tolist() == [1]


def test_shapes_points_and_regions(balls):
    world, _, poses = balls
    world.run(poses)
    assert world.query(cab.spheres([[3, 0, 0]], 0.6), exact="convex").hits["instance"].tolist() == [1, 2]
    assert world.query(cab.boxes([[3, 0, 0]], [0.6, 0.1, 0.1]), exact="convex").hits["instance"].tolist() == [1, 2]
    turned = cab.capsules([[3, 0, 0]], 0.1, 0.6, orientations=[0, np.sqrt(0.5), 0, np.sqrt(0.5)])
    assert world.query(turned, exact="convex").hits["instance"].tolist() == [1, 2]
    assert len(world.query(cab.capsules([[3, 0, 0]], 0.1, 0.6), exact="convex").hits) == 0
    deep = world.query(cab.spheres([[4, 0, 0.8]], 0.5, with_depth=True), exact="convex").hits
    assert deep["distance"] == pytest.approx([-0.2], abs=1e-5)
    near = world.query(cab.points([[9, 3, 0], [2, 0, 0]], [10, 10], want="all", max_hits=2), exact="convex").hits
    assert near["query"].tolist() == [0, 0, 1, 1]
    assert set(near["instance"][:2].tolist()) == {4, 5}
    assert near["inside"].tolist() == [False, False, True, False]
    assert near["distance"][2:] == pytest.approx([0, 1.5], abs=1e-5)
    slab = [[1, 0, 0, 3], [-1, 0, 0, 3]]  # |x - 9| <= 3
    assert world.query(cab.regions([[9, 0, 0]], slab)).hits["instance"].tolist() == [3, 4, 5, 6]
    both = cab.points([[0, 0, 0]]) + cab.regions([[9, 0, 0]], slab) + cab.regions([[0, 0, 0]], slab, want="any")
    answers = world.query(both)
    assert len(both) == 3 and answers.hits["query"].tolist() == [0, 1, 1, 1, 1]
    assert answers.found.all() and answers.stats.leaf_tests > 0


def test_hits_come_as_a_short_list_or_are_counted(balls):
    world, _, poses = balls
    queries = cab.spheres([[3, 0, 0], [0, 9, 0], [9, 0, 0]], [3, 1, 20]) + cab.rays([[-5, 0, 0]], [1, 0, 0], want="any")
    full = world.query(queries, poses)
    assert full.hits.dtype == cab.QUERY_HIT and full.counts.tolist() == [4, 0, 10, 0]
    short = world.query(queries, report="links", poses=poses)
    assert short.hits.dtype == cab.QUERY_LINK and cab.QUERY_LINK.itemsize == 16
    for name in cab.QUERY_LINK.names:
        assert short.hits[name].tolist() == full.hits[name].tolist()
    counted = world.query(queries, report="counts", poses=poses)
    assert len(counted.hits) == 0 and counted.found.tolist() == [True, False, True, True]
    for answers in short, counted:
        assert answers.counts.tolist() == full.counts.tolist()
    with pytest.raises(ValueError, match="report: 'hit' is none of hits, links, counts"):
        world.query(queries, poses, report="hit")


def test_rays_agree_with_numpy(rng):
    body = make_chain(4)
    world = cab.World()
    world.add(body, 30)
    poses, origins = random_poses(rng, 30, 4), rng.uniform(-5, 5, (30, 3))
    starts, ways = rng.uniform(-8, 8, (500, 3)), rng.standard_normal((500, 3))
    answers = world.query(cab.rays(starts, ways), poses, origins=origins)
    matrices = matrices_of(poses)
    rotation = matrices[..., :3, :3].reshape(-1, 3, 3)
    place = (matrices[..., :3, 3] + origins[:, None]).reshape(-1, 3) + rotation[..., 0] / 2
    ways = (ways / np.linalg.norm(ways, axis=1, keepdims=True)).astype(np.float32).astype(float)
    expected = np.full(500, np.inf)
    for turn, center in zip(rotation, place):
        from_here, along = (starts - center) @ turn, ways @ turn
        with np.errstate(divide="ignore"):
            half = np.array([0.5, 0.125, 0.125])
            near, far = np.sort([(-half - from_here) / along, (half - from_here) / along], 0)
        enter, leave = near.max(1), far.min(1)
        met = (enter <= leave) & (leave >= 0)
        expected = np.minimum(expected, np.where(met, np.maximum(enter, 0), np.inf))
    got = np.full(500, np.inf)
    got[answers.hits["query"]] = answers.hits["distance"]
    agree = np.isclose(got, expected, rtol=0, atol=1e-3)  # where both are without a hit too
    assert np.isfinite(got).sum() > 30
    assert (~agree).sum() <= 1  # a ray that grazes a padded box


def test_histories_answer_for_the_past(balls):
    world, crowd, poses = balls
    history = world.add_history(crowd, 4)
    assert history.batch is crowd and history.span[0] == 0
    for tick in range(6):
        history.record(tick * 0.1, poses, origins=np.tile([0, 0, 10.0 * tick], (10, 1)))
    assert history.span == (4, pytest.approx(0.2), pytest.approx(0.5))
    queries = cab.points([[4, 0, 0]] * 3, time=[0.3, 0.35, 0.5])
    answers = world.query(queries, [], exact="convex", histories=[history])
    assert answers.hits["distance"] == pytest.approx([29.5, 34.5, 49.5], abs=1e-3)
    assert answers.hits["instance"].tolist() == [2, 2, 2]
    history.remove()


def test_bad_queries_are_refused(balls):
    world, _, poses = balls
    with pytest.raises(cab.InputError, match="^query 1: ") as caught:
        world.query(cab.rays([[0, 0, 0], [np.nan, 0, 0]], [1, 0, 0]), poses)
    assert caught.value.status is cab.Status.BAD_QUERY
    with pytest.raises(ValueError, match="want"):
        cab.rays([[0, 0, 0]], [1, 0, 0], want="first")
    with pytest.raises(ValueError, match="positions"):
        cab.points([[0, 0]])
    with pytest.raises(ValueError, match="planes"):
        cab.regions([[0, 0, 0]], [[1, 2, 3]])
    with pytest.raises(ValueError):
        cab.rays([[0, 0, 0]], [[1, 0, 0], [1, 0, 0]])
    with pytest.raises(ValueError, match="exact"):
        world.query(cab.points([[0, 0, 0]]), poses, exact="mesh")


def test_a_character_of_a_batch_that_was_removed_cannot_be_left_out(rng, chain):
    world = cab.World()
    crowd = world.add(chain, 3)
    shots = cab.rays([[0, 0, -9], [0, 0, -9]], [0, 0, 1]).without(crowd, [0, 1])
    poses = random_poses(rng, 3, 8)
    world.query(shots, poses)
    world.remove(crowd)
    world.add(chain, 3)
    with pytest.raises(cab.InputError, match="^query 0: ") as caught:
        world.query(shots, poses)
    assert caught.value.status is cab.Status.UNKNOWN_BATCH


def test_several_threads_query_one_world(rng):
    world = cab.World()
    crowd = world.add(make_chain(8), 300)
    poses, origins = random_poses(rng, 300, 8), rng.uniform(-6, 6, (300, 3))
    world.run(crowd.posed(poses, origins=origins))
    # Growing counts, so that the memory of queries grows while others ask.
    asked = [cab.rays(rng.uniform(-8, 8, (n, 3)), rng.normal(size=(n, 3)), want="all") for n in (1, 70, 300, 900)]
    alone = cab.World()
    same = alone.add(make_chain(8), 300).posed(poses, origins=origins)
    alone.run(same)
    expected = [alone.query(queries, same).hits for queries in asked]
    assert sum(len(hits) for hits in expected) > 100

    def ask(first):
        posed = crowd.posed(poses, origins=origins)  # each thread has flags of its own
        for k in range(40):
            which = k if k < len(asked) else (first + k) % len(asked)
            assert (world.query(asked[which], posed, reuse_bounds=k % 2 == 0).hits == expected[which]).all()
            if k % 10 == 0:
                world.boxes(posed)
        return True

    with ThreadPoolExecutor(4) as threads:
        assert all(threads.map(ask, range(4)))
