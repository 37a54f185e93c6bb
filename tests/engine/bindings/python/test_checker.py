"""CollisionChecker: states of robots, beside the clip of their poses and the command's matrix."""

import json
import os
import pathlib
import pickle
import re
import subprocess
import sys
import threading

import numpy as np
import pytest

import cab
from conftest import rounds

ARM = """<robot name="arm">
  <link name="base"><collision><geometry><box size="1 1 1"/></geometry></collision></link>
  <link name="upper"><collision><origin xyz="0 0 1"/><geometry><cylinder radius="0.1" length="2"/></geometry>
    </collision></link>
  <link name="lower"><collision><origin xyz="0 0 0.75"/><geometry><cylinder radius="0.1" length="1.5"/></geometry>
    </collision></link>
  <link name="hand"><collision><geometry><sphere radius="0.2"/></geometry></collision></link>
  <joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/><origin xyz="0 0 0.6"/>
    <axis xyz="1 0 0"/><limit lower="-3" upper="3" effort="1" velocity="1"/></joint>
  <joint name="elbow" type="revolute"><parent link="upper"/><child link="lower"/><origin xyz="0 0 2"/>
    <axis xyz="1 0 0"/><limit lower="-3" upper="3" effort="1" velocity="1"/></joint>
  <joint name="wrist" type="fixed"><parent link="lower"/><child link="hand"/><origin xyz="0 0 1.6"/></joint>
</robot>
"""


@pytest.fixture
def arm(tmp_path):
    if not cab._cab.reads_files:
        pytest.skip("this build reads no files (CAB_PYTHON_FILES)")
    path = tmp_path / "arm.urdf"
    path.write_text(ARM)
    return cab.Robot(path)


def table():
    return cab.Body.from_boxes([-1], [[5, 5, 0.05]])


def test_states_collide_where_a_clip_of_their_poses_has_hits(arm):
    states = arm.random_states(3000, seed=5)
    allowed = arm.allowed_collisions()
    body = arm.body.ignoring(np.stack((allowed["a"], allowed["b"]), axis=1))
    expected = cab.Clip(body, arm.poses(states)).hits()
    assert 100 < len(set(expected["frame"])) < 2900
    assert np.flatnonzero(arm.collides(states)).tolist() == sorted(set(expected["frame"].tolist()))
    hits = arm.hits(states, depths=True)
    assert hits.dtype == cab.STATE_HIT
    for ours, theirs in [("state", "frame"), ("link_a", "link_a"), ("link_b", "link_b"), ("depth", "depth")]:
        assert np.array_equal(hits[ours], expected[theirs])
    assert set(hits["fixed"]) == {-1}
    assert np.isnan(arm.hits(states)["depth"]).all()
    assert arm.collides(states[:1]).tolist() == [len(expected) > 0 and expected["frame"][0] == 0]
    assert arm.collides(np.empty((0, 2))).shape == (0,)
    assert arm.collides(states.tolist()).tolist() == arm.collides(np.asfortranarray(states)).tolist()


def test_fixed_bodies_and_a_margin_count(arm):
    checker = cab.CollisionChecker(arm, threads=2)
    upright = [[0.0, 0.0]]
    assert not checker.collides(upright)[0]
    checker.add_fixed(table(), [[0, 0, 0, 1, 0, 0, 9]])
    checker.add_fixed(table(), [[0, 0, 0, 1, 0, 0, 4.3]])
    assert checker.collides(upright)[0]
    hits = checker.hits(upright, depths=True)
    assert arm.body.names[hits["link_a"][0]] == "hand"
    assert (hits["fixed"].tolist(), hits["link_b"].tolist()) == ([1], [0])
    assert hits["depth"][0] == pytest.approx(4.4 - 4.25, abs=1e-4)
    close = cab.CollisionChecker(arm, ignored=[], margin=0.05)
    assert close.collides(upright)[0]  # the upper arm stands 0.1 above the base, but elbow and hand touch as built
    near = cab.CollisionChecker(arm, margin=0.5)
    near.add_fixed(table(), [[0, 0, 0, 1, 0, 0, 4.75]])
    assert near.collides(upright)[0]
    assert near.hits(upright, depths=True)["depth"][0] == pytest.approx(-0.3, abs=1e-4)


# Seven joints by turns about z and y, as those of the Panda, with cylinders and balls.
LENGTHS = [0.333, 0.0, 0.316, 0.0, 0.384, 0.0, 0.2]


def seven_joints(tmp_path):
    links = ["""<link name="l0"><collision><geometry><box size="0.2 0.2 0.1"/></geometry></collision></link>"""]
    for i, length in enumerate(LENGTHS):
        cylinder = f'<origin xyz="0 0 {length / 2}"/><geometry><cylinder radius="0.06" length="{length}"/></geometry>'
        shape = cylinder if length else '<geometry><sphere radius="0.08"/></geometry>'
        below = LENGTHS[i - 1] if i else 0.1
        links.append(
            f"""<link name="l{i + 1}"><collision>{shape}</collision></link>
            <joint name="j{i + 1}" type="revolute"><parent link="l{i}"/><child link="l{i + 1}"/>
            <origin xyz="0 0 {below}"/><axis xyz="{'0 0 1' if i % 2 == 0 else '0 1 0'}"/>
            <limit lower="-2.8" upper="2.8" effort="1" velocity="1"/></joint>"""
        )
    path = tmp_path / "seven.urdf"
    path.write_text('<robot name="seven">' + "".join(links) + "</robot>")
    return cab.Robot(path)


