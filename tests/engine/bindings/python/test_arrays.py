"""Arrays: nothing is copied, and what does not fit is refused in words that say what was given and what is wanted."""

import threading
import tracemalloc

import numpy as np
import pytest

import cab
from conftest import matrices_of, random_poses


@pytest.fixture
def crowd(chain):
    return cab.World().add(chain, 2000)


def test_poses_of_every_format_are_read_where_they_are(rng, crowd):
    poses = random_poses(rng, 2000, 8)
    rows = matrices_of(poses).astype(np.float32)
    columns = np.ascontiguousarray(np.swapaxes(rows, -1, -2))
    structure = np.zeros((2000, 8), dtype=[("id", "u4"), ("pose", "f4", 7), ("more", "f4", 3)])
    structure["pose"] = poses
    read_only = poses.copy()
    read_only.flags.writeable = False
    for given, order in [
        (poses, "row"),
        (read_only, "row"),
        (rows, "row"),
        (rows[..., :3, :], "row"),
        (np.ascontiguousarray(rows[..., :3, :]), "row"),
        (np.swapaxes(columns, -1, -2), "row"),
        (columns, "column"),
        (np.swapaxes(rows, -1, -2), "column"),
        (poses[::2], "row"),
        (poses[500:1500], "row"),
        (structure["pose"], "row"),
        (structure["pose"][::3], "row"),
    ]:
        posed = crowd.posed(given, order=order)
        assert posed.poses_address == given.ctypes.data


def test_a_frame_of_views_has_the_hits_of_packed_poses(rng, chain):
    world = cab.World()
    crowd = world.add(chain, 50)
    poses = random_poses(rng, 50, 8)
    structure = np.zeros((100, 16), dtype=[("id", "u4"), ("pose", "f4", 7)])
    structure["pose"][::2, ::2] = poses
    structure["pose"][1::2] = np.nan
    structure["pose"][:, 1::2] = np.nan
    expected = world.run(poses).hits
    assert len(expected) > 20
    assert np.array_equal(world.run(structure["pose"][::2, ::2]).hits, expected)
    matrices = np.full((50, 9, 4, 4), np.nan, dtype=np.float32)
    matrices[:, :8] = matrices_of(poses)
    packed = world.run(np.ascontiguousarray(matrices[:, :8])).hits
    assert np.array_equal(world.run(matrices[:, :8]).hits, packed)
    assert crowd.room == 50


def test_a_frame_allocates_no_room_for_poses(rng, chain):
    world = cab.World()
    crowd = world.add(chain, 20000)
    poses = random_poses(rng, 20000, 8)
    origins = np.ascontiguousarray(np.stack([np.arange(20000.0) * 100] * 3, 1))
    world.run(poses, origins=origins)
    held = world.memory.total
    # NumPy's memory is seen by tracemalloc, the engine's by the engine, and what neither sees is read where it is.
    tracemalloc.start()
    try:
        world.run(poses, origins=origins)
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    # A byte of flags per character, and a little: a copy of the poses would take 4.5 MB, one of the origins 0.5 MB.
    assert poses.nbytes > 4_000_000
    assert peak < 200_000
    assert world.memory.total == held
    assert crowd.posed(poses, origins=origins).poses_address == poses.ctypes.data


def test_what_is_written_between_frames_is_seen(rng, crowd):
    poses = random_poses(rng, 2000, 8)
    posed = crowd.posed(poses)
    world = crowd._world
    first = world.run(posed).hits.copy()
    poses[...] = random_poses(rng, 2000, 8)
    second = world.run(posed).hits
    assert not np.array_equal(first, second)
    assert np.array_equal(second, world.run(poses).hits)


def test_other_types_are_a_type_error(rng, crowd):
    poses = random_poses(rng, 4, 8)
    for bad, words in [
        (poses.astype(np.float64), r"float32 .* is wanted, and float64 is given; poses.astype\(numpy.float32\)"),
        (poses.astype(np.float16), "float16 is given"),
        (poses.astype(">f4"), ">f4 is given"),
        (poses.tolist(), "list is given"),
        (None, "NoneType is given"),
        ("poses", "str is given"),
    ]:
        with pytest.raises(TypeError, match=words):
            crowd.posed(bad)
    for name, bad in [
        ("origins", np.zeros((4, 3), dtype=np.float32)),
        ("orientations", np.zeros((4, 4))),
        ("scales", np.ones(4)),
        ("layers", np.ones(4, dtype=np.int64)),
        ("layer_masks", np.ones(4, dtype=np.int32)),
        ("margins", np.ones(4)),
        ("moved", np.ones(4, dtype=np.uint8)),
        ("bounds", np.zeros((4, 2, 3))),
        ("origins", [["a", "b", "c"]] * 4),
        ("moved", [0.5] * 4),
        ("instances", [0.5]),
    ]:
        with pytest.raises(TypeError, match=name):
            crowd.posed(poses, **{name: bad})
    with pytest.raises(TypeError, match="colour"):
        crowd.posed(poses, colour=1)
    with pytest.raises(TypeError, match="no argument colour"):  # an argument that cab passes on, and C++ does not know
        crowd._world._engine.make_input(crowd._id, poses, False, False, colour=1)


