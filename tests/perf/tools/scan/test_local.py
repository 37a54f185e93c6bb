"""A scan without Dask: the same table, by processes of its own; shards, and the merge of their tables."""

import os
import pathlib
import signal
import sys

import pytest

from conftest import Scan, arm_bvh, write_corpus
from faults import children_of, wait_for_rows, workers_of
from test_robots import pairs_of, write_arm

_WITHOUT_DASK = (
    "import sys; sys.modules['dask'] = sys.modules['distributed'] = None; "
    "from cab_scan.__main__ import main; sys.exit(main())"
)


class Alone(Scan):
    """The command, for which there is no Dask."""

    def words(self, *words):
        return [sys.executable, "-c", _WITHOUT_DASK, *map(str, words)]


@pytest.fixture
def alone(tmp_path):
    return Alone(tmp_path)


@pytest.fixture
def loader(alone):
    alone.environment["PYTHONPATH"] = f"{pathlib.Path(__file__).parent}{os.pathsep}{os.environ['PYTHONPATH']}"
    return "fault_loader:load"


def write_list(scan, parts):
    write_corpus(scan.folder / "corpus", len(parts))
    files = sorted((scan.folder / "corpus").rglob("*.bvh"))
    lines = [f"{file.relative_to(scan.folder)},{part}" for file, part in zip(files, parts)]
    (scan.folder / "list.csv").write_text("\n".join(["path,part", *lines]) + "\n")


def test_the_table_is_that_of_dask_and_the_only_file(alone, quick):
    write_corpus(alone.folder / "corpus", 12)
    wanted = quick("self", "corpus", "--table", "dask.sqlite")
    outcome = alone("self", "corpus", "--workers", 3)
    assert outcome.code == 0 and outcome.hash == wanted.hash
    assert {path.name for path in alone.folder.iterdir()} == {"corpus", "dask.sqlite", "scan.sqlite"}
    assert len(alone.rows()) == 12
    again = alone("self", "corpus")
    assert again.code == 0 and again.hash == outcome.hash
    refused = alone("self", "corpus", "--scheduler", "tcp://127.0.0.1:1")
    assert refused.code == 1 and "Python has no module distributed" in refused.error


def test_recordings_and_robots_need_no_dask(alone, quick):
    write_arm(alone.folder / "arm.urdf")
    words = ["robot", "arm.urdf", "--states", 3000, "--samples", 2000, "--chunk", 1000]
    wanted, outcome = quick(*words, "--table", "dask.sqlite"), alone(*words)
    assert outcome.code == 0 and outcome.hash == wanted.hash
    assert pairs_of(alone, "robot states") == pairs_of(alone, "robot states", "dask.sqlite") != []
    (alone.folder / "none.cab").write_bytes(b"CABREC\r\n" + bytes(100))
    outcome = alone("recordings", "none.cab", "--table", "recordings.sqlite")
    (row,) = alone.rows(table="recordings.sqlite")
    assert outcome.code == 1 and row["outcome"] == "bad"


def test_what_kills_its_process_is_a_row_and_blames_nobody_else(alone, loader):
    parts = ["", "kill", "", "once", "eat", ""] + [""] * 6
    write_list(alone, parts)
    outcome = alone("self", "--list", "list.csv", "--loader", loader)
    assert outcome.code == 1 and "its worker died" in outcome.error and "out of memory" in outcome.error
    rows = {row["part"]: row for row in alone.rows()}
    assert len(alone.rows()) == 12
    assert rows["kill"]["outcome"] == rows["eat"]["outcome"] == "lost"
    assert rows["once"]["outcome"] == "done"
    assert sum(row["outcome"] == "done" for row in alone.rows()) == 10


def test_a_process_that_takes_too_much_memory_is_a_row(alone, loader):
    write_list(alone, ["", "grow", ""])
    outcome = alone("self", "--list", "list.csv", "--loader", loader, "--memory", "1GB")
    assert outcome.code == 1 and "out of memory" in outcome.error
    assert [row["outcome"] for row in alone.rows()] == ["done", "lost", "done"]


def test_an_interrupt_ends_all_processes_and_the_same_command_goes_on(alone, loader):
    write_list(alone, ["slow"] * 40)
    alone.environment["FAULT_SECONDS"] = "0.05"
    words = ["self", "--list", "list.csv", "--loader", loader]
    process = alone.start(*words)
    wait_for_rows(alone, 5, process)
    assert len(workers_of(process)) == 2
    os.killpg(process.pid, signal.SIGINT)  # as a terminal does: to the scan and its processes
    out, error = process.communicate(timeout=60)
    assert process.returncode == 130 and "the same command goes on" in error
    assert "Traceback" not in error and "KeyboardInterrupt" not in error and out == ""
    assert children_of(process.pid) == {}
    assert not (alone.folder / "scan.sqlite.lock").exists()
    assert alone(*words).code == 0 and len(alone.rows()) == 40


