"""Robots: chunks merged on any workers against `cab robot` with the same seed."""

import json
import os
import pathlib
import sqlite3
import subprocess

import pytest
from cab_scan import tasks

from conftest import data_folder

COMMAND = os.environ.get("CAB_COMMAND", "")

_LINKS = {
    "base": ".2 .2 .2", "upper": ".5 .1 .1", "elbow": "", "lower": ".5 .1 .1", "tip": ".1 .3 .1", "far": ".1 .1 .1"
}
_PARENTS = {"upper": "base", "elbow": "upper", "lower": "elbow", "tip": "lower", "far": "base"}


def write_arm(path: pathlib.Path, far: str = "9 0 0") -> None:
    """An arm that may fold onto its base, with a link without shape and one that nothing reaches."""
    lines = ['<robot name="arm">']
    for name, size in _LINKS.items():
        shape = f'<origin xyz=".25 0 0"/><geometry><box size="{size}"/></geometry>'
        lines.append(f'<link name="{name}">{"<collision>" + shape + "</collision>" if size else ""}</link>')
    for name, parent in _PARENTS.items():
        kind = "fixed" if name == "far" else "revolute"
        place = far if name == "far" else ".5 0 0" if parent != "base" else "0 0 0"
        lines.append(
            f'<joint name="j_{name}" type="{kind}"><parent link="{parent}"/><child link="{name}"/>'
            f'<origin xyz="{place}"/><axis xyz="0 0 1"/><limit lower="-3" upper="3" effort="1" velocity="1"/></joint>'
        )
    path.write_text("\n".join([*lines, "</robot>"]))


def robot_json(scan, file, *words):
    """What `cab robot` says."""
    out = scan.folder / "robot.json"
    command = [COMMAND, "robot", str(file), "--json", str(out), *map(str, words)]
    outcome = subprocess.run(command, cwd=scan.folder, capture_output=True, text=True, check=False)
    assert outcome.returncode == 0, outcome.stderr
    return json.loads(out.read_text())


def pairs_of(scan, what, table="scan.sqlite"):
    base = sqlite3.connect(scan.folder / table)
    found = base.execute("SELECT link_a, link_b, reason, states, first_state FROM pairs WHERE what = ?", (what,))
    rows = found.fetchall()
    base.close()
    return rows


