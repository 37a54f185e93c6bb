"""Runs blender_markers.py with a stand-in for Blender, on a file of the columns that `cab report` writes."""
import pathlib
import sys
import tempfile
import types

HEADER = (
    "file,character_a,link_a,character_b,link_b,first_frame,last_frame,frames,first_seconds,last_seconds,worst_depth,"
    "worst_triangles,worst_frame,worst_seconds,worst_x,worst_y,worst_z,problem\n"
)
ROWS = (
    'a.cab,anna,"arm, left",ben,hips,10,20,11,1,2,0.1,,15,1.5,1,2,3,\n'
    "a.cab,anna,arm,ben,hips,30,40,11,3,4,,,30,3,,,,\n"
    "b.cab,,,,,,,,,,,,,,,,,cut off\n"
)


def stand_in():
    """A module with what the script uses of `bpy`, and what it made."""
    made = {"markers": [], "objects": []}
    scene = types.SimpleNamespace(
        frame_start=1, render=types.SimpleNamespace(fps=60, fps_base=2.0),
        timeline_markers=types.SimpleNamespace(new=lambda name, frame: made["markers"].append((name, frame))),
        collection=types.SimpleNamespace(objects=types.SimpleNamespace(link=made["objects"].append)),
    )
    module = types.ModuleType("bpy")
    module.context = types.SimpleNamespace(scene=scene)
    module.data = types.SimpleNamespace(
        objects=types.SimpleNamespace(new=lambda name, data: types.SimpleNamespace(name=name, data=data))
    )
    return module, made


def main():
    script = pathlib.Path(__file__).with_name("blender_markers.py").read_text(encoding="utf-8")
    sys.modules["bpy"], made = stand_in()
    with tempfile.TemporaryDirectory() as folder:
        file = pathlib.Path(folder) / "report.csv"
        file.write_text(HEADER + ROWS, encoding="utf-8")
        assert '"/home/me/report.csv"' in script
        exec(compile(script.replace('"/home/me/report.csv"', repr(str(file))), "blender_markers.py", "exec"), {})
    assert made["markers"] == [("arm, left - hips", 46), ("arm - hips", 91)], made["markers"]
    (place,) = made["objects"]
    assert (place.name, place.location) == ("arm, left - hips", (1.0, -3.0, 2.0))


main()
