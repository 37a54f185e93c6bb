"""Which states of a file collide, in which links how deep, and how many of all states do. Usage: URDF SRDF CSV"""

import sys

import cab
import numpy as np

robot = cab.Robot(sys.argv[1], srdf=sys.argv[2])
columns = np.genfromtxt(sys.argv[3], delimiter=",", names=True)
states = robot.states({joint: columns[joint] for joint in columns.dtype.names})
print(robot.collides(states))
print(robot.table(robot.hits(states, depths=True)))
print(f"{100 * robot.collides(robot.random_states(100_000)).mean():.1f} % of random states collide")