def test_padding_is_what_distances_of_plain_links_ask_for(tmp_path):
    if not cab._cab.reads_files:
        pytest.skip("this build reads no files (CAB_PYTHON_FILES)")
    robot = seven_joints(tmp_path)
    states = robot.random_states(1000, seed=2)
    padding = {"l1": 0.03, "l4": 0.05, "l7": 0.1}
    points = np.random.default_rng(1).uniform(-1, 1, (50, 3))
    points = points[np.hypot(points[:, 0], points[:, 1]) > 0.3]  # l1 turns in place
    key = ["state", "fixed", "link_a", "link_b"]

    def checker_of(**options):
        checker = cab.CollisionChecker(robot, **options)
        checker.add_fixed(cab.Body.from_boxes([-1], [[2, 0.2, 0.05]]), [[0, 0, 0, 1, 0, 0.6, 0.5]])
        checker.add_points(points, 0.02)
        return checker

    plain, padded, within = checker_of(), checker_of(padding=padding), checker_of(margin=0.18)
    rows = padded.hits(states)[key].tolist()
    found = set(rows)
    assert [row[0] for row in rows] == sorted(row[0] for row in rows)
    itself = {row for row in plain.hits(states)[key].tolist() if row[1] < 0}
    assert {row for row in found if row[1] < 0} == itself and len(itself) > 50
    by = [padding.get(name, 0.0) for name in robot.body.names]
    near = apart = 0
    for *row, depth in within.hits(states, depths=True).tolist():
        if row[1] < 0:
            continue
        if -depth <= by[row[2]] - 1e-6:
            near += depth < 0
            assert tuple(row) in found
        elif -depth > 1.42 * by[row[2]] + 1e-5:  # at the rims of cylinders
            apart += 1
            assert tuple(row) not in found
    assert near > 50 and apart > 50
    assert padded.collides(states).tolist() == np.isin(np.arange(1000), [row[0] for row in rows]).tolist()
    assert (padded.clearance(states, 0.5) <= plain.clearance(states, 0.5) + 1e-6).all()

    starts = states[~padded.collides(states)][:100]
    ends = starts + 0.05 * (states[: len(starts)] - starts)
    edges = padded.edges(starts, ends)
    steps = np.linspace(0, 1, 65)[None, :, None]
    sampled = padded.collides((starts[:, None] + steps * (ends - starts)[:, None]).reshape(-1, 7))
    assert not (sampled.reshape(len(starts), -1).any(axis=1) & edges["free"]).any()
    assert 5 < edges["free"].sum() < len(starts)


def test_padding_is_a_number_for_all_links_or_numbers_by_name(arm):
    upright = [[0.0, 0.0]]
    for padding, colliding in [(0, False), (0.1, True), ({"hand": 0.1}, True), ({"base": 0.1}, False), ({}, False)]:
        checker = cab.CollisionChecker(arm, padding=padding)
        checker.add_fixed(table(), [[0, 0, 0, 1, 0, 0, 4.5]])  # 0.05 above the hand
        assert checker.collides(upright)[0] == colliding
        expected = 0.05 - (0.1 if colliding else 0)
        assert checker.distances(upright)["distance"][0] == pytest.approx(expected, abs=1e-4)
    with pytest.raises(ValueError, match="padding: the robot has no link 'arm'"):
        cab.CollisionChecker(arm, padding={"arm": 0.1})
    for wrong in (-1.0, np.nan, np.inf):
        with pytest.raises(ValueError, match="padding: .* of link 'hand' is not a length"):
            cab.CollisionChecker(arm, padding={"hand": wrong})
    with pytest.raises(ValueError, match="padding: .* of link 'base' is not a length"):
        cab.CollisionChecker(arm, padding=-0.1)


def turned(pose, by):
    """The pose `by` in the frame of `pose`, both (7,)."""
    x, y, z, w = pose[:4]
    turn = np.array([[w, -z, y, x], [z, w, -x, y], [-y, x, w, z], [-x, -y, -z, w]])  # of the product with by's, x y z w
    matrix = np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ])
    return np.concatenate((turn @ by[:4], pose[4:] + matrix @ by[4:]))


