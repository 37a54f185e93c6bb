"""Surfaces of skins: bodies of triangles, frames by them, and the triangles that touch, beside brute force in NumPy."""

import cab
import numpy as np
import pytest


def tube_skin(rings=9, sides=8):
    """A tube along x about two joints that are 1 apart; its middle bends smoothly."""
    x = np.linspace(-0.8, 1.8, rings)
    angle = np.linspace(0, 2 * np.pi, sides, endpoint=False)
    vertices = np.array([[place, 0.2 * np.cos(a), 0.2 * np.sin(a)] for place in x for a in angle], dtype=np.float32)
    triangles = []
    for ring in range(rings - 1):
        for side in range(sides):
            a, b = ring * sides + side, ring * sides + (side + 1) % sides
            triangles += [[a, b, a + sides], [b, b + sides, a + sides]]
    share = np.clip(x, 0, 1).repeat(sides)
    rest = np.tile(np.eye(4, dtype=np.float32), (2, 1, 1))
    rest[1, 0, 3] = 1
    return dict(
        parents=[-1, 0], poses=rest, vertices=vertices, triangles=np.array(triangles),
        bones=np.tile([0, 1], (len(vertices), 1)), weights=np.stack([1 - share, share], axis=1),
        inverse_bind=np.linalg.inv(rest).astype(np.float32),
    )


def bent_poses(rng, count):
    """Joint matrices (count, 2, 4, 4): the second joint turned about z, all moved a little."""
    out = np.tile(np.eye(4, dtype=np.float32), (count, 2, 1, 1))
    angle = rng.uniform(-1, 1, count)
    out[:, 1, 0, 0] = out[:, 1, 1, 1] = np.cos(angle)
    out[:, 1, 0, 1], out[:, 1, 1, 0] = -np.sin(angle), np.sin(angle)
    out[:, 1, 0, 3] = 1
    out[:, :, :3, 3] += rng.uniform(-0.6, 0.6, (count, 1, 3))
    return out


def skinned(skin, matrices):
    """The vertices (n, 3) where joint matrices (2, 4, 4) put them, in double."""
    points = np.concatenate([skin["vertices"], np.ones((len(skin["vertices"]), 1))], axis=1).astype(float)
    moved = np.einsum("jab,jbc,vc->vja", matrices.astype(float), skin["inverse_bind"].astype(float), points)
    return np.einsum("vj,vja->va", skin["weights"], moved)[:, :3]


def crosses(start, end, corners):
    """Whether segments (k, 3) pass through one triangle (3, 3)."""
    e, f, d = corners[1] - corners[0], corners[2] - corners[0], end - start
    h = np.cross(d, f)
    det = h @ e
    safe = np.where(det == 0, 1, det)
    t = start - corners[0]
    u = np.einsum("ka,ka->k", t, h) / safe
    q = np.cross(t, e)
    v = np.einsum("ka,ka->k", d, q) / safe
    s = q @ f / safe
    return (det != 0) & (u >= 0) & (v >= 0) & (u + v <= 1) & (s >= 0) & (s <= 1)


