"""Clips, pairs and policies: rows against the command, which is read by plain Python, and against the module."""

import base64
import csv
import errno
import json
import os
import re
import subprocess

import cab
import numpy as np
import pytest
from cab_scan import corpus, notes, work

from conftest import arm_bvh, data_folder, long, write_corpus

COMMAND = os.environ.get("CAB_COMMAND", "")


def run_command(*words):
    outcome = subprocess.run([COMMAND, *map(str, words)], capture_output=True, text=True, check=False)
    assert outcome.returncode == 0, outcome.stderr
    return outcome.stdout


def read_hits(path):
    """From `cab run --hits`: (frame, link, link) of each hit."""
    with open(path, newline="", encoding="utf-8") as file:
        return [(int(line["frame"]), line["link_a"], line["link_b"]) for line in csv.DictReader(file)]


def runs_of(hits):
    """Maximal runs of frames, by loops alone."""
    frames = {}
    for frame, one, other in hits:
        frames.setdefault((one, other), set()).add(frame)
    return sorted(
        (one, other, first, next(last for last in range(first, 10**9) if last + 1 not in there))
        for (one, other), there in frames.items()
        for first in there
        if first - 1 not in there
    )


@pytest.mark.parametrize("exact", ["convex", "none"])
def test_self_penetration_is_that_of_the_command(scan, quick, exact):
    write_corpus(scan.folder / "corpus", 6, frames=70)
    assert quick("self", "corpus", "--policies", f"exact={exact}", "--csv", "scan.csv").code == 0
    rows = scan.rows()
    assert len(rows) == 6 and rows[0]["file"] == "corpus/left/clip0001.bvh"
    with open(scan.folder / "scan.contacts.csv", newline="", encoding="utf-8") as file:
        contacts = list(csv.DictReader(file))
    for row in rows:
        out = scan.folder / "hits.csv"
        run_command("run", scan.folder / row["file"], "--self", "--exact", exact, "--hits", out)
        hits = read_hits(out)
        assert len(hits) > 20
        assert (row["hits"], row["hit_frames"]) == (len(hits), len({frame for frame, *_ in hits}))
        assert row["frames"] == 70
        found = [
            (line["link_a"], line["link_b"], int(line["first_frame"]), int(line["last_frame"]))
            for line in contacts if line["file"] == row["file"]
        ]
        assert sorted(found) == runs_of(hits)
        assert (row["depth"] is None) == (exact == "none")


def test_rows_are_those_of_the_module_whatever_the_chunks(scan, quick):
    # Longer than a chunk of frames, so that contacts go on over borders.
    angles = [abs(frame % 400 - 200) * 0.65 for frame in range(9000)]
    (scan.folder / "long.bvh").write_text(arm_bvh(angles))
    words = ["--hops", "0", "--gap", "2", "--min-depth", "0.002", "--csv", "scan.csv"]
    assert quick("self", "long.bvh", *words).code == 0
    (row,) = scan.rows()
    motion = cab.load_motion(scan.folder / "long.bvh")
    clip = cab.Clip(motion.body, motion.poses, fps=motion.fps)
    hits = clip.hits(min_depth=0.002)
    deepest = hits[hits["depth"].argmax()]
    assert row["hits"] == len(hits)
    assert row["depth"] == float(deepest["depth"]) and row["depth_frame"] == deepest["frame"]
    assert row["depth_link_a"] == motion.body.names[deepest["link_a"]]
    runs = clip.intervals(min_depth=0.002, gap=2)
    with open(scan.folder / "scan.contacts.csv", newline="", encoding="utf-8") as file:
        contacts = list(csv.DictReader(file))
    assert len(contacts) == len(runs) > 10
    found = sorted((int(line["first_frame"]), int(line["last_frame"]), float(line["depth"]),
                    int(line["deepest_frame"]), float(line["seconds"])) for line in contacts)
    assert found == sorted(zip(*(runs[name].tolist() for name in ("first", "last", "depth", "deepest", "seconds"))))