def test_lists_are_copied_where_arrays_are_borrowed(rng, chain):
    poses = random_poses(rng, 4, 8)
    world = cab.World()
    crowd = world.add(chain, 4)
    arrays = dict(
        origins=rng.uniform(-1, 1, (4, 3)),
        orientations=np.tile(np.array([0, 0, 1, 0], dtype=np.float32), (4, 1)),
        scales=np.array([1, 2, 1, 0.5], dtype=np.float32),
        layers=np.array([1, 2, 3, 1], dtype=np.uint32),
        layer_masks=np.array([3, 3, 1, 1], dtype=np.uint32),
        margins=np.array([0.5, 0, 0, 0], dtype=np.float32),
        moved=np.ones(4, dtype=bool),
    )
    expected = world.run(poses, **arrays).hits
    assert len(expected) > 10
    assert np.array_equal(world.run(poses, **{name: array.tolist() for name, array in arrays.items()}).hits, expected)
    bounds = np.tile(np.array([[-9, -9, -9], [9, 9, 9]], dtype=np.float32), (4, 1, 1))
    listed = crowd.posed(poses, bounds=bounds.tolist(), **arrays)
    assert np.array_equal(world.run(listed).hits, expected)
    with pytest.raises(ValueError, match=r"origins: .* the shape \(3, 3\) is given; here it must be \(4, 3\)"):
        crowd.posed(poses, origins=[[0, 0, 0]] * 3)
    with pytest.raises(ValueError, match=r"scales: .* the shape \(4, 1\) is given"):
        crowd.posed(poses, scales=[[1]] * 4)
    clip = cab.Clip(chain, poses, origins=[[0, 0, 0]] * 4)
    assert np.array_equal(clip.hits(), cab.Clip(chain, poses).hits())


def test_masked_arrays_are_a_type_error_since_their_masks_would_be_lost(rng, crowd):
    poses = random_poses(rng, 4, 8)
    masked = np.ma.array(poses, mask=np.zeros(poses.shape, dtype=bool))
    with pytest.raises(TypeError, match=r"poses: a masked array is given, .*; poses.filled\(\) makes"):
        crowd.posed(masked)
    with pytest.raises(TypeError, match="origins: a masked array"):
        crowd.posed(poses, origins=np.ma.zeros((4, 3)))
    with pytest.raises(TypeError, match="instances: a masked array"):
        crowd.posed(poses, instances=np.ma.array([0, 1], mask=[True, False]))
    with pytest.raises(TypeError, match="half: a masked array"):
        cab.Body.from_boxes([-1], np.ma.ones((1, 3)))
    with pytest.raises(TypeError, match="positions: a masked array"):
        cab.points(np.ma.zeros((1, 3)))
    with pytest.raises(TypeError, match="directions: a masked array"):
        cab.rays([[0, 0, 0]], np.ma.array([0, 0, 1], mask=[True, False, False]))
    assert len(crowd._world.run(crowd.posed(masked.filled())).hits) >= 0


def write_meanwhile(array, wrong, call):
    """Calls `call` again and again while another thread writes `wrong` into an array, and what was there."""
    right, stop = array.copy(), threading.Event()

    def write():
        while not stop.is_set():
            array[...] = wrong
            array[...] = right

    thread = threading.Thread(target=write)
    thread.start()
    answered = 0
    try:
        for _ in range(300):
            try:
                call()
                answered += 1
            except cab.InputError:
                pass
    finally:
        stop.set()
        thread.join()
    array[...] = right
    call()
    return answered


def test_what_another_thread_writes_into_an_index_is_refused_or_not_seen(rng, chain):
    world = cab.World()
    crowd = world.add(chain, 500)
    poses = random_poses(rng, 500, 8, 20)
    listed = np.arange(500, dtype=np.uint32)
    posed = crowd.posed(poses, instances=listed)
    write_meanwhile(listed, np.uint32(0xFFFFFFFF), lambda: world.run(posed))
    hits = world.run(poses).hits.copy()
    wrong = hits.copy()
    wrong["instance_a"], wrong["link_b"] = 0xFFFFFFF0, 0xFFF0
    write_meanwhile(hits, wrong, lambda: world.contacts(hits))
    asked = cab.regions(np.zeros((200, 3)), [[1, 0, 0, 5]])
    wrong = asked.array.copy()
    wrong["first_plane"] = 0xFFFFFF00
    write_meanwhile(asked.array, wrong, lambda: world.query(asked, poses))


