"""Files, names and folders of strangers: what may not run, hang, be written over, or pass for something else."""

import csv
import errno
import fnmatch
import os
import pathlib
import re
import signal
import socket
import subprocess
import sys
import threading
import tracemalloc
from random import Random

import cab
import pytest
from cab_scan import corpus, hashing, printable, reading, sequences, table, tasks, work

from conftest import ROOT, arm_bvh, write_corpus
from faults import children_of, wait_for_rows, workers_of

COMMAND = os.environ.get("CAB_COMMAND", "")


def items_of(*paths, what=work.SELF, **test):
    found = corpus.find([str(path) for path in paths], [], "", work.FileOptions(), corpus.MOTION_SUFFIXES)
    options = work.TestOptions(**test)
    text = "refit=cab exact=none" if what == work.RECORDING else ALL_POLICIES
    return [work.Item(what, entry.source, (text,), "{}", options, (None,)) for entry in found.entries]


ALL_POLICIES = " ".join(f"{field.name}={getattr(cab.Policies(), field.name)}" for field in cab.policy_table())


# ------------------------------------------------------------------------------------------------------------- S1: code


_EVIL = 'open(__import__("os").environ["MARK"], "a").write(__name__ + "\\n")\n'
# What Python, Dask and cab_scan import first, and what the processes of workers do.
_MODULES = "numpy dask distributed csv cab cab_scan multiprocessing contextlib tornado types".split()


def begin_among_evil(scan, begin):
    """A scan in a folder with modules of a stranger, which say that they ran."""
    folder = scan.folder / begin / "corpus"
    folder.mkdir(parents=True)
    (folder / "a.bvh").write_text(arm_bvh([3 * frame % 130 for frame in range(40)]))
    modules = _MODULES if begin != "-m" else ("numpy", "dask", "csv", "cab", "tornado")  # -m itself imports others
    for name in modules:
        (folder / f"{name}.py").write_text(_EVIL)
    (folder.parent / "mine.py").write_text("from cab_scan import copies\nload = lambda request: [copies.load_file"
                                           "(request.path, request.options)]\n")
    environment = {**os.environ, "MARK": str(folder.parent / "mark"), "CAB_PYTHON": sys.executable}
    # Its empty parts are the current folder.
    environment["PYTHONPATH"] = f":{folder.parent}:{os.environ['PYTHONPATH']}:"
    words = ["self", "a.bvh", "--table", "../a.sqlite", "--loader", "mine:load", "--workers", "1"]
    if begin == "command":
        command = [COMMAND, "scan"]
    else:
        # As before Python 3.11, which has no PYTHONSAFEPATH.
        environment["PYTHONPATH"] = environment["PYTHONPATH"].strip(":")
        environment.pop("PYTHONSAFEPATH", None)
        start = "import sys; sys.path[:] = filter(None, sys.path); from cab_scan.__main__ import main; sys.exit(main())"
        assert start in (ROOT / "perf/tools/scan/scan.cpp").read_text()
        command = [sys.executable, *(["-m", "cab_scan"] if begin == "-m" else ["-c", start])]
    return subprocess.Popen(
        [*command, *words], cwd=folder, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True
    )


def test_no_code_of_the_current_folder_runs(scan):
    processes = {begin: begin_among_evil(scan, begin) for begin in ("command", "old Python", "-m")}
    for begin, process in processes.items():
        _, error = process.communicate(timeout=120)
        assert process.returncode == 0, (begin, error)
        mark = scan.folder / begin / "mark"
        assert not mark.exists(), (begin, mark.read_text())
        assert [row["outcome"] for row in scan.rows(table=f"{begin}/a.sqlite")] == ["done"], begin


# ------------------------------------------------------------------------------------------------- S2: others' commands


def listening_ports(process):
    """Of a process, by its number, and those that it started."""
    sockets = set()
    for number in [process, *children_of(process)]:
        for place in pathlib.Path(f"/proc/{number}/fd").glob("*"):
            try:
                sockets.add(os.readlink(place))
            except OSError:
                pass
    ports = []
    for name in ("tcp", "tcp6"):
        for line in pathlib.Path(f"/proc/net/{name}").read_text().splitlines()[1:]:
            words = line.split()
            if words[3] == "0A" and f"socket:[{words[9]}]" in sockets:
                ports.append(int(words[1].rpartition(":")[2], 16))
    return ports


def test_other_users_of_the_machine_cannot_reach_workers(scan):
    (scan.folder / "slow.py").write_text("import time\nfrom cab_scan import copies\n"
                                         "def load(request):\n    time.sleep(10 * int(request.part))\n"
                                         "    return copies.load(request)\n")
    (scan.folder / "a.bvh").write_text(arm_bvh([3 * frame % 130 for frame in range(40)]))
    (scan.folder / "list.csv").write_text("path,part\n" + "".join(f"a.bvh,{number}\n" for number in range(20)))
    scan.environment["PYTHONPATH"] = f"{scan.folder}{os.pathsep}{os.environ['PYTHONPATH']}"
    process = scan.start("self", "--list", "list.csv", "--loader", "slow:load")
    wait_for_rows(scan, 1, process)
    assert len(workers_of(process)) == 2
    ports = listening_ports(process.pid)
    process.terminate()
    out, error = process.communicate(timeout=60)
    assert ports == []
    with socket.create_server(("127.0.0.1", 0)) as server:  # one that listens is seen
        assert server.getsockname()[1] in listening_ports(os.getpid())
    assert process.returncode == 130 and out == "", error