def test_the_table_does_not_depend_on_workers_order_or_isa(scan, quick):
    write_corpus(scan.folder / "corpus", 30)
    one = scan.here("self", "corpus", "--workers", "1", "--table", "one.sqlite", "--csv", "one.csv")
    words = ["--table", "two.sqlite", "--csv", "two.csv"]
    two = quick("self", "corpus/left", "corpus/right", *words)  # on two workers
    with open(scan.folder / "list.txt", "w", encoding="utf-8") as file:
        file.write("# backwards\n" + "".join(f"{row['file']}\n" for row in reversed(scan.rows("file", "one.sqlite"))))
    words = ["--table", "three.sqlite", "--csv", "three.csv"]
    three = scan.here("self", "--list", "list.txt", "--workers", "3", *words)
    assert one.code == two.code == three.code == 0
    assert one.hash == two.hash == three.hash
    read = [(scan.folder / f"{name}.contacts.csv").read_bytes() for name in ("one", "two", "three")]
    assert read[0] == read[1] == read[2]


@long
def test_names_may_start_at_a_root_so_that_a_corpus_may_move(scan, quick):
    write_corpus(scan.folder / "here", 4)
    first = quick("self", "here", "--root", "here", "--table", "a.sqlite")
    (scan.folder / "here").rename(scan.folder / "there")
    second = quick("self", scan.folder / "there", "--root", scan.folder / "there", "--table", "b.sqlite")
    assert first.hash == second.hash
    assert scan.rows("file", "a.sqlite")[0]["file"] == "left/clip0001.bvh"


def test_options_come_from_the_command_line_folders_and_lists(scan, quick):
    write_corpus(scan.folder / "corpus", 4)
    (scan.folder / "corpus/cab-scan.csv").write_text("path,units\n*,2\nleft/*3.bvh,3\n")
    (scan.folder / "corpus/right/cab-scan.csv").write_text("path,units\nclip0002.bvh,4\n")
    assert quick("self", "corpus", "--units", "5").code == 0
    assert [row["options"] for row in scan.rows("options")] == [
        '{"units": 2.0}', '{"units": 3.0}', '{"units": 2.0}', '{"units": 4.0}'
    ]
    (scan.folder / "list.csv").write_text("path,units\ncorpus/left/clip0001.bvh,7\ncorpus/left/clip0003.bvh,\n")
    assert quick("self", "--list", "list.csv", "--units", "5", "--table", "listed.sqlite").code == 0
    assert [row["options"] for row in scan.rows("options", "listed.sqlite")] == ['{"units": 7.0}', '{"units": 3.0}']


def test_lines_of_a_list_with_other_options_are_rows_of_their_own(scan, quick):
    write_corpus(scan.folder / "corpus", 2)
    one, two = "corpus/left/clip0001.bvh", "corpus/right/clip0000.bvh"
    lines = [f"{one},1", f"{two},1", f"{one},2", f"{one},1.0", f"{two},", f"{two},1"]
    (scan.folder / "list.csv").write_text("\n".join(["path,units", *lines]))
    outcome = quick("self", "--list", "list.csv")
    assert outcome.code == 0
    assert [(row["file"], row["options"]) for row in scan.rows(rest="WHERE hits > 0")] == [
        (one, '{"units": 1.0}'), (one, '{"units": 2.0}'), (two, '{"units": 1.0}'), (two, "{}"),
    ]
    assert f"cab scan: list.csv: 2 lines repeat what is named before; the first is of {one}\n" in outcome.error
    lines = [f"{one},{two},{units}" for units in (1, 2, 2)]
    (scan.folder / "pairs.csv").write_text("\n".join(["path,other,other_units", *lines]))
    outcome = quick("pairs", "--list", "pairs.csv", "--table", "pairs.sqlite")
    assert f"cab scan: pairs.csv: 1 line repeats what is named before; the first is of {one}\n" in outcome.error
    assert len(scan.rows(table="pairs.sqlite")) == 2
    # No file is paired with itself.
    for name, units in (("take_a.bvh", 1), ("take_a.bvh", 2), ("take_b.bvh", 1)):
        (scan.folder / name).write_text(arm_bvh([3 * frame % 130 for frame in range(20)]))
        lines.append(f"{name},,{units}")
    (scan.folder / "takes.csv").write_text("path,other,units\n" + "\n".join(lines[3:]))
    assert quick("pairs", "--list", "takes.csv", "--pattern", "take_(.)", "--table", "takes.sqlite").code == 0
    there = [(row["file"], row["other"]) for row in scan.rows(table="takes.sqlite")]
    assert there == [("take_a.bvh", "take_b.bvh")] * 2
    # A file that several paths name is one.
    assert "repeat" not in quick("self", "corpus", one, "corpus/*/*", "--table", "paths.sqlite").error
    assert len(scan.rows(table="paths.sqlite")) == 2


