"""The programs that docs/python.md quotes run and print what it says."""

import importlib.util
import os
import pathlib
import re
import subprocess
import sys

import pytest

import cab
from conftest import ROOT

HERE = pathlib.Path(__file__).parent
DOCUMENT = (ROOT / "docs/python.md").read_text(encoding="utf-8")


def run(program, *arguments):
    return subprocess.run(
        [sys.executable, str(HERE / program), *map(str, arguments)], capture_output=True, text=True, check=True
    ).stdout


def printed_in_docs(program):
    """The block of text that follows the quote of a program."""
    return re.search(rf"<!-- tests/engine/bindings/python/{program} -->\n.*?```text\n(.*?)```", DOCUMENT, re.S).group(1)


def test_the_crowd_prints_what_the_document_says():
    assert run("crowd.py") == printed_in_docs("crowd.py")


def test_the_clip_is_cleaned_as_the_document_says(tmp_path):
    if importlib.util.find_spec("matplotlib") is None:
        pytest.skip("matplotlib is not installed (Debian: python3-matplotlib)")
    if not cab._cab.reads_files:
        pytest.skip("this build reads no files (CAB_PYTHON_FILES)")
    clips = list(pathlib.Path("/usr/share/assimp").rglob("01_01.bvh"))
    if not clips:
        pytest.skip("the clip 01_01.bvh is not there (Debian: assimp-testmodels)")
    picture = tmp_path / "clip.png"
    assert run("clean_clip.py", clips[0], 0.0564, picture) == printed_in_docs("clean_clip.py")
    assert picture.read_bytes().startswith(b"\x89PNG") and picture.stat().st_size > 5000


def test_the_arm_collides_as_the_document_says():
    if not cab._cab.reads_files:
        pytest.skip("this build reads no files (CAB_PYTHON_FILES)")
    assert run("arm_states.py") == printed_in_docs("arm_states.py")


def test_other_lines_of_python_in_the_document_run():
    blocks = re.findall(r"```python\n(.*?)```", DOCUMENT, re.S)
    assert len(blocks) > 3
    names = {}
    for block in blocks:
        exec(compile(block, "docs/python.md", "exec"), names)  # noqa: S102 - our own document


def test_every_public_name_has_a_docstring():
    missing = []
    for name in cab.__all__:
        thing = getattr(cab, name)
        if isinstance(thing, type) or callable(thing):
            if not thing.__doc__:
                missing.append(name)
            if isinstance(thing, type):
                missing += [
                    f"{name}.{member}"
                    for member, value in vars(thing).items()
                    if not member.startswith("_") and (callable(value) or isinstance(value, property))
                    and not value.__doc__
                ]
    assert missing == []


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