# ------------------------------------------------------------------------------------------ S3: files that are no files


def test_only_regular_files_are_opened_and_no_more_than_they_are_said_to_have(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "large").touch()
    os.truncate(tmp_path / "large", 8 << 30)
    (tmp_path / "link").symlink_to("/dev/zero")
    for name, told in (("pipe", "is not a regular file"), ("link", "is not a regular file"),
                       (".", "is a directory, not a file"), ("large", "the file is larger than 256 MiB")):
        with pytest.raises(reading.RefusedError, match=told):
            hashing.file_sha256(str(tmp_path / name), cab.MAX_FILE_BYTES)
    assert cab.MAX_FILE_BYTES == 256 << 20
    # Its size is 0, and what can be read of it has no end.
    assert reading.bytes_of("/proc/self/pagemap", 1 << 30) == b""


_URI = "../" * 12 + "proc/self/pagemap"


def test_strange_files_are_rows_of_their_own(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    os.mkfifo("a.bvh")
    pathlib.Path("b.bvh").touch()
    os.truncate("b.bvh", 8 << 30)
    pathlib.Path("c.gltf").write_text('{"asset":{"version":"2.0"},"buffers":[{"byteLength":4,"uri":"%s"}]}' % _URI)
    pathlib.Path("d.gltf").write_text('{"asset":{"version":"2.0"},"buffers":[' + "[" * 100000)
    pathlib.Path("e.amc").write_text("x")  # without a skeleton
    os.mkfifo("f.gltf")
    os.mkdir("sub")
    pathlib.Path("sub/11_01.amc").write_text("x")
    os.mkfifo("sub/11.asf")
    report = tasks.run_items(items_of("."), str(tmp_path))
    told = {row.key.file: (row.outcome, row.error) for row in report.rows}
    assert all(outcome == "bad" for outcome, _ in told.values())
    for name, words in (
        ("a.bvh", "is not a regular file"), ("b.bvh", "larger than 256 MiB"), ("f.gltf", "is not a regular file"),
        ("c.gltf", "not below the file's folder"), ("d.gltf", "nested more than"), ("e.amc", "no skeleton"),
        ("sub/11_01.amc", "11.asf: is not a regular file"),
    ):
        assert words in told[name][1] and "/tmp" not in told[name][1], told[name]
    # What is no recording is refused by its first bytes, however many there are.
    pathlib.Path("g.cab").touch()
    os.truncate("g.cab", 1 << 40)
    (item,) = items_of("g.cab", what=work.RECORDING)
    assert tasks._content(item, ["g.cab"]) is None


def test_companions_are_those_that_are_read_with_a_file(tmp_path):
    def companions(name, text):
        (tmp_path / name).write_text(text)
        return [os.path.relpath(path, tmp_path) for path in hashing.companions(str(tmp_path / name))]

    for name in ("11.asf", "1.asf", "a b.bin", "walk.md5mesh"):
        (tmp_path / name).write_text("x")
    (tmp_path / "only").mkdir()
    (tmp_path / "only/dance.asf").write_text("x")
    assert companions("11_01.amc", "x") == ["11.asf"]
    assert companions("only/60_05.amc", "x") == ["only/dance.asf"]  # the only skeleton there
    gltf = '{"buffers": [{"uri": "a%20b.bin"}, {"uri": "data:x"}, {}, {"uri": "none.bin"}, {"uri": "/etc/passwd"}]}'
    assert companions("a.gltf", gltf) == ["a b.bin"]
    assert companions("a.vrm", gltf) == ["a b.bin"]
    assert companions("walk.md5anim", "x") == ["walk.md5mesh"]
    assert companions("a.bvh", "x") == companions("b.gltf", "[" * 100000) == []
    before = hashing.content_sha256([str(tmp_path / name) for name in ("a.gltf", "a b.bin")])
    (tmp_path / "a b.bin").write_text("y")
    assert hashing.content_sha256([str(tmp_path / name) for name in ("a.gltf", "a b.bin")]) != before


# ------------------------------------------------------------------------------------------------------------ S4: names


def test_different_names_stay_different_in_the_table():
    names = [os.fsdecode(b"\xff"), "\\xff", "\\\\xff", "\ud800", "\\ud800", "a", "å", "a\nb", "\x1b"]
    texts = [printable.table_text(name) for name in names]
    assert len(set(texts)) == len(names)
    assert texts[:2] == ["\\xff", "\\\\xff"] and texts[5:] == names[5:]
    assert all(text.encode() for text in texts)


def test_files_of_any_name_have_a_row_each(scan):
    folder = os.fsencode(scan.folder)
    good = arm_bvh([3 * frame % 130 for frame in range(40)])
    names = [b"good\xff.bvh", b"\xff\xfe.bvh", b"\\xff\\xfe.bvh", b"red\x1b[31m.bvh", b"two\nlines.bvh",
             "turn\u202e.bvh".encode(), b"=1+1.bvh"]
    for name in names:
        pathlib.Path(os.fsdecode(folder + b"/" + name)).write_text(good)
    pathlib.Path(os.fsdecode(folder + b"/\xffbad\x1b]0;x\x07.bvh")).write_text("HIERARCHY\n")
    os.mkdir(folder + b"/sub")
    pathlib.Path(os.fsdecode(folder + b"/sub/p\xff_01.amc")).write_text("x")
    os.mkdir(folder + b"/sub/p\xff.asf")
    outcome = scan("self", ".", "--workers", 1, "--csv", "scan.csv")
    assert outcome.code == 1
    rows = {row["file"]: row for row in scan.rows()}
    assert len(rows) == 9
    assert sum(row["outcome"] == "done" for row in rows.values()) == len(names)
    assert {"\\xff\\xfe.bvh", "\\\\xff\\\\xfe.bvh", "good\\xff.bvh", "sub/p\\xff_01.amc"} <= set(rows)
    assert "is a directory" in rows["sub/p\\xff_01.amc"]["error"]
    # A line per error, and nothing in it that a terminal obeys.
    lines = outcome.error.splitlines()
    assert len(lines) == 2 and all(printable.printable(line) == line for line in lines), lines
    with open(scan.folder / "scan.csv", newline="", encoding="utf-8") as file:
        files = [line["file"] for line in csv.DictReader(file)]
    assert "'=1+1.bvh" in files and "two\nlines.bvh" in files and len(files) == 9
    assert scan.here("self", ".", "--workers", 1).hash == outcome.hash


def test_what_a_loader_says_cannot_end_the_scan(tmp_path, monkeypatch):
    (tmp_path / "odd.py").write_text(
        "import sys\nfrom cab_scan import Sequence, copies\n"
        "def words(request):\n    raise ValueError('no \\udcff \\x1b[31m\\n\\u202e')\n"
        "def leave(request):\n    sys.exit(3)\n"
        "def name(request):\n    yield copies.load_file(request.path, request.options)._replace(name=None)\n"
        "def surrogate(request):\n"
        "    for name in ('\\udcff', '\\\\xff'):\n"
        "        yield copies.load_file(request.path, request.options)._replace(name=name)\n"
    )
    (tmp_path / "gone.py").write_text("import sys\nsys.exit(5)\n")
    (tmp_path / "a.bvh").write_text(arm_bvh([0, 30, 60]))
    monkeypatch.syspath_prepend(str(tmp_path))
    base = table.Table(str(tmp_path / "a.sqlite"))
    for function, told in (("words", "no ? ?[31m ?"), ("leave", "sys.exit(3)"), ("name", "the name None")):
        (row,) = tasks.run_items(items_of(tmp_path / "a.bvh", loader=f"odd:{function}"), str(tmp_path)).rows
        assert row.outcome == "bad" and told in row.error
        base.add([row])
    rows = tasks.run_items(items_of(tmp_path / "a.bvh", loader="odd:surrogate"), str(tmp_path)).rows
    assert [row.sequence for row in rows] == ["\\xff", "\\\\xff"]
    rows[0].depth_link_a = "\udcff"  # a link of a loader's body
    base.add(rows)
    base.close()
    with pytest.raises(sequences.LoaderError, match="SystemExit: 5"):
        sequences.find_loader("gone:load")


# ---------------------------------------------------------------------------------------------------------- S5: outputs


def test_an_output_is_neither_an_input_nor_another_output(scan):
    write_corpus(scan.folder / "corpus", 2)
    clip = scan.folder / "corpus/left/clip0001.bvh"
    (scan.folder / "hard.csv").hardlink_to(clip)
    (scan.folder / "soft.csv").symlink_to(clip)
    (scan.folder / "11_01.amc").write_text("x")
    (scan.folder / "11.asf").write_text("x")
    (scan.folder / "list.csv").write_text("path\ncorpus/left/clip0001.bvh\n")
    before = {path: path.read_bytes() for path in scan.folder.rglob("*") if path.is_file()}
    for words, told in (
        (["corpus", "--table", "t.sqlite", "--csv", "./t.sqlite"], "are the same file"),
        (["corpus", "--csv", "corpus/left/clip0001.bvh"], "is an input"),
        (["corpus", "--csv", "corpus/../corpus/left/clip0001.bvh"], "is an input"),
        (["corpus", "--csv", "hard.csv"], "is an input"),
        (["corpus", "--csv", "soft.csv"], "is an input"),
        (["corpus", "--table", "corpus/left/clip0001.bvh"], "is an input"),
        (["--list", "list.csv", "--csv", "list.csv"], "is an input"),
        (["11_01.amc", "--csv", "11.asf"], "is an input"),
        (["corpus", "--motion", "hard.csv", "--csv", "a.csv", "--table", "hard.csv"], "is an input"),
        (["corpus", "--csv", "/dev/null"], "is not a regular file"),
        (["corpus", "--csv", "corpus"], "is a directory"),
        (["corpus", "--table", ""], "the name of a file is wanted"),
        (["corpus", "--table", ":memory:"], "the name of a file is wanted"),
        (["corpus", "--table", "-"], "the name of a file is wanted"),
        (["corpus", "--csv", "-"], "the name of a file is wanted"),
        (["corpus", "--table", "a.csv", "--csv", "a.csv.lock"], "are the same file"),
    ):
        outcome = scan.here("self", *words)
        assert outcome.code == 2 and told in outcome.error, (words, outcome)
    assert {path: path.read_bytes() for path in scan.folder.rglob("*") if path.is_file()} == before


def test_no_output_is_standard_output(scan):
    write_corpus(scan.folder / "corpus", 1)
    for words in (["--csv", "/dev/stdout"], ["--csv", "report"], ["--table", "report"]):
        with open(scan.folder / "report", "a+", encoding="utf-8") as report:
            report.write("what was there before")
            report.flush()
            outcome = scan("self", "corpus", *words, stdout=report)
        assert outcome.code == 2 and outcome.error == (
            f"cab scan: {words[0]}: {words[1]} is standard output, which has the report\n"
        )
    assert (scan.folder / "report").read_text() == "what was there before" * 3
    outcome = scan("self", "corpus", "--csv", "/dev/stdout")
    assert outcome.code == 2 and "/dev/stdout is not a regular file" in outcome.error


def test_an_output_that_is_a_link_stays_one(scan, quick):
    write_corpus(scan.folder / "corpus", 1)
    (scan.folder / "far").mkdir()
    for name in ("scan.csv", "scan.contacts.csv"):
        (scan.folder / name).symlink_to(f"far/{name}")
    (scan.folder / "far/scan.csv").write_text("of another scan")
    assert quick("self", "corpus", "--csv", "scan.csv").code == 0
    for name in ("scan.csv", "scan.contacts.csv"):
        assert (scan.folder / name).is_symlink()
        assert (scan.folder / "far" / name).read_text().startswith("row,file")
    assert sorted(path.name for path in (scan.folder / "far").iterdir()) == ["scan.contacts.csv", "scan.csv"]


# -------------------------------------------------------------------------------------------------------- S6: the table


def test_a_table_has_one_lock_whatever_its_name(tmp_path):
    (tmp_path / "b.sqlite").symlink_to("a.sqlite")
    (tmp_path / "there").symlink_to(tmp_path)
    first = table.Table(str(tmp_path / "a.sqlite"))
    for name in ("a.sqlite", "b.sqlite", "there/b.sqlite"):
        with pytest.raises(table.TableError, match="another cab scan writes it"):
            table.Table(str(tmp_path / name))
    first.close()
    second = table.Table(str(tmp_path / "b.sqlite"))
    assert sorted(path.name for path in tmp_path.glob("*.lock")) == ["a.sqlite.lock"]
    second.close()
    assert not list(tmp_path.glob("*.lock"))
    (tmp_path / "c.sqlite").hardlink_to(tmp_path / "a.sqlite")
    with pytest.raises(table.TableError, match="hard links"):
        table.Table(str(tmp_path / "c.sqlite"))


def test_a_lock_leaves_alone_what_is_there(tmp_path):
    (tmp_path / "v.sqlite.lock").write_text("precious")
    (tmp_path / "w.sqlite.lock").symlink_to("v.sqlite.lock")
    os.mkfifo(tmp_path / "x.sqlite.lock")
    (tmp_path / "y.sqlite.lock").touch()
    for name, told in (("v", "no lock of cab scan"), ("w", "it is a link"), ("x", "no lock of cab scan")):
        with pytest.raises(table.TableError, match=told):
            table.Table(str(tmp_path / f"{name}.sqlite"))
    table.Table(str(tmp_path / "y.sqlite")).close()
    assert (tmp_path / "v.sqlite.lock").read_text() == "precious"
    assert sorted(path.name[0] for path in tmp_path.glob("*.lock")) == ["v", "w", "x", "y"]
    (tmp_path / "bad.sqlite").write_text("no table " * 100)
    with pytest.raises(table.TableError, match="not a database"):
        table.Table(str(tmp_path / "bad.sqlite"))
    with pytest.raises(table.TableError, match="No such file"):
        table.Table(str(tmp_path / "none/a.sqlite"))
    assert not (tmp_path / "bad.sqlite.lock").exists()
    # What a scan left that was killed.
    (tmp_path / "z.sqlite.lock").write_bytes(table._Lock._MARK)
    table.Table(str(tmp_path / "z.sqlite")).close()
    assert not (tmp_path / "z.sqlite.lock").exists()


def test_a_lock_that_a_full_disk_does_not_take_leaves_nothing(tmp_path, monkeypatch):
    def full(file, data):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    def nearly_full(file, data, write=os.write):
        return write(file, data[:3])

    for write in (full, nearly_full):
        with monkeypatch.context() as patch:
            patch.setattr(os, "write", write)
            before = len(os.listdir("/proc/self/fd"))
            with pytest.raises(table.TableError, match="a.sqlite.lock: No space left"):
                table.Table(str(tmp_path / "a.sqlite"))
            assert len(os.listdir("/proc/self/fd")) == before
        assert not list(tmp_path.iterdir())
    table.Table(str(tmp_path / "a.sqlite")).close()


def test_pairs_of_a_chunk_are_counted_once(tmp_path):
    base = table.Table(str(tmp_path / "a.sqlite"))
    key = work.Key("r.urdf", "", "0+8", work.STATES, "p", "{}")

    def row(outcome, sha256="1"):
        return work.Row(key, outcome=outcome, sha256=sha256, version="1", pairs=[work.LinkPair("a", "b", "", 5, 2)])

    base.add([work.Row(key, outcome=work.LOST, version="1")])
    base.add([row(work.DONE)])
    base.add([row(work.DONE)])
    assert base.touching(key) == {("a", "b"): 5} and base.totals().rows == 1
    with pytest.raises(table.TableError, match="of another robot"):
        base.add([row(work.DONE, "2")])
    base.close()


# -------------------------------------------------------------------------------------------------- S7: Ctrl-C, SIGTERM


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_the_scan_stops_at_any_moment(tmp_path, number):
    (tmp_path / "slow.py").write_text("import time\nfrom cab_scan import copies\n"
                                      "def load(request):\n    time.sleep(0.2)\n    return copies.load(request)\n")
    (tmp_path / "a.bvh").write_text(arm_bvh([3 * frame % 130 for frame in range(40)]))
    (tmp_path / "list.csv").write_text("path,part\n" + "".join(f"a.bvh,{number}\n" for number in range(2000)))
    environment = {**os.environ, "CAB_PYTHON": sys.executable,
                   "PYTHONPATH": f"{tmp_path}{os.pathsep}{os.environ['PYTHONPATH']}"}
    running = []
    for delay in (0.0, 0.05, 0.2, 0.5, 0.9, 1.4, 2.5):  # of which none is the end: that takes minutes
        words = ["self", "--list", "list.csv", "--loader", "slow:load", "--table", f"{delay}.sqlite"]
        process = subprocess.Popen([COMMAND, "scan", *words], cwd=tmp_path, env=environment, stdout=subprocess.PIPE,
                                   stderr=subprocess.PIPE, text=True, start_new_session=True)
        timer = threading.Timer(delay, os.killpg, [process.pid, number])
        timer.start()
        running.append((process, timer))
    for process, timer in running:
        timer.join()
        out, error = process.communicate(timeout=120)
        assert out == "" and children_of(process.pid) == {}
        if process.returncode == -number and error == "":
            continue  # before the command had done anything, the system ended it
        assert process.returncode == 130, error
        assert error.startswith("cab scan: stopped") and error.count("\n") == 1, error
    assert not list(tmp_path.glob("*.csv.*")) and not list(tmp_path.glob("*.lock"))


def test_the_scan_stops_in_a_call_that_does_not_return(tmp_path):
    program = """
import hashlib, signal, sys
from cab_scan import stopping
stopping.begin()
stopping.raise_from_now_on()
with stopping.cleaning(lambda: "clean", lambda made: print(made, flush=True)):
    line, words = "", "begun\\n"
    while True:
        try:
            line, words = words, ""
            print(line, end="", flush=True)
            hashlib.pbkdf2_hmac("sha256", b"", b"", 1 << 30)
        except KeyboardInterrupt:  # it came between two calls
            pass
"""
    words = [sys.executable, "-c", program]
    process = subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert process.stdout.readline() == "begun\n"
    process.send_signal(signal.SIGINT)
    out, error = process.communicate(timeout=120)
    assert (process.returncode, out) == (130, "clean\n") and error.startswith("cab scan: stopped")


@pytest.mark.parametrize("moment", ["before", "after", "away"])
def test_a_signal_while_something_is_made_or_put_away_leaves_none_of_it(tmp_path, moment):
    program = """
import os, signal, sys
from cab_scan import stopping

def stop(moment):
    if sys.argv[1] == moment:
        os.kill(os.getpid(), signal.SIGTERM)

def make():
    stop("before")
    open("made", "w").close()
    stop("after")
    return "made"

def put_away(name):
    stop("away")
    os.remove(name)

stopping.begin()
stopping.raise_from_now_on()
try:
    with stopping.cleaning(make, put_away) as name:
        print("with " + name)
    print("not stopped")
except KeyboardInterrupt:
    print("stopped")
    stopping.end()
"""
    words = [sys.executable, "-c", program, moment]
    ended = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True, timeout=120, check=False)
    assert (ended.returncode, ended.stderr) == (130, "")
    assert ended.stdout == ("with made\n" if moment == "away" else "") + "stopped\n"
    assert not list(tmp_path.iterdir())


