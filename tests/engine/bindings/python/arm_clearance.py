"""How near an arm comes to itself and to a table, as a picture; and a way out of a collision. Usage: URDF PICTURE"""

import sys

import cab
import matplotlib.pyplot as plt
import numpy as np

robot = cab.Robot(sys.argv[1])
checker = cab.CollisionChecker(robot)
checker.add_fixed(cab.Body.from_boxes([-1], [[2, 2, 0.05]], names=["table"]), [[0, 0, 0, 1, 0, 3, 0.3]])

shoulder, elbow = np.meshgrid(np.linspace(-2, 2, 201), np.linspace(-3, 3, 301))
states = np.stack((shoulder.ravel(), elbow.ravel()), axis=1)
# quote
clearance = checker.clearance(states, most=1)  # metres; below 0: depth; infinite where nothing is within 1
# end quote
shown = clearance.clip(-0.5, 0.5).reshape(shoulder.shape)
plt.colorbar(plt.pcolormesh(shoulder, elbow, shown, cmap="RdBu"), label="metres")
plt.xlabel("shoulder, radians")
plt.ylabel("elbow, radians")
plt.savefig(sys.argv[2], bbox_inches="tight")
print(f"{100 * (clearance < 0).mean():.1f} % collide, {100 * (clearance < 0.05).mean():.1f} % come within 5 cm")

# quote
# Out of a collision: along the gradient of the distance of what is nearest, until 5 cm are free.
state = np.array([[-1.2, -1.5]])
for step in range(100):
    nearest, slopes = checker.distances(state, most=1, gradients=True)
    distance = nearest["distance"][0]
    if step == 0 or distance >= 0.05:
        a, b = checker.names(nearest)[0]
        print(f"step {step}: {a} is {distance:.3f} m from {b}")
    if distance >= 0.05:
        break
    state += min(0.1, 0.06 - distance) * slopes / (slopes**2).sum()
print(f"shoulder {state[0, 0]:.2f}, elbow {state[0, 1]:.2f}")

way = checker.edges(state, [[0.5, -0.5]])[0]
print(f"straight from there to 0.5, -0.5: {'proven free' if way['free'] else 'not free'}")
# end quote