def touching(a, b):
    """The pairs (i, k) of triangles (n, 3, 3) and (m, 3, 3) of which an edge of one passes through the other."""
    found = set()
    for first, second, swap in ((a, b, False), (b, a, True)):
        starts, ends = first.reshape(-1, 3), np.roll(first, -1, axis=1).reshape(-1, 3)
        for k, corners in enumerate(second):
            for edge in np.flatnonzero(crosses(starts, ends, corners)):
                found.add((k, edge // 3) if swap else (edge // 3, k))
    return found


def test_the_triangles_of_two_characters_touch_where_brute_force_says(rng):
    skin = tube_skin()
    body = cab.Body.from_surface(**skin, names=["upper", "lower"], most_triangles=40)
    assert body.is_surface and body.names == ("upper", "lower")
    assert sum(len(t) for t in body.triangles) == len(skin["triangles"])
    matrices = bent_poses(rng, 12)
    poses = body.link_poses(matrices)
    world = cab.World()
    world.add(body, 12)
    frame = world.run(poses, exact="surface")
    assert frame.contacts is None
    places = np.stack([skinned(skin, m) for m in matrices])
    truth, pairs = set(), set()
    for a in range(12):
        for b in range(a + 1, 12):
            found = touching(places[a][skin["triangles"]], places[b][skin["triangles"]])
            truth |= {(a, b, *map(int, pair)) for pair in found}
            pairs |= {(a, b)} if found else set()
    assert {(int(hit["instance_a"]), int(hit["instance_b"])) for hit in frame.hits} == pairs and len(pairs) > 5
    # Without an exact test boxes decide, and find more.
    assert len(world.run(poses, exact="none").hits) >= len(frame.hits)
    listed = world.touching_triangles(frame.hits, poses)
    assert listed.dtype == cab.TOUCHING_TRIANGLES
    sources = body.source_triangles
    hits = frame.hits[listed["pair"]]
    assert (body.box_links[listed["leaf_a"]] == hits["link_a"]).all()
    named = {
        (int(hit["instance_a"]), int(hit["instance_b"]), int(sources[one["leaf_a"]][one["triangle_a"]]),
         int(sources[one["leaf_b"]][one["triangle_b"]]))
        for one, hit in zip(listed, hits)
    }
    assert named == truth and len(named) == len(listed)


def test_with_surface_solids_are_as_with_convex():
    solid = cab.Body.from_boxes([-1], [[0.5, 0.5, 0.5]])
    poses = np.array([[[0, 0, 0, 1, 0, 0, 0]], [[0, 0, 0, 1, 1.2, 0, 0]]], dtype=np.float32)
    clip = cab.Clip()
    clip.add(solid, poses[:1])
    clip.add(solid, poses[1:])
    by_surface, by_convex = (clip.distances(0.5, exact=exact) for exact in ("surface", "convex"))
    assert len(by_surface) == 1 and np.array_equal(by_surface, by_convex)
    world = cab.World()
    world.add(solid, 2)
    frame = world.run(poses, exact="surface", report="distances", margin=0.5)
    assert np.allclose(frame.contacts["depth"], -0.2, atol=1e-5)


def test_surfaces_are_bodies_like_others(rng):
    skin = tube_skin()
    body = cab.Body.from_surface(**skin)
    assert body.sha256() == cab.Body.from_surface(**skin).sha256()
    moved = {**skin, "vertices": skin["vertices"] * np.float32(1.5)}
    assert body.sha256() != cab.Body.from_surface(**moved).sha256()
    quiet = body.ignoring([[0, 1]], hops=3)
    assert isinstance(quiet, cab.SkinnedBody) and quiet.is_surface and len(quiet.triangles) == len(body.triangles)
    assert len(quiet.ignored_pairs) == len(body.ignored_pairs) + 1 and quiet.ignored_pairs[-1].tolist() == [0, 1]
    assert quiet.sha256() != body.ignoring([[0, 1]]).sha256()
    clip = cab.Clip(quiet, body.link_poses(bent_poses(rng, 5)))
    assert len(clip.hits()) == 0
    two = cab.Clip()
    for _ in range(2):
        two.add(body, body.link_poses(bent_poses(rng, 5)))
    hits = two.hits(within=False)
    assert len(hits) > 0 and np.isnan(hits["depth"]).all()
    assert len(hits) <= len(two.hits(within=False, exact="none"))
    with pytest.raises(cab.InputError, match="skin"):
        two.distances(0.5)
    with pytest.raises(cab.InputError):
        two.hits(within=False, exact="convex")
    with pytest.raises(ValueError, match="triangles"):
        cab.Body.from_surface(**{**skin, "triangles": np.zeros((0, 3), dtype=int)})
