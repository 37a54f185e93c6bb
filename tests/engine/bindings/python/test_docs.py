"""The programs that docs/python.md and docs/robots_in_python.md quote run and print what they say."""

import importlib.util
import os
import pathlib
import pydoc
import re
import subprocess
import sys
import types
from typing import get_args

import numpy as np
import pytest

import cab
from cab import _options
from conftest import ROOT

HERE = pathlib.Path(__file__).parent
DOCUMENT = (ROOT / "docs/python.md").read_text(encoding="utf-8")
ROBOTS = (ROOT / "docs/robots_in_python.md").read_text(encoding="utf-8")


def run(program, *arguments):
    return subprocess.run(
        [sys.executable, str(HERE / program), *map(str, arguments)], capture_output=True, text=True, check=True
    ).stdout


def printed_in_docs(program, document=DOCUMENT):
    """The block of text that follows the quote of a program."""
    quote = rf"<!-- tests/engine/bindings/python/{program}(?:, in part)? -->\n"
    return re.search(rf"{quote}.*?```text\n(.*?)```", document, re.S).group(1)


def need_matplotlib():
    if importlib.util.find_spec("matplotlib") is None:
        pytest.skip("matplotlib is not installed (Debian: python3-matplotlib)")


def need_files():
    if not cab._cab.reads_files:
        pytest.skip("this build reads no files (CAB_PYTHON_FILES)")


def test_the_crowd_prints_what_the_document_says():
    assert run("crowd.py") == printed_in_docs("crowd.py")


def test_the_clip_is_cleaned_as_the_document_says(tmp_path):
    need_matplotlib()
    need_files()
    clips = list(pathlib.Path("/usr/share/assimp").rglob("01_01.bvh"))
    if not clips:
        pytest.skip("the clip 01_01.bvh is not there (Debian: assimp-testmodels)")
    picture = tmp_path / "clip.png"
    assert run("clean_clip.py", clips[0], 0.0564, picture) == printed_in_docs("clean_clip.py")
    assert picture.read_bytes().startswith(b"\x89PNG") and picture.stat().st_size > 5000


def test_the_meshes_penetrate_as_the_document_says():
    assert run("mesh_penetration.py") == printed_in_docs("mesh_penetration.py")


def test_the_arm_collides_as_the_document_says():
    need_files()
    assert run("arm_states.py", HERE / "arm.urdf") == printed_in_docs("arm_states.py", ROBOTS)


def test_the_first_robot_reads_states_as_the_command_does(tmp_path):
    need_files()
    srdf = tmp_path / "arm.srdf"
    pairs = [("base", "upper"), ("upper", "lower")]
    lines = [f'<disable_collisions link1="{a}" link2="{b}" reason="Adjacent"/>' for a, b in pairs]
    srdf.write_text(f'<robot name="arm">{"".join(lines)}</robot>')
    simple, named = tmp_path / "simple.csv", tmp_path / "named.csv"
    simple.write_text("shoulder,elbow\n0,0\n1,2.9\n-1.5,-2.95\n2,3\n")
    expected = run("first_robot.py", HERE / "arm.urdf", srdf, simple)
    assert expected.startswith("[False False  True  True]")
    urdf = (HERE / "arm.urdf").read_text()
    for shoulder, elbow in [("joint_0.0", "left elbow"), ("file", "\u6b65-\u00e9")]:
        robot = tmp_path / "named.urdf"
        robot.write_text(urdf.replace('"shoulder"', f'"{shoulder}"').replace('"elbow"', f'"{elbow}"'), "utf-8")
        lines = ["# a grasp, by hand", f"{elbow} , {shoulder}", "", "0,0", "2.9, 1", "# more", "-2.95,-1.5", "3,2"]
        named.write_text("\n".join(lines), "utf-8")
        assert run("first_robot.py", robot, srdf, named) == expected
    for text, answers in [("elbow\n", "[]\n"), ("elbow\n3\n", "[False]\n")]:
        simple.write_text(text)
        assert run("first_robot.py", HERE / "arm.urdf", srdf, simple).startswith(answers)


def test_the_matrix_of_the_arm_is_an_srdf_file_as_the_document_says(tmp_path):
    need_files()
    assert run("arm_srdf.py", HERE / "arm.urdf", tmp_path / "arm.srdf") == printed_in_docs("arm_srdf.py", ROBOTS)


def test_the_arm_holds_a_stick_as_the_document_says():
    need_files()
    assert run("arm_holds.py", HERE / "arm.urdf") == printed_in_docs("arm_holds.py", ROBOTS)


def test_the_arm_finds_its_way_out_as_the_document_says(tmp_path):
    need_matplotlib()
    need_files()
    picture = tmp_path / "arm.png"
    assert run("arm_clearance.py", HERE / "arm.urdf", picture) == printed_in_docs("arm_clearance.py", ROBOTS)
    assert picture.read_bytes().startswith(b"\x89PNG") and picture.stat().st_size > 5000


