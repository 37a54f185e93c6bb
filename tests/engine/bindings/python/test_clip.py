"""Clips: frames of recorded motion, as intervals of links that touch, with depths and durations."""

import numpy as np
import pytest

import cab
from conftest import make_chain, random_poses


def sphere_body(radius=0.5):
    return cab.Body.from_boxes([-1], [[radius] * 3], shapes=[cab.Shape.sphere(radius)])


def places(x):
    poses = np.zeros((len(x), 1, 7), dtype=np.float32)
    poses[:, 0, 3] = 1
    poses[:, 0, 4] = x
    return poses


def test_a_clip_has_the_hits_of_a_world_per_frame(rng, chain):
    poses = random_poses(rng, 40, 8)
    other = random_poses(rng, 40, 8)
    clip = cab.Clip(chain, poses)
    assert clip.add(chain, other) == 1
    for exact in ("none", "convex"):
        hits = clip.hits(exact=exact)
        expected = []
        for frame in range(40):
            world = cab.World()
            world.add(chain, 2)
            both = np.stack([poses[frame], other[frame]])
            for hit in world.run(both, within=True, exact=exact).hits:
                expected.append((frame, hit["instance_a"], hit["link_a"], hit["instance_b"], hit["link_b"]))
        found = hits[["frame", "a", "link_a", "b", "link_b"]].tolist()
        assert sorted(found) == sorted(expected) and len(found) > 40
        assert (np.diff(hits["frame"].astype(int)) >= 0).all()
        assert np.isnan(hits["depth"]).all() == (exact == "none")
        fast = clip.hits(exact=exact, depths=False)
        assert np.isnan(fast["depth"]).all()
        assert fast[["frame", "a", "link_a", "b", "link_b"]].tolist() == found


def test_intervals_have_frames_seconds_and_the_deepest_depth():
    #        0    1    2    3    4    5    6    7    8    9
    gaps = [2.0, 0.9, 0.8, 0.7, 0.8, 2.0, 0.9, 2.0, 2.0, 0.6]
    clip = cab.Clip(sphere_body(), places(np.zeros(10)), fps=50)
    clip.add(sphere_body(), places(np.array(gaps)))
    rows = clip.intervals()
    assert rows[["a", "link_a", "b", "link_b"]].tolist() == [(0, 0, 1, 0)] * 3
    assert rows["first"].tolist() == [1, 6, 9]
    assert rows["last"].tolist() == [4, 6, 9]
    assert rows["seconds"] == pytest.approx([0.08, 0.02, 0.02])
    assert rows["depth"] == pytest.approx([0.3, 0.1, 0.4], abs=1e-5)
    assert rows["deepest"].tolist() == [3, 6, 9]
    assert clip.intervals(gap=1)["last"].tolist() == [6, 9]
    assert clip.intervals(gap=2)["last"].tolist() == [9]
    deep = clip.intervals(min_depth=0.25)
    assert deep["first"].tolist() == [3, 9] and deep["last"].tolist() == [3, 9]
    assert clip.intervals(margin=1.5)["first"].tolist() == [0]
    assert len(clip.intervals(between=False)) == 0
    assert cab.Clip(sphere_body(), places(np.zeros(3))).intervals().dtype == cab.INTERVAL


def test_a_character_meets_itself_but_for_ignored_pairs(rng):
    poses = random_poses(rng, 30, 8)
    everything = cab.Clip(make_chain(8), poses).hits()
    some = cab.Clip(make_chain(8, ignored_hops=1), poses).hits()
    apart = np.abs(everything["link_a"].astype(int) - everything["link_b"]) > 1
    assert np.array_equal(everything[apart], some)
    assert 0 < len(some) < len(everything)
    named = cab.Clip(make_chain(8, names=[f"bone {k}" for k in range(8)]), poses, name="walker")
    assert named.names == ("walker",) and named.link_name(0, 3) == "bone 3"


def test_a_fixed_object_is_there_in_every_frame():
    clip = cab.Clip(sphere_body(), places(np.linspace(-2, 2, 9)), fps=10)
    clip.add(sphere_body(0.25), places(np.zeros(1)), name="ball")
    assert clip.frames == 9 and clip.fps == 10
    rows = clip.intervals()
    assert rows["first"].tolist() == [3] and rows["last"].tolist() == [5] and rows["deepest"].tolist() == [4]
    table = cab.Clip(fps=10)
    assert table.add(sphere_body(0.25), places(np.zeros(1))) == 0
    assert table.add(sphere_body(), places(np.linspace(-2, 2, 9))) == 1
    assert table.intervals()["first"].tolist() == [3]


def test_distances_name_the_nearest_links(rng, chain):
    clip = cab.Clip(sphere_body(), places(np.zeros(4)))
    clip.add(sphere_body(), places(np.array([3, 2, 0.5, 9.0])))
    rows = clip.distances(5)
    assert rows["frame"].tolist() == [0, 1, 2]
    assert rows["distance"] == pytest.approx([2, 1, -0.5], abs=1e-5)

    poses, other = random_poses(rng, 30, 8), random_poses(rng, 30, 8)
    clip = cab.Clip(chain, poses)
    clip.add(chain, other)
    rows = clip.distances(100)
    hits = clip.hits(margin=100, within=False)
    assert len(rows) == 30
    for row in rows:
        here = hits[hits["frame"] == row["frame"]]
        assert -row["distance"] == here["depth"].max()
    assert len(clip.distances(100, within=True)) == 90


