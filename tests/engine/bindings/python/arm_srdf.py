"""Writes the pairs of links that need no test as an SRDF file. Usage: URDF SRDF"""

import pathlib
import sys

import cab

robot = cab.Robot(sys.argv[1])
table = robot.table(robot.allowed_collisions(samples=10_000))
print(table)
lines = [
    f'  <disable_collisions link1="{a}" link2="{b}" reason="{reason.capitalize()}"/>' for a, b, reason, _ in table
]
pathlib.Path(sys.argv[2]).write_text("\n".join(['<robot name="arm">', *lines, "</robot>", ""]))
print(cab.Robot(sys.argv[1], srdf=sys.argv[2]).body.ignored_pairs.tolist())
