"""Bodies of skeletons, skins and files."""

import os
import pathlib
import pickle

import numpy as np
import pytest

import cab
from conftest import make_chain, random_poses

NAMES = ["hips", "spine", "head", "upperarm_l", "lowerarm_l", "hand_l", "thigh_l", "calf_l"]
PARENTS = [-1, 0, 1, 1, 3, 4, 0, 6]
PLACES = np.array(
    [[0, 0.9], [0, 1.4], [0, 1.5], [0.2, 1.4], [0.5, 1.4], [0.75, 1.4], [0.1, 0.9], [0.1, 0.5]], dtype=np.float32
)


def test_a_skeleton_becomes_a_person_of_human_size():
    places = np.concatenate([PLACES, np.zeros((8, 1), dtype=np.float32)], axis=1)
    body = cab.Body.from_skeleton(PARENTS, places, names=NAMES)
    assert body.names == tuple(NAMES) and body.link_count == 8 and len(body.box_links) >= 5
    assert 0.01 < body.boxes["half"].min() and body.boxes["half"].max() < 0.5
    poses = np.zeros((2, 8, 7), dtype=np.float32)
    poses[..., 3] = 1
    poses[..., 4:6] = PLACES
    world = cab.World()
    world.add(body, 2)
    hits = world.run(poses, origins=np.array([[0, 0, 0], [0.95, 0, 0]])).hits
    assert "hand_l" in {body.names[link] for link in hits["link_a"]}
    # The same from poses, and from a motion whose first frame is the rest pose.
    again = cab.Body.from_skeleton(PARENTS, poses[0], names=NAMES)
    moving = cab.Body.from_skeleton(PARENTS, np.concatenate([poses, poses]), names=NAMES)
    assert np.array_equal(body.boxes, again.boxes) and np.array_equal(body.boxes, moving.boxes)
    thick = cab.Body.from_skeleton(PARENTS, places, names=NAMES, thickness=2)
    assert thick.boxes["half"].sum() > body.boxes["half"].sum()
    assert len(body.ignored_pairs) > 0
    with pytest.raises(ValueError, match="nothing to make bodies of"):
        cab.Body.from_skeleton(PARENTS, np.zeros((8, 3)), names=NAMES)
    with pytest.raises(ValueError, match="parents"):
        cab.Body.from_skeleton([-1, 5], np.ones((2, 3)))
    with pytest.raises(ValueError, match="names"):
        cab.Body.from_skeleton(PARENTS, places, names=["a"])
    with pytest.raises(TypeError, match="poses"):
        cab.Body.from_skeleton(PARENTS, [[1, 2], [3]])


def box_skin():
    """Two boxes of vertices, each fixed to one of two joints that are 1 apart along x."""
    corners = np.array([[x, y, z] for x in (-0.4, 0.4) for y in (-0.1, 0.1) for z in (-0.1, 0.1)], dtype=np.float32)
    vertices = np.concatenate([corners, corners + [1, 0, 0]])
    bones = np.repeat([[0], [1]], 8, axis=0)
    rest = np.tile(np.eye(4, dtype=np.float32), (2, 1, 1))
    rest[1, 0, 3] = 1
    return dict(
        parents=[-1, 0], poses=rest, vertices=vertices, bones=bones, weights=np.ones((16, 1)),
        inverse_bind=np.linalg.inv(rest).astype(np.float32),
    )


