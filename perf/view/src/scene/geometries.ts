// The geometries that pieces are drawn with. Each has size 1, and a piece's transform gives it its size; only capsules
// and hulls have geometries of their own.
import * as THREE from 'three';
import {ConvexGeometry} from 'three/addons/geometries/ConvexGeometry.js';
import {mergeGeometries, mergeVertices} from 'three/addons/utils/BufferGeometryUtils.js';

/** How finely round shapes are drawn: `fine` for a few characters, `coarse` for crowds. */
export type Fineness = 'fine' | 'coarse';

// Faces that are lit as faces share their corners.
function withoutNormals(geometry: THREE.BufferGeometry): THREE.BufferGeometry {
  geometry.deleteAttribute('normal');
  geometry.deleteAttribute('uv');
  return mergeVertices(geometry);
}

/**
 * The three faces of a box from -1 to 1 that meet in its upper corner. Both triangles of a face end in a vertex that no
 * other face has, whose normal is that of the face: it is the one that counts where shading is flat.
 */
export function boxCorner(): THREE.BufferGeometry {
  const corners = [[1, 1, 1], [-1, 1, 1], [-1, -1, 1], [1, -1, 1], [1, -1, -1], [1, 1, -1], [-1, 1, -1]];
  const normals = [[0, 0, 1], [0, 0, 1], [0, 0, 1], [0, 0, 1], [1, 0, 0], [0, 0, 1], [0, 1, 0]];
  return new THREE.BufferGeometry()
      .setAttribute('position', new THREE.Float32BufferAttribute(corners.flat(), 3))
      .setAttribute('normal', new THREE.Float32BufferAttribute(normals.flat(), 3))
      .setIndex([0, 1, 2, 3, 0, 2, 0, 3, 4, 5, 0, 4, 0, 5, 6, 1, 0, 6]);
}

/** Of radius 1. */
export const unitBall = (fineness: Fineness): THREE.BufferGeometry =>
  fineness === 'fine' ? new THREE.SphereGeometry(1, 24, 16) : new THREE.SphereGeometry(1, 8, 6);

/** Of radius 1, from -1 to 1 along z. */
export const unitCylinder = (fineness: Fineness): THREE.BufferGeometry =>
  new THREE.CylinderGeometry(1, 1, 2, fineness === 'fine' ? 24 : 8).rotateX(Math.PI / 2);

/** Of radius 1; `halfLength` is half the length of its cylinder along z. */
export const unitCapsule = (halfLength: number, fineness: Fineness): THREE.BufferGeometry =>
  (fineness === 'fine' ? new THREE.CapsuleGeometry(1, 2 * halfLength, 8, 20) :
                         new THREE.CapsuleGeometry(1, 2 * halfLength, 2, 8)).rotateX(Math.PI / 2);

/** From -1 to 1 along x and y, at z = 0. */
export const unitQuad = (): THREE.BufferGeometry => withoutNormals(new THREE.PlaneGeometry(2, 2));

/** The edges of a box from -1 to 1, for lines. */
export function unitBoxEdges(): THREE.BufferGeometry {
  const corners: number[] = [];
  for (let axis = 0; axis < 3; ++axis) {
    for (const u of [-1, 1]) {
      for (const v of [-1, 1]) {
        for (const along of [-1, 1]) {
          const corner = [0, 0, 0];
          corner[axis] = along;
          corner[(axis + 1) % 3] = u;
          corner[(axis + 2) % 3] = v;
          corners.push(...corner);
        }
      }
    }
  }
  return new THREE.BufferGeometry().setAttribute('position', new THREE.Float32BufferAttribute(corners, 3));
}

/** From the origin to 1 along z. */
export const unitArrow = (): THREE.BufferGeometry => mergeGeometries([
  new THREE.CylinderGeometry(0.03, 0.03, 0.75, 8).rotateX(Math.PI / 2).translate(0, 0, 0.375),
  new THREE.ConeGeometry(0.1, 0.3, 12).rotateX(Math.PI / 2).translate(0, 0, 0.85),
]);

/** The convex hull of points; of points in one plane their polygon, seen from both sides. */
export function hull(vertices: Float32Array): THREE.BufferGeometry {
  const points: THREE.Vector3[] = [];
  for (let i = 0; i + 2 < vertices.length; i += 3) {
    points.push(new THREE.Vector3(vertices[i], vertices[i + 1], vertices[i + 2]));
  }
  return withoutNormals(flatNormal(points) ? polygon(points) : solidHull(points));
}

// Points that are almost in one plane may have no hull in float: they become the box about them.
function solidHull(points: THREE.Vector3[]): THREE.BufferGeometry {
  try {
    const made = new ConvexGeometry(points);
    if (made.getAttribute('position').count > 0) return made;
  } catch {
    // The box below takes its place.
  }
  const box = new THREE.Box3().setFromPoints(points);
  const size = box.getSize(new THREE.Vector3());
  return new THREE.BoxGeometry(size.x, size.y, size.z).translate(...box.getCenter(new THREE.Vector3()).toArray());
}

/** The normal of the plane that all points are in; null if they are not in one. */
function flatNormal(points: readonly THREE.Vector3[]): THREE.Vector3 | null {
  const box = new THREE.Box3().setFromPoints([...points]);
  const size = box.getSize(new THREE.Vector3()).length();
  const first = points[0] ?? new THREE.Vector3();
  const normal = new THREE.Vector3(), along = new THREE.Vector3(), arm = new THREE.Vector3();
  for (const p of points) {
    arm.copy(p).sub(first);
    if (arm.lengthSq() > along.lengthSq()) along.copy(arm);
  }
  for (const p of points) {
    arm.copy(p).sub(first).cross(along);
    if (arm.lengthSq() > normal.lengthSq()) normal.copy(arm);
  }
  if (normal.lengthSq() === 0) return new THREE.Vector3(0, 0, 1);
  normal.normalize();
  const isFlat = points.every((p) => Math.abs(p.clone().sub(first).dot(normal)) < 1e-5 * size);
  return isFlat ? normal : null;
}

function polygon(points: readonly THREE.Vector3[]): THREE.BufferGeometry {
  const normal = flatNormal(points) ?? new THREE.Vector3(0, 0, 1);
  const middle = points.reduce((sum, p) => sum.add(p), new THREE.Vector3()).divideScalar(points.length);
  const u = points[0]!.clone().sub(middle).normalize();
  const v = normal.clone().cross(u);
  const angle = (p: THREE.Vector3): number => {
    const d = p.clone().sub(middle);
    return Math.atan2(d.dot(v), d.dot(u));
  };
  const around = [...points].sort((a, b) => angle(a) - angle(b));
  const triangles: THREE.Vector3[] = [];
  around.forEach((p, i) => {
    const next = around[(i + 1) % around.length]!;
    triangles.push(middle, p, next, middle, next, p);
  });
  return new THREE.BufferGeometry().setFromPoints(triangles);
}
