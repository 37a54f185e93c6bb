# Two arms of two jointed links each: which links touch?
import numpy as np

import cab

# Once: link 1 hangs on link 0. Each is a box 1 long, with its joint at the frame's origin and x along it.
arm = cab.Body.from_boxes(parents=[-1, 0], half=[[0.5, 0.1, 0.1]] * 2, center=[[0.5, 0, 0]] * 2)
world = cab.World()
world.add(arm, 2)

# Every frame: a quaternion x y z w and a translation for each link of each arm, and where each arm stands.
poses = np.array(
    [
        [[0, 0, 0, 1, 0, 0, 0], [0, 0, 0.7071068, 0.7071068, 1, 0, 0]],  # bent upwards
        [[0, 0, 0, 1, 0, 0, 0], [0, 0, 0, 1, 1, 0, 0]],  # straight
    ],
    dtype=np.float32,
)
origins = np.array([[0, 0, 0], [0.6, 0.5, 0]])
for hit in world.run(poses, origins=origins).hits:
    print(f"link {hit['link_a']} of arm {hit['instance_a']} touches link {hit['link_b']} of arm {hit['instance_b']}")