def test_a_list_says_how_files_of_paths_are_read(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write_corpus(tmp_path / "corpus", 2)
    one, two = "corpus/left/clip0001.bvh", "corpus/right/clip0000.bvh"

    def find(text):
        (tmp_path / "list.csv").write_text(text)
        found = corpus.find(["corpus"], ["list.csv"], "", work.FileOptions(), [".bvh"])
        entries = [(entry.source.name, entry.part, entry.source.options.units) for entry in found.entries]
        return entries, found.notes

    assert find(f"path,units\n{one},2\n") == ([(one, "", 2), (two, "", None)], [])
    # The path's options are one of its lines.
    told = [f"list.csv: 1 line repeats what is named before; the first is of {one}"]
    assert find(f"path,units\n{one},2\n{one},\n") == ([(one, "", 2), (one, "", None), (two, "", None)], told)
    # Other work of the same file.
    assert find(f"path,part\n{one},a\n") == ([(one, "", None), (one, "a", None), (two, "", None)], [])


def larger(text, factor):
    """A BVH text with other lengths."""
    lines = text.splitlines()
    for number, line in enumerate(lines):
        if line.startswith("OFFSET"):
            lines[number] = "OFFSET " + " ".join(str(float(word) * factor) for word in line.split()[1:])
    return "\n".join(lines)


def test_a_folder_gives_its_files_of_motion(tmp_path):
    for name in ("a.bvh", "b.AMC", "b.asf", "c.vrm", "d.glb", "e.txt", "f.fbx", "bvh"):
        (tmp_path / name).touch()
    found = corpus.find([str(tmp_path)], [], str(tmp_path), work.FileOptions(), corpus.MOTION_SUFFIXES)
    assert [entry.source.name for entry in found.entries] == ["a.bvh", "b.AMC", "c.vrm", "d.glb", "f.fbx"]


def test_links_to_folders_are_followed_once(tmp_path):
    for name in ("corpus/z/in/a.bvh", "far/b.bvh", "far/in/c.bvh"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).touch()
    for link, target in (
        ("corpus/a", "corpus/z"), ("corpus/z/in/up", "corpus"), ("corpus/m", "far"), ("far/back", "corpus"),
        ("corpus/n", "far/in"), ("far/o", "far"), ("corpus/gone", "nowhere"), ("corpus/self", "corpus/self"),
        ("start", "corpus"),
    ):
        (tmp_path / link).symlink_to(tmp_path / target)

    def names(*paths):
        found = corpus.find([str(tmp_path / path) for path in paths], [], str(tmp_path), work.FileOptions(), [".bvh"])
        assert found.problems == []
        return [entry.source.name for entry in found.entries]

    assert names("corpus") == ["corpus/m/b.bvh", "corpus/m/in/c.bvh", "corpus/z/in/a.bvh"]
    assert names("start") == ["start/m/b.bvh", "start/m/in/c.bvh", "start/z/in/a.bvh"]
    assert names("far") == ["far/b.bvh", "far/back/z/in/a.bvh", "far/in/c.bvh"]
    # Once in all paths and what a glob matches, and again without links if there is such a name.
    for paths in (["corpus", "far"], ["corpus/[amz]", "far"], ["corpus/a", "corpus/m/", "corpus/z", "start", "far/"]):
        assert names(*paths) == ["corpus/z/in/a.bvh", "far/b.bvh", "far/in/c.bvh"]
    assert names("start", "corpus", "corpus/z", "corpus") == names("corpus/[a-z]") == names("corpus")
    (tmp_path / "far/none").mkdir()
    found = corpus.find([str(tmp_path / path) for path in ("far", "far/none")], [], "", work.FileOptions(), [".bvh"])
    assert found.problems == [f"{tmp_path}/far/none: the folder has no file to scan in it"]


def test_a_link_to_what_cannot_be_read_leaves_the_rest(tmp_path, monkeypatch):
    for name in ("corpus/a.bvh", "far/b.bvh", "far/in/c.bvh", "shut/d.bvh", "gone/e.bvh"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).touch()
    for name in ("far", "shut", "gone"):
        (tmp_path / "corpus" / name).symlink_to(tmp_path / name)

    def refusing(function, error, *names):  # root may read all
        def called(path=".", **more):
            if str(path).endswith(names):
                raise OSError(error, os.strerror(error), path)
            return function(path, **more)

        return called

    monkeypatch.setattr(os, "scandir", refusing(os.scandir, errno.EACCES, "/shut", "/far/in"))
    monkeypatch.setattr(os, "stat", refusing(os.stat, errno.ENOENT, "/gone"))

    def find(path):
        return corpus.find([str(path)], [], str(tmp_path), work.FileOptions(), [".bvh"])

    found = find(tmp_path / "corpus")
    assert [entry.source.name for entry in found.entries] == ["corpus/a.bvh", "corpus/far/b.bvh"]
    assert found.problems == [
        f"{tmp_path}/corpus/far/in: Permission denied", f"{tmp_path}/corpus/gone: No such file or directory",
        f"{tmp_path}/corpus/shut: Permission denied",
    ]
    with pytest.raises(corpus.CorpusError, match="far/in: Permission denied"):
        find(tmp_path / "far")


def test_what_the_reader_doubts_is_told_once_and_in_the_table(scan, quick):
    figure = arm_bvh([0, 10, 20])
    for name, factor in (("good", 1), ("a", 90), ("b", 100), ("c", 110), ("long" * 60, 39.4)):
        (scan.folder / f"{name}.bvh").write_text(larger(figure, factor))
    outcome = quick("self", ".", "--csv", "scan.csv")
    assert outcome.code == 0
    (line,) = outcome.error.splitlines()
    assert line.startswith("cab scan: a.bvh and 3 more files: warning: the figure is 162 m tall, a person is")
    there = {row["file"]: row["notes"] for row in scan.rows()}
    assert there["good.bvh"] is None
    assert json.loads(there["b.bvh"]) == list(cab.load_motion(scan.folder / "b.bvh").notes)
    with open(scan.folder / "scan.csv", newline="", encoding="utf-8") as file:
        assert {line["file"]: line["notes"] or None for line in csv.DictReader(file)} == there
    assert quick("self", ".").error == outcome.error  # the table has it
    guessed = quick("self", ".", "--units", "auto", "--table", "auto.sqlite").error.splitlines()
    assert [re.sub("longl.*long", "long", line.partition(", ")[0]) for line in guessed] == [
        "cab scan: a.bvh and 2 more files: unit guessed: 0.01 m (centimetres)",
        "cab scan: long.bvh: unit guessed: 0.0254 m (inches)",
    ]
    assert max(map(len, guessed)) <= 300
    assert quick("pairs", "good.bvh", "b.bvh", "--pattern", "^(.*).bvh", "--table", "pairs.sqlite").error.startswith(
        "cab scan: b.bvh: warning: the figure is 180 m tall")
    (row,) = scan.rows("file, notes", "pairs.sqlite")
    assert row["file"] == "b.bvh" and json.loads(row["notes"])[0].startswith("warning: the figure is 180 m tall")


def test_notes_are_short_whatever_they_say():
    source = work.Source("a.bvh", "/there/a.bvh", work.FileOptions(), 1)
    item = work.Item(work.SELF, source, ("",), "{}", work.TestOptions(), (None,))
    assert notes.notes_text(item, ["of /there/a.bvh and /there/b.asf"]) == '["of a.bvh and b.asf"]'
    text = notes.notes_text(item, ["x" * 5000, "y\n"], [f"{number}:" for number in range(200)])
    kept = json.loads(text)
    assert len(kept) == 101 and max(map(len, kept)) == 300 and kept[1] == "y?" and kept[2] == "other: 0:"
    assert kept[-1] == "and 102 notes more"
    assert notes.notes_text(item, []) is None
    told = list(notes.told_notes([("a" * 4000, "b" * 4000, text)] * 3, 20))
    assert len(told) == 4 and max(len(f"cab scan: {line}") for line in told) <= 300
    many = notes.notes_text(item, [f"warning: {chr(65 + number)}" for number in range(26)] + ["a: 1", "a: 2"])
    told = list(notes.told_notes([("f", "", many), ("g", "", many)], 20))
    assert len(told) == 21 and told[0] == "f and 1 more file: warning: A"
    assert told[-1] == "and 7 more kinds of notes; the column notes has all"


def test_pairs_are_those_of_the_command(scan, quick):
    (scan.folder / "dance").mkdir()
    for who, offset in (("anna", 0), ("ben", 0.25), ("cleo", 0.5)):
        text = arm_bvh([3 * frame % 130 for frame in range(50)], offset=offset)
        (scan.folder / f"dance/take1_{who}.bvh").write_text(text)
    outcome = quick("pairs", "dance", "--pattern", "take1_(.*)[.]bvh")
    assert outcome.code == 0 and "in no pair" not in outcome.error, outcome.error
    rows = scan.rows()
    assert [(row["file"][12:-4], row["other"][12:-4]) for row in rows] == [
        ("anna", "ben"), ("anna", "cleo"), ("ben", "cleo")
    ]
    for row in rows:
        out = scan.folder / "hits.csv"
        run_command("run", scan.folder / row["file"], scan.folder / row["other"], "--exact", "convex", "--hits", out)
        hits = read_hits(out)
        assert row["hits"] == len(hits) and row["hit_frames"] == len({frame for frame, *_ in hits})
    assert rows[0]["hits"] > rows[1]["hits"] > 0
    (scan.folder / "list.csv").write_text(f"path,other\n{rows[0]['file']},{rows[0]['other']}\n")
    assert quick("pairs", "--list", "list.csv", "--table", "listed.sqlite").code == 0
    (row,) = scan.rows(table="listed.sqlite")
    assert row["hits_hash"] == rows[0]["hits_hash"]


def test_files_in_no_pair_are_counted(scan, quick):
    for name in ("take1_a", "take1_b", "take2_a", "take3"):
        (scan.folder / f"{name}.bvh").write_text(arm_bvh([3 * frame % 130 for frame in range(10)]))
    (scan.folder / "list.csv").write_text("path,other\ntake2_a.bvh,take3.bvh\n")
    words = ["--pattern", "take._(.)[.]bvh"]
    for files, told in (
        (["."], "2 files are in no pair; the first is take2_a.bvh"),
        (["take1_a.bvh", "take1_b.bvh", "take3.bvh"], "1 file is in no pair; the first is take3.bvh"),
        ([".", "--list", "list.csv"], None),
    ):
        outcome = quick("pairs", *files, *words)
        lines = [line for line in outcome.error.splitlines() if "in no pair" in line]
        assert outcome.code == 0 and lines == ([f"cab scan: --pattern: {told}"] if told else [])
    nothing = quick("pairs", "take3.bvh", *words)
    assert nothing.code == 1 and nothing.error.splitlines() == [
        "cab scan: --pattern: 1 file is in no pair; the first is take3.bvh", "cab scan: there is nothing to scan",
    ]


def test_a_pair_has_the_clock_of_who_moves_and_says_what_it_cuts_off(scan, quick):
    for name, count in (("pose", 1), ("short", 20), ("whole", 50)):
        text = arm_bvh([3 * frame % 130 for frame in range(count)], frame_time=0.02)
        (scan.folder / f"{name}.bvh").write_text(text)
    (scan.folder / "list.csv").write_text("path,other\npose.bvh,whole.bvh\nwhole.bvh,short.bvh\n")
    assert quick("pairs", "--list", "list.csv", "--csv", "scan.csv").code == 0
    held, cut = scan.rows()
    assert (held["file"], held["frames"], held["hit_frames"]) == ("pose.bvh", 50, 50)
    assert json.loads(held["notes"]) == ["no motion: the pose of the file holds for all frames"]
    assert (cut["file"], cut["frames"]) == ("whole.bvh", 20)
    assert json.loads(cut["notes"])[0] == "30 of 50 frames are not tested: short.bvh ends first"
    with open(scan.folder / "scan.contacts.csv", newline="", encoding="utf-8") as file:
        seconds = {float(line["seconds"]) for line in csv.DictReader(file) if line["file"] == "pose.bvh"}
    assert max(seconds) == pytest.approx(50 * 0.02)


def test_a_sweep_of_policies_has_a_row_each_and_the_same_exact_hits(scan, quick):
    write_corpus(scan.folder / "corpus", 3)
    words = ["--policies", "balanced", "--policies", "sat=faces_6", "--policies", "exact=none"]
    outcome = quick("policies", "corpus", *words)
    assert outcome.code == 0 and "false positives" in outcome.out
    rows = scan.rows(rest="WHERE file LIKE '%0000%'")
    assert len(rows) == 3 and len(scan.rows()) == 9
    exact = [row for row in rows if "exact=convex" in row["policies"]]
    assert len({row["hits_hash"] for row in exact}) == 1
    boxes = next(row for row in rows if "exact=none" in row["policies"])
    assert boxes["hits"] > exact[0]["hits"] and boxes["exact_tests"] == 0
    for row in exact:
        assert row["leaf_pairs"] - row["false_positives"] == row["hits"]
        assert row["box_tests"] > 0 and row["engine_seconds"] > 0


def test_policies_are_compared_over_the_files_of_their_scan(scan, quick):
    write_corpus(scan.folder / "corpus", 4)
    words = ["policies", "corpus/left", "--policies", "balanced", "--policies", "sat=faces_6"]

    def compared(outcome):
        """Of each policies, all but the time."""
        lines = [line.rsplit(None, 5) for line in outcome.out.splitlines() if line.startswith("refit=")]
        return {policies: counts for policies, _, *counts in lines}

    wanted = quick(*words, "--table", "alone.sqlite")
    assert len(compared(wanted)) == 2
    # Other scans test other files, and these in another unit, by one of the policies.
    assert quick("self", "corpus", "--units", 2, "--policies", "balanced").code == 0
    assert quick("self", "corpus", "--policies", "balanced").code == 0
    for _ in range(2):  # the second time all is done already
        assert compared(quick(*words)) == compared(wanted)


def test_recordings_are_replayed_and_reported(scan, quick):
    figure = arm_bvh([3 * frame % 130 for frame in range(60)])
    (scan.folder / "arm.bvh").write_text(figure.replace("JOINT Left", "JOINT =Left"))  # a formula in a CSV file
    run_command("run", scan.folder / "arm.bvh", "--self", "--record", scan.folder / "arm.cab")
    whole = (scan.folder / "arm.cab").read_bytes()
    (scan.folder / "cut.cab").write_bytes(whole[: len(whole) // 2])
    with open(scan.folder / "none.cab", "wb") as file:
        file.truncate(1 << 40)  # no recording, which nobody reads to its end
    outcome = quick("recordings", ".")
    assert outcome.code == 1 and "cut.cab" in outcome.error
    good, cut, none = scan.rows()
    assert good["sha256"] and cut["sha256"] and none["sha256"] is None and none["outcome"] == "bad"
    assert quick("self", "arm.bvh", "--table", "self.sqlite").code == 0
    (same,) = scan.rows(table="self.sqlite")
    assert good["outcome"] == "done" and good["error"] is None
    for name in ("frames", "hits", "hit_frames", "depth_frame", "depth_link_a", "depth_link_b"):
        assert good[name] == same[name]
    assert good["depth"] == pytest.approx(same["depth"], rel=1e-6)
    assert cut["outcome"] == "bad" and "cut off" in cut["error"]
    assert quick("recordings", ".").hash == outcome.hash
    # No columns of a list change how a recording is read, so it is one row.
    (scan.folder / "list.csv").write_text("path,units,part\narm.cab,1,\narm.cab,2,\narm.cab,,a\n")
    assert quick("recordings", "--list", "list.csv", "--table", "listed.sqlite").code == 0
    assert [row["file"] for row in scan.rows(table="listed.sqlite")] == ["arm.cab"]


def test_a_loader_yields_arrays(scan, monkeypatch):
    (scan.folder / "my_arrays.py").write_text(
        """
import cab, cab_scan, numpy
def load(request):
    arrays = numpy.load(request.path)
    body = cab.Body.from_boxes([-1, 0], arrays["half"])
    for name in ("slow", "fast"):
        yield cab_scan.Sequence(body, arrays[name], fps=50, name=name)
def nothing(request):
    return []
def wrong(request):
    yield 1
"""
    )
    poses = np.zeros((10, 2, 7), dtype=np.float32)
    poses[..., 3] = 1
    poses[:, 1, 4] = np.arange(10) * 0.3
    np.savez(scan.folder / "a.npz", half=np.full((2, 3), 0.5, dtype=np.float32), slow=poses, fast=poses[::2].copy())
    monkeypatch.syspath_prepend(str(scan.folder))
    assert scan.here("self", "a.npz", "--workers", 1, "--hops", 0, "--loader", "my_arrays:load").code == 0
    assert {(row["sequence"], row["frames"], row["hits"]) for row in scan.rows()} == {("slow", 10, 4), ("fast", 5, 2)}
    for loader, told in (("my_arrays:nothing", "no sequence"), ("my_arrays:wrong", "cab_scan.Sequence is wanted")):
        outcome = scan.here("self", "a.npz", "--workers", 1, "--loader", loader, "--table", "bad.sqlite")
        assert outcome.code == 1 and told in outcome.error
    assert "has no absent" in scan.here("self", "a.npz", "--workers", 1, "--loader", "my_arrays:absent").error


def test_copies_make_a_corpus_of_any_size(scan, quick):
    write_corpus(scan.folder / "corpus", 2)
    words = [*scan.words()[:2], "cab_scan.copies", "corpus", "--count", "12"]
    made = subprocess.run(words, cwd=scan.folder, capture_output=True, text=True, check=True).stdout
    (scan.folder / "list.csv").write_text(made)
    outcome = quick("self", "--list", "list.csv", "--loader", "cab_scan.copies:load")
    assert outcome.code == 0, outcome.error
    rows = scan.rows()
    assert len(rows) == 12 and len({row["hits_hash"] for row in rows}) > 6
    assert len({(row["file"], row["hits"], row["depth"]) for row in rows}) == 2


@pytest.mark.skipif(data_folder() is None, reason="CAB_DATA_DIR names no folder")
def test_real_dancers_are_those_of_the_command(scan, quick):
    folder = data_folder() / "pairs/cmu_salsa_10"
    assert quick("pairs", folder, "--pattern", "(60|61)_", "--units", "1.4").code == 0
    (row,) = scan.rows()
    out = scan.folder / "hits.csv"
    run_command("run", *sorted(folder.glob("*.bvh")), "--units", "1.4", "--exact", "convex", "--hits", out)
    assert row["hits"] == len(read_hits(out)) > 1000


def test_a_command_that_is_not_there_is_told(scan, quick, monkeypatch):
    (scan.folder / "a.cab").write_bytes(b"x")
    monkeypatch.setenv("CAB_COMMAND", str(scan.folder / "nowhere"))
    outcome = quick("recordings", "a.cab")
    assert outcome.code == 1 and "cannot be run" in outcome.error
    assert scan.rows()[0]["outcome"] == "lost"


def write_tetrahedra(path):
    """A glTF file of three tetrahedra, each on a joint. The third comes near the second until they pass through."""
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], dtype=np.float32)
    faces = np.array([0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3], dtype=np.uint16)
    joints = np.zeros((12, 4), dtype=np.uint16)
    joints[:, 0] = np.repeat([0, 1, 2], 4)
    arrays = [
        (np.tile(corners, (3, 1)), "VEC3", 5126),
        (np.concatenate([faces, faces + 4, faces + 8]).astype(np.uint16), "SCALAR", 5123),
        (joints, "VEC4", 5123), (np.tile([1, 0, 0, 0], (12, 1)).astype(np.float32), "VEC4", 5126),
        (np.tile(np.eye(4, dtype=np.float32).ravel(), (3, 1)), "MAT4", 5126),
        (np.array([0, 1], dtype=np.float32), "SCALAR", 5126),
        (np.array([[0.9, 0.9, 0.9], [0.2, 0.1, 0.1]], dtype=np.float32), "VEC3", 5126),
    ]
    views, accessors, data = [], [], b""
    for values, kind, component in arrays:
        views.append({"buffer": 0, "byteOffset": len(data), "byteLength": values.nbytes})
        accessors.append({"bufferView": len(views) - 1, "componentType": component, "count": len(values), "type": kind})
        data += values.tobytes()
    uri = "data:application/octet-stream;base64," + base64.b64encode(data).decode()
    path.write_text(json.dumps({
        "asset": {"version": "2.0"}, "accessors": accessors, "bufferViews": views,
        "buffers": [{"byteLength": len(data), "uri": uri}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "JOINTS_0": 2, "WEIGHTS_0": 3}, "indices": 1}]}],
        "skins": [{"joints": [0, 1, 2], "inverseBindMatrices": 4}],
        "nodes": [{"name": "base", "translation": [0, 0, -9], "children": [1, 2]}, {"name": "one"}, {"name": "other"},
                  {"mesh": 0, "skin": 0}],
        "animations": [{"samplers": [{"input": 5, "output": 6}],
                        "channels": [{"sampler": 0, "target": {"node": 2, "path": "translation"}}]}],
        "scenes": [{"nodes": [0, 3]}], "scene": 0,
    }))


