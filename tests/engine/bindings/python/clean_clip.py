"""Where does a recorded person go through itself, for how long, and how deep? Usage: FILE UNIT_IN_METRES PICTURE"""

import sys

import cab
import matplotlib.pyplot as plt

motion = cab.load_motion(sys.argv[1], units=float(sys.argv[2]))
body = motion.body.ignoring(hops=2)  # links that are at most two joints apart always touch
clip = cab.Clip(body, motion.poses, fps=motion.fps or 30, name="walker")
rows = clip.intervals(min_depth=0.01, gap=3)  # deeper than a centimetre; gaps of three frames are bridged
table = clip.table(rows)
print(table)
colours = plt.cm.viridis(rows["depth"] / rows["depth"].max(initial=1e-9))
names = [f"{a} in {b}" for a, b in zip(table["link_a"], table["link_b"])]
plt.barh(names, rows["seconds"], left=rows["first"] / clip.fps, color=colours)
plt.xlabel("seconds")
plt.savefig(sys.argv[3], bbox_inches="tight")