def test_an_object_in_the_hand_touches_what_stands_where_it_is(tmp_path):
    if not cab._cab.reads_files:
        pytest.skip("this build reads no files (CAB_PYTHON_FILES)")
    robot = seven_joints(tmp_path)
    names = robot.body.names
    states = robot.random_states(300, seed=6)
    box = cab.Body.from_boxes(
        [-1], [[0.05, 0.3, 0.1], [0.1, 0.1, 0.1]], center=[[0, 0, 0], [0, 0, 0.2]], links=[0, 0],
        shapes=[None, cab.Shape.sphere(0.1, [0, 0, 0.2])],
    )
    pose = np.array([0.1, 0.7, -0.1, 0.7, 0.05, 0.1, 0.3])
    pose[:4] /= np.linalg.norm(pose[:4])
    shelf, shelf_pose = cab.Body.from_boxes([-1], [[0.4, 0.4, 0.05]]), [[0, 0, 0, 1, 0.5, 0, 0.6]]
    held = cab.Attached("l7", box, pose=np.r_[3 * pose[:4], pose[4:]], touching=["l6", "l5"], name="box")
    checker, plain = cab.CollisionChecker(robot, attached=[held]), cab.CollisionChecker(robot)
    for one in (checker, plain):
        one.add_fixed(shelf, shelf_pose)
    hits = checker.hits(states, depths=True)
    own = hits[(hits["link_a"] != len(names)) & ((hits["link_b"] != len(names)) | (hits["fixed"] >= 0))]
    assert np.array_equal(own, plain.hits(states, depths=True))
    assert {name for pair in checker.names(hits) for name in pair} >= {"box", "l2"}

    # In each state the object stands still for a robot alone; the shelf, too, is tested against it.
    frames, expected = robot.poses(states).astype("f8"), []
    of_links = of_shelf = 0
    for i, state in enumerate(states):
        there = turned(frames[i, names.index("l7")], pose)
        one = cab.CollisionChecker(robot, ignored=[(a, b) for b in range(len(names)) for a in range(b)])
        one.add_fixed(box, [there])
        rows = [(i, -1, a, len(names), d) for _, _, a, _, d in one.hits([state], depths=True).tolist()]
        rows = [row for row in rows if names[row[2]] not in ("l5", "l6", "l7")]
        of_links += len(rows)
        world = cab.World()
        a, b = world.add(box, 1), world.add(shelf, 1)
        frame = world.run(
            [a.posed(there[None, None].astype("f4")), b.posed(np.array([shelf_pose], "f4"))], pairs=[(a, b)],
            exact="convex", contacts=True,
        )
        rows += [(i, 0, len(names), 0, d) for d in frame.contacts["depth"].tolist()]
        of_shelf += len(frame.hits)
        expected += rows
    found = hits[(hits["link_a"] == len(names)) | ((hits["link_b"] == len(names)) & (hits["fixed"] < 0))]
    assert of_links > 30 and of_shelf > 30
    for ours, theirs in [(found.tolist(), expected), (expected, found.tolist())]:
        rows = {row[:4] for row in theirs}
        assert not [row for row in ours if row[4] > 1e-5 and row[:4] not in rows]
    assert np.flatnonzero(checker.collides(states)).tolist() == sorted(set(hits["state"].tolist()))
    assert (checker.clearance(states) <= plain.clearance(states) + 1e-6).all()

    # Motions that are free are free of the object too.
    starts = states[~checker.collides(states)][:100]
    ends = starts + 0.1 * (states[: len(starts)] - starts)
    free = checker.edges(starts, ends)["free"]
    steps = np.linspace(0, 1, 65)[None, :, None]
    sampled = checker.collides((starts[:, None] + steps * (ends - starts)[:, None]).reshape(-1, 7))
    assert not (sampled.reshape(len(starts), -1).any(axis=1) & free).any()
    assert 5 < free.sum() < plain.edges(starts, ends)["free"].sum()


def stick(length=0.5):
    return cab.Body.from_boxes([-1], [[0.05, 0.05, length]])


def test_objects_are_named_and_padded_as_the_link_that_holds_them(arm):
    upright = [[0.0, 0.0]]
    on_hand = [0, 0, 0, 1, 0, 0, 0.75]
    held = cab.Attached("hand", stick(), on_hand, name="stick")
    beside = cab.Attached("hand", stick(), [0, 0, 0, 1, 0.05, 0, 0.75], name="beside")
    tip = cab.Attached("stick", stick(0.1), [0, 0, 0, 1, 0, 0, 0.6], touching=["beside"], name="tip")
    for padding, own in [(0, 0), (0.1, 0.1), ({"hand": 0.1}, 0.1), ({"hand": 0.1, "stick": 0.2}, 0.2),
                         ({"tip": 0.15}, 0.15), ({"hand": 0.1, "stick": 0, "beside": 0}, 0), ({"base": 1}, 0)]:
        checker = cab.CollisionChecker(arm, attached=[held, beside, tip], padding=padding)
        checker.add_fixed(table(), [[0, 0, 0, 1, 0, 0, 5.95]])
        row = checker.distances(upright)
        # The tip ends 0.75 + 0.6 + 0.1 above the hand at 4.2.
        assert row["distance"][0] == pytest.approx(5.9 - 5.65 - own, abs=1e-4)
        assert checker.names(row) == [("tip", "link 0")]
    # Where the elbow is bent all three reach into the base. What one link holds does not count, nor what may touch.
    names = set(checker.names(checker.hits(arm.random_states(2000, seed=1))))
    assert {pair for pair in names if pair[1] in ("stick", "beside", "tip")} >= {
        ("base", "stick"), ("base", "beside"), ("base", "tip")}
    assert not names & {("hand", "stick"), ("hand", "beside"), ("stick", "beside"), ("stick", "tip"), ("beside", "tip")}
    # The tip is held by the stick, not by the hand.
    other = cab.Attached("hand", stick(), [0, 0, 0, 1, 0.05, 0, 1.35], name="other")
    for touching, colliding in [([], True), (["tip"], False)]:
        attached = [held, tip._replace(touching=()), other._replace(touching=touching)]
        assert cab.CollisionChecker(arm, attached=attached).collides(upright)[0] == colliding


