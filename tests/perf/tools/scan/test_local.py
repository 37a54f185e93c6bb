"""Workers of this machine: what they survive and leave behind; shards, and the merge of their tables."""

import contextlib
import multiprocessing
import os
import pathlib
import random
import resource
import shutil
import signal
import sqlite3
import struct
import subprocess
import sys

import pytest
from cab_scan import command, export, local, summary, table, work

from conftest import arm_bvh, rounds, write_corpus
from faults import children_of, wait_for_rows, workers_of
from test_robots import pairs_of, write_arm


@pytest.fixture
def loader(scan):
    scan.environment["PYTHONPATH"] = f"{pathlib.Path(__file__).parent}{os.pathsep}{os.environ['PYTHONPATH']}"
    return "fault_loader:load"


def write_list(scan, parts):
    write_corpus(scan.folder / "corpus", len(parts))
    files = sorted((scan.folder / "corpus").rglob("*.bvh"))
    lines = [f"{file.relative_to(scan.folder)},{part}" for file, part in zip(files, parts)]
    (scan.folder / "list.csv").write_text("\n".join(["path,part", *lines]) + "\n")


def test_any_number_of_workers_makes_one_table_and_no_other_file(scan, quick):
    write_corpus(scan.folder / "corpus", 12)
    wanted = quick("self", "corpus", "--table", "two.sqlite")
    outcome = scan("self", "corpus", "--workers", 3)
    assert outcome.code == 0 and outcome.hash == wanted.hash
    assert {path.name for path in scan.folder.iterdir()} == {"corpus", "two.sqlite", "scan.sqlite"}
    assert len(scan.rows()) == 12
    again = scan("self", "corpus")
    assert again.code == 0 and again.hash == outcome.hash


def test_a_scheduler_is_refused_where_there_is_no_dask(scan, monkeypatch):
    write_corpus(scan.folder / "corpus", 1)
    monkeypatch.setattr(command.importlib.util, "find_spec", lambda name: None)
    refused = scan.here("self", "corpus", "--scheduler", "tcp://127.0.0.1:1")
    assert refused.code == 1 and "Python has no module distributed" in refused.error


def test_what_kills_its_process_is_a_row_and_blames_nobody_else(scan, loader):
    parts = ["", "kill", "", "once", "eat", ""] + [""] * 6
    write_list(scan, parts)
    outcome = scan("self", "--list", "list.csv", "--loader", loader)
    assert outcome.code == 1 and "its worker died" in outcome.error and "out of memory" in outcome.error
    rows = {row["part"]: row for row in scan.rows()}
    assert len(scan.rows()) == 12
    assert rows["kill"]["outcome"] == rows["eat"]["outcome"] == "lost"
    assert rows["once"]["outcome"] == "done"
    assert sum(row["outcome"] == "done" for row in scan.rows()) == 10


def test_a_process_that_takes_too_much_memory_is_a_row(scan, loader):
    write_list(scan, ["", "grow", ""])
    outcome = scan("self", "--list", "list.csv", "--loader", loader, "--memory", "1GB")
    assert outcome.code == 1 and "out of memory" in outcome.error
    assert [row["outcome"] for row in scan.rows()] == ["done", "lost", "done"]