def test_a_skin_becomes_a_body_about_its_vertices():
    skin = box_skin()
    body = cab.Body.from_skin(**skin, names=["upper", "lower"], kinds=["box", "hull"])
    assert body.names == ("upper", "lower") and body.joints.tolist() == [0, 1]
    assert np.allclose(np.sort(body.boxes["half"], axis=1), [[0.1, 0.1, 0.4]] * 2, atol=1e-4)
    matrices = np.stack([skin["poses"]] * 3)
    poses = body.link_poses(matrices)
    assert poses.shape == (3, 2, 7) and poses.dtype == np.float32
    assert np.allclose(poses[:, 1], [0, 0, 0, 1, 1, 0, 0])
    assert np.array_equal(body.link_poses(np.swapaxes(matrices, -1, -2), order="column"), poses)
    columns = {**skin, **{name: np.swapaxes(skin[name], -1, -2) for name in ("poses", "inverse_bind")}}
    by_columns = cab.Body.from_skin(**columns, kinds=["box"], order="column")
    assert np.array_equal(by_columns.boxes, cab.Body.from_skin(**skin, kinds=["box"]).boxes)
    cab.Clip(body, poses).hits()
    quiet = body.ignoring(hops=1)
    assert isinstance(quiet, cab.SkinnedBody) and quiet.names == body.names
    assert quiet.joints.tolist() == [0, 1] and np.array_equal(quiet.link_poses(matrices), poses)
    world = cab.World()
    assert len(world.ignored_pairs(world.add(quiet))) == 1
    with pytest.raises(ValueError, match="kinds"):
        cab.Body.from_skin(**skin, kinds=["cone"])
    with pytest.raises(ValueError, match="influences must be"):
        cab.Body.from_skin(**{**skin, "bones": skin["bones"] + 5})
    with pytest.raises(ValueError, match="no vertex has a weight"):
        cab.Body.from_skin(**{**skin, "weights": np.zeros((16, 1))})
    with pytest.raises(ValueError, match="weights"):
        cab.Body.from_skin(**{**skin, "weights": np.ones((15, 1))})


def test_a_box_is_fitted_about_vertices(rng):
    points = rng.uniform(-1, 1, (200, 3)) * [3, 1, 0.5] + [5, 0, 0]
    box = cab.fit_box(points)
    inside = np.abs((points - box.center) @ box.axes.T)
    assert (inside <= box.half + 1e-5).all()
    assert np.allclose(np.sort(box.half), [0.5, 1, 3], atol=0.2)


def test_ignored_pairs_are_not_tested(rng):
    chain = make_chain(8, ignored_pairs=[[0, 7]])
    more = chain.ignoring([[1, 5]], hops=1)
    poses = random_poses(rng, 300, 8, 0.5)
    def within(body):
        hits = cab.Clip(body, poses).hits(exact="none")
        return set(map(tuple, hits[["link_a", "link_b"]].tolist()))
    everything = within(make_chain(8))
    assert {(0, 7), (1, 5), (2, 3)} <= everything
    assert everything - within(chain) == {(0, 7)}
    assert everything - within(more) == {(0, 7), (1, 5), *((k, k + 1) for k in range(7))}
    pose = np.zeros((8, 7), dtype=np.float32)
    pose[:, 3] = 1
    pose[:, 4] = np.arange(8)
    at_rest = make_chain(8, rest_pose=pose)
    assert everything - within(at_rest) == {(k, k + 1) for k in range(7)}
    assert within(at_rest.ignoring()) == within(at_rest)
    assert within(make_chain(8, rest_pose=pose.tolist())) == within(at_rest)