def test_surfaces_are_tested_by_their_triangles_unless_told_otherwise(scan, quick):
    write_tetrahedra(scan.folder / "three.gltf")
    body, poses, *_ = cab.load_motion(str(scan.folder / "three.gltf"), body="surface")
    with cab.Clip(body, poses) as clip:
        hits, by_boxes = len(clip.hits()), len(clip.hits(exact="none"))
    assert 0 < hits < by_boxes
    for words, exact, expected in (((), "surface", hits), (("--policies", "exact=none"), "none", by_boxes)):
        table = f"{exact}.sqlite"
        assert quick("self", "three.gltf", "--body", "surface", "--hops", 0, "--table", table, *words).code == 0
        (row,) = scan.rows(table=table)
        assert f"exact={exact}" in row["policies"].split()
        assert (row["hits"], row["depth"], row["error"]) == (expected, None, None)


def test_each_file_of_a_list_or_folder_has_the_exact_test_of_its_bodies(scan, quick):
    write_corpus(scan.folder / "corpus", 2)
    write_tetrahedra(scan.folder / "corpus/three.gltf")
    assert quick("self", "corpus/three.gltf", "--body", "surface", "--hops", 0, "--table", "alone.sqlite").code == 0
    (alone,) = scan.rows(table="alone.sqlite")
    assert alone["hits"] > 0
    (scan.folder / "list.csv").write_text(
        "path,body\ncorpus/three.gltf,surface\ncorpus/right/clip0000.bvh,\ncorpus/left/clip0001.bvh,skeleton\n"
    )
    (scan.folder / "corpus/cab-scan.csv").write_text("path,body\n*.gltf,surface\n")
    for table, words in (("list.sqlite", ["--list", "list.csv"]), ("folder.sqlite", ["corpus"])):
        outcome = quick("self", *words, "--hops", 0, "--table", table)
        assert outcome.code == 0 and "did not name" not in outcome.error
        left, right, surface = scan.rows(table=table)
        assert tuple(surface)[1:-3] == tuple(alone)[1:-3] and "exact=surface" in surface["policies"].split()
        for row in (left, right):
            assert "exact=convex" in row["policies"].split() and row["depth"] > 0
    for words, told in (
        (["--min-depth", "0.01"], "--min-depth wants depths, and exact=surface has none"),
        (["--policies", "exact=convex"], "a surface is tested with exact=surface or none, not exact=convex"),
    ):
        for found in (["--list", "list.csv"], ["corpus"]):
            refused = quick("self", *found, *words, "--table", "refused.sqlite")
            assert refused.code == 1 and f"three.gltf, a surface: {told}\n" in refused.error
    none = quick("self", "corpus/left/clip0001.bvh", "--policies", "exact=surface", "--table", "refused.sqlite")
    assert none.code == 1 and "exact=surface tests triangles, and no file is one of bodies with them" in none.error
    assert not (scan.folder / "refused.sqlite").exists()
