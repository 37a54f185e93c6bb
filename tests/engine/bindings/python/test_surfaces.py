"""Surfaces of skins: bodies of triangles, frames by them, and the triangles that touch, beside brute force in NumPy."""

import base64
import json

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


@pytest.mark.parametrize("make", [cab.Body.from_skin, cab.Body.from_surface])
def test_matrices_of_a_skin_in_the_other_order_are_refused(make):
    skin = tube_skin()
    other = {name: np.ascontiguousarray(np.swapaxes(skin[name], -1, -2)) for name in ("poses", "inverse_bind")}
    body = make(**skin)
    assert np.array_equal(make(**{**skin, **other}, order="column").boxes, body.boxes)
    for given, name, which in [
        (other, "inverse_bind", "bone 1"),
        ({"inverse_bind": other["inverse_bind"]}, "inverse_bind", "bone 1"),
        ({"poses": other["poses"]}, "poses", "pose 0, joint 1"),
    ]:
        with pytest.raises(ValueError, match=f'{name}: the last row of the matrix of {which} .*; say order="column"'):
            make(**{**skin, **given})
    with pytest.raises(ValueError, match='inverse_bind: the last column .* bone 1 .*; order="column" says'):
        make(**skin, order="column")
    frames = np.stack([np.eye(4, dtype=np.float32)[None].repeat(2, 0), skin["poses"]])
    assert np.array_equal(body.link_poses(np.swapaxes(frames, -1, -2), order="column"), body.link_poses(frames))
    with pytest.raises(ValueError, match='matrices: the last row .* pose 1, joint 1 .* 1 0 0 1; say order'):
        body.link_poses(np.swapaxes(frames, -1, -2))
    with pytest.raises(ValueError, match='matrices: the last column .* pose 1, joint 1 .* 1 0 0 1; order'):
        body.link_poses(frames, order="column")


def test_the_last_rows_of_a_skin_may_be_off_by_rounding():
    skin = tube_skin()
    body = cab.Body.from_skin(**skin)
    inverse_bind = skin["inverse_bind"].copy()
    assert not inverse_bind[0, :3, 3].any()
    inverse_bind[0, 3] = [1e-6, -0.0, -1e-6, 1 - 1e-6]
    inverse_bind[1, 3] = [1e-6, -0.0, -1e-6, 1 + 1e-6]
    assert np.array_equal(cab.Body.from_skin(**{**skin, "inverse_bind": inverse_bind}).boxes, body.boxes)
    for last in ([0, 0, 0, 2], [0, 0, 0, 0], [1e-3, 0, 0, 1]):
        inverse_bind[1, 3] = last
        with pytest.raises(ValueError, match="inverse_bind: the last row of the matrix of bone 1 must be 0 0 0 1"):
            cab.Body.from_skin(**{**skin, "inverse_bind": inverse_bind})


def octahedron(size):
    """The arguments of `Body.from_surface` for a closed skin of one joint."""
    vertices = np.array([[s, 0, 0] for s in (1, -1)] + [[0, s, 0] for s in (1, -1)] + [[0, 0, s] for s in (1, -1)])
    triangles = [[x, y, z] for x in (0, 1) for y in (2, 3) for z in (4, 5)]
    triangles = [t if sum(t) % 2 == 0 else [t[0], t[2], t[1]] for t in triangles]
    return dict(
        parents=[-1], poses=np.eye(4, dtype=np.float32)[None], vertices=(size * vertices).astype(np.float32),
        triangles=np.array(triangles), bones=np.zeros((6, 1), dtype=int), weights=np.ones((6, 1)),
        inverse_bind=np.eye(4, dtype=np.float32)[None],
    )


def test_what_is_wholly_inside_a_closed_surface_is_found_unless_that_is_turned_off():
    bodies = [cab.Body.from_surface(**octahedron(size)) for size in (1, 0.1)]
    world, clip = cab.World(), cab.Clip()
    batches = [world.add(body, 2) for body in bodies]
    still = np.array([0, 0, 0, 1, 0, 0, 0], dtype=np.float32)
    beside = np.array([0, 0, 0, 1, 0.6, 0.6, 0], dtype=np.float32)
    outer, inner = np.stack([still, still])[:, None], np.stack([still, beside])[:, None]
    for body, poses in zip(bodies, (outer, inner)):
        clip.add(body, poses)
    posed = [batch.posed(poses) for batch, poses in zip(batches, (outer, inner))]
    hits = world.run(posed, pairs=[tuple(batches)], exact="surface").hits
    assert [(int(h["instance_a"]), int(h["instance_b"])) for h in hits] == [(0, 0), (1, 0)]
    assert len(world.run(posed, pairs=[tuple(batches)], exact="surface", containment=False).hits) == 0
    assert clip.hits()["frame"].tolist() == [0] and len(clip.hits(containment=False)) == 0
    assert len(clip.intervals()) == 1 and len(clip.intervals(containment=False)) == 0


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