@pytest.mark.parametrize(
    "held, error, words",
    [
        (dict(link="claw"), ValueError, "attached 'box': the robot has no link 'claw'"),
        (dict(touching=["base", "claw"]), ValueError, "attached 'box': the robot has no link 'claw'"),
        (dict(touching="base"), TypeError, "attached 'box': touching is a list"),
        (dict(name="hand"), ValueError, "attached 'hand': there is a link"),
        (dict(pose=[0, 0, 0, 1]), ValueError, "attached 'box', pose: .*\\(7,\\)"),
        (dict(pose=[0, 0, 0, 0, 1, 2, 3]), ValueError, "attached 'box': pose is no quaternion"),
        (dict(pose=[0, 0, 0, 1, 0, np.nan, 0]), ValueError, "attached 'box': pose is no quaternion"),
        (dict(body=cab.Body.from_boxes([-1, 0], [[1, 1, 1]] * 2)), ValueError, "attached 'box': a body of one link"),
        (dict(body=cab.Body.from_boxes([-1], [[1, 1, 1]] * 1024, links=[0] * 1024)), cab.InputError,
         "attached 'box': .* 1024 leaves"),
    ],
)
def test_what_no_link_can_hold_is_an_error_that_names_it(arm, held, error, words):
    right = dict(link="hand", body=stick(), name="box")
    with pytest.raises(error, match=words):
        cab.CollisionChecker(arm, attached=[cab.Attached(**{**right, **held})])


def test_attached_is_a_list_of_objects_with_names_of_their_own(arm):
    box = cab.Attached("hand", stick())
    with pytest.raises(TypeError, match="attached: a list of cab.Attached is wanted, and str is in it"):
        cab.CollisionChecker(arm, attached=box)
    with pytest.raises(ValueError, match="attached 'object': there is a link or an object of that name"):
        cab.CollisionChecker(arm, attached=[box, box])
    with pytest.raises(ValueError, match="attached 'object': the robot has no link 'later'"):
        cab.CollisionChecker(arm, attached=[box._replace(touching=["later"]), box._replace(name="later")])
    with pytest.raises(cab.InputError, match="ignored_pairs"):
        cab.CollisionChecker(arm, attached=[box], ignored=[(0, 4)])


def test_edges_are_free_where_no_state_collides(arm):
    checker = cab.CollisionChecker(arm)
    checker.add_fixed(table(), [[0, 0, 0, 1, 0, 0, 4.4]])
    starts, ends = arm.random_states(300, seed=3), arm.random_states(300, seed=4)
    edges = checker.edges(starts, ends, first=True)
    assert edges.dtype == cab.EDGE
    steps = np.linspace(0, 1, 129)[None, :, None]
    states = starts[:, None] + steps * (ends - starts)[:, None]
    sampled = checker.collides(states.reshape(-1, 2)).reshape(300, -1).any(axis=1)
    assert not (sampled & edges["free"]).any() and 20 < edges["free"].sum() < 280
    assert np.isnan(edges["moment"][edges["free"]]).all()
    first = np.where(edges["free"], 2, edges["moment"])[:, None]
    before = steps[..., 0] < first
    assert not (checker.collides(states.reshape(-1, 2)).reshape(300, -1) & before).any()
    assert 20 < edges["colliding"].sum()
    assert np.array_equal(checker.edges(starts, ends)["free"], edges["free"])
    assert arm.edges([[0.0, 0.0]], [[0.1, 0.1]])["free"].tolist() == [True]
    with pytest.raises(ValueError, match="as many states"):
        checker.edges(starts, ends[:5])
    with pytest.raises(ValueError, match=r"starts\[0\]"):
        checker.edges([[np.inf, 0]], [[0, 0]])
    for resolution in (0, -1, np.nan, np.inf, 1.1e18):
        with pytest.raises(cab.InputError, match=f"^resolution: {re.escape(str(float(resolution)))} is not a length"):
            checker.edges(starts, ends, resolution=resolution)


def test_what_is_allowed_is_what_the_command_finds(arm, tmp_path):
    command = os.environ.get("CAB_COMMAND")
    if not command:
        pytest.skip("the command is not built")
    out = tmp_path / "matrix.json"
    file = tmp_path / "arm.urdf"
    subprocess.run([command, "robot", file, "--samples", "500", "--seed", "7", "--json", out], check=False)
    masked = json.loads(out.read_text())["masked"]
    allowed = arm.allowed_collisions(500, 7)
    names = arm.body.names
    assert len(allowed) > 0 and allowed.dtype == cab.ALLOWED_COLLISION
    assert [(names[a], names[b], why) for a, b, why, _ in allowed.tolist()] == [
        (pair["link_a"], pair["link_b"], pair["reason"]) for pair in masked
    ]
    assert {"adjacent"} <= set(allowed["reason"])
    assert len(arm.allowed_collisions(0)) < len(allowed) or "never" not in allowed["reason"]


@pytest.fixture
def hoist(tmp_path):
    """A tool that its limits keep 5 mm above a plate, so that they touch in no state."""
    if not cab._cab.reads_files:
        pytest.skip("this build reads no files (CAB_PYTHON_FILES)")

    def box(name, size):
        shape = f'<collision><geometry><box size="{size}"/></geometry></collision>'
        return f'<link name="{name}">{shape if size else ""}</link>'

    def slide(name, parent, child, axis, height, lower, upper):
        return (
            f'<joint name="{name}" type="prismatic"><parent link="{parent}"/><child link="{child}"/>'
            f'<origin xyz="0 0 {height}"/><axis xyz="{axis}"/>'
            f'<limit lower="{lower}" upper="{upper}" effort="1" velocity="1"/></joint>'
        )

    path = tmp_path / "hoist.urdf"
    path.write_text(
        f'<robot name="hoist">{box("plate", "1 1 .1")}{box("cart", ".1 .1 .1")}{box("tool", ".1 .1 .1")}'
        f'{slide("x", "plate", "cart", "1 0 0", 2, -.3, .3)}{slide("z", "cart", "tool", "0 0 1", -1.5, -.395, 0)}'
        "</robot>"
    )
    return cab.Robot(path)