def is_running(number):
    try:
        return pathlib.Path(f"/proc/{number}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


def test_what_takes_too_long_is_a_row_and_leaves_no_process(scan, loader):
    parts = ["", "hang", "", "hold 600", ""]
    write_list(scan, parts)
    scan.environment["TMPDIR"] = str(scan.folder / "temporary")
    (scan.folder / "temporary").mkdir()
    outcome = scan("self", "--list", "list.csv", "--loader", loader, "--most-seconds", 4)
    assert outcome.code == 1 and "more than --most-seconds" in outcome.error
    assert [row["outcome"] for row in scan.rows()] == ["lost" if part else "done" for part in parts]
    (file,) = (scan.folder / "corpus").rglob("*.started")
    numbers = [int(line) for line in file.read_text().splitlines()]
    assert len(numbers) == 2  # in a task, then alone
    assert not any(map(is_running, numbers))
    assert list((scan.folder / "temporary").iterdir()) == []


def test_a_worker_that_is_stopped_is_killed_and_its_item_is_named(scan, monkeypatch):
    write_list(scan, ["stop", "", ""])
    monkeypatch.setattr(local, "_SURPLUS_SECONDS", 10)
    monkeypatch.setattr(local, "make_tasks", lambda items, _: [items[1:], items[:1]])
    give, given = local._Worker.give, []

    def give_a_stopped_one(worker, task):
        if not given:  # before its first item
            os.kill(worker.process.pid, signal.SIGSTOP)
        given.append([item.part for item in task])
        give(worker, task)

    monkeypatch.setattr(local._Worker, "give", give_a_stopped_one)
    with local.pool(2, "1GB", 4) as pool:
        outcome = scan.here("self", "--list", "list.csv", "--loader", "fault_loader:load", workers=pool)
    assert outcome.code == 0 and [row["outcome"] for row in scan.rows()] == ["done"] * 3, outcome.error
    assert given[:2] == [["", ""], ["stop"]] and sorted(given[2:]) == [[""], [""], ["stop"]]  # together, then alone
    files = sorted((scan.folder / "corpus").rglob("*.bvh"))[:2]
    assert sorted(outcome.error.splitlines()) == sorted(
        f"cab scan: {file.relative_to(scan.folder)}{part}: its worker is silent after --most-seconds, and is killed"
        for file, part in zip(files, [" stop", ""])
    )


def test_a_worker_that_is_stopped_within_a_message_is_one_that_died(monkeypatch):
    monkeypatch.setattr(local, "_SURPLUS_SECONDS", 1)
    pipe, other = multiprocessing.Pipe()
    local._bound(pipe)
    os.write(other.fileno(), struct.pack("!i", 100) + b"half")
    with pytest.raises(OSError):
        pipe.recv()
    with pytest.raises(OSError):
        pipe.send(bytes(1 << 24))  # which nobody reads


def test_a_pool_whose_rows_could_not_be_written_gives_them_to_no_later_scan(scan, workers, quick):
    write_list(scan, ["", "hold 1", "hold 1", ""])

    class Unwritten:
        def dispatch(self, items, _finished):
            workers.dispatch(items, lambda rows: 1 / 0)

    with pytest.raises(ZeroDivisionError):
        scan.here("self", "--list", "list.csv", "--loader", "fault_loader:load", workers=Unwritten())
    (file, *_) = sorted((scan.folder / "corpus").rglob("*.bvh"))
    assert quick("self", file, "--table", "other.sqlite").code == 0
    assert [row["file"] for row in scan.rows(table="other.sqlite")] == [str(file)]


_INTERRUPTED = """
import os, signal, sys, time
from cab_scan import __main__, local

def slowly(worker, *words):
    make(worker, *words)
    os.kill(os.getpid(), signal.SIGINT)
    time.sleep(600)

make, local._Worker.__init__ = local._Worker.__init__, slowly
sys.exit(__main__.main())
"""


def test_an_interrupt_while_workers_start_leaves_no_folder(scan):
    write_corpus(scan.folder / "corpus", 1)
    (scan.folder / "temporary").mkdir()
    ended = subprocess.run(
        [sys.executable, "-P", "-c", _INTERRUPTED, "self", "corpus"], cwd=scan.folder, capture_output=True, text=True,
        env={**os.environ, "TMPDIR": str(scan.folder / "temporary")}, timeout=120, check=False,
    )
    assert ended.returncode == 130 and ended.stderr.startswith("cab scan: stopped;"), ended.stderr
    assert list((scan.folder / "temporary").iterdir()) == []


def test_workers_have_folders_of_their_own_which_go_with_them(scan, loader):
    write_list(scan, ["folder", "folder"] * 4)
    assert scan("self", "--list", "list.csv", "--loader", loader).code == 0
    seen = {file.read_text() for file in (scan.folder / "corpus").rglob("*.folder")}
    assert len({pathlib.Path(name).parent for name in seen}) == 1 and len(seen) == 2
    assert not any(map(os.path.exists, seen))


def test_a_limit_that_is_there_already_stays(scan, loader):
    write_list(scan, ["", "grow", ""])
    limit = (1 << 30, 1 << 30)
    outcome = scan(
        "self", "--list", "list.csv", "--loader", loader, "--memory", "1000GB",
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_DATA, limit),
    )
    assert outcome.code == 1 and "out of memory" in outcome.error
    assert [row["outcome"] for row in scan.rows()] == ["done", "lost", "done"]