def test_clips_refuse_what_does_not_fit(rng, chain):
    clip = cab.Clip(chain, random_poses(rng, 10, 8))
    with pytest.raises(ValueError, match="the clip has 10 frames, and 11 are given"):
        clip.add(chain, random_poses(rng, 11, 8))
    with pytest.raises(TypeError, match="float64"):
        clip.add(chain, random_poses(rng, 10, 8).astype("f8"))
    with pytest.raises(ValueError, match="links"):
        clip.add(chain, random_poses(rng, 10, 7))
    with pytest.raises(ValueError, match="fps"):
        cab.Clip(fps=0)
    with pytest.raises(TypeError, match="both body and poses"):
        cab.Clip(chain)
    assert clip.names == ("character 0",)
    assert clip.add(chain, random_poses(rng, 10, 8), name="b") == 1
    clip.close()
    with pytest.raises(ValueError, match="closed"):
        clip.add(chain, random_poses(rng, 10, 8))


def test_poses_of_clips_are_read_where_they_are(rng, chain):
    poses = random_poses(rng, 60, 8)
    clip = cab.Clip(chain, poses[::2])
    assert clip._characters[0].frame_input.poses_address == poses.ctypes.data
    assert np.array_equal(clip.hits(), cab.Clip(chain, poses[::2].copy()).hits())


def test_fixed_objects_touch_each_other_in_every_frame():
    clip = cab.Clip(sphere_body(), places(np.zeros(1)), fps=10)
    clip.add(sphere_body(), places(np.array([0.75])))
    clip.add(sphere_body(), places(np.array([9, 1.5, 9, 9])))
    hits = clip.hits()
    assert hits[["frame", "a", "b"]].tolist() == [(0, 0, 1), (1, 0, 1), (1, 1, 2), (2, 0, 1), (3, 0, 1)]
    assert hits["depth"] == pytest.approx([0.25] * 5, abs=1e-5)
    rows = clip.intervals()
    assert rows[["a", "b", "first", "last"]].tolist() == [(0, 1, 0, 3), (1, 2, 1, 1)]
    assert rows["seconds"] == pytest.approx([0.4, 0.1])
    near = clip.distances(1)
    assert near["frame"].tolist() == [0, 1, 1, 1, 2, 3]
    two = cab.Body.from_boxes([-1, 0], [[0.5] * 3] * 2)
    poses = np.zeros((1, 2, 7), dtype=np.float32)
    poses[..., 3] = 1
    alone = cab.Clip(two, poses)  # a fixed object goes through itself
    alone.add(sphere_body(), places(np.array([9.0, 9, 9])))
    assert alone.hits()[["frame", "a", "b", "link_a", "link_b"]].tolist() == [(k, 0, 0, 0, 1) for k in range(3)]


def test_policies_of_a_clip_keep_their_exact_test(rng, chain):
    clip = cab.Clip(chain, random_poses(rng, 10, 8))
    chosen = []
    engine = clip._engine

    class Watching:
        def __getattr__(self, name):
            return getattr(engine, name)

        def run_frame(self, inputs, rules, names, *rest):
            chosen.append(dict(zip([field.name for field in cab.policy_table()], names))["exact"])
            return engine.run_frame(inputs, rules, names, *rest)

    clip._engine = Watching()
    for policies, exact, expected in [
        (None, None, "convex"),
        ("tight", None, "convex"),
        (cab.Policies(exact="fcl"), None, "fcl"),
        (cab.Policies(exact="fcl"), "convex", "convex"),
        (None, "none", "none"),
    ]:
        for call in (clip.hits, clip.intervals):
            try:
                call(policies=policies, **({} if exact is None else {"exact": exact}))
            except cab.UnsupportedError:
                assert expected == "fcl" and not cab.build_info().fcl
            assert chosen.pop() == expected
    with pytest.raises(ValueError, match="exact"):
        clip.distances(1, exact="none")


def test_intervals_of_parts_are_those_of_the_whole(rng, chain):
    poses = random_poses(rng, 48, 8, spread=1)
    clip = cab.Clip(chain, poses, fps=60)
    assert clip.stats is None
    whole = clip.intervals(gap=1)
    assert clip.stats is not None and clip.stats.box_tests > 0
    parts = []
    for first in (0, 16, 32):
        hits = cab.Clip(chain, poses[first : first + 16]).hits()
        hits["frame"] += first
        parts.append(hits)
    assert np.array_equal(cab.intervals_of(np.concatenate(parts), 60, gap=1), whole)
    assert len(cab.intervals_of(np.empty(0, dtype=cab.CLIP_HIT), 60)) == 0