class Tensor(np.ndarray):
    """What the loss uses of PyTorch's tensor."""

    def detach(self):
        return self

    def numpy(self):
        return np.asarray(self)


class Function:
    """What the loss uses of torch.autograd.Function."""

    @classmethod
    def apply(cls, *inputs):
        context = types.SimpleNamespace()
        return cls.forward(context, *inputs), lambda gradient: cls.backward(context, gradient)


def test_the_gradient_of_the_loss_is_the_difference_of_its_values(monkeypatch):
    need_files()
    torch = types.ModuleType("torch")
    torch.autograd = types.SimpleNamespace(Function=Function)
    torch.from_numpy = lambda array: array.view(Tensor)
    monkeypatch.setitem(sys.modules, "torch", torch)
    monkeypatch.syspath_prepend(HERE)
    clearance = importlib.import_module("clearance_loss").Clearance

    robot = cab.Robot(HERE / "arm.urdf")
    checker = cab.CollisionChecker(robot)
    checker.add_fixed(cab.Body.from_boxes([-1], [[2, 2, 0.05]]), [[0, 0, 0, 1, 0, 3, 0.3]])
    weights = np.random.default_rng(1).uniform(0.5, 2, 40)
    # Above the table, where the lower arm alone comes near it.
    states = np.stack((np.linspace(-1, -0.4, 40), np.linspace(-1.7, -0.9, 40)), axis=1).view(Tensor)

    def loss(at):
        values, back = clearance.apply(at, checker, 0.45)
        return (weights * values).sum(), back

    value, back = loss(states)
    gradient, *others = back(weights)
    assert others == [None, None] and value > 0
    step = 1e-3
    near = np.asarray(checker.clearance(states, 0.45) < 0.4)
    assert near.sum() > 5
    for i in np.flatnonzero(near):
        for v in range(2):
            moved = np.zeros_like(states)
            moved[i, v] = step
            difference = (loss(states + moved)[0] - loss(states - moved)[0]) / (2 * step)
            assert difference == pytest.approx(gradient[i, v], abs=0.01)
    assert not np.asarray(gradient)[np.isinf(checker.clearance(states, 0.45))].any()


def test_other_lines_of_python_in_the_document_run():
    blocks = re.findall(r"```python\n(.*?)```", DOCUMENT, re.S)
    assert len(blocks) > 3
    names = {}
    for block in blocks:
        exec(compile(block, "docs/python.md", "exec"), names)  # noqa: S102 - our own document


def described(thing):
    """Whether help() of it is more than a name: a sentence of its own."""
    words = thing.__doc__ or ""
    return len(words) > 10 and not words.startswith(("Alias for field", "Initialize self"))


def test_every_public_name_has_a_docstring():
    missing = []
    for name in cab.__all__:
        thing = getattr(cab, name)
        if isinstance(thing, type) or callable(thing):
            if not described(thing):
                missing.append(name)
            if isinstance(thing, type):
                missing += [
                    f"{name}.{member}"
                    for member, value in vars(thing).items()
                    if not member.startswith("_") and (callable(value) or isinstance(value, property))
                    and not described(value)
                ]
    assert missing == []


@pytest.mark.parametrize(
    "call", [cab.World.run, cab.World.query, cab.Batch.posed, cab.Clip.hits, cab.Body.from_boxes, cab.rays]
)
def test_help_shows_types_by_short_names(call):
    title = pydoc.plain(pydoc.render_doc(call)).split("\n")[2]
    assert title.startswith(call.__name__) and len(title) < 1000
    assert not re.search(r"numpy\.|_typing|ForwardRef|~", title)


def test_options_are_those_of_the_library():
    fields = {field.name: set(field.values) for field in cab.policy_table()}
    for name, literal in [("refit", _options.Refit), ("strategy", _options.Strategy), ("exact", _options.Exact),
                          ("extents", _options.Extents), ("sat", _options.Sat)]:
        assert set(get_args(literal)) == fields.pop(name)
    assert not fields and set(get_args(_options.Preset)) == set(cab.presets())
    with pytest.raises(ValueError, match="'mmx' is none of ") as caught:
        cab.World(isa="mmx")
    assert get_args(_options.Isa) == tuple(str(caught.value).split(" is none of ")[1].split(", "))


def test_the_command_is_the_command(tmp_path):
    command = os.environ.get("CAB_COMMAND", "")
    if not os.access(command, os.X_OK):
        pytest.skip("the command cab is not built")
    environment = {**os.environ, "PATH": os.path.dirname(command)}

    def call(*arguments):
        return subprocess.run(
            [sys.executable, "-m", "cab", *arguments], capture_output=True, text=True, env=environment, check=False
        )

    assert call("--version").returncode == 0
    assert call("--version").stdout == subprocess.run([command, "--version"], capture_output=True, text=True).stdout
    assert call("run", str(tmp_path / "no file.bvh")).returncode == 1
    assert call("dance").returncode == 2
    environment["PATH"] = str(tmp_path)
    lost = call("--version")
    assert lost.returncode == 127 and "cab-tools" in lost.stderr