def test_arguments_of_bodies_are_checked():
    for error, words, arguments in [
        (ValueError, "which link each box is on", dict(parents=[-1], half=[[1, 1, 1]] * 2)),
        (ValueError, "half", dict(parents=[-1], half=[1, 1, 1])),
        (TypeError, "half", dict(parents=[-1], half=[["a", "b", "c"]])),
        (TypeError, "parents", dict(parents=[0.5], half=[[1, 1, 1]])),
        (ValueError, "center", dict(parents=[-1], half=[[1, 1, 1]], center=[[0, 0]])),
        (ValueError, "axes", dict(parents=[-1], half=[[1, 1, 1]], axes=np.eye(3))),
        (ValueError, "joints", dict(parents=[-1], half=[[1, 1, 1]], joints=[[0, 0, 0]] * 2)),
        (ValueError, "names", dict(parents=[-1], half=[[1, 1, 1]], names=["a", "b"])),
        (ValueError, "shapes", dict(parents=[-1], half=[[1, 1, 1]], shapes=[None, None])),
        (TypeError, r"shapes\[0\]", dict(parents=[-1], half=[[1, 1, 1]], shapes=["ball"])),
        (ValueError, "ignored_pairs", dict(parents=[-1], half=[[1, 1, 1]], ignored_pairs=[1, 2, 3])),
    ]:
        with pytest.raises(error, match=words):
            cab.Body.from_boxes(**arguments)
    shapes = [
        cab.Shape.box([0.5] * 3), cab.Shape.ellipsoid([0.5] * 3), cab.Shape.capsule(0.2, 0.3), cab.Shape.sphere(0.5),
        cab.Shape.cylinder(0.3, 0.5), cab.Shape.hull(np.eye(3) / 2), cab.Shape.half_space(),
    ]
    body = cab.Body.from_boxes([-1], [[1, 1, 1]], shapes=[shapes])
    cab.World().add(body)
    assert [part[1] for part in body._data.parts] == [0, 1, 2, 4, 5, 3, 6]


URDF = """<robot name="arm">
  <link name="base"><collision><geometry><box size="1 1 1"/></geometry></collision></link>
  <link name="arm"><collision><geometry><sphere radius="0.5"/></geometry></collision></link>
  <joint name="slide" type="prismatic"><parent link="base"/><child link="arm"/><axis xyz="1 0 0"/>
    <limit lower="0" upper="4" effort="1" velocity="1"/></joint>
</robot>
"""


@pytest.fixture
def reads_files():
    if not cab._cab.reads_files:
        pytest.skip("this build reads no files (CAB_PYTHON_FILES)")


def test_a_robot_of_urdf_is_posed_by_its_joints(reads_files, tmp_path):
    path = tmp_path / "arm.urdf"
    path.write_text(URDF)
    robot = cab.Robot(path)
    assert robot.variables == (cab.Variable("slide", 0, 4, 0),)
    assert robot.body.names == ("base", "arm") and robot.rest().tolist() == [0]
    poses = robot.poses([[0.0], [0.9], [2.0]])
    assert poses[:, 1, 4] == pytest.approx([0, 0.9, 2])
    hits = cab.Clip(robot.body, poses, fps=1).hits()
    assert hits["frame"].tolist() == [0, 1]
    assert hits["depth"][1] == pytest.approx(0.1, abs=1e-5)
    states = robot.random_states(50, seed=3)
    assert states.shape == (50, 1) and states.min() >= 0 and states.max() <= 4
    assert np.array_equal(states[:10], robot.random_states(10, seed=3))
    assert np.array_equal(states[20:], robot.random_states(30, seed=3, first=20))
    assert robot.random_states(2, first=2**63).shape == (2, 1)
    assert robot.adjacent_pairs.tolist() == [[0, 1]]
    srdf = tmp_path / "arm.srdf"
    srdf.write_text('<robot name="arm"><disable_collisions link1="base" link2="arm" reason="Never"/></robot>')
    quiet = cab.Robot(path, srdf=srdf)
    assert quiet.body.ignored_pairs.tolist() == [[0, 1]]
    assert len(cab.Clip(quiet.body, poses).hits()) == 0
    with pytest.raises(ValueError, match="states"):
        robot.poses([[0.0, 1.0]])


