"""What the tests of `cab scan` share: a corpus of small clips, and the command."""

import compileall
import contextlib
import functools
import importlib.util
import io
import os
import pathlib
import sqlite3
import subprocess
import sys
from fractions import Fraction
from typing import Callable, Dict, Iterator, List, NamedTuple, Optional

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[4]


def pytest_configure() -> None:
    """Compiles what many processes import, and none of them writes down compiled."""
    for name in ("cab", "cab_scan"):
        compileall.compile_dir(os.path.dirname(str(importlib.util.find_spec(name).origin)), quiet=2)


def rounds() -> float:
    """CAB_TEST_ROUNDS: a factor of what tests do."""
    return float(Fraction(os.environ.get("CAB_TEST_ROUNDS", "1")))


# What `./dev test --long` has, with five times the rounds.
long = pytest.mark.skipif(rounds() < 5, reason="it is long: CAB_TEST_ROUNDS=5, or ./dev test --long")


class Outcome(NamedTuple):
    """How a run ended."""

    code: int
    out: str
    error: str

    @property
    def hash(self) -> str:
        """The hash of the table, as printed."""
        return next(line.split()[1] for line in self.out.splitlines() if line.startswith("hash "))


class Scan:
    """The command in a folder."""

    def __init__(self, folder: pathlib.Path) -> None:
        self.folder = folder
        self.environment: Dict[str, str] = {}

    def words(self, *words: object) -> List[str]:
        return [sys.executable, "-m", "cab_scan", *map(str, words)]

    def start(self, *words: object, **more) -> "subprocess.Popen[str]":
        """A run that goes on."""
        pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True, **more}
        return subprocess.Popen(
            self.words(*words), cwd=self.folder, env={**os.environ, **self.environment}, start_new_session=True, **pipes
        )

    def __call__(self, *words: object, **more) -> Outcome:
        """A run to its end."""
        process = self.start(*words, **more)
        out, error = process.communicate(timeout=900)
        assert "Traceback" not in error, error
        return Outcome(process.returncode, out, error)

    def here(self, *words: object, workers: object = None) -> Outcome:
        """A run in this process, on workers that are there already, or as far as it goes without."""
        from cab_scan import command, local

        out, error = io.StringIO(), io.StringIO()
        with pytest.MonkeyPatch.context() as patch:
            patch.chdir(self.folder)
            if workers is not None:
                patch.setattr(local, "pool", lambda *_: contextlib.nullcontext(workers))
            with contextlib.redirect_stdout(out), contextlib.redirect_stderr(error):
                code = command.run([str(word) for word in words])
        assert "Traceback" not in error.getvalue(), error.getvalue()
        return Outcome(code, out.getvalue(), error.getvalue())

    def rows(self, what: str = "*", table: str = "scan.sqlite", rest: str = "") -> List[sqlite3.Row]:
        """Rows of the table."""
        base = sqlite3.connect(self.folder / table)
        base.row_factory = sqlite3.Row
        found = base.execute(f"SELECT {what} FROM work {rest} ORDER BY file, other, part, policies").fetchall()
        base.close()
        return found


@pytest.fixture
def scan(tmp_path: pathlib.Path) -> Scan:
    """The command in a new folder."""
    return Scan(tmp_path)


@pytest.fixture(scope="session")
def workers() -> Iterator[object]:
    """Two workers, for all tests of a file."""
    from cab_scan import local

    with local.pool(2, "1GB", 3600) as pool:
        yield pool


@pytest.fixture
def quick(scan: Scan, workers: object) -> Callable[..., Outcome]:
    """The command in a new folder, in this process and on workers that are there already."""
    return functools.partial(scan.here, workers=workers)


def arm_bvh(angles: List[float], frame_time: float = 0.01, offset: float = 0.0) -> str:
    """A trunk with an arm of three parts, which folds by an angle per frame, until the hand is in the trunk."""
    lines = ["HIERARCHY", "ROOT Hips", "{", "OFFSET 0 0 0"]
    lines += ["CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation"]
    lines += ["JOINT Chest", "{", "OFFSET 0 0.5 0", "CHANNELS 3 Zrotation Xrotation Yrotation"]
    for name in ("LeftArm", "LeftForeArm", "LeftHand"):
        lines += [f"JOINT {name}", "{", "OFFSET 0.3 0 0", "CHANNELS 3 Zrotation Xrotation Yrotation"]
    lines += ["End Site", "{", "OFFSET 0.15 0 0", "}", "}", "}", "}"]
    lines += ["JOINT Head", "{", "OFFSET 0 0.2 0", "CHANNELS 3 Zrotation Xrotation Yrotation"]
    lines += ["End Site", "{", "OFFSET 0 0.2 0", "}", "}", "}"]
    lines += ["JOINT LeftUpLeg", "{", "OFFSET 0.1 0 0", "CHANNELS 3 Zrotation Xrotation Yrotation"]
    lines += ["End Site", "{", "OFFSET 0 -0.9 0", "}", "}", "}"]
    lines += ["MOTION", f"Frames: {len(angles)}", f"Frame Time: {frame_time}"]
    for angle in angles:
        turns = ["0 0 0"] * 2 + [f"{angle} 0 0"] * 3 + ["0 0 0"] * 2
        lines.append(f"{offset} 1 0 " + " ".join(turns))
    return "\n".join(lines) + "\n"


def write_corpus(folder: pathlib.Path, count: int, frames: int = 40) -> None:
    """Clips that fold at different paces, in two folders."""
    for number in range(count):
        place = folder / ("left" if number % 2 else "right")
        place.mkdir(parents=True, exist_ok=True)
        pace = 2 + number % 7
        (place / f"clip{number:04d}.bvh").write_text(arm_bvh([pace * frame % 130 for frame in range(frames)]))


def data_folder() -> Optional[pathlib.Path]:
    """The folder of CAB_DATA_DIR, if there is one."""
    name = os.environ.get("CAB_DATA_DIR")
    return pathlib.Path(name) if name and pathlib.Path(name).is_dir() else None