def write_tube(path, frames=5):
    """A glTF file of the tube, whose second joint turns about z by half a turn and more."""
    skin = tube_skin()
    angles = np.linspace(0, 3, frames)
    turns = np.stack([0 * angles, 0 * angles, np.sin(angles / 2), np.cos(angles / 2)], axis=1)
    arrays = [
        (skin["vertices"], "VEC3", 5126), (skin["triangles"].astype(np.uint16).ravel(), "SCALAR", 5123),
        (np.tile([0, 1, 0, 0], (len(skin["vertices"]), 1)).astype(np.uint16), "VEC4", 5123),
        (np.pad(skin["weights"], ((0, 0), (0, 2))).astype(np.float32), "VEC4", 5126),
        (np.swapaxes(skin["inverse_bind"], 1, 2).reshape(-1, 16), "MAT4", 5126),
        (np.linspace(0, 1, frames, dtype=np.float32), "SCALAR", 5126), (turns.astype(np.float32), "VEC4", 5126),
    ]
    views, accessors, data = [], [], b""
    for values, kind, component in arrays:
        views.append({"buffer": 0, "byteOffset": len(data), "byteLength": values.nbytes})
        accessors.append({"bufferView": len(views) - 1, "componentType": component, "count": len(values), "type": kind})
        data += values.tobytes() + b"\0" * (-values.nbytes % 4)
    attributes = {"POSITION": 0, "JOINTS_0": 2, "WEIGHTS_0": 3}
    path.write_text(json.dumps({
        "asset": {"version": "2.0"}, "accessors": accessors, "bufferViews": views,
        "buffers": [{"byteLength": len(data), "uri": "data:application/octet-stream;base64," +
                     base64.b64encode(data).decode()}],
        "meshes": [{"primitives": [{"attributes": attributes, "indices": 1}]}],
        "skins": [{"joints": [0, 1], "inverseBindMatrices": 4}],
        "nodes": [{"name": "upper", "children": [1]}, {"name": "lower", "translation": [1, 0, 0]},
                  {"mesh": 0, "skin": 0}],
        "animations": [{"samplers": [{"input": 5, "output": 6}],
                        "channels": [{"sampler": 0, "target": {"node": 1, "path": "rotation"}}]}],
        "scenes": [{"nodes": [0, 2]}], "scene": 0,
    }))
    return path


def test_a_file_becomes_a_surface_that_moves(tmp_path):
    path = write_tube(tmp_path / "tube.gltf")
    body, poses, *rest = cab.load_motion(path, body="surface")
    assert body.is_surface and sum(map(len, body.triangles)) == len(tube_skin()["triangles"])
    assert poses.shape[1:] == (2, 7) and len(poses) > 3
    two = cab.Clip()
    two.add(body, poses)
    two.add(body, poses, origins=np.tile([0.3, 0.1, 0.1], (len(poses), 1)))
    hits = two.hits(within=False)
    assert len(hits) > 0 and np.isnan(hits["depth"]).all()
    assert not cab.load_motion(path, body="skin").body.is_surface
    with pytest.raises(ValueError, match="body: 'mesh' is none of skeleton, skin, surface"):
        cab.load_motion(path, body="mesh")


def test_rays_say_where_on_which_triangle_they_hit(rng):
    skin = tube_skin()
    body = cab.Body.from_surface(**skin, most_triangles=40)
    solid = cab.Body.from_boxes([-1], [[0.5, 0.5, 0.5]])
    matrices = bent_poses(rng, 4)
    world = cab.World()
    tubes, box = world.add(body, 4), world.add(solid, 1)
    posed = [tubes.posed(body.link_poses(matrices)),
             box.posed(np.array([[[0, 0, 0, 1, 9, 0, 0]]], dtype=np.float32))]
    starts = rng.uniform(-1, 1, (400, 3)) * [2, 1.5, 0.5] + [0, 0, 3]
    starts[0] = [9, 0, 3]
    rays = cab.rays(starts, np.tile([0, 0, -1.0], (400, 1)), length=9)
    answers = world.query(rays, posed, exact="surface", surface_points=True)
    points = answers.surface_points
    assert points.dtype == cab.SURFACE_POINT and len(points) == len(answers.hits) > 50
    places = [skinned(skin, m) for m in matrices]
    on_skin = 0
    for hit, point in zip(answers.hits, points):
        if hit["batch"] == box.slot:
            assert point["triangle"] == 0xFFFFFFFF
            continue
        corners = skin["triangles"][body.source_triangles[hit["leaf"]][point["triangle"]]]
        there = point["weights"].astype(float) @ places[hit["instance"]][corners]
        assert np.allclose(there, starts[hit["query"]] + hit["point"], atol=1e-5)
        on_skin += 1
    assert on_skin > 50 and on_skin < len(points)
    assert world.query(rays, posed, exact="surface").surface_points is None
    none = cab.rays(starts[:0], starts[:0], length=1)
    assert len(world.query(none, posed, exact="surface", surface_points=True).surface_points) == 0
    with pytest.raises(ValueError, match="surface_points: hits in full have them, not report='links'"):
        world.query(rays, posed, exact="surface", surface_points=True, report="links")