def test_other_shapes_are_a_value_error(rng, crowd):
    poses = random_poses(rng, 4, 8)
    for shape in [(4, 8), (4, 8, 6), (4, 8, 8), (8, 7), (4, 8, 7, 1), (4, 8, 3, 3), (4, 8, 4, 3), (4, 0, 7)]:
        with pytest.raises(ValueError, match=r"poses: .*\(n, links, 7\).* is wanted, and the shape .* is given"):
            crowd.posed(np.zeros(shape, dtype=np.float32))
    with pytest.raises(ValueError, match="the body has 8 links, and poses of 7 are given"):
        crowd.posed(np.zeros((4, 7, 7), dtype=np.float32))
    with pytest.raises(ValueError, match="by columns"):
        crowd.posed(np.zeros((4, 8, 3, 4), dtype=np.float32), order="column")
    with pytest.raises(ValueError, match="'row' or 'column'"):
        crowd.posed(poses, order="C")
    with pytest.raises(ValueError, match="only matrices"):
        crowd.posed(poses, has_scale=True)
    for name, bad, words in [
        ("origins", np.zeros((5, 3)), r"the shape \(5, 3\) is given; here it must be \(4, 3\)"),
        ("origins", np.zeros(12), r"\(12,\)"),
        ("orientations", np.zeros((4, 3), dtype=np.float32), r"\(4, 4\)"),
        ("layers", np.ones(3, dtype=np.uint32), r"\(4,\)"),
        ("moved", np.ones((4, 1), dtype=bool), r"\(4,\)"),
        ("bounds", np.zeros((4, 6), dtype=np.float32), r"\(4, 2, 3\)"),
        ("instances", [-1], "range"),
    ]:
        with pytest.raises(ValueError, match=words):
            crowd.posed(poses, **{name: bad})


def test_strides_that_cannot_be_walked_are_a_value_error(rng, crowd):
    poses = random_poses(rng, 8, 8)
    rows = matrices_of(poses).astype(np.float32)
    unaligned = np.zeros((8, 8), dtype=np.dtype([("flag", "u1"), ("pose", "f4", 7)]))["pose"]
    for bad, words in [
        (poses[::-1], "instances are -224 bytes apart"),
        (poses[:, ::-1], "links are -28 bytes apart"),
        (np.broadcast_to(poses[:1], (8, 8, 7)), "instances are 0 bytes apart"),
        (np.ascontiguousarray(poses.transpose(2, 0, 1)).transpose(1, 2, 0), "side by side"),
        (np.ascontiguousarray(poses.transpose(1, 0, 2)).transpose(1, 0, 2), "instances are 28 bytes apart"),
        (np.zeros((8, 8, 14), dtype=np.float32)[..., ::2], "side by side"),
        (rows[..., ::-1, :], "side by side"),
        (unaligned, "multiple of its number's size"),
    ]:
        with pytest.raises(ValueError, match=words):
            crowd.posed(bad)
    with pytest.raises(ValueError, match="ascontiguousarray"):
        crowd.posed(poses, origins=np.zeros((8, 6))[:, ::2])


def test_arrays_live_as_long_as_what_was_posed(rng, crowd):
    poses = random_poses(rng, 2000, 8)
    origins = rng.uniform(-20, 20, (2000, 3))
    expected = crowd._world.run(poses, origins=origins).hits
    assert len(expected) > 100
    posed = crowd.posed(poses.copy(), origins=origins.copy())
    junk = [np.full((2000, 8, 7), np.nan, dtype=np.float32) for _ in range(8)]
    more = [np.full((2000, 3), np.nan) for _ in range(8)]
    assert np.array_equal(crowd._world.run(posed).hits, expected)
    assert len(junk) == len(more)


def test_structures_that_do_not_lie_as_in_c_are_a_value_error(chain):
    world = cab.World()
    world.add(chain, 1)
    for start, call in [
        (2, lambda pairs: world.contacts(pairs)),
        (4, lambda queries: world._engine.run_queries([], [], queries, np.empty(0, cab._queries._cab.query_plane_dtype),
                                                      "none", False, 0, False)),
    ]:
        dtype = cab.HIT if start == 2 else cab.QUERY
        memory = np.zeros(2 * dtype.itemsize + 16, dtype=np.uint8)
        skipped = start + -memory.ctypes.data % 8
        moved = memory[skipped : skipped + dtype.itemsize].view(dtype)
        assert moved.ctypes.data % 8 == start
        with pytest.raises(ValueError, match="multiple"):
            call(moved)
