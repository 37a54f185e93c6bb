"""Errors: every status that a program can reach is an exception of its kind, with the engine's words."""

import re
import subprocess
import sys

import numpy as np
import pytest

import cab
from cab import _cab, _errors
from conftest import ROOT, make_chain, random_poses


def posed_world(count=4):
    world = cab.World()
    crowd = world.add(make_chain(8), count)
    return world, crowd, np.tile(np.array([0, 0, 0, 1, 0, 0, 0], "f4"), (count, 8, 1))


def test_statuses_are_those_of_the_header():
    header = (ROOT / "layout/include/cab/types.h").read_text()
    block = re.search(r"enum class Status : std::int32_t \{(.*?)\n\};", header, re.S).group(1)
    names = [re.sub(r"(?<!^)(?=[A-Z])", "_", name).upper() for name in re.findall(r"^  k(\w+)(?: = 0)?,", block, re.M)]
    assert [status.name for status in cab.Status] == names
    assert [int(status) for status in cab.Status] == list(range(len(names)))


def test_every_status_has_an_exception_and_words():
    for status in cab.Status:
        if status is cab.Status.OK:
            continue
        error = _errors.make_error(int(status), status.words)
        assert isinstance(error, cab.Error) and error.status is status
        assert status.words in str(error) and len(status.words) > 10
    assert isinstance(_errors.make_error(cab.Status.OUT_OF_MEMORY, "x"), MemoryError)
    assert isinstance(_errors.make_error(cab.Status.BUSY, "x"), RuntimeError)
    assert isinstance(_errors.make_error(cab.Status.BAD_POSES, "x"), ValueError)


BODIES = [
    (cab.Status.NO_LINKS, dict(parents=[], half=np.ones((0, 3)))),
    (cab.Status.TOO_MANY_LINKS, dict(parents=np.full(1025, -1), half=[[1, 1, 1]], links=[0])),
    (cab.Status.NO_LEAVES, dict(parents=[-1], half=np.ones((0, 3)), links=[])),
    (cab.Status.TOO_MANY_LEAVES, dict(parents=[-1], half=np.ones((1025, 3)), links=np.zeros(1025, int))),
    (cab.Status.BAD_PARENT, dict(parents=[-1, 1], half=np.ones((2, 3)))),
    (cab.Status.BAD_JOINT, dict(parents=[-1], half=np.ones((1, 3)), joints=[[np.nan, 0, 0]])),
    (cab.Status.BAD_LEAF_LINK, dict(parents=[-1], half=np.ones((1, 3)), links=[1])),
    (cab.Status.BAD_LEAF_BOX, dict(parents=[-1], half=[[-1, 1, 1]])),
    (cab.Status.BAD_LEAF_AXES, dict(parents=[-1], half=[[1, 1, 1]], axes=[np.zeros((3, 3))])),
    (cab.Status.BAD_SHAPE, dict(parents=[-1], half=[[1, 1, 1]], shapes=[cab.Shape.sphere(-1)])),
    (cab.Status.SHAPE_OUTSIDE_LEAF_BOX, dict(parents=[-1], half=[[1, 1, 1]], shapes=[cab.Shape.sphere(2)])),
    (cab.Status.BAD_IGNORED_PAIR, dict(parents=[-1], half=[[1, 1, 1]], ignored_pairs=[[0, 5]])),
    (
        cab.Status.BAD_REST_POSE,
        dict(parents=[-1], half=[[1, 1, 1]], rest_pose=np.zeros((1, 7), dtype=np.float32)),
    ),
]


@pytest.mark.parametrize("status, arguments", BODIES, ids=[status.name for status, _ in BODIES])
def test_a_bad_body_is_an_input_error(status, arguments):
    with pytest.raises(cab.InputError) as caught:
        cab.Body.from_boxes(**arguments)
    assert caught.value.status is status
    assert status.words in str(caught.value)
    assert isinstance(caught.value, ValueError)


def test_pairs_of_links_that_are_not_there_cannot_be_ignored():
    with pytest.raises(cab.InputError) as caught:
        make_chain(8).ignoring([[0, 8]])
    assert caught.value.status is cab.Status.BAD_IGNORED_PAIR


def test_the_bad_element_is_named():
    half = np.ones((3, 3))
    half[1, 2] = np.inf
    with pytest.raises(cab.InputError, match="^box 1: "):
        cab.Body.from_boxes([-1, 0, 1], half)
    with pytest.raises(cab.InputError, match="^link 2: "):
        cab.Body.from_boxes([-1, 0, 2], np.ones((3, 3)))