def test_an_interrupt_ends_all_processes_and_the_same_command_goes_on(scan, loader):
    write_list(scan, ["slow"] * 40)
    scan.environment["FAULT_SECONDS"] = "0.05"
    words = ["self", "--list", "list.csv", "--loader", loader]
    process = scan.start(*words)
    wait_for_rows(scan, 5, process)
    assert len(workers_of(process)) == 2
    os.killpg(process.pid, signal.SIGINT)  # as a terminal does: to the scan and its processes
    out, error = process.communicate(timeout=60)
    assert process.returncode == 130 and "the same command goes on" in error
    assert "Traceback" not in error and "KeyboardInterrupt" not in error and out == ""
    assert children_of(process.pid) == {}
    assert not (scan.folder / "scan.sqlite.lock").exists()
    assert scan(*words).code == 0 and len(scan.rows()) == 40


def test_shards_share_all_files_and_their_merge_is_the_whole_table(scan, quick):
    write_corpus(scan.folder / "corpus", 7)
    (scan.folder / "corpus/bad.bvh").write_text("")
    whole = quick("self", "corpus", "--table", "whole.sqlite", "--csv", "whole.csv")
    files = []
    for number in range(1, 4):
        scan("self", "corpus", "--shard", f"{number}/3", "--table", f"{number}.sqlite")
        files += [row["file"] for row in scan.rows(table=f"{number}.sqlite")]
    assert sorted(files) == sorted(row["file"] for row in scan.rows(table="whole.sqlite"))
    tables = [f"{number}.sqlite" for number in (3, 1, 2)]
    for _ in range(2):  # twice is the same
        merged = scan("merge", *tables, "--csv", "scan.csv")
        assert merged.code == whole.code == 1 and merged.hash == whole.hash
    for name in ("csv", "contacts.csv"):
        there, wanted = ((scan.folder / f"{stem}.{name}").read_text() for stem in ("scan", "whole"))
        assert [line.split(",")[:20] for line in there.splitlines()] == [
            line.split(",")[:20] for line in wanted.splitlines()
        ]
    nothing = quick("self", "corpus/left/clip0001.bvh", "--shard", "2/2", "--table", "none.sqlite")
    assert nothing.code == 0 and scan.rows(table="none.sqlite") == []


def test_a_merge_replaces_rows_of_the_same_work(scan, quick):
    for name in ("arm", "other"):
        write_arm(scan.folder / f"{name}.urdf")
    (scan.folder / "clip.bvh").write_text(arm_bvh([3 * frame % 130 for frame in range(40)]))
    words = ["--states", 2000, "--samples", 1000, "--chunk", 1000]
    for table, file in (("a", "arm"), ("b", "other"), ("whole", "*")):
        assert quick("robot", f"{file}.urdf", *words, "--table", f"{table}.sqlite").code == 0
    for table in ("a", "b"):
        assert quick("self", "clip.bvh", "--table", f"{table}.sqlite").code == 0
    assert quick("self", "clip.bvh", "--table", "whole.sqlite").code == 0
    merged = quick("merge", "a.sqlite", "b.sqlite", "a.sqlite", "--table", "all.sqlite")
    assert merged.code == 0
    assert merged.hash == quick("merge", "whole.sqlite", "--table", "copy.sqlite").hash
    assert pairs_of(scan, "robot states", "all.sqlite") == pairs_of(scan, "robot states", "whole.sqlite")