def test_links_that_touch_in_no_sample_have_margins_and_distances(hoist):
    assert hoist.allowed_collisions().tolist() == [
        (0, 1, "adjacent", 0), (0, 2, "never", 0), (1, 2, "adjacent", 0)
    ]
    assert [row[2] for row in hoist.allowed_collisions(margin=0.02).tolist()] == ["adjacent"] * 2
    low = [[0.1, -0.395], [0.1, -0.3]]
    assert hoist.clearance(low) == pytest.approx([0.005, 0.1], abs=1e-6)
    assert hoist.distances(low[0])["link_b"].tolist() == [2]
    assert not hoist.collides(low).any()
    near = cab.CollisionChecker(hoist, margin=0.02)
    assert near.collides(low).tolist() == [True, False]
    assert not near.edges([0.1, 0.0], low[0])["free"][0]
    # Beyond the limits, where the tool is 2 cm in the plate.
    beyond = cab.CollisionChecker(hoist, ignored=hoist.adjacent_pairs)
    assert beyond.collides([[0.1, -0.42]]).all()
    with pytest.raises(cab.InputError, match="margin"):
        hoist.allowed_collisions(margin=-1)


def test_links_that_are_within_a_margin_at_rest_alone_are_tested_with_it(hoist, tmp_path):
    text = (tmp_path / "hoist.urdf").read_text()
    for old, new in [('lower="-0.395" upper="0"', 'lower="0" upper="1e6"'), ("0 0 -1.5", "0 0 -1.895")]:
        assert text.count(old) == 1
        text = text.replace(old, new)
    (tmp_path / "tall.urdf").write_text(text)
    tall = cab.Robot(tmp_path / "tall.urdf")
    assert [row[2] for row in tall.allowed_collisions(1000).tolist()] == ["adjacent", "never", "adjacent"]
    assert [row[2] for row in tall.allowed_collisions(1000, margin=0.02).tolist()] == ["adjacent"] * 2
    assert cab.CollisionChecker(tall, margin=0.02).collides(tall.rest()).all()


def test_what_is_added_before_and_after_distances_counts_in_all_calls(hoist):
    checker = cab.CollisionChecker(hoist)
    low = [[0.1, -0.395]]
    points = np.array([[0.155, 0.0, 0.105]])
    checker.add_points(points, 0.002, name="beside")
    points[:] = 9
    nearest = checker.distances(low)
    assert (nearest["distance"], checker.names(nearest)) == (pytest.approx([0.003], abs=1e-6), [("tool", "beside 0")])
    checker.add_fixed(table(), [[0, 0, 0, 1, 0, 0, 0.206]])
    nearest = checker.distances(low)
    assert nearest["distance"] == pytest.approx([0.001], abs=1e-6)
    assert nearest["fixed"].tolist() == [1]
    assert checker.clearance([[0.1, -0.39]]) == pytest.approx([-0.004], abs=1e-6)
    assert checker.hits([[0.1, -0.39]])["fixed"].tolist() == [1]


def test_an_srdf_file_is_all_that_is_allowed(arm, tmp_path):
    srdf = tmp_path / "arm.srdf"
    srdf.write_text('<robot name="arm"><disable_collisions link1="base" link2="hand" reason="Never"/></robot>')
    allowed = cab.Robot(tmp_path / "arm.urdf", srdf=srdf).allowed_collisions()
    assert [(a, b, why) for a, b, why, _ in allowed.tolist()] == [(0, 3, "file")]


def test_states_are_given_as_arrays_one_alone_or_by_names(arm):
    elbows = np.linspace(-3, 3, 50)
    states = np.stack((np.full(50, 0.5), elbows), axis=1)
    expected = arm.collides(states)
    assert 0 < expected.sum() < 50
    by_names = {"elbow": elbows, "shoulder": 0.5}
    assert arm.states(by_names).dtype == np.float64 and np.array_equal(arm.states(by_names), states)
    assert np.array_equal(arm.collides(by_names), expected)
    assert np.array_equal(arm.poses(by_names), arm.poses(states))
    assert np.array_equal(arm.states({"elbow": [1, 2]}), [[0, 1], [0, 2]])
    assert np.array_equal(arm.states({}), [arm.rest()])
    for one in (states[3], states[3].tolist(), tuple(states[3])):
        assert arm.collides(one).tolist() == [expected[3]]
    assert arm.edges({"elbow": -1}, {"elbow": 1}).shape == (1,)
    for words, bad in [
        ("no variable 'ellbow'; it has shoulder, elbow", {"ellbow": 1}),
        ("one number or 3 are wanted, and 2 are given", {"elbow": [1, 2, 3], "shoulder": [1, 2]}),
        (r"states\['elbow'\]", {"elbow": [[1]]}),
        ("states", 1.0),
    ]:
        with pytest.raises(ValueError, match=words):
            arm.states(bad)


def test_states_with_a_mask_are_refused_however_they_are_given(arm):
    masked = np.ma.masked_array([0.0, 2.9], mask=[False, True])
    two = np.ma.vstack([masked, masked])
    for name, bad in [("states['elbow']", {"elbow": masked}), ("states", masked), ("states", two)]:
        for call in (arm.states, arm.collides):
            with pytest.raises(TypeError, match=f"^{re.escape(name)}: a masked array"):
                call(bad)


