"""Which triangles of two skinned meshes pass through each other, frame by frame, as arrays."""

import cab
import numpy as np


def limb(rings=41, sides=24):
    """A tube along x that bends at x = 0: vertices, triangles, and the weights of its two bones."""
    x = np.linspace(-0.5, 0.5, rings)
    angle = np.linspace(0, 2 * np.pi, sides, endpoint=False)
    vertices = np.array([[at, 0.08 * np.cos(a), 0.08 * np.sin(a)] for at in x for a in angle], dtype=np.float32)
    a = np.arange((rings - 1) * sides)
    b = a // sides * sides + (a + 1) % sides
    triangles = np.concatenate([np.stack([a, b, a + sides], axis=1), np.stack([b, b + sides, a + sides], axis=1)])
    upper = np.clip(0.5 - 4 * vertices[:, 0], 0, 1)
    return vertices, triangles, np.stack([upper, 1 - upper], axis=1)


def bend(angles, place):
    """(frames, bones, 4, 4): the second bone turned about z at the origin, and all moved."""
    out = np.tile(np.eye(4, dtype=np.float32), (len(angles), 2, 1, 1))
    cosine, sine = np.cos(angles), np.sin(angles)
    out[:, 1, :2, :2] = np.stack([np.stack([cosine, -sine], axis=-1), np.stack([sine, cosine], axis=-1)], axis=-2)
    out[:, :, :3, 3] = place
    return out


# quote
vertices, triangles, weights = limb()
bones = np.tile([0, 1], (len(vertices), 1))
rest = np.tile(np.eye(4, dtype=np.float32), (2, 1, 1))  # joint to model; so are the inverse bind matrices
body = cab.Body.from_surface([-1, 0], rest, vertices, triangles, bones, weights, rest, names=["upper", "lower"])

sources = body.source_triangles

angles = np.linspace(0, 1.5, 6)
left, right = bend(angles, [0, 0, 0]), bend(-angles, [0, 0.6, 0.03])
world = cab.World()
one, other = world.add(body), world.add(body)
for frame in range(len(angles)):
    now = slice(frame, frame + 1)
    posed = [one.posed(body.link_poses(left[now])), other.posed(body.link_poses(right[now]))]
    hits = world.run(posed, pairs=[(one, other)], exact="surface").hits
    rows = world.touching_triangles(hits, posed)
    # Which triangles of the mesh these are, as pairs of rows of `triangles`: what a loss of penetration takes.
    pairs = np.array(
        [(sources[r["leaf_a"]][r["triangle_a"]], sources[r["leaf_b"]][r["triangle_b"]]) for r in rows]
    )
    links = ", ".join(f"{body.names[hit['link_a']]} and {body.names[hit['link_b']]}" for hit in hits)
    print(f"frame {frame}: {len(pairs)} pairs of triangles" + (f", {links}" if links else ""))
# end quote