FRAMES = [
    (cab.Status.BAD_ORIGINS, dict(origins=np.full((4, 3), np.nan))),
    (cab.Status.BAD_SCALES, dict(scales=np.ones(4, "f4"), has_scale=True)),
    (cab.Status.BAD_INSTANCES, dict(instances=[2, 1])),
    (cab.Status.BAD_INSTANCES, dict(instances=[4])),
    (cab.Status.BAD_MARGINS, dict(margins=np.full(4, -1, "f4"))),
    (cab.Status.BAD_MARGIN, dict(margin=-1)),
    (cab.Status.BAD_MIN_DEPTH, dict(exact="convex", min_depth=-1)),
    (cab.Status.CONTACTS_NEED_EXACT, dict(contacts=True)),
    (cab.Status.CONTACTS_NEED_EXACT, dict(min_depth=1)),
]


@pytest.mark.parametrize("status, arguments", FRAMES, ids=[status.name for status, _ in FRAMES])
def test_a_bad_frame_is_an_input_error_that_names_the_member(status, arguments):
    world, _, poses = posed_world()
    if arguments.get("has_scale"):
        poses = np.tile(np.eye(4, dtype="f4"), (4, 8, 1, 1))
    with pytest.raises(cab.InputError) as caught:
        world.run(poses, **arguments)
    assert caught.value.status is status
    assert status.words in str(caught.value)
    assert len(str(caught.value)) > len(status.words)  # and what it was about


def test_wrong_batches_and_rules():
    world, crowd, poses = posed_world()
    posed, later = crowd.posed(poses), crowd.posed(poses.copy())
    for status, call in [
        (cab.Status.BATCH_GIVEN_TWICE, lambda: world.run([posed, posed])),
        (cab.Status.PAIR_RULE_GIVEN_TWICE, lambda: world.run(posed, pairs=[(crowd, crowd), (crowd, crowd)])),
        (cab.Status.UNKNOWN_BATCH, lambda: world.run(posed_world()[1].posed(poses))),
        (cab.Status.NO_INSTANCES, lambda: world.add(make_chain(8), 0)),
        (cab.Status.TOO_MANY_INSTANCES, lambda: world.add(make_chain(8), 2**24 + 1)),
        (cab.Status.BAD_STATIC_BODY, lambda: world.add_static([[1, 1, 1]], origins=[[np.nan, 0, 0]])),
        (cab.Status.BAD_TRIANGLES, lambda: world.add_static(vertices=[[0, 0, 0]], triangles=[[0, 1, 2]])),
        (cab.Status.BAD_TICKS, lambda: world.add_history(crowd, 0)),
        (cab.Status.BAD_VERTICES, lambda: cab.fit_box([[np.nan, 0, 0]])),
        (cab.Status.BAD_QUERY, lambda: world.query(cab.rays([[0, 0, 0]], [0, 0, 0]), poses)),
        (cab.Status.EXACT_NOT_BUILT, lambda: world.query(cab.points([[0, 0, 0]]), poses, exact="fcl")),
        (cab.Status.BAD_RESOLUTION, lambda: world.touching_moments([posed], [later], np.empty(0, cab.HIT), 0)),
        (cab.Status.BAD_PAIRS, lambda: world.contacts(np.zeros(1, cab.HIT), poses)),
    ]:
        with pytest.raises(cab.Error) as caught:
            call()
        assert caught.value.status is status, caught.value
        assert str(caught.value)
    other = world.add(make_chain(8), 4)
    with pytest.raises(cab.InputError) as caught:
        world.run([posed], pairs=[(crowd, other)])
    assert caught.value.status is cab.Status.BAD_PAIR_RULE
    history = world.add_history(crowd, 2)
    history.record(1.0, poses)
    with pytest.raises(cab.InputError) as caught:
        history.record(1.0, poses)
    assert caught.value.status is cab.Status.BAD_TIME
    mirrored = np.tile(np.diag([-1, 1, 1, 1]).astype("f4"), (4, 8, 1, 1))
    with pytest.raises(cab.InputError) as caught:
        history.record(2.0, mirrored)
    assert caught.value.status is cab.Status.BAD_HISTORY_POSES
    with pytest.raises(cab.InputError) as caught:
        world.query(cab.points([[0, 0, 0]], time=1), posed, histories=[history, history])
    assert caught.value.status is cab.Status.HISTORY_GIVEN_TWICE
    history.remove()
    with pytest.raises(cab.InputError) as caught:
        assert history.span
    assert caught.value.status is cab.Status.UNKNOWN_HISTORY