# ----------------------------------------------------------------------------------------------------- S8: cab-scan.csv


def test_options_of_folders_are_told_and_come_from_below_what_is_named(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write_corpus(tmp_path / "corpus", 4)
    (tmp_path / "cab-scan.csv").write_text("path,units\n*,5\n")
    (tmp_path / "corpus/cab-scan.csv").write_text("path,units,fps\n*,2,\nleft/*3.bvh,3,60\n")

    def find(*paths, root=""):
        return corpus.find(paths, [], str(tmp_path / root) if root else "", work.FileOptions(), corpus.MOTION_SUFFIXES)

    found = find("corpus")
    assert [entry.source.options.units for entry in found.entries] == [2, 3, 2, 2]
    inner = tmp_path / "corpus/cab-scan.csv"
    assert found.notes == [
        f"{inner}: line 2 sets units=2 for 4 files", f"{inner}: line 3 sets units=3, fps=60 for 1 file",
        f"{tmp_path}/cab-scan.csv is not read: it is above what is scanned; with --root at its folder it counts",
    ]
    assert str(inner) in found.read
    for paths in (["corpus/left"], ["corpus/left/clip0001.bvh"], ["corpus/left/*1.bvh"]):
        found = find(*paths)
        assert {entry.source.options.units for entry in found.entries} == {None}
        assert [note.split(" ")[0] for note in found.notes] == [f"{tmp_path}/cab-scan.csv", str(inner)]
    assert {entry.source.options.units for entry in find("corpus/*/*1.bvh").entries} == {2}
    assert {entry.source.options.units for entry in find("corpus/left/clip0001.bvh", root="corpus").entries} == {2}
    (tmp_path / "corpus/cab-scan.csv").write_text("path,motion\n*,/proc/self/pagemap\n")
    for motion in ("/proc/self/pagemap", "../cab-scan.csv", "left/../../x"):
        (tmp_path / "corpus/cab-scan.csv").write_text(f"path,motion\n*,{motion}\n")
        with pytest.raises(corpus.CorpusError, match="line 2: motion must be below the folder"):
            find("corpus")
    (tmp_path / "corpus/cab-scan.csv").write_text("path,motion\n*,left/clip0001.bvh\n")
    assert find("corpus").entries[0].source.options.motion == str(tmp_path / "corpus/left/clip0001.bvh")
    (tmp_path / "corpus/cab-scan.csv").unlink()
    os.mkfifo(tmp_path / "corpus/cab-scan.csv")
    with pytest.raises(corpus.CorpusError, match="is not a regular file"):
        find("corpus")


def test_options_of_folders_are_those_of_listed_files_too(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write_corpus(tmp_path / "corpus", 2)
    write_corpus(tmp_path / "other", 1)
    for folder, units in ((".", 5), ("corpus", 2), ("corpus/left", 3), ("other/right", 4), ("other", 6)):
        (tmp_path / folder / "cab-scan.csv").write_text(f"path,units\n*,{units}\n")
    files = ["left/clip0001.bvh", "right/clip0000.bvh", "../other/right/clip0000.bvh", "gone/x.bvh", "g\0ne/x.bvh"]
    (tmp_path / "corpus/list.txt").write_text("\n".join(files))

    def find(name, root=""):
        return corpus.find([], [name], root and str(tmp_path / root), work.FileOptions(), ())

    found = find("corpus/list.txt")
    assert [entry.source.options.units for entry in found.entries] == [2, 2, 3, 2, 4]
    left = "is not read: it is above what is scanned; with --root at its folder it counts"
    assert found.notes == [
        f"{tmp_path}/corpus/cab-scan.csv: line 2 sets units=2 for 4 files",
        f"{tmp_path}/corpus/left/cab-scan.csv: line 2 sets units=3 for 1 file",
        f"{tmp_path}/other/right/cab-scan.csv: line 2 sets units=4 for 1 file",
        f"{tmp_path}/cab-scan.csv {left}", f"{tmp_path}/other/cab-scan.csv {left}",
    ]
    assert str(tmp_path / "corpus/cab-scan.csv") in found.read
    assert [entry.source.options.units for entry in find("corpus/list.txt", "other").entries] == [2, 2, 3, 2, 4]
    (tmp_path / "corpus/cab-scan.csv").unlink()
    assert [entry.source.options.units for entry in find("corpus/list.txt", ".").entries] == [5, 5, 3, 5, 4]
    # Columns win, and those of a line are of both its files.
    (tmp_path / "corpus/list.csv").write_text(
        f"path,other,units,other_units,fps\n{files[0]},{files[1]},,,60\n{files[0]},{files[2]},7,,\n"
        f"{files[0]},{files[2]},,8,\n"
    )
    pairs = find("corpus/list.csv", ".").entries
    assert [(pair.source.options.units, pair.other.options.units) for pair in pairs] == [(3, 5), (7, 7), (3, 8)]
    assert {pair.other.options.fps for pair in pairs} == {0, 60}


def test_options_of_folders_match_as_fnmatch_does_and_the_last_line_counts(tmp_path):
    names = ["a.bvh", "A.bvh", "b[1].bvh", "c/a.bvh", "c/1!.bvh", "c/-.bvh", "é.bvh"]
    for name in names:
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text("x")
    patterns = ["a.bvh", "*.bvh", "[aA].bvh", "?.bvh", "c/*", "c/[!0-9].bvh", "c/[0-9]!.bvh", "b[[]1].bvh", "[z-a].bvh",
                "c/a.bvh", "./a.bvh", "[", "é.bvh", "*/[!a-z]*"]
    for shift in range(len(patterns)):
        tried = patterns[shift:] + patterns[:shift]
        lines = [f"{pattern},{number}" for number, pattern in enumerate(tried, 1)]
        (tmp_path / "cab-scan.csv").write_text("\n".join(["path,units", *lines]))
        found = corpus.find([str(tmp_path)], [], "", work.FileOptions(), corpus.MOTION_SUFFIXES)
        read = {os.path.relpath(entry.source.path, tmp_path): entry.source.options.units for entry in found.entries}
        assert read == {
            name: max(number for number, pattern in enumerate(tried, 1) if fnmatch.fnmatchcase(name, pattern))
            for name in names
        }


def test_options_of_folders_take_no_time_and_have_bounds(tmp_path, monkeypatch):
    tried = []
    translate = fnmatch.translate
    monkeypatch.setattr(fnmatch, "translate", lambda pattern: tried.append(pattern) or translate(pattern))
    monkeypatch.setattr(fnmatch, "fnmatchcase", None)
    names = [f"clip{number}.bvh" for number in range(100)]
    for name in names:
        (tmp_path / name).write_text("x")

    def find(lines):
        (tmp_path / "cab-scan.csv").write_text("\n".join(["path,units", *lines]))
        return corpus.find([str(tmp_path)], [], "", work.FileOptions(), corpus.MOTION_SUFFIXES)

    # A line for each file, and many others: none is tried on a file that it does not name.
    found = find([*(f"{name},{number}" for number, name in enumerate(names, 1)), *(f"x{k},1" for k in range(50000))])
    assert {entry.source.path[len(str(tmp_path)) + 1:]: entry.source.options.units for entry in found.entries} == {
        name: number for number, name in enumerate(names, 1)
    }
    assert not tried
    assert len(find(f"*{number}.bvh,1" for number in range(1000)).notes) > 0
    assert len(tried) == 1000  # once each, not for each file
    with pytest.raises(corpus.CorpusError, match="line 1002: there are more than 1000 patterns") as error:
        find(f"*{number},1" for number in range(1001))
    assert len(str(error.value).removeprefix(str(tmp_path))) <= 300
    with pytest.raises(corpus.CorpusError, match="line 67: .*more than 65536 characters"):
        find(["*" * 1000 + ",1"] * 66)


_MOST_PEAK_BYTES = 1_000_000  # measured 363 544, and 2 041 890 with a set of files for each line


def test_options_of_folders_count_each_file_once_in_little_memory(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name in ("corpus/cab-scan.csv", "corpus/in/cab-scan.csv"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text("path,units\n" + "*,2\n" * 100)
    names = [f"corpus/in/clip{number}.bvh" for number in range(100)]
    for name in names:
        (tmp_path / name).write_text("x")
    (tmp_path / "list.txt").write_text("\n".join(names + names[:1]))
    # Of the file's own folder, then of that above too, which the file that is named has not.
    tracemalloc.start()
    found = corpus.find([names[0], "corpus"], ["list.txt"], "", work.FileOptions(), corpus.MOTION_SUFFIXES)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    counts = [note.partition(" sets ")[2] for note in found.notes if " sets " in note]
    assert counts == ["units=2 for 100 files"] * 200
    assert peak < _MOST_PEAK_BYTES


@pytest.mark.skipif(os.geteuid() != 0, reason="only root gives files away")
def test_options_of_other_users_are_left_out(tmp_path):
    write_corpus(tmp_path, 2)
    (tmp_path / "cab-scan.csv").write_text("path,units\n*,5\n")
    os.chown(tmp_path / "cab-scan.csv", 65534, 65534)

    def find():
        return corpus.find([str(tmp_path)], [], "", work.FileOptions(), corpus.MOTION_SUFFIXES)

    found = find()
    assert {entry.source.options.units for entry in found.entries} == {None}
    assert found.notes == [f"{tmp_path}/cab-scan.csv is not read: it is of another user"]
    # The owner of a file may say how it is read: of that one alone.
    os.chown(found.entries[0].source.path, 65534, 65534)
    assert [entry.source.options.units for entry in find().entries] == [5, None]


_OPTIONS = (
    b"path,units,motion,motion_units,animation,fps,body,stature,thickness\r\n*,auto,,,,,,,\r\n"
    b'left/*3.bvh,0.5,left/clip0001.bvh,1,walk,60,skin,1.8,1.1\r\n'
    b'"right/[a-c],*",1,,,"a ""b""",,skeleton,,\r\n*2.bvh,2,,,,,,,\r\n'
)
_INSERTED = (
    b'"', b"\0", b"\r", b"\xff", b"\xed\xa0\x80", "\u2028".encode(), b"9" * 400, b"1e999", b"nan", b"[z-a]", b"../",
    b"path,", b",", b"[" * 2000, b"a" * 200000, b"?*" * 500, b",\n" * 600000,
)


def damaged(text, random):
    """A text with a few bytes changed, taken away or put in, or a line repeated."""
    for _ in range(random.choice((1, 2, 6))):
        at, kind = random.randrange(len(text)), random.randrange(4)
        if kind == 0:
            text = text[:at] + bytes([random.randrange(256)]) + text[at + 1:]
        elif kind == 1:
            text = text[:at] + text[at + random.randrange(1, 9):] or b"p"
        elif kind == 2:
            text = text[:at] + random.choice(_INSERTED) + text[at:]
        else:
            lines = text.splitlines(keepends=True)
            text = b"".join(lines + [random.choice(lines)])
    return text


def test_options_of_folders_that_are_damaged_are_read_or_refused_in_one_line(tmp_path):
    write_corpus(tmp_path, 4, frames=1)
    random, told = Random(20261125), set()
    for text in (_OPTIONS, *(damaged(_OPTIONS, random) for _ in range(300))):
        (tmp_path / "cab-scan.csv").write_bytes(text)
        try:
            corpus.find([str(tmp_path)], [], "", work.FileOptions(), corpus.MOTION_SUFFIXES)
            told.add("it is read")
        except corpus.CorpusError as error:
            line = str(error).removeprefix(str(tmp_path))
            assert re.match("/cab-scan.csv: (line [1-9]|the file is larger than 1 MiB$)", line), line[:400]
            assert len(line) <= 300 and len(line.splitlines()) == 1, line[:400]
            told.add(line)
    for words in ("it is read", "field limit", "expected after", "is none of the columns", "a number above 0",
                  "a field has more than 1024 characters", "larger than 1 MiB"):
        assert any(words in line for line in told), words


# ------------------------------------------------------------------------------------------ S9: terminals, spreadsheets


def test_what_is_printed_is_plain_and_cells_are_no_formulas():
    text = "a\x1b[31m\n\x9b\u202e\u2066\u200f\u2028\udcff\x7fé漢"
    assert printable.printable(text) == "a?[31m???????" + "?é漢"
    # The same as of the command, in tests/perf/base/report_test.cpp.
    for text in ("=1+2", "+x", "-x", "@x", "\tx", "\nx", "'=x", "-2+3", "-.5", "+-1", "-1e", "-inf", "+", "-1 "):
        assert printable.csv_cell(text) == f"'{text}"
    for cell in ("x", "", None, -1, -0.5, "-1", "+3", "-1.5e-3", "-1.", "+2E+9", "-1e999"):
        assert printable.csv_cell(cell) is cell


# ------------------------------------------------------------------------------------------------- S10, S11: machines


def killed(path, stop):
    """Kills each child of this process until `stop` is set."""
    own = pathlib.Path("/proc/self/task")
    while not stop.is_set():
        for place in own.glob("*/children"):
            for number in place.read_text().split():
                try:
                    os.kill(int(number), signal.SIGKILL)
                except ProcessLookupError:
                    pass


def test_a_child_that_the_machine_kills_is_no_fault_of_its_file(tmp_path):
    path = tmp_path / "a.bvh"
    path.write_text(arm_bvh([3 * frame % 130 for frame in range(20000)]))
    stop = threading.Event()
    killer = threading.Thread(target=killed, args=(path, stop))
    killer.start()
    try:
        with pytest.raises(cab.FileError, match="stopped from outside: Killed") as error:
            cab.load_motion(path)
        (row,) = tasks.run_items(items_of(path), str(tmp_path)).rows
    finally:
        stop.set()
        killer.join()
    assert error.value.is_machine
    assert row.outcome == "lost" and "a.bvh: reading it was stopped from outside: Killed" in row.error
    path.write_text("HIERARCHY\n")
    with pytest.raises(cab.FileError) as error:
        cab.load_motion(path)
    assert not error.value.is_machine


def test_a_machine_with_less_memory_than_a_file_may_take_is_told(tmp_path):
    (tmp_path / "a.bvh").write_text(arm_bvh([3 * frame % 130 for frame in range(20000)]))
    program = """
import resource, sys
import cab
with open("/proc/self/statm") as file:
    mapped = int(file.read().split()[0]) * resource.getpagesize()
resource.setrlimit(resource.RLIMIT_AS, (mapped + (16 << 20),) * 2)
try:
    cab.load_motion(sys.argv[1])
except cab.FileError as error:
    print(error.is_machine, error)
"""
    words = [sys.executable, "-c", program, str(tmp_path / "a.bvh")]
    out = subprocess.run(words, capture_output=True, text=True, check=True).stdout
    assert out.startswith("True ") and "the machine gives less than the 4096 MiB" in out