def test_no_states_have_no_answers_however_they_are_given(arm):
    for none in ([], (), np.empty((0, 2)), {"elbow": []}, {"elbow": np.empty(0), "shoulder": 0.5}):
        assert arm.states(none).shape == (0, 2)
        assert arm.collides(none).shape == arm.hits(none).shape == arm.clearance(none).shape == (0,)
        assert arm.edges(none, none).shape == (0,) and arm.poses(none).shape == (0, len(arm.body.names), 7)
    with pytest.raises(ValueError, match="one number or 2 are wanted, and 0 are given"):
        arm.states({"elbow": [], "shoulder": [1, 2]})


@pytest.mark.parametrize("apart, touches", [(0.5, True), (3, False)])
def test_a_robot_without_variables_has_states_without_numbers(tmp_path, apart, touches):
    if not cab._cab.reads_files:
        pytest.skip("this build reads no files (CAB_PYTHON_FILES)")
    shape = '<collision><geometry><box size="1 1 1"/></geometry></collision>'
    (tmp_path / "still.urdf").write_text(
        f'<robot name="still"><link name="a">{shape}</link><link name="b">{shape}</link><joint name="j" type="fixed">'
        f'<parent link="a"/><child link="b"/><origin xyz="{apart} 0 0"/></joint></robot>'
    )
    robot = cab.Robot(tmp_path / "still.urdf")
    checker = cab.CollisionChecker(robot, ignored=np.empty((0, 2), dtype=np.uint32))
    assert robot.variables == ()
    for states, count in (([], 0), ((), 0), ({}, 1), ([robot.rest()], 1), ([[], []], 2), (np.empty((40, 0)), 40)):
        assert robot.states(states).shape == (count, 0) and robot.states(states).dtype == np.float64
        assert checker.collides(states).tolist() == [touches] * count
        assert len(checker.hits(states)) == count * touches
        assert robot.poses(states).shape == (count, 2, 7)


def test_what_is_not_tested_or_no_state_is_an_error(arm):
    states = np.zeros((2000, 2))
    states[1900, 1] = np.nan
    for call in (arm.collides, arm.hits):
        with pytest.raises(ValueError, match=r"states\[1900\]: a number is not finite"):
            call(states)
        with pytest.raises(ValueError, match="states"):
            call([[0.0]])
        with pytest.raises(TypeError, match="states"):
            call([["a", "b"]])
    checker = cab.CollisionChecker(arm)
    with pytest.raises(ValueError, match="poses"):
        checker.add_fixed(table(), [[0, 0, 0, 1, 0, 0]])
    with pytest.raises(cab.InputError, match="poses"):
        checker.add_fixed(table(), [[0, 0, 0, 0, 0, 0, 0]])
    with pytest.raises(cab.InputError, match="margin"):
        cab.CollisionChecker(arm, margin=-1).collides([[0.0, 0.0]])
    with pytest.raises(ValueError, match="isa"):
        cab.CollisionChecker(arm, isa="z80")
    assert checker.isa in cab.isas() and checker.threads == 1


