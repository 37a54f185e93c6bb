"""What an arm touches with a stick in its hand. Usage: URDF"""

import sys

import cab

robot = cab.Robot(sys.argv[1])
states = robot.random_states(100_000)
table = cab.Body.from_boxes(parents=[-1], half=[[2, 2, 0.05]], names=["table"])
stick = cab.Body.from_boxes(parents=[-1], half=[[0.05, 0.05, 0.4]])
held = cab.Attached("lower", stick, pose=[0, 0, 0, 1, 0, 0, 1.9], name="stick")

for attached in [], [held]:
    checker = cab.CollisionChecker(robot, attached=attached)
    checker.add_fixed(table, [[0, 0, 0, 1, 0, 2.6, 0.3]])
    print(f"{len(attached)} held: {100 * checker.collides(states).mean():.1f} % of the states collide")

pairs = checker.names(checker.hits(states))
print("the stick touches", ", ".join(sorted({b if a == "stick" else a for a, b in pairs if "stick" in (a, b)})))