def clip_row(outcome, version="1", file="a.bvh"):
    key = work.Key(file, "", "", work.SELF, "p", "{}")
    contacts = [work.Contact("", "a", "", "b", 1, 2, 0.1, 0.2, 1)] if outcome == work.DONE else []
    return work.Row(key, outcome=outcome, version=version, contacts=contacts)


def robot_row(what, first, outcome=work.DONE, options="{}", states=8):
    key = work.Key("r.urdf", "", f"{first}+{states}", what, "p", options)
    is_done = outcome == work.DONE
    pairs = [work.LinkPair("a", "b", "", 5, first)] if is_done else []
    return work.Row(key, outcome=outcome, version="1", frames=states if is_done else None, pairs=pairs)


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
        return content_of(base)


def content_of(base):
    rows = list(base.rows(("file", "what", "part", "outcome", "version")))
    return rows, len(list(base.contacts())), [pair[1:] for pair in base.pairs()]


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
def test_a_merge_keeps_the_robot_of_which_more_states_are_done(tmp_path, tables, states):
    other = robot_row(work.STATES, 0, options='{"seed": 2}')  # of which the last table knows nothing
    rows, _, pairs = merged_of(tmp_path, [*tables[0], other], *tables[1:])
    assert sorted(row[1] for row in rows) == [work.SAMPLES] + [work.STATES] * (states + 1)
    assert {row[3] for row in rows} == {work.DONE}
    assert [(what, options, count) for what, _, options, _, _, _, count, _ in pairs] == [
        (work.SAMPLES, "{}", 5), (work.STATES, other.key.options, 5), (work.STATES, "{}", 5 * states),
    ]


def test_a_merge_counts_states_not_chunks(tmp_path):
    large = [robot_row(work.STATES, 0, states=8), robot_row(work.STATES, 8, states=8)]
    small = [robot_row(work.STATES, 0, states=8), robot_row(work.STATES, 8, states=1)]
    for order in ([large, small], [small, large]):
        folder = tmp_path / str(order.index(small))
        folder.mkdir()
        rows, _, _ = merged_of(folder, *order)
        assert [row[2] for row in rows] == ["0+8", "8+8"]


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


def _changed_table(tmp_path, change):
    name = str(tmp_path / "changed.sqlite")
    merged_of(tmp_path, robot_rows(3))
    shutil.copy(tmp_path / "all.sqlite", name)
    with contextlib.closing(sqlite3.connect(name, isolation_level=None)) as base:
        change(base)
    return name


def _as_before_types(base):
    base.execute("PRAGMA writable_schema = ON")
    base.execute("UPDATE sqlite_master SET sql = replace(sql, ' STRICT', '')")


def _with_bytes_for_text(base):
    base.execute("PRAGMA writable_schema = ON")
    base.execute("UPDATE sqlite_master SET sql = CAST(sql AS BLOB) WHERE name = 'contacts_of'")


def _with_text_for_numbers(base):
    ((made,),) = base.execute("SELECT sql FROM sqlite_master WHERE name = 'work'")
    base.execute("PRAGMA writable_schema = ON")
    base.execute("UPDATE sqlite_master SET sql = replace(sql, ' STRICT', '') WHERE name = 'work'")
    base.execute("PRAGMA writable_schema = RESET")
    base.execute("UPDATE work SET frames = 'many'")
    base.execute("PRAGMA writable_schema = ON")
    base.execute("UPDATE sqlite_master SET sql = ? WHERE name = 'work'", (made,))


