"""What is sent to other processes: bodies, robots and what describes them are the same after a pickle."""

import pickle

import numpy as np
import pytest

import cab
from conftest import make_chain, random_poses
from test_bodies import URDF, box_skin
from test_surfaces import bent_poses, tube_skin


def again(thing):
    return pickle.loads(pickle.dumps(thing))


def all_kinds():
    return cab.Body.from_boxes(
        [-1, 0], [[1, 1, 1], [2, 2, 2]], center=[[0, 0, 0], [1, 0, 0]], joints=[[0, 0, 0], [-1, 0, 0]],
        shapes=[
            [cab.Shape.box([0.5] * 3, [0.1, 0, 0]), cab.Shape.ellipsoid([0.5, 0.4, 0.3]), cab.Shape.capsule(0.2, 0.3)],
            [
                cab.Shape.sphere(0.5), cab.Shape.cylinder(0.3, 0.5), cab.Shape.hull(np.eye(3) / 2),
                cab.Shape.half_space(),
            ],
        ],
        names=["upper", "lower"], ignored_pairs=[[0, 1]],
    )


def rest_pose(form):
    pose = np.zeros((4, 7), dtype=np.float32)
    pose[:, 3] = 1
    pose[:, 4] = 10 * np.arange(4)
    if form == "quaternions":
        return dict(rest_pose=pose)
    matrices = np.tile(np.eye(4, dtype=np.float32), (4, 1, 1))
    matrices[:, :3, 3] = pose[:, 4:]
    if form == "rows":
        return dict(rest_pose=matrices)
    return dict(rest_pose=np.ascontiguousarray(np.swapaxes(matrices, -1, -2)), order="column")


@pytest.mark.parametrize(
    "make",
    [
        lambda: make_chain(8, ignored_hops=2),
        all_kinds,
        lambda: make_chain(4, **rest_pose("quaternions")),
        lambda: make_chain(4, **rest_pose("rows")),
        lambda: make_chain(4, **rest_pose("columns")),
        lambda: cab.Body.from_boxes([-1, 0], [[1, 1, 1]], links=[1]),
        lambda: cab.Body.from_skin(**box_skin(), names=["a", "b"]).ignoring([[0, 1]]),
        lambda: cab.Body.from_surface(**tube_skin()),
    ],
)
def test_a_body_is_the_same_after_a_pickle(make):
    body = make()
    copy = again(body)
    assert type(copy) is type(body) and copy.names == body.names and copy.sha256() == body.sha256()
    assert again(copy).sha256() == body.sha256()


def test_a_body_that_is_another_has_another_digest_after_a_pickle():
    digests = {again(make_chain(4, **more)).sha256() for more in [{}, rest_pose("rows"), dict(ignored_hops=1)]}
    assert len(digests) == 3


def test_a_clip_of_a_pickled_body_has_the_same_hits(rng):
    body = all_kinds().ignoring()
    poses = random_poses(rng, 40, 2, 1)
    clips = [cab.Clip(one, poses) for one in (body, again(body))]
    for clip, one in zip(clips, (body, again(body))):
        clip.add(one, random_poses(np.random.default_rng(5), 40, 2, 1))
    first, second = (clip.hits() for clip in clips)
    assert len(first) > 20 and first.tobytes() == second.tobytes()


def test_a_pickled_skin_poses_links_and_finds_the_same_triangles(rng):
    body = cab.Body.from_surface(**tube_skin())
    copy = again(body)
    matrices = bent_poses(rng, 2)
    assert np.array_equal(copy.link_poses(matrices), body.link_poses(matrices))
    assert [a.tolist() for a in copy.source_triangles] == [a.tolist() for a in body.source_triangles]
    found = []
    for one in (body, copy):
        world = cab.World()
        world.add(one, 2)
        frame = world.run(one.link_poses(matrices), exact="surface")
        found.append(world.touching_triangles(frame.hits).tobytes())
    assert found[0] == found[1] and len(found[0]) > 0


def test_a_robot_is_read_again_after_a_pickle(tmp_path):
    if not cab._cab.reads_files:
        pytest.skip("this build reads no files (CAB_PYTHON_FILES)")
    path = tmp_path / "arm.urdf"
    path.write_text(URDF)
    robot = cab.Robot(path, leave_out_missing=True)
    copy = again(robot)
    assert copy.body.sha256() == robot.body.sha256() and copy.variables == robot.variables
    assert np.array_equal(copy.poses([[0.5]]), robot.poses([[0.5]]))
    data = pickle.dumps(robot)
    path.unlink()
    with pytest.raises(cab.FileError, match="no such file"):
        pickle.loads(data)


def test_small_things_are_the_same_after_a_pickle():
    for thing in (cab.Shape.hull(np.eye(3)), cab.rays([[0, 0, 0]], [1, 0, 0]), cab.spheres([[0, 0, 0]], 1)):
        assert repr(again(thing)) == repr(thing)
    assert again(cab.Policies(exact="convex")) == cab.Policies(exact="convex")
    queries = again(cab.points([[1, 2, 3]], 4))
    assert queries.array.tobytes() == cab.points([[1, 2, 3]], 4).array.tobytes()


def test_what_lives_in_an_engine_is_not_pickled(chain):
    for thing in (cab.World(), cab.Clip()):
        with pytest.raises(TypeError, match="pickle"):
            pickle.dumps(thing)


def test_a_pickle_of_a_body_that_does_not_fit_itself_is_an_error():
    call, (data, names) = make_chain(4, **rest_pose("rows")).__reduce__()
    state = list(data.__getstate__())
    for at, bad in [(8, (0, False, np.zeros(3, dtype=np.float32))), (3, state[3][:1]), (0, state[0].astype("f8"))]:
        with pytest.raises((TypeError, ValueError)):
            data.__class__.__new__(data.__class__).__setstate__(tuple([*state[:at], bad, *state[at + 1 :]]))
    assert call(data, names).names == names
