"""Worlds: the hits are those of NumPy and of C++, and characters come, go, rest and grow."""

import threading
import warnings

import numpy as np
import pytest

import cab
from conftest import ROOT, make_chain, matrices_of, random_poses, rounds, separation

# Boxes are padded by a few units in the last place of float; whoever is nearer to touching than this is left open.
UNDECIDED = 1e-4


def pairs_of(hits):
    """Hits as a set of tuples, without leaves."""
    return set(map(tuple, hits[["batch_a", "instance_a", "link_a", "batch_b", "instance_b", "link_b"]].tolist()))


def brute_force(body, poses, origins, slot):
    """All pairs of links by fifteen axes in double: those that touch, and those that are too near to say."""
    boxes, links = body.boxes, body.box_links
    matrices = matrices_of(poses)
    placed = []
    for instance in range(len(poses)):
        for box, link in zip(boxes, links):
            rotation, place = matrices[instance, link, :3, :3], matrices[instance, link, :3, 3]
            center = rotation @ box["center"] + place + origins[instance]
            placed.append((instance, int(link), center, (rotation @ box["axis"].T).T, box["half"].astype(float)))
    touch, open_pairs = set(), set()
    for k, a in enumerate(placed):
        for b in placed[k + 1 :]:
            if a[:2] == b[:2]:
                continue
            gap = separation(*a[2:], *b[2:])
            key = (slot, a[0], a[1], slot, b[0], b[1])
            if abs(gap) < UNDECIDED:
                open_pairs.add(key)
            elif gap < 0:
                touch.add(key)
    return touch, open_pairs


def test_hits_are_those_of_brute_force_in_numpy(rng):
    body = make_chain(4)
    found = 0
    for _ in range(rounds(6)):
        world = cab.World()
        crowd = world.add(body, 6)
        poses = random_poses(rng, 6, 4, 1)
        origins = rng.uniform(-1.5, 1.5, (6, 3))
        frame = world.run(poses, origins=origins, within=True)
        touch, open_pairs = brute_force(body, poses, origins, crowd.slot)
        hits = pairs_of(frame.hits)
        assert hits - open_pairs == touch - open_pairs
        assert frame.stats.instances_masked == 0
        found += len(hits)
    assert found > 20


