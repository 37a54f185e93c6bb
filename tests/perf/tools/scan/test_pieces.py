"""Pieces that need no workers: hashes, runs over borders, tasks, lists, progress, the command line."""

import io
import sys

import cab
import numpy as np
import pytest
from cab_scan import contacts, corpus, hashing, options, plan, policies, progress, work


def fnv(data: bytes) -> int:
    value = 0xCBF29CE484222325
    for byte in data:
        value = (value ^ byte) * 0x100000001B3 % 2**64
    return value


def some_hits(random, count, frames):
    hits = np.zeros(count, dtype=cab.CLIP_HIT)
    hits["frame"] = np.sort(random.integers(0, frames, count))
    for name in ("a", "b"):
        hits[name] = random.integers(0, 3, count)
    for name in ("link_a", "link_b"):
        hits[name] = random.integers(0, 4, count)
    hits["depth"] = random.random(count)
    return hits


def test_the_hash_of_hits_is_fnv_of_frames_and_knows_no_chunks():
    hits = some_hits(np.random.default_rng(1), 300, 80)
    text = b""
    for frame in np.unique(hits["frame"]):
        words = b""
        for hit in hits[hits["frame"] == frame]:
            for name in ("a", "link_a", "b", "link_b", "depth"):
                words += hit[name].tobytes()
        text += int(frame).to_bytes(4, "little") + fnv(words).to_bytes(8, "little")
    whole = hashing.HitsHash()
    whole.add(hits)
    assert whole.digits() == f"{fnv(text):016x}"
    parts = hashing.HitsHash()
    for first in range(0, 80, 16):
        parts.add(hits[(hits["frame"] >= first) & (hits["frame"] < first + 16)])
    assert parts.digits() == whole.digits()


@pytest.mark.parametrize("gap", [0, 1, 5])
@pytest.mark.parametrize("seed", range(10))
def test_runs_over_borders_are_those_of_the_whole(seed, gap):
    hits = some_hits(np.random.default_rng(seed), 700, 90)
    if seed % 3 == 0:
        hits["depth"] = np.nan
    parts = [
        cab.intervals_of(hits[(hits["frame"] >= first) & (hits["frame"] < first + 16)], 25, gap)
        for first in range(0, 90, 16)
    ]
    merged = contacts.merge_runs(parts, 25, gap)
    whole = cab.intervals_of(hits, 25, gap)
    assert merged.tobytes() == whole.tobytes()


def test_a_run_has_the_depth_of_a_part_that_has_one():
    hits = np.zeros(3, dtype=cab.CLIP_HIT)
    hits["frame"], hits["b"] = [14, 15, 16], 1
    for depths in ([np.nan, np.nan, 0.25], [0.25, 0.25, np.nan]):
        hits["depth"] = depths
        (run,) = contacts.merge_runs([cab.intervals_of(part, 25, 0) for part in (hits[:2], hits[2:])], 25, 0)
        assert (run["first"], run["last"], run["depth"]) == (14, 16, 0.25)
        assert run["deepest"] == hits["frame"][depths.index(0.25)]


def test_chunks_are_tiles_and_bounded():
    for links in (1, 2, 30, 60, 500, 1024):
        frames = contacts.chunk_frames(links)
        assert frames % 16 == 0 and 16 <= frames <= 4096
    assert contacts.chunk_frames(1024) == 16


def item(name, size):
    return work.Item(
        work.SELF, work.Source(name, name, work.FileOptions(), size), ("p",), "{}", work.TestOptions(), (None,)
    )


def test_tasks_keep_order_and_are_bounded():
    items = [item(str(number), 1000 * (number % 50)) for number in range(5000)]
    tasks = plan.make_tasks(items, 2)
    assert [one for task in tasks for one in task] == items
    assert max(map(len, tasks)) <= 64 and 78 <= len(tasks) < 500
    assert [len(task) for task in plan.make_tasks(items[:6], 2)] == [1] * 6
    assert plan.make_tasks([], 2) == []


def test_lists_and_patterns_say_what_is_wrong_with_them(tmp_path):
    def told(text):
        path = tmp_path / "list.csv"
        path.write_text(text)
        with pytest.raises(corpus.CorpusError) as error:
            corpus.find([], [str(path)], "", work.FileOptions(), ())
        return str(error.value).removeprefix(f"{path}: ")

    assert told("path,colour\na,red\n").startswith("line 1: 'colour' is none of the columns")
    assert told("path,units\na,1\nb\n").startswith("line 3: 2 fields")
    assert told("path,units, units\na,1,2\n") == "line 1: the column units is there twice"
    assert told("path,units\na,-1\n") == "line 2: a number above 0 is wanted, and '-1' is given"
    assert told("path,body\na,mesh\n").startswith("line 2: skeleton, skin or surface is wanted")
    with pytest.raises(corpus.CorpusError, match="No such file"):
        corpus.find([], [str(tmp_path / "none")], "", work.FileOptions(), ())
    with pytest.raises(corpus.CorpusError, match="one group is wanted"):
        corpus.pair_up([], "60|61")
    with pytest.raises(corpus.CorpusError, match="unterminated|missing"):
        corpus.pair_up([], "(60")


