"""What people read: results with names, and what objects print as."""

import numpy as np
import pytest

import cab
from conftest import make_chain

URDF = """<robot name="arm">
  <link name="base"><collision><geometry><box size="1 1 1"/></geometry></collision></link>
  <link name="rod"><collision><geometry><sphere radius="0.5"/></geometry></collision></link>
  <link name="hand"><collision><geometry><sphere radius="0.3"/></geometry></collision></link>
  <joint name="slide" type="prismatic"><parent link="base"/><child link="rod"/><axis xyz="1 0 0"/>
    <limit lower="0" upper="4" effort="1" velocity="1"/></joint>
  <joint name="turn" type="revolute"><parent link="rod"/><child link="hand"/><axis xyz="0 0 1"/>
    <origin xyz="-1 0 0"/><limit lower="0" upper="1" effort="1" velocity="1"/></joint>
</robot>
"""


@pytest.fixture
def robot(tmp_path):
    if not cab._cab.reads_files:
        pytest.skip("this build reads no files (CAB_PYTHON_FILES)")
    path = tmp_path / "arm.urdf"
    path.write_text(URDF)
    return cab.Robot(path)


def people(frames=3):
    """Two characters of two links, whose second links touch in all frames."""
    body = make_chain(2, names=["upper", "lower"], ignored_hops=1)
    poses = np.zeros((frames, 2, 7), dtype=np.float32)
    poses[..., 3] = 1
    poses[:, 1, 4] = 1
    return body, poses


def test_a_table_of_a_clip_has_names_and_every_other_column():
    body, poses = people()
    clip = cab.Clip(body, poses, name="Ada", fps=30)
    clip.add(cab.Body.from_boxes([-1], [[0.5, 0.5, 0.5]], names=["table"]), poses[:1, 1:], name="room")
    for rows in (clip.hits(), clip.intervals(), clip.distances(1)):
        table = clip.table(rows)
        assert list(table.columns) == list(rows.dtype.names) and len(table) == len(rows) > 0
        assert table["a"].tolist() == ["Ada"] * len(rows) and table["b"].tolist() == ["room"] * len(rows)
        assert table["link_a"].tolist() == [body.names[link] for link in rows["link_a"]]
        assert table["link_b"].tolist() == ["table"] * len(rows)
        for column in set(rows.dtype.names) - {"a", "b", "link_a", "link_b"}:
            assert np.array_equal(table[column], rows[column])
    assert next(iter(clip.table(clip.intervals())))[:4] == ("Ada", "upper", "room", "table")
    assert len(clip.table(clip.hits()[:0])) == 0


def test_a_table_is_printed_in_columns_and_cut_after_twenty_rows():
    table = cab.Table({
        "link": np.array(["a", "hand"] * 15), "depth": np.linspace(0, 0.29, 30), "normal": np.ones((30, 2)),
    })
    lines = str(table).split("\n")
    assert lines[:3] == ["link  depth  normal", "a         0  (1, 1)", "hand   0.01  (1, 1)"]
    assert len(lines) == 22 and lines[-1] == "... 10 more rows"
    assert repr(table) == str(table) and len(list(table)) == 30
    assert str(cab.Table({"link": np.array(["<b>"])})) == "link\n<b>"
    page = cab.Table({"link": np.array(["<b>"])})._repr_html_()
    assert "<td>&lt;b&gt;</td>" in page and "<th>link</th>" in page
    assert table._repr_html_().count("<tr>") == 21 and "10 more rows" in table._repr_html_()


def test_a_table_of_a_world_names_links_of_every_batch():
    body, poses = people(2)
    world = cab.World()
    gone = world.add(make_chain(3), 1)
    crowd = world.add(body, 2)
    world.remove(gone)
    floor = world.add_static([[9, 9, 1]], center=[[0, 0, -1]])
    other = world.add(cab.Body.from_boxes([-1], [[0.5, 0.5, 0.5]], names=["ball"]))
    both = [crowd.posed(poses, origins=[[0, 0, 0], [0, 9.5, 0]]), other.posed(poses[:1, 1:])]
    frame = world.run(both, exact="convex")
    table = world.table(frame)
    assert list(table.columns) == [
        "batch_a", "instance_a", "batch_b", "instance_b", "link_a", "link_b", "depth",
    ]
    assert np.array_equal(table["depth"], frame.contacts["depth"])
    names = {crowd.slot: body.names, other.slot: ("ball",), floor.slot: ("static",)}
    for side in "ab":
        assert table[f"link_{side}"].tolist() == [
            names[hit[f"batch_{side}"]][hit[f"link_{side}"]] for hit in frame.hits
        ]
    assert {"lower", "ball", "static"} <= {*table["link_a"], *table["link_b"]}
    assert "depth" not in world.table(frame.hits).columns and len(world.table(frame.hits[:1])) == 1
    answers = world.query(cab.rays([[1.5, 0, 5]], [0, 0, -1], want="all"))
    assert world.table(answers)["link"].tolist()[0] in ("lower", "ball")
    assert np.array_equal(world.table(answers.hits)["distance"], answers.hits["distance"])
    world.remove(other)
    with pytest.raises(KeyError):
        world.table(frame)