def test_shards_share_all_files_and_their_merge_is_the_whole_table(alone, quick):
    write_corpus(alone.folder / "corpus", 7)
    (alone.folder / "corpus/bad.bvh").write_text("")
    whole = quick("self", "corpus", "--table", "whole.sqlite", "--csv", "whole.csv")
    files = []
    for number in range(1, 4):
        alone("self", "corpus", "--shard", f"{number}/3", "--table", f"{number}.sqlite")
        files += [row["file"] for row in alone.rows(table=f"{number}.sqlite")]
    assert sorted(files) == sorted(row["file"] for row in alone.rows(table="whole.sqlite"))
    tables = [f"{number}.sqlite" for number in (3, 1, 2)]
    for _ in range(2):  # twice is the same
        merged = alone("merge", *tables, "--csv", "scan.csv")
        assert merged.code == whole.code == 1 and merged.hash == whole.hash
    for name in ("csv", "contacts.csv"):
        there, wanted = ((alone.folder / f"{stem}.{name}").read_text() for stem in ("scan", "whole"))
        assert [line.split(",")[:20] for line in there.splitlines()] == [
            line.split(",")[:20] for line in wanted.splitlines()
        ]
    nothing = quick("self", "corpus/left/clip0001.bvh", "--shard", "2/2", "--table", "none.sqlite")
    assert nothing.code == 0 and alone.rows(table="none.sqlite") == []


def test_a_merge_replaces_rows_of_the_same_work(alone, quick):
    for name in ("arm", "other"):
        write_arm(alone.folder / f"{name}.urdf")
    (alone.folder / "clip.bvh").write_text(arm_bvh([3 * frame % 130 for frame in range(40)]))
    words = ["--states", 2000, "--samples", 1000, "--chunk", 1000]
    for table, file in (("a", "arm"), ("b", "other"), ("whole", "*")):
        assert quick("robot", f"{file}.urdf", *words, "--table", f"{table}.sqlite").code == 0
    for table in ("a", "b"):
        assert quick("self", "clip.bvh", "--table", f"{table}.sqlite").code == 0
    assert quick("self", "clip.bvh", "--table", "whole.sqlite").code == 0
    merged = quick("merge", "a.sqlite", "b.sqlite", "a.sqlite", "--table", "all.sqlite")
    assert merged.code == 0
    assert merged.hash == quick("merge", "whole.sqlite", "--table", "copy.sqlite").hash
    assert pairs_of(alone, "robot states", "all.sqlite") == pairs_of(alone, "robot states", "whole.sqlite")


def test_what_is_no_table_is_not_merged(alone, quick):
    write_corpus(alone.folder / "corpus", 1)
    assert quick("self", "corpus").code == 0
    (alone.folder / "text.sqlite").write_text("no database " * 100)
    for name, told in (("text.sqlite", "file is not a database"), ("gone.sqlite", "there is no such table")):
        outcome = quick("merge", "scan.sqlite", name, "--table", "all.sqlite")
        assert outcome.code == 1 and f"{name}: {told}" in outcome.error
    same = quick("merge", "scan.sqlite", "--table", "scan.sqlite")
    assert same.code == 2 and "is an input" in same.error
    for words in (["self", "corpus", "--shard", "0/2"], ["self", "corpus", "--shard", "3/2"], ["merge"]):
        outcome = alone(*words)
        assert outcome.code == 2 and "cab scan" in outcome.error


def test_the_worst_clips_are_printed_last_the_deepest_first(alone, quick):
    write_corpus(alone.folder / "corpus", 14)
    outcome = quick("self", "corpus")
    assert outcome.code == 0
    lines = outcome.out.splitlines()
    (begin,) = [number for number, line in enumerate(lines) if line.startswith("the worst ")]
    rows = sorted(
        (row for row in alone.rows() if row["hits"]), key=lambda row: (-row["depth"], -row["hit_frames"], row["file"])
    )
    assert len(rows) > 10
    assert len(lines) == begin + 11
    for line, row in zip(lines[begin + 1:], rows):
        words = line.split()
        assert words[0] == row["file"]
        assert words[1:4] == [str(row["hit_frames"]), "of", "40"]
        assert words[4] == f"{100 * row['depth']:.1f}" and words[5] == str(row["depth_frame"])
        assert line.endswith(f"{row['depth_link_a']} - {row['depth_link_b']}")


def test_sizes_of_memory_are_read_as_dask_reads_them():
    from cab_scan import local
    from dask.utils import parse_bytes

    for size in ("800MB", "1.5GiB", "700kB", "3 MiB", "2GB"):
        assert local.bytes_of(size) == parse_bytes(size), size
