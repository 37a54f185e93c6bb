"""Which states of an arm collide, with itself and with a table. Usage: URDF"""

import sys

import cab
import numpy as np

robot = cab.Robot(sys.argv[1])
for a, b, reason, _ in robot.allowed_collisions().tolist():
    print(f"not tested: {robot.body.names[a]} - {robot.body.names[b]}, {reason}")

states = robot.random_states(100_000)  # float64 (100 000, 2): shoulder, elbow
print(f"{100 * robot.collides(states).mean():.1f} % of the states collide")

checker = cab.CollisionChecker(robot, margin=0.02)
table = cab.Body.from_boxes(parents=[-1], half=[[2, 2, 0.05]], names=["table"])
checker.add_fixed(table, [[0, 0, 0, 1, 0, 2.6, 0.3]])
print(f"{100 * checker.collides(states).mean():.1f} % of them beside the table, with 2 cm between all")

hit = checker.hits(states[:100], depths=True)[0]
shoulder, elbow = np.degrees(states[hit["state"]])
a, b = checker.names([hit])[0]
print(f"state {hit['state']}, shoulder {shoulder:.0f}, elbow {elbow:.0f} degrees: "
      f"{a} is {hit['depth']:.3f} m deep in {b}")