def test_a_motion_file_is_a_body_with_poses(reads_files):
    files = list(pathlib.Path("/usr/share/assimp").rglob("01_01.bvh"))
    if not files:
        pytest.skip("the clip 01_01.bvh is not there (Debian: assimp-testmodels)")
    motion = cab.load_motion(files[0], units=0.0564)
    assert motion.poses.shape == (len(motion.origins), motion.body.link_count, 7)
    assert motion.fps == pytest.approx(120, rel=0.01)
    assert "Hips" in motion.body.names and "Head" in motion.body.names
    tall = (motion.poses[0, :, 4:] + motion.origins[0]).max(0) - (motion.poses[0, :, 4:] + motion.origins[0]).min(0)
    assert 1.2 < tall.max() < 2
    hits = cab.Clip(motion.body, motion.poses[:50], origins=motion.origins[:50], fps=motion.fps).hits()
    pairs = {(motion.body.names[hit["link_a"]], motion.body.names[hit["link_b"]]) for hit in hits}
    assert set(hits["frame"].tolist()) == set(range(50)) and ("Hips", "Spine") in pairs
    for animation in (0, "walk"):  # a number is taken as its digits are
        with pytest.raises(cab.FileError, match="without a name"):
            cab.load_motion(files[0], animation=animation)


def test_a_bad_file_is_an_error_that_names_file_line_and_reason(reads_files, tmp_path):
    with pytest.raises(cab.FileError, match="no file.bvh"):
        cab.load_motion(tmp_path / "no file.bvh")
    bad = tmp_path / "bad.bvh"
    bad.write_text("HIERARCHY\nROOT hips\n{\n  OFFSET 0 x 0\n}\n")
    with pytest.raises(cab.FileError, match=r"bad\.bvh: line 4.*x"):
        cab.load_motion(bad)
    robot = tmp_path / "bad.urdf"
    robot.write_text(URDF.replace('radius="0.5"', 'radius="-1"'))
    with pytest.raises(cab.FileError, match=r"bad\.urdf: line 3"):
        cab.Robot(robot)
    robot.write_text(URDF.replace("</robot>", ""))
    with pytest.raises(ValueError, match=r"bad\.urdf") as error:
        cab.Robot(robot)
    assert not error.value.is_machine
    assert pickle.loads(pickle.dumps(cab.FileError("killed", True))).is_machine


def test_paths_may_have_any_bytes(reads_files, tmp_path):
    name = os.fsencode(tmp_path) + b"/\xff\xfe.urdf"
    with open(name, "w", encoding="utf-8") as file:
        file.write(URDF)
    assert cab.Robot(name).body.names == cab.Robot(pathlib.Path(os.fsdecode(name))).body.names
    for path in (name + b".bvh", os.fsdecode(name + b".bvh"), pathlib.Path(os.fsdecode(name + b".bvh"))):
        with pytest.raises(cab.FileError, match=r"\?\?\.urdf\.bvh: no such file"):
            cab.load_motion(path)
    for path in ("a\0b.bvh", b"a\0b.bvh"):
        with pytest.raises(ValueError, match="null"):
            cab.load_motion(path)
    with pytest.raises(TypeError):
        cab.load_motion(3)


def test_companions_are_the_files_that_are_read_with_a_file(reads_files, tmp_path):
    file = os.fsdecode(os.fsencode(tmp_path) + b"/\xff.gltf")
    with open(file, "w", encoding="utf-8") as out:
        out.write('{"buffers": [{"uri": "a%20b.bin"}, {"uri": "data:,"}, {"uri": "../c.bin"}]}')
    assert cab.companion_files(file) == [str(tmp_path / "a b.bin")]
    assert cab.MAX_FILE_BYTES == 256 << 20
    with pytest.raises(cab.FileError, match="no such file"):
        cab.companion_files(tmp_path / "none.amc")


def test_a_path_that_holds_a_null_character_is_refused_not_cut(reads_files):
    for call in [
        lambda: cab.load_motion("walk.bvh\0.txt"),
        lambda: cab.load_motion("walk.asf", motion="walk\0.amc"),
        lambda: cab.load_motion("walk.fbx", animation="run\0ning"),
        lambda: cab.Robot("arm.urdf\0"),
        lambda: cab.Robot("arm.urdf", srdf="arm.srdf\0"),
        lambda: cab.Robot("arm.urdf", packages={"arm\0": "."}),
        lambda: cab.Robot("arm.urdf", packages={"arm": ".\0"}),
    ]:
        with pytest.raises(ValueError, match="null character"):
            call()