def test_an_instruction_set_that_is_not_there():
    # A PC has no NEON, and an ARM no SSE: one of the two is known to the library, and does not run here.
    missing = {"neon64", "sse2"} - set(cab.isas())
    assert missing
    for isa in missing:
        with pytest.raises(cab.UnsupportedError) as caught:
            cab.World(isa=isa)
        assert caught.value.status is cab.Status.ISA_NOT_AVAILABLE
    with pytest.raises(ValueError, match="'mmx' is none of auto, scalar"):
        cab.World(isa="mmx")


def test_no_memory_is_a_memory_error():
    world = cab.World()
    body = make_chain(1)
    with pytest.raises(MemoryError):
        # 2^24 characters per batch take some 5 GB each: the address space is bounded for this test alone.
        import resource

        limits = resource.getrlimit(resource.RLIMIT_AS)
        with open("/proc/self/statm", encoding="ascii") as file:
            used = int(file.read().split()[0]) * resource.getpagesize()
        resource.setrlimit(resource.RLIMIT_AS, (used + 200_000_000, limits[1]))
        try:
            world.add(body, 2**24)
        finally:
            resource.setrlimit(resource.RLIMIT_AS, limits)
    assert world.batches == () and world.memory.articulations == 0
    world.add(body, 10)


def test_names_of_policies():
    for field in cab.policy_table():
        assert field.meaning
        for value in field.values:
            assert getattr(cab.Policies(**{field.name: value}), field.name) == value
        with pytest.raises(ValueError, match=f"^{field.name}: 'x' is none of"):
            cab.Policies(**{field.name: "x"})
    assert cab.Policies.preset("balanced") == cab.Policies()
    for name in cab.presets():
        assert cab.Policies.preset(name).exact == "none"
    world, _, poses = posed_world()
    for name in cab.presets():
        world.run(poses, policies=name)
    with pytest.raises(ValueError, match="'slow' is none of paper, balanced, tight$"):
        world.run(poses, policies="slow")
    with pytest.raises(ValueError, match="'fast' is none of .*tight$"):
        world.run(poses, policies="fast")
    with pytest.raises(TypeError, match="int is given"):
        world.run(poses, policies=3)
    with pytest.raises(ValueError, match="report"):
        world.run(poses, report="all")
    with pytest.raises(ValueError, match="resting"):
        world.run(poses, resting="all")


def test_masked_characters_are_a_warning_that_names_link_and_reason(rng):
    names = [f"bone {k}" for k in range(8)]
    world = cab.World()
    world.add(make_chain(8, names=names), 6)
    poses = random_poses(rng, 6, 8)
    expected = world.run(poses).hits
    poses[2, 3, 5] = np.nan
    poses[4, 0, :4] = 0
    with pytest.warns(cab.MaskedWarning) as caught:
        frame = world.run(poses)
    assert len(caught) == 1
    words = str(caught[0].message)
    assert words.startswith("batch 1, character 2 took no part: number 5 of the pose of link 3 is nan")
    assert "(link 3 is bone 3)" in words and words.endswith("1 more took no part")
    assert caught[0].filename == __file__
    assert frame.posed[0].flags.tolist() == [0, 0, 1, 0, 2, 0]
    masked = [2, 4]
    kept = expected[~np.isin(expected["instance_a"], masked) & ~np.isin(expected["instance_b"], masked)]
    assert np.array_equal(frame.hits, kept)
    with pytest.warns(cab.MaskedWarning, match="character 2 .* 1 more"):
        world.query(cab.points([[0, 0, 0]]), poses)


def test_masked_frames_of_a_clip_are_a_warning(rng):
    poses = random_poses(rng, 20, 8)
    poses[7, 1, 6] = np.inf
    clip = cab.Clip(make_chain(8), poses, name="walker")
    with pytest.warns(cab.MaskedWarning, match="walker, frame 7 took no part: number 6 of the pose of link 1"):
        clip.hits()


def test_a_numpy_that_the_build_does_not_know_is_an_import_error():
    if _cab.knows_numpy_2:
        pytest.skip("this build knows NumPy 2, by its pybind11")
    program = "import numpy; numpy.__version__ = '2.3.4'; import cab"
    ran = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert ran.returncode == 1 and "ImportError: cab was built with pybind11 2." in ran.stderr
    assert "does not know NumPy 2.3.4: install numpy<2, or build cab with pybind11 2.12" in ran.stderr


def test_build_and_version():
    header = (ROOT / "layout/include/cab/version.h").read_text()
    numbers = re.findall(r"^#define CAB_VERSION_(?:MAJOR|MINOR|PATCH) (\d+)$", header, re.M)
    assert cab.__version__.startswith(".".join(numbers))
    assert isinstance(cab.build_info().fcl, bool)
    assert "scalar" in cab.isas() and cab.World().isa == cab.isas()[-1]
    assert _cab.__doc__
