"""Which states of a file collide, in which links how deep, and how many of all states do. Usage: URDF SRDF CSV"""

import sys

import cab
import numpy as np

robot = cab.Robot(sys.argv[1], srdf=sys.argv[2])
table = np.char.strip(np.loadtxt(sys.argv[3], str, delimiter=",", encoding="utf-8-sig", ndmin=2))
states = robot.states(dict(zip(table[0], table[1:].astype(float).T)))
print(robot.collides(states))
print(robot.table(robot.hits(states, depths=True)))
print(f"{100 * robot.collides(robot.random_states(100_000)).mean():.1f} % of random states collide")
