"""A scan without Dask: the same table, by processes of its own; shards, and the merge of their tables."""

import contextlib
import os
import pathlib
import resource
import shutil
import signal
import sqlite3
import sys

import pytest
from cab_scan import table, work

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


def is_running(number):
    try:
        return pathlib.Path(f"/proc/{number}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


def test_what_takes_too_long_is_a_row_and_leaves_no_process(alone, loader):
    parts = ["", "hang", "", "hold 600", ""]
    write_list(alone, parts)
    alone.environment["TMPDIR"] = str(alone.folder / "temporary")
    (alone.folder / "temporary").mkdir()
    outcome = alone("self", "--list", "list.csv", "--loader", loader, "--most-seconds", 4)
    assert outcome.code == 1 and "more than --most-seconds" in outcome.error
    assert [row["outcome"] for row in alone.rows()] == ["lost" if part else "done" for part in parts]
    (file,) = (alone.folder / "corpus").rglob("*.started")
    numbers = [int(line) for line in file.read_text().splitlines()]
    assert len(numbers) == 2  # in a task, then alone
    assert not any(map(is_running, numbers))
    assert list((alone.folder / "temporary").iterdir()) == []


def test_workers_have_folders_of_their_own_which_go_with_them(alone, loader):
    write_list(alone, ["folder", "folder"] * 4)
    assert alone("self", "--list", "list.csv", "--loader", loader).code == 0
    seen = {file.read_text() for file in (alone.folder / "corpus").rglob("*.folder")}
    assert len({pathlib.Path(name).parent for name in seen}) == 1 and len(seen) == 2
    assert not any(map(os.path.exists, seen))


def test_a_limit_that_is_there_already_stays(alone, loader):
    write_list(alone, ["", "grow", ""])
    limit = (1 << 30, 1 << 30)
    outcome = alone(
        "self", "--list", "list.csv", "--loader", loader, "--memory", "1000GB",
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_DATA, limit),
    )
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


def clip_row(outcome, version="1", file="a.bvh"):
    key = work.Key(file, "", "", work.SELF, "p", "{}")
    contacts = [work.Contact("", "a", "", "b", 1, 2, 0.1, 0.2, 1)] if outcome == work.DONE else []
    return work.Row(key, outcome=outcome, version=version, contacts=contacts)


def robot_row(what, first, outcome=work.DONE, options="{}"):
    key = work.Key("r.urdf", "", f"{first}+8", what, "p", options)
    pairs = [work.LinkPair("a", "b", "", 5, first)] if outcome == work.DONE else []
    return work.Row(key, outcome=outcome, version="1", pairs=pairs)


def merged_of(folder, *tables):
    """The rows (file, what, part, outcome, version), how many contacts, and the pairs of the merge of such tables."""
    names = []
    for number, rows in enumerate(tables):
        names.append(str(folder / f"{number}.sqlite"))
        with contextlib.closing(table.Table(names[-1])) as base:
            base.add(rows)
    with table.reserved(names), contextlib.closing(table.Table(str(folder / "all.sqlite"))) as base:
        for name in names:
            base.merge(name)
        found = list(base.rows(("file", "what", "part", "outcome", "version")))
        return found, len(list(base.contacts())), [pair[1:] for pair in base.pairs()]


@pytest.mark.parametrize("others, stays", [
    ((work.DONE, work.LOST), (work.DONE, "0")),
    ((work.DONE, work.BAD), (work.DONE, "0")),
    ((work.BAD, work.LOST), (work.BAD, "0")),
    ((work.LOST, work.BAD), (work.BAD, "1")),
    ((work.LOST, work.BAD, work.DONE, work.LOST), (work.DONE, "2")),
    ((work.DONE, work.DONE), (work.DONE, "1")),
])
def test_a_merge_keeps_work_that_is_done(tmp_path, others, stays):
    tables = [[clip_row(outcome, str(number))] for number, outcome in enumerate(others)]
    tables[-1].append(clip_row(work.LOST, "1", "b.bvh"))
    rows, contacts, _ = merged_of(tmp_path, *tables)
    assert [row[3:] for row in rows if row[0] == "a.bvh"] == [stays]
    assert [row[3:] for row in rows if row[0] == "b.bvh"] == [(work.LOST, "1")]
    assert contacts == (stays[0] == work.DONE)


_LOST_CHUNKS = [robot_row(work.STATES, 8 * k, work.LOST) for k in range(3, 9)]


def robot_rows(states):
    return [robot_row(work.SAMPLES, 0), *(robot_row(work.STATES, 8 * k) for k in range(states))]


@pytest.mark.parametrize("tables, states", [
    ((robot_rows(3), robot_rows(1) + _LOST_CHUNKS), 3),
    ((robot_rows(1) + _LOST_CHUNKS, robot_rows(3)), 3),
    ((robot_rows(2), robot_rows(2)), 2),
    ((robot_rows(2), [robot_row(work.STATES, 0, work.BAD)]), 2),
])
def test_a_merge_keeps_the_robot_of_which_more_chunks_are_done(tmp_path, tables, states):
    other = robot_row(work.STATES, 0, options='{"seed": 2}')  # of which the last table knows nothing
    rows, _, pairs = merged_of(tmp_path, [*tables[0], other], *tables[1:])
    assert sorted(row[1] for row in rows) == [work.SAMPLES] + [work.STATES] * (states + 1)
    assert {row[3] for row in rows} == {work.DONE}
    assert [(what, options, count) for what, _, options, _, _, _, count, _ in pairs] == [
        (work.SAMPLES, "{}", 5), (work.STATES, other.key.options, 5), (work.STATES, "{}", 5 * states),
    ]


def test_a_merge_takes_a_matrix_that_has_no_chunks_of_its_own(tmp_path):
    states = robot_row(work.STATES, 0)
    for name in ("a", "b"):
        with contextlib.closing(table.Table(str(tmp_path / f"{name}.sqlite"))) as base:
            base.add([states])
            base.add_pairs(states.key._replace(what=work.SAMPLES), [work.LinkPair("a", "c", "file", 0, None)])
    names = [str(tmp_path / f"{name}.sqlite") for name in ("a", "b")]
    with table.reserved(names), contextlib.closing(table.Table(str(tmp_path / "all.sqlite"))) as base:
        for name in names:
            base.merge(name)
        assert len(list(base.pairs())) == 2


def test_what_is_no_table_is_not_merged(alone, quick):
    write_corpus(alone.folder / "corpus", 1)
    assert quick("self", "corpus").code == 0
    (alone.folder / "text.sqlite").write_text("no database " * 100)
    shutil.copy(alone.folder / "scan.sqlite", alone.folder / "old.sqlite")
    with contextlib.closing(sqlite3.connect(alone.folder / "old.sqlite")) as base:
        base.execute("PRAGMA user_version = 3")
    busy = table.Table(str(alone.folder / "busy.sqlite"))
    for name, told in (
        ("text.sqlite", "file is not a database"), ("gone.sqlite", "there is no such table"),
        ("old.sqlite", "it has format 3, and this cab scan writes format 4"),
        ("busy.sqlite", "another cab scan writes it"),
    ):
        outcome = quick("merge", "scan.sqlite", name, "--table", "all.sqlite")
        assert outcome.code == 1 and f"{name}: {told}" in outcome.error
        assert not (alone.folder / "all.sqlite").exists()
    busy.close()
    assert not list(alone.folder.glob("*.lock"))
    old = quick("self", "corpus", "--table", "old.sqlite")
    assert old.code == 1 and "old.sqlite: it has format 3, and this cab scan writes format 4" in old.error
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