def test_a_table_of_a_robot_has_names_of_links_and_of_what_stands_around(robot):
    checker = cab.CollisionChecker(robot)
    checker.add_fixed(cab.Body.from_boxes([-1], [[0.1, 9, 9]], names=["wall"]), [[0, 0, 0, 1, 3, 0, 0]])
    checker.add_points([[9, 0, 0]], 0.1, name="cloud")
    hits = checker.hits({"slide": [1.2, 3, 3.5]})
    table = checker.table(hits)
    assert list(table.columns) == ["state", "link_a", "link_b", "depth"]
    assert list(zip(table["link_a"], table["link_b"])) == checker.names(hits)
    assert ("rod", "wall") in checker.names(hits) and ("base", "hand") in checker.names(hits)
    nearest = checker.table(checker.distances({"slide": 2}))
    assert list(nearest.columns) == ["distance", "link_a", "link_b", "normal", "point_a", "point_b"]
    assert nearest["normal"].shape == (1, 3) and "(" in str(nearest)
    allowed = robot.allowed_collisions()
    assert [row[:3] for row in robot.table(allowed)] == [("base", "rod", "adjacent"), ("rod", "hand", "adjacent")]
    assert robot.table(robot.hits({"slide": 1.2}))["link_b"].tolist() == ["hand"]
    assert len(checker.table(hits[:0])) == 0


def test_rows_of_another_checker_are_refused(robot):
    ball = cab.Body.from_boxes([-1], [[0.3, 0.3, 0.3]])
    holding = cab.CollisionChecker(robot, attached=[cab.Attached("hand", ball, [0, 0, 0, 1, -1, 0, 0], name="ball")])
    around = cab.CollisionChecker(robot)
    around.add_points([[9, 9, 9]], 0.1)
    around.add_fixed(cab.Body.from_boxes([-1, 0], [[0.1, 9, 9]] * 2), np.array([[0, 0, 0, 1, 3, 0, 0]] * 2))
    fewer = cab.CollisionChecker(robot)
    fewer.add_fixed(ball)
    fewer.add_fixed(ball)
    for rows, others in [(holding.hits([1.2, 0]), [robot, around]), (around.hits([3, 0]), [robot, holding, fewer])]:
        for other in others:
            with pytest.raises(ValueError, match=r"^rows\[\d\]: .* another checker, whose `table` takes them$"):
                other.table(rows)

def test_objects_say_what_they_are(robot):
    body, poses = people()
    world = cab.World()
    assert repr(world) == "cab.World(empty)"
    crowd = world.add(body, 3)
    world.add_static([[1, 1, 1]])
    posed = crowd.posed(poses)
    clip = cab.Clip(body, poses, name="Ada", fps=30)
    queries = cab.rays([[0, 0, 0]] * 2, [1, 0, 0]) + cab.points([[0, 0, 0]])
    frame = world.run(posed)
    for thing, words in [
        (body, "cab.Body(2 links, 2 boxes)"),
        (world, "cab.World(3 characters, 1 static bodies)"),
        (posed, "cab.Posed(3 of cab.Batch(slot 1, room for 3 characters of 2 links))"),
        (world.add_history(crowd, 4), "cab.History(of cab.Batch(slot 1, room for 3 characters of 2 links))"),
        (clip, "cab.Clip(3 frames at 30 per second: Ada)"),
        (cab.Clip(), "cab.Clip(1 frames at 30 per second: nobody)"),
        (queries, "cab.Queries(2 rays, 1 points)"),
        (cab.Shape.capsule(0.1, 0.25), "cab.Shape.capsule(0.1, 0.25)"),
        (cab.Shape.hull(np.eye(3)), "cab.Shape.hull(3 vertices)"),
        (robot, "cab.Robot(3 links, 2 variables)"),
        (cab.CollisionChecker(robot), "cab.CollisionChecker(3 links, 0 fixed)"),
    ]:
        assert repr(thing) == words
    assert repr(frame.stats).startswith(f"cab.FrameStats(candidates={frame.stats.candidates}, box_tests=")
    assert "seconds_total=" in repr(frame.stats) and "instances_masked" not in repr(frame.stats)
    assert f"total={world.memory.total})" in repr(world.memory)
    assert repr(world.query(queries).stats).startswith("cab.QueryStats(")