def test_threads_share_a_checker(arm):
    states = arm.random_states(500)
    expected = arm.collides(states).tolist()
    answers = [None] * 8

    def ask(k):
        answers[k] = arm.collides(states).tolist()

    threads = [threading.Thread(target=ask, args=(k,)) for k in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert answers == [expected] * 8


def often_switched(calls):
    """Runs calls in a thread each, which the interpreter switches between as often as it can. Raises what they do."""
    failed = []

    def run(call):
        try:
            call()
        except Exception as error:
            failed.append(error)

    before = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    try:
        threads = [threading.Thread(target=run, args=(call,)) for call in calls]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
    finally:
        sys.setswitchinterval(before)
    if failed:
        raise failed[0]


def test_hits_beside_a_thread_that_adds_points_name_what_is_touched(arm):
    states = np.zeros((64, 2))
    points = [[50, 0, 0]] * 7 + [[0, 0, 1.5]]  # the last one is in the upper arm
    for _ in range(rounds(15)):
        checker = cab.CollisionChecker(arm)
        wrong, done = set(), []

        def add():
            try:
                for _ in range(40):
                    checker.add_points(points, 0.05, name="cloud")
            finally:
                done.append(True)

        def look():
            while not done:
                wrong.update(set(checker.names(checker.hits(states))) - {("upper", "cloud 7")})

        often_switched([add, look, look, look])
        assert not wrong


def test_threads_that_add_at_once_keep_the_names_of_each(arm):
    for _ in range(rounds(200)):
        checker = cab.CollisionChecker(arm)
        often_switched([
            lambda: checker.add_points([[50, 0, 0]], 0.05, name="cloud"),
            lambda: checker.add_fixed(table(), [[0, 0, 0, 1, 0, 0, 4.3]]),
        ])
        assert checker.names(checker.hits([0, 0])) == [("hand", "link 0")]


def test_all_pairs_of_the_panda_robot():
    data = os.environ.get("CAB_DATA_DIR")
    path = pathlib.Path(data or "") / "robots/panda_description"
    if not data or not path.exists() or not cab._cab.reads_files:
        pytest.skip("the Panda is not there (CAB_DATA_DIR)")
    robot = cab.Robot(path / "urdf/panda.urdf", packages={"example-robot-data": data}, srdf=path / "srdf/panda.srdf")
    states = robot.random_states(2000)
    hits = cab.Clip(robot.body, robot.poses(states)).hits(depths=False)
    assert np.flatnonzero(robot.collides(states)).tolist() == sorted(set(hits["frame"].tolist()))


def test_distances_are_those_of_a_clip_and_name_their_links(arm):
    states = arm.random_states(500, seed=9)
    allowed = arm.allowed_collisions()
    body = arm.body.ignoring(np.stack((allowed["a"], allowed["b"]), axis=1))
    expected = cab.Clip(body, arm.poses(states)).distances(0.8, within=True)
    rows = arm.distances(states, 0.8)
    assert rows.dtype == cab.NEAREST and rows.shape == (500,)
    near = np.isfinite(rows["distance"])
    assert 50 < near.sum() < 450
    assert np.array_equal(np.flatnonzero(near), expected["frame"])
    for name in ("link_a", "link_b", "distance"):
        assert np.array_equal(rows[name][near], expected[name])
    assert (rows["fixed"][near] == -1).all()
    found = rows[near]
    gap = found["point_b"] - found["point_a"] - found["distance"][:, None] * found["normal"]
    assert np.abs(gap).max() < 1e-4
    assert np.array_equal(arm.clearance(states, 0.8), rows["distance"])
    assert (arm.clearance(states, 0.4) <= 1).sum() < near.sum()

    checker = cab.CollisionChecker(arm)
    checker.add_fixed(table(), [[0, 0, 0, 1, 0, 0, -1.5]])
    rows = checker.distances(states, 5)
    names = checker.names(rows)
    assert len(names) == 500
    for (a, b), row in zip(names, rows):
        assert a == arm.body.names[row["link_a"]]
        assert b == (table().names if row["fixed"] == 0 else arm.body.names)[row["link_b"]]
    assert {row["fixed"] for row in rows} == {-1, 0}
    assert checker.names(checker.hits(states)[:3]) != []


def test_gradients_are_the_differences_of_distances(arm):
    checker = cab.CollisionChecker(arm)
    checker.add_fixed(table(), [[0, 0, 0, 1, 0, 0, -1]])
    states = arm.random_states(300, seed=2)
    rows, slopes = checker.distances(states, 4, gradients=True)
    assert slopes.shape == states.shape and slopes.dtype == np.float64
    step = 1e-3
    compared = 0
    for v in range(states.shape[1]):
        moved = [checker.distances(states + sign * step * np.eye(2)[v], 4) for sign in (1, -1)]
        # Where the same links stay nearest and their points move smoothly.
        same = np.isfinite(rows["distance"])
        for other in moved:
            same &= np.isfinite(other["distance"])
            for name in ("fixed", "link_a", "link_b"):
                same &= other[name] == rows[name]
            same &= np.linalg.norm(other["point_a"] - rows["point_a"], axis=1) < 0.02
            same &= np.linalg.norm(other["normal"] - rows["normal"], axis=1) < 0.02
        difference = (moved[0]["distance"] - moved[1]["distance"]) / (2 * step)
        assert np.allclose(slopes[same, v], difference[same], atol=0.02)
        compared += (same & (np.abs(difference) > 0.1)).sum()
    assert compared > 100
    assert not slopes[~np.isfinite(rows["distance"])].any()


def test_distances_refuse_what_they_cannot_take(arm):
    with pytest.raises(ValueError, match=r"states\[1\]: a number is not finite"):
        arm.distances([[0, 0], [float("nan"), 0]])
    with pytest.raises(ValueError, match=r"states: .*\(n, 2\)"):
        arm.clearance([[0, 0, 0]])
    for most in (-1.0, 1.1e18, np.inf, np.nan):
        words = f"most: {most} is not a length from 0 to 1e18 metres"
        with pytest.raises(cab.InputError, match=f"^{re.escape(words)}$"):
            arm.clearance([[0, 0]], most)
    assert arm.distances(np.empty((0, 2))).shape == (0,)
    rows, slopes = arm.distances(np.empty((0, 2)), gradients=True)
    assert rows.shape == (0,) and slopes.shape == (0, 2)


def test_points_are_balls_of_their_radius(arm):
    rng = np.random.default_rng(4)
    points = (rng.uniform(-1, 1, (200, 3)) * [0.15, 4, 4]).astype("f4")  # about the plane of the arm
    points = points[np.abs(points).max(axis=1) > 0.7]  # not in its base
    count = len(points)
    states = arm.random_states(400, seed=3)
    checker = cab.CollisionChecker(arm)
    checker.add_fixed(table(), [[0, 0, 0, 1, 0, 0, -1.5]])
    checker.add_points(points, 0.05, name="cloud")
    hits = checker.hits(states, depths=True)
    assert (np.diff(hits["state"].astype(int)) >= 0).all()
    touched = hits[hits["fixed"] == 1]
    assert len(touched) > 50 and len(set(touched["link_b"])) > 20
    assert np.flatnonzero(checker.collides(states)).tolist() == sorted(set(hits["state"].tolist()))
    assert checker.names(touched[:1])[0][1] == f"cloud {touched['link_b'][0]}"

    # The same as bodies of their own.
    other = cab.CollisionChecker(arm)
    other.add_fixed(table(), [[0, 0, 0, 1, 0, 0, -1.5]])
    ball = cab.Body.from_boxes([-1] * count, [[0.05] * 3] * count, shapes=[cab.Shape.sphere(0.05)] * count)
    poses = np.concatenate((np.tile([0, 0, 0, 1], (count, 1)), points), axis=1)
    other.add_fixed(ball, poses)
    expected = other.hits(states, depths=True)
    order = ["state", "fixed", "link_a", "link_b"]
    assert np.array_equal(np.sort(hits, order=order)[order], np.sort(expected, order=order)[order])
    assert np.allclose(np.sort(hits, order=order)["depth"], np.sort(expected, order=order)["depth"], atol=1e-6)
    near, far = checker.distances(states, 0.5), other.distances(states, 0.5)
    assert np.allclose(near["distance"], far["distance"], atol=1e-6)
    ways = checker.edges(states[:-1], states[1:])
    assert np.array_equal(ways["free"], other.edges(states[:-1], states[1:])["free"])

    points[17, 1] = np.nan
    with pytest.raises(cab.InputError, match=r"^points\[17\]: a number is not finite$"):
        checker.add_points(points, 0.1)
    for none in ([], np.empty((0, 3))):
        with pytest.raises(cab.InputError, match="^points: there are none$"):
            checker.add_points(none, 0.1)
    for radius in (0.0, -1.0, 1e18, np.inf, np.nan):
        words = f"radius: {radius} is not a length above 0, up to 5e17 metres"
        with pytest.raises(cab.InputError, match=f"^{re.escape(words)}$"):
            checker.add_points(points[:9], radius)
    with pytest.raises(ValueError, match=r"points: .*\(n, 3\)"):
        checker.add_points([[0, 0]], 0.1)
    assert np.array_equal(checker.hits(states, depths=True), hits)


# The base is two plates at x = 0 and x = 4, whose hull fills the gap. A bar slides along x through it.
TWO_PLATES = "v 0 -1 -1\nv 0 1 -1\nv 0 0 1\nv 4 -1 -1\nv 4 1 -1\nv 4 0 1\nf 1 2 3\nf 4 5 6\n"
BAR = "v -1 0 0\nv 1 0 0.1\nv 1 0.1 0\nf 1 2 3\n"
SLIDE = """<robot name="slide">
  <link name="base"><collision><geometry><mesh filename="two.obj"/></geometry></collision></link>
  <link name="bar"><collision><geometry><mesh filename="bar.obj"/></geometry></collision></link>
  <joint name="slide" type="prismatic"><parent link="base"/><child link="bar"/><axis xyz="1 0 0"/>
    <limit lower="0" upper="10" effort="1" velocity="1"/></joint>
</robot>
"""


@pytest.fixture
def slide(tmp_path):
    """The file of a robot of two meshes: a bar that slides through the gap between two plates."""
    if not cab._cab.reads_files:
        pytest.skip("this build reads no files (CAB_PYTHON_FILES)")
    (tmp_path / "slide.urdf").write_text(SLIDE)
    (tmp_path / "two.obj").write_text(TWO_PLATES)
    (tmp_path / "bar.obj").write_text(BAR)
    return tmp_path / "slide.urdf"


def test_a_mesh_that_is_cut_leaves_its_gap_free_and_has_depths(slide):
    robot = pickle.loads(pickle.dumps(cab.Robot(slide, leaves_per_link=2)))
    assert not robot.body.is_surface
    checker = cab.CollisionChecker(robot, ignored=np.empty((0, 2), "u4"))
    assert checker.collides([[0], [2], [3.5], [5.5]]).tolist() == [True, False, True, False]
    assert checker.hits([[0]], depths=True)["depth"][0] >= 0
    for count in (0, 65):
        with pytest.raises(ValueError, match=f"leaves_per_link is from 1 to 64, not {count}"):
            cab.Robot(slide, leaves_per_link=count)
    with pytest.raises(ValueError, match="leaves_per_link cuts hulls, and shapes='surface' has none"):
        cab.Robot(slide, shapes="surface", leaves_per_link=2)


def test_a_robot_of_surfaces_leaves_gaps_free_and_refuses_depths_and_padding(slide):
    states = [[0], [2], [3.5], [5.5]]
    hulls = cab.Robot(slide)
    robot = cab.Robot(slide, shapes="surface")
    assert not hulls.body.is_surface and robot.body.is_surface
    surface = "surface: 3 triangles in 2 leaves of 2 links, 3 parts, 3 of them open"
    assert surface + " (9 edges; a body wholly inside these is not found)" in robot.notes
    none = np.empty((0, 2), "u4")
    solid = cab.CollisionChecker(hulls, ignored=none)
    checker = cab.CollisionChecker(robot, ignored=none)
    assert solid.collides(states).tolist() == [True, True, True, False]
    assert checker.collides(states).tolist() == [True, False, True, False]
    assert checker.hits(states)[["state", "link_a", "link_b"]].tolist() == [(0, 0, 1), (2, 0, 1)]
    ways = checker.edges([[1.5], [1.5]], [[2.5], [5.5]], first=True)
    assert ways["free"].tolist() == [True, False]
    assert ways["colliding"][1] and abs(1.5 + 4 * ways["moment"][1] - 3) < 0.01  # its tip meets the second plate
    gate = cab.Body.from_boxes([-1], [[0.1, 1, 1]])
    checker.add_fixed(gate, [[0, 0, 0, 1, 2, 0, 0]])
    assert checker.collides(states).tolist() == [True, True, True, False]
    for refused in (lambda: checker.hits(states, depths=True), lambda: checker.distances(states)):
        with pytest.raises(cab.Error, match="triangles have no depth and no distance; take a robot of hulls"):
            refused()
    with pytest.raises(cab.Error, match="triangles are not padded; take a robot of hulls"):
        cab.CollisionChecker(robot, ignored=none, padding=0.1)
    with pytest.raises(ValueError, match="shapes is 'hulls' or 'surface', not 'mesh'"):
        cab.Robot(slide, shapes="mesh")
