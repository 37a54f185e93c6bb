"""Which states of an arm collide, with itself and with a table."""

import pathlib
import tempfile

import cab
import numpy as np

URDF = """<robot name="arm">
  <link name="base"><collision><geometry><box size="1 1 1"/></geometry></collision></link>
  <link name="upper"><collision><origin xyz="0 0 1"/><geometry><cylinder radius=".1" length="2"/></geometry>
    </collision></link>
  <link name="lower"><collision><origin xyz="0 0 .8"/><geometry><cylinder radius=".1" length="1.6"/></geometry>
    </collision></link>
  <joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/><origin xyz="0 0 .6"/>
    <axis xyz="1 0 0"/><limit lower="-2" upper="2" effort="1" velocity="1"/></joint>
  <joint name="elbow" type="revolute"><parent link="upper"/><child link="lower"/><origin xyz="0 0 2"/>
    <axis xyz="1 0 0"/><limit lower="-3" upper="3" effort="1" velocity="1"/></joint>
</robot>
"""

file = pathlib.Path(tempfile.mkdtemp()) / "arm.urdf"
file.write_text(URDF)
robot = cab.Robot(file)
for a, b, reason, _ in robot.allowed_collisions().tolist():
    print(f"not tested: {robot.body.names[a]} - {robot.body.names[b]}, {reason}")

states = robot.random_states(100_000)  # float64 (100 000, 2): shoulder, elbow
print(f"{100 * robot.collides(states).mean():.1f} % of the states collide")

checker = cab.CollisionChecker(robot, margin=0.02)
table = cab.Body.from_boxes(parents=[-1], half=[[2, 2, 0.05]])
checker.add_fixed(table, [[0, 0, 0, 1, 0, 2.6, 0.3]])
print(f"{100 * checker.collides(states).mean():.1f} % of them beside the table, with 2 cm between all")

hit = checker.hits(states[:100], depths=True)[0]
shoulder, elbow = np.degrees(states[hit["state"]])
what = robot.body.names[hit["link_b"]] if hit["fixed"] < 0 else "table"
print(f"state {hit['state']}, shoulder {shoulder:.0f}, elbow {elbow:.0f} degrees: "
      f"{robot.body.names[hit['link_a']]} is {hit['depth']:.3f} m deep in the {what}")
