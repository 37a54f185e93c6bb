"""Run it in Blender's text editor: a marker in the timeline for each contact, and an empty where it is worst."""
import csv

import bpy

FILE = "/home/me/report.csv"  # of `cab report`, or of the button Markers

scene = bpy.context.scene
frames_per_second = scene.render.fps / scene.render.fps_base
with open(FILE, newline="", encoding="utf-8") as file:
    for row in csv.DictReader(file):
        if row["problem"]:
            continue
        name = f"{row['link_a']} - {row['link_b']}"
        frame = scene.frame_start + round(float(row["worst_seconds"]) * frames_per_second)
        scene.timeline_markers.new(name, frame=frame)
        if row["worst_x"]:
            x, y, z = (float(row["worst_" + axis]) for axis in "xyz")
            place = bpy.data.objects.new(name, None)
            place.location = (x, -z, y)  # of files in which y is up; else (x, y, z)
            place.empty_display_size = 0.05
            scene.collection.objects.link(place)