def golden_hash(isa):
    """The golden 300 frames of tests/embed/golden/golden.cpp."""
    state, value = 1, 14695981039346656037
    world = cab.World(isa=isa)
    world.add(make_chain(8), 64)
    index = np.arange(64)
    origins = np.stack([1.5 * (index % 8), 1.5 * (index // 8), np.zeros(64)], 1)
    fields = {field.name: list(field.values) for field in cab.policy_table()}
    count = 64 * 8 * 7
    for frame in range(300):
        numbers = np.empty(count, dtype=np.int64)
        for k in range(count):
            state = (state * 1664525 + 1013904223) & 0xFFFFFFFF
            numbers[k] = (state >> 16) - 32768
        poses = (numbers / 32768).astype(np.float32).reshape(64, 8, 7)
        poses[..., 4:] *= 2
        exact = "convex" if frame % 3 == 2 else "none"
        policies = cab.Policies(
            refit=fields["refit"][frame % len(fields["refit"])],
            strategy=fields["strategy"][frame % 4],
            extents=fields["extents"][frame % 2],
            exact=exact,
        )
        result = world.run(poses, origins=origins, within=True, policies=policies)
        words = [np.array([len(result.hits)], dtype=np.uint32)]
        columns = [
            result.hits[name].astype(np.uint32)
            for name in ("batch_a", "instance_a", "batch_b", "instance_b", "link_a", "link_b")
        ]
        if result.contacts is not None:
            columns.append(np.ascontiguousarray(result.contacts["depth"]).view(np.uint32))
        words.append(np.stack(columns, 1).reshape(-1))
        for byte in np.concatenate(words).astype("<u4").tobytes():
            value = ((value ^ byte) * 1099511628211) & 0xFFFFFFFFFFFFFFFF
    return f"{value:016x}"


def test_the_golden_300_frames_have_the_hash_of_every_language():
    expected = (ROOT / "tests/embed/golden/expected.txt").read_text().split()[-1]
    assert golden_hash("auto") == expected


def test_formats_of_poses_give_the_same_hits(rng):
    world = cab.World()
    world.add(make_chain(4), 50)
    poses = random_poses(rng, 50, 4)
    rows = matrices_of(poses).astype(np.float32)
    expected = pairs_of(world.run(poses, within=True).hits)
    assert len(expected) > 50
    columns = np.ascontiguousarray(np.swapaxes(rows, -1, -2))
    for given, order in [
        (rows, "row"),
        (np.ascontiguousarray(rows[..., :3, :]), "row"),
        (columns, "column"),
        (np.swapaxes(columns, -1, -2), "row"),
        (np.swapaxes(rows, -1, -2), "column"),
    ]:
        found = pairs_of(world.run(given, within=True, order=order).hits)
        # Matrices are rounded otherwise than quaternions, so a pair at the limit may be on its other side.
        assert len(found ^ expected) <= 1, (given.shape, given.strides, order)


def test_matrices_by_columns_are_not_taken_for_rows_in_silence(rng):
    world = cab.World()
    world.add(make_chain(2), 3)
    columns = np.ascontiguousarray(np.swapaxes(matrices_of(random_poses(rng, 3, 2)).astype(np.float32), -1, -2))
    with pytest.raises(ValueError, match='order="column"'):
        world.run(columns)
    world.run(columns, order="column")


def path_of(places):
    """A frame per place along x, of one link that never turns: matrices by rows."""
    rows = np.tile(np.eye(4, dtype=np.float32), (len(places), 1, 1, 1))
    rows[:, 0, 0, 3] = places
    return rows


def test_a_path_that_begins_at_the_identity_is_not_taken_for_the_other_order():
    body = cab.Body.from_boxes([-1], [[0.1] * 3])
    world = cab.World()
    crowd = world.add(body, 4)
    rows = path_of([0, 0, 5, 9])
    columns = np.ascontiguousarray(np.swapaxes(rows, -1, -2))
    for given in (columns, np.swapaxes(rows, -1, -2)):
        for call in (world.run, crowd.posed, lambda poses: cab.Clip(body, poses)):
            with pytest.raises(ValueError, match='poses: the last row .* pose 2, link 0 .* 5 0 0 1; say order='):
                call(given)
        assert len(world.run(given, order="column").hits) == 1
    for given in (rows, np.swapaxes(columns, -1, -2)):
        with pytest.raises(ValueError, match='poses: the last column .* pose 2, link 0 .* 5 0 0 1; order="column"'):
            crowd.posed(given, order="column")
        assert len(world.run(given).hits) == 1


def test_a_last_row_must_be_0_0_0_1_but_for_rounding():
    world = cab.World()
    crowd = world.add(cab.Body.from_boxes([-1], [[0.1] * 3]), 2)
    rows = path_of([0, 5])
    for last in ([0, 0, 0, 2], [0, 0, 0, 0], [1, 0, 0, 1], [0, 1e-3, 0, 1], [0, 0, 0, 1.001]):
        rows[:, :, 3] = last
        with pytest.raises(ValueError, match="the last row of the matrix of pose 0, link 0 must be 0 0 0 1"):
            crowd.posed(rows)
        with pytest.raises(ValueError, match="the last column of the matrix of pose 0, link 0 must be 0 0 0 1"):
            crowd.posed(np.swapaxes(rows, -1, -2), order="column")
    rows[:, :, 3] = [-0.0, 0, -0.0, 1 - 1e-6]
    rows[1, :, 3] = [1e-6, 0, -1e-6, 1 + 1e-6]
    crowd.posed(rows)
    crowd.posed(np.swapaxes(rows, -1, -2), order="column")


def test_a_bad_matrix_masks_its_own_character_whatever_its_last_row(rng):
    world = cab.World()
    crowd = world.add(make_chain(2), 20)
    rows = matrices_of(random_poses(rng, 20, 2, 1)).astype(np.float32)
    expected = world.run(rows, instances=np.arange(3, 20)).hits
    assert len(expected) > 5
    rows[0], rows[1], rows[2] = 0, np.nan, rng.uniform(-1, 1, (2, 4, 4))
    for given, order in [(rows, "row"), (np.ascontiguousarray(np.swapaxes(rows, -1, -2)), "column")]:
        posed = crowd.posed(given, order=order)
        with pytest.warns(cab.MaskedWarning):
            frame = world.run(posed)
        assert np.flatnonzero(posed.flags).tolist() == [0, 1, 2]
        assert pairs_of(frame.hits) == pairs_of(expected)


def test_the_order_is_told_by_characters_that_are_there():
    world = cab.World()
    crowd = world.add(cab.Body.from_boxes([-1], [[0.1] * 3]), 3)
    rows = path_of([0, 0, 5])
    rows[1, 0, 3, 0] = 7  # as an array has that nobody has filled
    crowd.posed(rows, instances=[0, 2])
    crowd.posed(rows, instances=[])
    with pytest.raises(ValueError, match="pose 1, link 0"):
        crowd.posed(rows, instances=[0, 1])


def test_overflow_of_hits_grows_and_retries(chain):
    world = cab.World()
    world.add(chain, 40)
    poses = np.zeros((40, 8, 7), dtype=np.float32)
    poses[..., 3] = 1
    frame = world.run(poses)  # all in one place: far more hits than there is room for at first
    assert len(frame.hits) == 40 * 39 // 2 * 64
    assert frame.hits.base is None and frame.hits.flags.owndata


def test_characters_grow_and_go(rng, chain):
    world = cab.World()
    crowd = world.add(chain, 10)
    poses = random_poses(rng, 30, 8)
    few = world.run(poses[:10]).hits
    with pytest.raises(ValueError, match="room for 10 characters"):
        world.run(poses)
    crowd.grow(30)
    assert crowd.room == 30
    many = world.run(poses).hits
    assert np.array_equal(world.run(poses[:10]).hits, few)
    old = many[(many["instance_a"] < 10) & (many["instance_b"] < 10)]
    assert pairs_of(old) == pairs_of(few)
    listed = world.run(poses, instances=np.arange(10)).hits
    assert np.array_equal(listed, few)
    assert len(world.run(poses, instances=[]).hits) == 0

    dogs = world.add(make_chain(3), 5)
    with pytest.raises(ValueError, match="2 batches"):
        world.run(poses)
    both = world.run([crowd.posed(poses), dogs.posed(random_poses(rng, 5, 3))])
    assert set(both.hits["batch_b"].tolist()) == {crowd.slot, dogs.slot}
    assert world.batch_of(dogs.slot) is dogs
    world.remove(dogs)
    assert world.batches == (crowd,)
    assert np.array_equal(world.run(poses).hits, many)
    with pytest.raises(cab.InputError) as caught:
        world.run([crowd.posed(poses), dogs.posed(random_poses(rng, 5, 3))])
    assert caught.value.status == cab.Status.UNKNOWN_BATCH


def test_rests_scales_layers_and_margins(rng, chain):
    world = cab.World()
    world.add(chain, 60)
    poses = random_poses(rng, 60, 8)
    origins = rng.uniform(-6, 6, (60, 3))
    everything = world.run(poses, origins=origins).hits
    still = np.zeros(60, dtype=bool)
    world.run(poses, origins=origins, moved=still)
    rested = world.run(poses, origins=origins, moved=still)
    assert rested.stats.instances_resting == 60
    assert np.array_equal(rested.hits, everything)
    world.run(poses, origins=origins, moved=still, resting="skipped")
    assert len(world.run(poses, origins=origins, moved=still, resting="skipped").hits) == 0 < len(everything)

    layers = np.array([1, 2] * 30, dtype=np.uint32)
    odd = world.run(poses, origins=origins, layers=layers, layer_masks=layers).hits
    assert pairs_of(odd) == {p for p in pairs_of(everything) if p[1] % 2 == p[4] % 2}

    near = world.run(poses, origins=origins, margin=0.3).hits
    own = world.run(poses, origins=origins, margins=np.full(60, 0.15, dtype=np.float32)).hits
    assert pairs_of(everything) < pairs_of(near) == pairs_of(own)

    half = world.run(poses, origins=origins, scales=np.full(60, 0.5, dtype=np.float32)).hits
    small = poses.copy()
    assert len(half) < len(everything)
    twice = world.run(small, origins=origins * 2, scales=np.full(60, 2, dtype=np.float32)).hits
    assert len(pairs_of(twice) ^ pairs_of(everything)) <= 1


def test_static_bodies_are_hit(chain):
    world = cab.World()
    crowd = world.add(chain, 1)
    floor = world.add_static(
        [[5, 5, 1]], center=[[0, 0, -1]], shapes=[cab.Shape.half_space()], vertices=[[3, 0, 0], [3, 1, 0], [3, 0, 1]],
        triangles=[[0, 1, 2]],
    )
    poses = np.zeros((1, 8, 7), dtype=np.float32)
    poses[..., 3] = 1
    poses[..., 4] = np.arange(8)
    poses[..., 6] = 0.1
    hits = world.run(poses, exact="convex").hits
    by_floor = hits[hits["instance_b"] == 0]
    assert by_floor["link_a"].tolist() == list(range(6))  # the floor's box ends at x = 5
    assert set(hits["batch_b"].tolist()) == {floor.slot}
    assert 3 in hits[hits["instance_b"] == 1]["link_a"]
    assert crowd.slot != floor.slot


def test_contacts_have_depth_and_normal():
    body = cab.Body.from_boxes([-1], [[0.5, 0.5, 0.5]], shapes=[cab.Shape.sphere(0.5)])
    world = cab.World()
    world.add(body, 2)
    poses = np.zeros((2, 1, 7), dtype=np.float32)
    poses[..., 3] = 1
    frame = world.run(poses, origins=np.array([[0, 0, 0], [0.8, 0, 0]]), exact="convex")
    assert len(frame.hits) == 1
    assert frame.contacts["depth"][0] == pytest.approx(0.2, abs=1e-6)
    assert frame.contacts["normal"][0] == pytest.approx([1, 0, 0], abs=1e-6)
    assert len(world.run(poses, origins=np.array([[0, 0, 0], [0.8, 0, 0]]), exact="convex", min_depth=0.3).hits) == 0
    pair = np.zeros(1, dtype=cab.HIT)
    pair["batch_a"] = pair["batch_b"] = frame.hits["batch_a"]
    pair["instance_b"] = 1
    apart = world.contacts(pair, poses, origins=np.array([[0, 0, 0], [3.0, 0, 0]]))
    assert apart["depth"][0] == pytest.approx(-2, abs=1e-5)


def test_reports_of_contact_and_distances(rng, chain):
    world = cab.World()
    crowd = world.add(chain, 20)
    poses = random_poses(rng, 20, 8)
    origins = rng.uniform(-4, 4, (20, 3))
    hits = world.run(poses, origins=origins).hits
    touched = np.zeros(20, dtype=bool)
    touched[hits["instance_a"]] = touched[hits["instance_b"]] = True
    frame = world.run(poses, origins=origins, report="in_contact")
    assert np.array_equal(frame.posed[0].in_contact, touched)
    assert len(frame.hits) == 0
    frame = world.run([crowd.posed(poses, origins=origins, in_contact=True)])
    assert np.array_equal(frame.posed[0].in_contact, touched)
    near = world.run(poses, origins=origins, report="distances", margin=2, exact="convex")
    keys = near.hits[["instance_a", "instance_b"]].tolist()
    assert len(keys) == len(set(keys)) > 0
    assert near.contacts["depth"].min() >= -2 - 1e-4


def test_the_lock_is_released_in_frames(rng):
    body = make_chain(16)
    world = cab.World()
    world.add(body, 3000)
    poses = random_poses(rng, 3000, 16)
    origins = rng.uniform(-30, 30, (3000, 3))
    inside, stop, seen = threading.Event(), threading.Event(), 0

    def watch():
        # Another thread that runs at all while the call is in the engine: it meets an engine that is busy.
        nonlocal seen
        inside.wait()
        while not stop.is_set():
            try:
                world.spatial_order(world.batches[0])
            except cab.BusyError as error:
                assert error.status == cab.Status.BUSY
                seen += 1

    thread = threading.Thread(target=watch)
    thread.start()
    try:
        inside.set()
        for _ in range(200):
            while True:
                try:
                    world.run(poses, origins=origins)
                    break
                except cab.BusyError:
                    pass
            if seen:
                break
    finally:
        stop.set()
        thread.join()
    assert seen > 0


def test_every_instruction_set_and_thread_count_gives_the_same_hits(rng, chain):
    poses = random_poses(rng, 100, 8)
    origins = rng.uniform(-5, 5, (100, 3))
    expected = None
    for isa in cab.isas():
        for threads in (1, 2):
            with cab.World(isa=isa, threads=threads) as world:
                assert world.isa == isa
                world.add(chain, 100)
                hits = world.run(poses, origins=origins).hits
            expected = hits if expected is None else expected
            assert np.array_equal(hits, expected)


def test_boxes_order_and_sweeps(rng, chain):
    world = cab.World()
    crowd = world.add(chain, 30)
    poses = random_poses(rng, 30, 8)
    posed = crowd.posed(poses)
    world.run(posed)
    boxes = world.boxes(posed)
    assert boxes.shape == (30, 15)
    expected = matrices_of(poses)[..., :3, 3] + matrices_of(poses)[..., :3, 0] / 2
    assert np.abs(boxes["center"][:, :8] - expected).max() < 1e-5
    assert sorted(world.spatial_order(crowd).tolist()) == list(range(30))
    later = poses.copy()
    later[..., 4] += 1
    now = crowd.posed(later)
    margins = world.sweep_margins(posed, now)
    assert margins.shape == (30,) and (margins >= 1).all()
    frame = world.run(crowd.posed(later, margins=margins))
    moments = world.touching_moments([posed], [now], frame.hits, 1e-3)
    assert len(moments) == len(frame.hits)
    assert ((moments <= 1) | (moments == 2)).all() and (moments <= 1).any()


def test_two_frames_of_the_same_arrays_are_no_sweep():
    world = cab.World()
    balls = world.add(cab.Body.from_boxes([-1], [[0.1] * 3], shapes=[cab.Shape.sphere(0.1)]), 2)
    others = world.add(make_chain(1), 1)
    pose = random_poses(np.random.default_rng(1), 2, 1)
    pose[..., 4:] = 0
    origins = np.array([[-1.0, 0, 0], [0, 0, 0]])
    last = balls.posed(pose, origins=origins)
    before = balls.posed(pose, origins=origins.copy())
    origins[0, 0] += 2
    now = balls.posed(pose, origins=origins)
    other = [others.posed(pose[:1] + 0), others.posed(pose[:1] + 0)]
    none = np.empty(0, cab.HIT)
    words = f"last and now: .* slot {balls.slot} both have the same arrays.*keep a copy"
    for wrong in (last, now):
        with pytest.raises(ValueError, match=words):
            world.sweep_margins(wrong, now)
        with pytest.raises(ValueError, match=words):
            world.touching_moments([wrong], [now], none, 1e-3)
        assert len(world.touching_moments([other[0], wrong], [now, other[1]], none, 1e-3)) == 0
    assert world.sweep_margins(before, now)[0] >= 2
    assert len(world.touching_moments([before], [now], none, 1e-3)) == 0
    # One array of its own is enough, whichever moves; frames of one recording may overlap.
    turned = pose[:, 0, :4].copy()
    scales = np.full(2, 2, dtype=np.float32)
    path = np.repeat(pose[:1], 3, axis=0)
    path[:, 0, 4] = [0, 1, 2]
    for a, b in [
        (now, balls.posed(pose.copy(), origins=origins)),
        (now, balls.posed(pose, origins=origins, orientations=turned)),
        (now, balls.posed(pose, origins=origins, scales=scales)),
        (balls.posed(path[:2], origins=origins), balls.posed(path[1:], origins=origins)),
    ]:
        assert len(world.sweep_margins(a, b)) == 2


def test_memory_and_close(chain):
    world = cab.World()
    empty = world.memory.total
    crowd = world.add(chain, 1000)
    assert world.memory.batches > 0 and world.memory.total > empty
    world.remove(crowd)
    assert world.memory.batches == 0 and world.memory.articulations == 0
    world.close()
    with pytest.raises(ValueError, match="closed"):
        world.add(chain, 1)


def test_growth_that_is_refused_changes_nothing(rng, chain):
    world = cab.World()
    crowd = world.add(chain, 10)
    posed = crowd.posed(random_poses(rng, 10, 8))
    hits, slot = world.run(posed).hits, crowd.slot
    with pytest.raises(cab.InputError) as caught:
        crowd.grow(2**24 + 1)
    assert caught.value.status is cab.Status.TOO_MANY_INSTANCES
    for room in (10.5, 2**40):
        with pytest.raises(TypeError):
            crowd.grow(room)
    assert crowd.room == 10 and crowd.slot == slot and world.batches == (crowd,)
    assert np.array_equal(world.run(posed).hits, hits)  # what was posed is of use still
    crowd.grow(20)
    assert crowd.room == 20 and crowd.slot == slot
    with pytest.raises(cab.InputError):
        world.run(posed)


def test_a_batch_that_growth_has_lost_is_forgotten(chain, monkeypatch):
    world = cab.World()
    crowd = world.add(chain, 10)
    engine = world._engine

    class Losing:
        def __getattr__(self, name):
            return getattr(engine, name)

        def grow_batch(self, batch, articulation, room):
            engine.remove_batch(batch)
            raise cab.OutOfMemory(cab.Status.OUT_OF_MEMORY, "x")

    monkeypatch.setattr(world, "_engine", Losing())
    with pytest.raises(MemoryError):
        crowd.grow(20)
    assert world.batches == () and world.memory.articulations == 0


class BusyOnce:
    """An engine that another thread is in, for the first call of one name."""

    def __init__(self, engine, name):
        self._engine, self._name = engine, name

    def __getattr__(self, name):
        if name == self._name:
            self._name = ""
            raise cab.BusyError(cab.Status.BUSY, "another call on the same engine is running")
        return getattr(self._engine, name)


def test_a_busy_engine_leaves_no_half_of_a_change(rng, chain, monkeypatch):
    world = cab.World()
    first = world.add(chain, 3)
    engine = world._engine
    monkeypatch.setattr(world, "_engine", BusyOnce(engine, "remove_articulation"))
    world.remove(first)  # the body stays until the next change
    assert world.batches == () and engine.memory.articulations > 0
    one = engine.memory.articulations
    again = world.add(chain, 3)  # it is taken again
    assert engine.memory.articulations == one
    world.remove(again)
    assert engine.memory.articulations == 0
    monkeypatch.setattr(world, "_engine", BusyOnce(engine, "remove_articulation"))
    with pytest.raises(cab.InputError):
        world.add(chain, 0)
    assert engine.memory.articulations > 0
    world.remove(world.add(make_chain(2), 1))
    assert engine.memory.articulations == 0

    clip = cab.Clip(chain, random_poses(rng, 5, 8))
    other = random_poses(rng, 5, 8)
    expected = cab.Clip(chain, other)
    monkeypatch.setattr(clip, "_engine", BusyOnce(clip._engine, "remove_batch"))
    with pytest.raises(TypeError):
        clip.add(chain, other.astype("f8"))
    assert clip.add(chain, other) == 1
    rows = clip.hits(between=False)
    assert np.array_equal(rows[rows["a"] == 1]["link_b"], expected.hits()["link_b"]) and set(rows["a"]) == {0, 1}


def test_flags_and_boxes_are_of_those_that_are_listed_now(rng, chain):
    world = cab.World()
    crowd = world.add(chain, 4)
    poses = random_poses(rng, 4, 8)
    poses[2, 0, 0] = np.nan
    listed = np.array([0, 2], dtype=np.uint32)
    posed = crowd.posed(poses, instances=listed)
    with pytest.warns(cab.MaskedWarning, match="character 2"):
        world.run(posed)
    assert posed.flags.tolist() == [0, 0, 1, 0]
    listed[:] = [0, 1]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        frame = world.run(posed)
    assert posed.flags.tolist() == [0, 0, 0, 0] and len(frame.hits) > 0
    poses[1, 0, 0] = np.nan
    with pytest.warns(cab.MaskedWarning, match="character 1"):
        world.run(posed)
    assert posed.flags.tolist() == [0, 1, 0, 0]

    junk = [np.full(4 * 15 * 15, 7, dtype=np.float32) for _ in range(50)]  # what the boxes' memory was before
    del junk
    boxes = world.boxes(crowd.posed(random_poses(rng, 4, 8), instances=[0, 3]))
    assert (boxes["half"][[0, 3], :8] > 0).all()
    assert not boxes[1:3].tobytes().strip(b"\0")
    assert len(world.boxes(crowd.posed(poses, instances=[])).tobytes().strip(b"\0")) == 0


def test_a_frame_is_not_lost_when_the_reason_of_a_mask_is(rng, chain, monkeypatch):
    world = cab.World()
    crowd = world.add(chain, 6)
    poses = random_poses(rng, 6, 8)
    poses[3, 0, 0] = poses[5, 0, 0] = np.nan
    posed = crowd.posed(poses)
    engine = world._engine
    monkeypatch.setattr(world, "_engine", BusyOnce(engine, "why_masked"))
    with pytest.warns(cab.MaskedWarning, match="^batch 1, character 3 took no part; 1 more took no part$"):
        frame = world.run(posed, within=True)
    assert len(frame.hits) > 0
    monkeypatch.setattr(world, "_engine", BusyOnce(engine, "find_masked"))
    with pytest.warns(cab.MaskedWarning, match="^2 characters took no part$"):
        answers = world.query(cab.points([[0, 0, 0]]))
    assert answers.found.all()
    with pytest.warns(cab.MaskedWarning, match="character 3 took no part: .*; 1 more took no part$") as caught:
        world.query(cab.points([[0, 0, 0]]), crowd.posed(poses, instances=[0, 3, 5]))
    assert caught[0].filename == __file__
    clip = cab.Clip(chain, poses)
    monkeypatch.setattr(clip, "_engine", BusyOnce(clip._engine, "why_masked"))
    with pytest.warns(cab.MaskedWarning, match="^character 0, frame 3 took no part; 1 more"):
        assert len(clip.hits()) > 0


def test_arguments_without_effect_are_refused(rng, chain):
    world = cab.World()
    crowd = world.add(chain, 4)
    posed = crowd.posed(random_poses(rng, 4, 8))
    world.run(posed)
    pairs = np.empty(0, dtype=cab.HIT)
    history = world.add_history(crowd, 2)
    for call in [
        lambda: world.query(cab.points([[0, 0, 0]]), exakt="convex"),
        lambda: world.query(cab.points([[0, 0, 0]]), posed, exakt="convex"),
        lambda: world.contacts(pairs, exakt=1),
        lambda: world.contacts(pairs, origins=np.zeros((4, 3))),
        lambda: history.record(0.0, posed, exakt=1),
    ]:
        with pytest.raises(TypeError, match="exakt|origins"):
            call()
    assert history.span[0] == 0
    with pytest.raises(ValueError, match="in_contact=True"):
        world.run(posed, report="in_contact")


def test_overflow_with_contacts_and_in_contact(chain):
    poses = np.zeros((30, 8, 7), dtype=np.float32)
    poses[..., 3] = 1
    poses[..., 4] = np.arange(30)[:, None] * 0.01
    poses[29, :, 4] = 500
    world = cab.World()
    posed = world.add(chain, 30).posed(poses, in_contact=True)
    grown = world.run(posed, exact="convex")
    assert len(grown.hits) > 20_000 and len(grown.contacts) == len(grown.hits)
    assert posed.in_contact.tolist() == [True] * 29 + [False]
    again = world.run(posed, exact="convex")  # there is room now
    assert np.array_equal(again.hits, grown.hits)
    assert again.contacts.tobytes() == grown.contacts.tobytes()


def test_ignored_pairs_say_why():
    world = cab.World()
    crowd = world.add(make_chain(4, ignored_hops=1, ignored_pairs=[[0, 3], [1, 0]]), 1)
    assert world.ignored_pairs(crowd).tolist() == [(0, 1, 3), (0, 3, 1), (1, 2, 2), (2, 3, 2)]
    with pytest.raises(ValueError, match="static"):
        world.ignored_pairs(world.add_static([[1, 1, 1]]))