@pytest.mark.parametrize("change, told", [
    (lambda base: base.execute("ALTER TABLE work DROP COLUMN hits"), "work is not as cab scan makes it"),
    (lambda base: base.execute("DROP INDEX contacts_of"), "contacts_of is not as cab scan makes it"),
    (_with_bytes_for_text, "contacts_of is not as cab scan makes it"),
    (_as_before_types, "work is not as cab scan makes it"),
    (_with_text_for_numbers, "value in work.frames"),
])
def test_a_table_with_other_columns_or_values_is_refused(tmp_path, change, told):
    name = _changed_table(tmp_path, change)
    for open_table in (table.Table, lambda path: table.reserved([path]).__enter__()):
        with pytest.raises(table.TableError) as error:
            open_table(name)
        assert str(error.value).startswith(f"{name}: ") and told in str(error.value)


def test_a_table_with_views_and_indexes_of_a_user_stays_one(tmp_path):
    name = _changed_table(tmp_path, lambda base: base.executescript(
        "CREATE VIEW touching AS SELECT file FROM work WHERE hits > 0; CREATE INDEX by_hits ON work (hits); ANALYZE"
    ))
    with contextlib.closing(table.Table(name)) as base:
        assert base.totals().rows == 4


def test_a_damaged_table_is_refused_or_read_to_its_end(tmp_path, capsys):
    wanted = merged_of(tmp_path, robot_rows(3), robot_rows(2))
    good = (tmp_path / "all.sqlite").read_bytes()
    chance = random.Random(41)
    outcomes = {"read": 0, "refused": 0}
    for number in range(round(100 * rounds())):
        damaged = bytearray(good[:chance.randrange(1, len(good))] if chance.random() < 0.1 else good)
        for _ in range(chance.randint(1, 20)):
            damaged[chance.randrange(len(damaged))] = chance.randrange(256)
        (tmp_path / f"{number}.sqlite").write_bytes(damaged)
        mine = tmp_path / f"mine_{number}.sqlite"
        shutil.copy(tmp_path / "all.sqlite", mine)
        try:
            name = str(tmp_path / f"{number}.sqlite")
            with table.reserved([name]), contextlib.closing(table.Table(str(mine))) as base:
                base.merge(name)
                export.write_csv_files(base, export.csv_files(str(tmp_path / "out.csv")))
                summary.tell(base, [], "robot")
            with contextlib.closing(table.Table(str(mine))) as base:
                assert len(content_of(base)[0]) >= len(wanted[0])
            outcomes["read"] += 1
        except table.TableError as error:
            assert str(error).startswith(f"{name}: ")
            outcomes["refused"] += 1
            with contextlib.closing(table.Table(str(mine))) as base:
                assert content_of(base) == wanted
    assert outcomes["refused"] > 0 and (outcomes["read"] > 0 or rounds() < 1), outcomes
    assert "Traceback" not in capsys.readouterr().err


def test_rows_that_nobody_reads_to_the_end_may_outlive_the_table(tmp_path):
    merged_of(tmp_path, robot_rows(3))
    with contextlib.closing(table.Table(str(tmp_path / "all.sqlite"))) as base:
        left = [base.rows(("file",)), base.pairs()]
        for rows in left:
            next(rows)
    for rows in left:
        rows.close()


def test_what_is_no_table_is_not_merged(scan, quick):
    write_corpus(scan.folder / "corpus", 1)
    assert quick("self", "corpus").code == 0
    (scan.folder / "text.sqlite").write_text("no database " * 100)
    shutil.copy(scan.folder / "scan.sqlite", scan.folder / "old.sqlite")
    with contextlib.closing(sqlite3.connect(scan.folder / "old.sqlite")) as base:
        base.execute("PRAGMA user_version = 4")
    busy = table.Table(str(scan.folder / "busy.sqlite"))
    for name, told in (
        ("text.sqlite", "file is not a database"), ("gone.sqlite", "there is no such table"),
        ("old.sqlite", "it has format 4, and this cab scan writes format 5"),
        ("busy.sqlite", "another cab scan writes it"),
    ):
        outcome = quick("merge", "scan.sqlite", name, "--table", "all.sqlite")
        assert outcome.code == 1 and f"{name}: {told}" in outcome.error
        assert not (scan.folder / "all.sqlite").exists()
    busy.close()
    assert not list(scan.folder.glob("*.lock"))
    old = quick("self", "corpus", "--table", "old.sqlite")
    assert old.code == 1 and "old.sqlite: it has format 4, and this cab scan writes format 5" in old.error
    same = quick("merge", "scan.sqlite", "--table", "scan.sqlite")
    assert same.code == 2 and "is an input" in same.error
    for words in (["self", "corpus", "--shard", "0/2"], ["self", "corpus", "--shard", "3/2"], ["merge"]):
        outcome = scan(*words)
        assert outcome.code == 2 and "cab scan" in outcome.error


