"""Two thousand people walk about a square of 45 metres: who touches whom?"""

import cab
import numpy as np

trunk, head = [0.25, 0.2, 0.7], [0.1, 0.1, 0.12]  # half extents in metres
body = cab.Body.from_boxes(parents=[-1, 0], half=[trunk, head], names=["trunk", "head"])
world = cab.World()
world.add(body, 2000)
poses = np.zeros((2000, 2, 7), dtype=np.float32)  # per person and link: quaternion x y z w, translation x y z
poses[:, :, 3] = 1
poses[:, :, 6] = [0.7, 1.55]  # how high the links are
random = np.random.default_rng(1)
origins = np.zeros((2000, 3))  # where each person stands
origins[:, :2] = random.uniform(0, 45, (2000, 2))
for frame in range(100):
    origins[:, :2] += random.normal(0, 0.02, (2000, 2))
    hits = world.run(poses, origins=origins).hits
for hit in hits[:3]:
    print(f"person {hit['instance_a']}'s {body.names[hit['link_a']]} touches person {hit['instance_b']}")
print(f"{len(hits)} pairs of links touch")