def test_policies_are_read_from_words_and_back():
    made = policies.choose_policies("tight,strategy=tree", "convex")
    assert (made.strategy, made.exact, made.refit) == ("tree", "convex", cab.Policies.preset("tight").refit)
    assert policies.policies_of(policies.policies_text(made)) == made
    assert policies.choose_policies("exact=none", "convex").exact == "none"
    for words in ("quick", "colour=red", "sat=all"):
        with pytest.raises(ValueError):
            policies.choose_policies(words, "convex")


def test_a_policy_that_is_gone_is_refused_by_its_name():
    text = policies.policies_text(cab.Policies()).replace("refit=cab", "refit=covariance_leaves")
    gone = "refit: 'covariance_leaves' is none of cab, "
    with pytest.raises(ValueError, match=gone):
        policies.choose_policies("refit=covariance_leaves", "convex")
    with pytest.raises(ValueError, match=gone):
        policies.policies_of(text)
    with pytest.raises(ValueError, match="there is no policy 'depth'"):
        policies.choose_policies("depth=any", "convex")
    with pytest.raises(ValueError, match="'fast' is none of paper, balanced, tight$"):
        policies.choose_policies("fast,exact=none", "convex")


def test_the_command_line_refuses_what_is_wrong(capsys):
    for words, told in (
        (["self"], "give a PATH"),
        (["self", "a", "--workers", "0"], "from 1 to 1024"),
        (["self", "a", "--memory", "much"], "a size with its unit"),
        (["self", "a", "--units", "0"], "a number above 0"),
        (["robot", "a", "--states", "1.5"], "a whole number"),
        (["robot", "a", "--states", "1e999"], "a whole number"),
        (["robot", "a", "--states", "1.2345e2"], "a whole number"),
        (["self", "a", "--gap", "1e9999"], "a whole number"),
        (["self", "a", "--gap", "9" * 5000], "a whole number"),
        *((["self", "a", "--gap", text], "a whole") for text in ("1_0", " 1", "1 ", "+1", "-1", "1\n", "١", "²")),
        *((["robot", "a", "--states", text], "a whole number") for text in ("1_0e1", "١e2", "1e+2", "1e٢", "1.٠e1")),
        *((["self", "a", "--shard", text], "I/N with I from 1 to N") for text in ("١/٢", "²/²", "1/" + "9" * 5000)),
        (["self", "a", "--memory", "٢GB"], "a size with its unit"),
        (["robot", "a", "--states", "1e12"], "--states has more than 1048576 chunks of 65536: raise --chunk"),
        (["robot", "a", "--samples", "3e6", "--chunk", "2"], "--samples has more than 1048576 chunks of 2"),
        (["robot", "a", "--package", "x"], "NAME=DIR"),
        (["dance", "a"], "invalid choice"),
        (["self", "a", "--most-seconds", "0"], "a whole number from 1"),
        (["self", "a", "--policies", "exact=fast"], "--policies: "),
        (["self", "a", "--body", "mesh"], "skeleton, skin or surface is wanted"),
        (["pairs", "a", "--body", "surface", "--policies", "exact=convex"], "a surface is tested with exact="),
        (["policies", "a", "--body", "surface", "--policies", "tight", "--policies", "exact=fcl"], "not exact=fcl"),
        (["self", "a", "--body", "surface", "--min-depth", "0.01"], "--min-depth wants depths, and exact=surface"),
        (["self", "a", "--policies", "exact=none", "--min-depth", "0.01"], "--min-depth wants depths, and exact=none"),
    ):
        with pytest.raises(SystemExit) as end:
            options.parse(words, "1")
        assert end.value.code == 2 and told in capsys.readouterr().err
    for text, states in (("1e9", 10**9), ("1.5e3", 1500), ("0010", 10), ("68719476736", 1 << 36)):
        assert options.parse(["robot", "a", "--states", text], "1").states == states
    # Without samples, which an SRDF file leaves out.
    assert options.parse(["robot", "a", "--srdf", "b", "--samples", "1e12"], "1").srdf == "b"
    for words in (["--body", "skin", "--min-depth", "0.01"], ["--body", "surface", "--policies", "exact=none"]):
        assert options.parse(["self", "a", *words], "1").paths == ["a"]


class Terminal(io.StringIO):
    """Standard error as a terminal."""

    def isatty(self):
        return True


def test_progress_is_one_line_for_terminals_alone(monkeypatch):
    assert progress.time_left(50, 100, 1.0) == "" and progress.time_left(100, 100, 9.0) == ""
    assert progress.time_left(50, 100, 12.0) == "about 15 s left"
    assert progress.time_left(10, 100, 60.0) == "about 9 min left"
    assert progress.time_left(1, 100, 3600.0) == "about 99 h left"
    assert progress.time_left(1, 100, 4000.0) == "over 99 h left"
    now = [0.0]
    monkeypatch.setattr(progress.time, "monotonic", lambda: now[0])
    terminal, file = Terminal(), io.StringIO()
    for stream in (terminal, file):
        monkeypatch.setattr(sys, "stderr", stream)
        now[0] = 0.0
        bar = progress.Progress(1000)
        for _ in range(1000):
            now[0] += 0.01
            bar.advance(1)
        bar.close()
    lines = terminal.getvalue().split("\r\033[K")
    assert 9 <= len(lines) <= 13 and lines[-1] == ""
    assert lines[6].startswith("scan [####") and lines[6].endswith("left")
    assert file.getvalue() == ""