def test_the_worst_clips_are_printed_last_the_deepest_first(scan, quick):
    write_corpus(scan.folder / "corpus", 14)
    outcome = quick("self", "corpus")
    assert outcome.code == 0
    lines = outcome.out.splitlines()
    (begin,) = [number for number, line in enumerate(lines) if line.startswith("the worst ")]
    rows = sorted(
        (row for row in scan.rows() if row["hits"]), key=lambda row: (-row["depth"], -row["hit_frames"], row["file"])
    )
    assert len(rows) > 10
    assert len(lines) == begin + 11
    for line, row in zip(lines[begin + 1:], rows):
        words = line.split()
        assert words[0] == row["file"]
        assert words[1:4] == [str(row["hit_frames"]), "of", "40"]
        assert words[4] == f"{100 * row['depth']:.1f}" and words[5] == str(row["depth_frame"])
        assert line.endswith(f"{row['depth_link_a']} - {row['depth_link_b']}")


def test_no_seconds_are_negative(tmp_path, capsys):
    row = clip_row(work.DONE)
    row.frames = row.hit_frames = row.hits = 0
    row.load_seconds, row.engine_seconds, row.seconds = 1.0, 0.5, 0.4
    with contextlib.closing(table.Table(str(tmp_path / "scan.sqlite"))) as base:
        base.add([row])
        summary.tell(base, [], "self")
    assert "seconds of workers  1.0 reading, 0.5 testing, 0.0 counting\n" in capsys.readouterr().out


def test_sizes_of_memory_have_decimal_and_binary_units():
    for size, wanted in (
        ("800MB", 800 * 10**6), ("1.5GiB", 3 << 29), ("700kB", 700 * 10**3), ("3 MiB", 3 << 20), ("2GB", 2 * 10**9),
        ("99999999999GB", 2**63 - 1), ("9" * 400 + "GiB", 2**63 - 1),
    ):
        assert local.bytes_of(size) == wanted, size


def test_as_much_memory_as_one_likes_is_no_fault_of_a_file(scan):
    write_corpus(scan.folder / "corpus", 1)
    outcome = scan("self", "corpus", "--memory", "99999999999GB")
    assert outcome.code == 0, outcome.error
    assert [row["outcome"] for row in scan.rows()] == ["done"]


def test_a_scan_that_is_out_of_memory_says_so(scan, monkeypatch):
    def no_memory(*_):
        raise MemoryError

    monkeypatch.setattr(command.corpus, "find", no_memory)
    outcome = scan.here("self", "corpus")
    assert outcome.code == 1 and outcome.error == "cab scan: out of memory\n"


def test_a_closed_output_is_told_before_anything_is_done(scan):
    write_corpus(scan.folder / "corpus", 1)
    outcome = scan("self", "corpus", preexec_fn=lambda: os.close(1))
    assert outcome.code == 1
    assert outcome.error == "cab scan: cannot write to standard output: Bad file descriptor\n"
    assert not (scan.folder / "scan.sqlite").exists()
    outcome = scan("self", "corpus", preexec_fn=lambda: os.close(2))
    assert outcome.code == 0 and outcome.hash and len(scan.rows()) == 1