def check_against_command(scan, quick, file, states, samples, *words):
    outcome = quick("robot", file, "--states", states, "--samples", samples, "--chunk", 1000, "--seed", 3, *words)
    assert outcome.code == 0, outcome.error
    wanted = robot_json(scan, file, "--random", states, "--samples", samples, "--seed", 3)
    rows = [row for row in scan.rows() if row["what"] == "robot states"]
    assert len(rows) == -(-states // 1000)
    assert sum(row["frames"] for row in rows) == wanted["states"] == states
    assert sum(row["hits"] for row in rows) == wanted["hits"]
    assert sum(row["hit_frames"] for row in rows) == wanted["states_in_self_collision"] > 0
    masked = {(a, b): why for a, b, why, *_ in pairs_of(scan, "robot samples") if why}
    assert masked == {(one["link_a"], one["link_b"]): one["reason"] for one in wanted["masked"]}
    touching = {(a, b): (count, first) for a, b, _, count, first in pairs_of(scan, "robot states")}
    assert touching == {
        (one["link_a"], one["link_b"]): (one["states"], one["first_state"]) for one in wanted["pairs"]
    }
    return outcome, wanted


def test_chunks_merge_to_what_the_command_finds(scan, quick):
    write_arm(scan.folder / "arm.urdf")
    outcome, wanted = check_against_command(scan, quick, "arm.urdf", 5500, 2500)
    assert {one["reason"] for one in wanted["masked"]} >= {"adjacent", "never"}
    one = scan.here("robot", "arm.urdf", "--states", 5500, "--samples", 2500, "--chunk", 1000, "--seed", 3,
                    "--workers", 1, "--table", "one.sqlite")
    assert one.hash == outcome.hash


def test_bodies_of_one_rigid_body_are_welded_as_the_command_says(scan, quick):
    bodies = ("<body name='a'><geom size='.3'/><joint axis='0 0 1' range='-90 90'/><body name='b' pos='.4 0 0'>"
              "<geom size='.3'/><body name='c' pos='.5 0 0'><joint axis='0 0 1' range='-170 170'/><geom size='.3'/>"
              "<body name='d' pos='.5 0 0'><joint axis='0 0 1' range='-150 150'/><geom size='.3'/></body></body></body>"
              "</body>")
    (scan.folder / "arm.xml").write_text(f"<mujoco><worldbody>{bodies}</worldbody></mujoco>")
    (scan.folder / "arm.srdf").write_text("<robot name='arm'/>")
    probe = subprocess.run([COMMAND, "robot", "arm.xml", "--random", "1"], cwd=scan.folder, capture_output=True,
                           text=True, check=False)
    if "libmujoco" in probe.stderr:
        pytest.skip(probe.stderr)
    _, wanted = check_against_command(scan, quick, "arm.xml", 1000, 500)
    reasons = {(one["link_a"], one["link_b"]): one["reason"] for one in wanted["masked"]}
    assert reasons["a", "b"] == "welded" and reasons["b", "c"] == "adjacent"
    # With SRDF too, which has no word for it.
    assert quick("robot", "arm.xml", "--states", 100, "--srdf", "arm.srdf", "--table", "srdf.sqlite").code == 0
    assert pairs_of(scan, "robot samples", "srdf.sqlite") == [("a", "b", "welded", 0, None)]


def test_finished_chunks_are_kept_and_another_robot_begins_anew(scan, quick):
    write_arm(scan.folder / "arm.urdf")
    words = ["robot", "arm.urdf", "--samples", 1000, "--chunk", 1000]
    first = quick(*words, "--states", 3500)
    there = {row["part"]: row["id"] for row in scan.rows() if row["what"] == "robot states"}
    assert len(there) == 4
    assert quick(*words, "--states", 3500).hash == first.hash
    for states in (3499, 3000, 1000, 0):  # what is done is not forgotten unasked
        fewer = quick(*words, "--states", states)
        assert fewer.code == 1 and fewer.error == (
            "cab scan: scan.sqlite: arm.urdf: chunks are done up to state 3500, and --states "
            f"{states} has fewer; --again forgets them, another --table keeps them\n"
        )
    assert quick(*words, "--states", 3500).hash == first.hash
    for states, kept in ((3700, 3), (4000, 3), (5100, 4)):  # the last chunk grows, and others are as they were
        longer = quick(*words, "--states", states)
        rows = [row for row in scan.rows() if row["what"] == "robot states"]
        assert sum(there.get(row["part"]) == row["id"] for row in rows) == kept
        assert sum(row["frames"] for row in rows) == states
        assert quick(*words, "--states", states, "--table", f"{states}.sqlite").hash == longer.hash
        there = {row["part"]: row["id"] for row in rows}
    again = quick(*words, "--states", 1000, "--again")
    assert again.code == 0 and again.hash == quick(*words, "--states", 1000, "--table", "again.sqlite").hash
    write_arm(scan.folder / "arm.urdf", far="0 8 0")
    changed = quick(*words, "--states", 900)
    assert changed.error.splitlines() == [
        f"cab scan: arm.urdf: robot {what} begin anew: 1 chunk of another robot or version of cab"
        for what in ("samples", "states")
    ]
    assert quick(*words, "--states", 900, "--table", "changed.sqlite").hash == changed.hash


def test_a_chunk_that_was_lost_stays_what_it_was(scan, quick):
    write_arm(scan.folder / "arm.urdf")
    words = ["robot", "arm.urdf", "--samples", 100, "--chunk", 1000]
    assert quick(*words, "--states", 1500).code == 0

    class Lost:
        def dispatch(self, items, finished):
            for item in items:
                finished(tasks.lost_rows(item))

    assert scan.here(*words, "--states", 3000, workers=Lost()).code == 1
    outcomes = [(row["part"], row["outcome"]) for row in scan.rows() if row["what"] == "robot states"]
    assert outcomes == [
        ("0000000000000+1000", "done"), ("0000000001000+1000", "lost"), ("0000000001000+500", "done"),
        ("0000000002000+1000", "lost"),
    ]
    for states in (1500, 3000):
        wanted = quick(*words, "--states", states, "--table", f"{states}.sqlite").hash
        assert quick(*words, "--states", states).hash == wanted


def test_given_pairs_are_masked_and_bad_robots_told(scan, quick):
    write_arm(scan.folder / "arm.urdf")
    (scan.folder / "arm.srdf").write_text(
        '<robot name="arm"><disable_collisions link1="base" link2="upper" reason="Adjacent"/>'
        '<disable_collisions link1="base" link2="ghost" reason="Never"/></robot>'
    )
    outcome = quick("robot", "arm.urdf", "--states", 2000, "--srdf", "arm.srdf")
    assert outcome.code == 0
    assert "cab scan: arm.urdf: arm.srdf: the robot has no link ghost" in outcome.error, outcome.error
    assert all("ghost" in row["notes"] for row in scan.rows(rest="WHERE part <> ''"))
    wanted = robot_json(scan, scan.folder / "arm.urdf", "--random", 2000, "--srdf", scan.folder / "arm.srdf")
    assert sum(row["hits"] for row in scan.rows()) == wanted["hits"]
    assert pairs_of(scan, "robot samples") == [("base", "upper", "file", 0, None)]
    (scan.folder / "bad.urdf").write_text((scan.folder / "arm.urdf").read_text().replace(".5 .1 .1", "-1 .1 .1", 1))
    outcome = quick("robot", "bad.urdf", "arm.urdf", "--states", 100, "--samples", 100, "--table", "bad.sqlite")
    assert outcome.code == 1 and "bad.urdf: line 3" in outcome.error
    assert [row["outcome"] for row in scan.rows(table="bad.sqlite")] == ["done", "done", "bad"]


def test_rows_of_robots_that_the_scan_did_not_name_are_reported(scan, quick):
    for name in ("arm", "other"):
        write_arm(scan.folder / f"{name}.urdf")
    (scan.folder / "bad.urdf").write_text("")
    words = ["--samples", 100, "--states", 100]
    told = "cab scan: {} rows of scan.sqlite are of files or options that this scan did not name"
    for files, count in ((["."], 0), (["arm.urdf"], 3), (["arm.urdf", "--policies", "tight"], 5), (["."], 2)):
        outcome = quick("robot", *files, *words)
        lines = [line for line in outcome.error.splitlines() if "did not name" in line]
        assert lines == ([told.format(count)] if count else []), outcome.error


def given_by(scan, *words):
    """All items that a scan of robots gives to workers."""
    items = []

    class Workers:
        def dispatch(self, given, finished):
            items.extend(given)
            for item in given:
                finished(tasks.run_items([item], str(scan.folder)).rows)

    outcome = scan.here("robot", *words, "--states", 100, "--samples", 100, workers=Workers())
    assert outcome.code == 0, outcome.error
    return items


def test_a_robot_that_is_listed_twice_is_scanned_once(scan):
    write_arm(scan.folder / "arm.urdf")
    (scan.folder / "list.csv").write_text("path,units,part\narm.urdf,1,\narm.urdf,2,\narm.urdf,,a\n")
    (item,) = [item for item in given_by(scan, "--list", "list.csv") if item.what == "robot states"]
    assert item.source.name == "arm.urdf"


@pytest.mark.skipif(data_folder() is None, reason="CAB_DATA_DIR names no folder")
def test_a_real_hand_is_that_of_the_command(scan, quick):
    check_against_command(scan, quick, data_folder() / "robots/allegro_hand/allegro_hand_right.urdf", 20000, 10000)
