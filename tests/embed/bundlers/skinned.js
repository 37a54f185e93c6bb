// Two skinned meshes of three.js: the triangles that touch are red.
import {load} from 'cab-collision/inline';
import * as THREE from 'three';

// The links of a SkinnedMesh, and of each bone the triangles that it moves most.
function bodyOf({geometry, skeleton, bindMatrix}) {
  const {position, skinIndex, skinWeight} = geometry.attributes, {bones, boneInverses} = skeleton;
  const leaves = bones.map((_, link) => ({link, triangles: []}));
  const index = geometry.index.array;
  for (let t = 0; t < index.length; t += 3) {
    const corners = index.slice(t, t + 3), shares = bones.map(() => 0);
    for (const corner of corners) {
      for (let k = 0; k < 4; ++k) shares[skinIndex.getComponent(corner, k)] += skinWeight.getComponent(corner, k);
    }
    leaves[shares.indexOf(Math.max(...shares))].triangles.push(...corners);
  }
  return {
    linkParents: bones.map((bone) => bones.indexOf(bone.parent)),
    leaves: leaves.filter((leaf) => leaf.triangles.length > 0),
    ignoredHops: 1,
    skin: {
      vertices: position.array,
      influenceCount: 4, influenceLinks: skinIndex.array, influenceWeights: skinWeight.array,
      inverseBind: boneInverses.flatMap((inverse) => inverse.clone().multiply(bindMatrix).elements),
    },
  };
}

// A tube about two bones, whose upper half bends.
function makeTube(x) {
  const geometry = new THREE.CylinderGeometry(0.15, 0.15, 2, 24, 40).toNonIndexed();
  const {count} = geometry.attributes.position;
  geometry.setIndex(Array.from({length: count}, (_, i) => i));
  const places = geometry.attributes.position, links = [], weights = [];
  for (let i = 0; i < count; ++i) {
    const upper = THREE.MathUtils.smoothstep(places.getY(i), -0.3, 0.3);
    links.push(0, 1, 0, 0);
    weights.push(1 - upper, upper, 0, 0);
  }
  geometry.setAttribute('skinIndex', new THREE.Uint16BufferAttribute(links, 4));
  geometry.setAttribute('skinWeight', new THREE.Float32BufferAttribute(weights, 4));
  geometry.setAttribute('color', new THREE.Float32BufferAttribute(new Float32Array(3 * count), 3));
  const mesh = new THREE.SkinnedMesh(geometry, new THREE.MeshStandardMaterial({vertexColors: true}));
  const [lower, upper] = [new THREE.Bone(), new THREE.Bone()];
  lower.position.y = -1;
  upper.position.y = 1;
  lower.add(upper);
  mesh.add(lower);
  mesh.bind(new THREE.Skeleton([lower, upper]));
  mesh.position.x = x;
  return mesh;
}

async function main() {
  const renderer = new THREE.WebGLRenderer({antialias: true});
  renderer.setSize(innerWidth, innerHeight);
  document.body.append(renderer.domElement);
  const scene = new THREE.Scene(), camera = new THREE.PerspectiveCamera(40, innerWidth / innerHeight, 0.1, 100);
  camera.position.set(0, 0.4, 4);
  const light = new THREE.DirectionalLight(0xffffff, 2);
  light.position.set(1, 2, 3);
  scene.add(light, new THREE.HemisphereLight(0xffffff, 0x444444, 1.5));
  const meshes = [makeTube(-0.5), makeTube(0.5)];
  scene.add(...meshes);

  const cab = await load();
  const world = cab.createWorld();
  const desc = bodyOf(meshes[0]), body = world.addArticulation(desc);
  const batches = meshes.map(() => world.addBatch(body, 1, {format: 'matrix4x4_columns'}));

  renderer.setAnimationLoop((time) => {
    const angle = 0.7 * (1 - Math.cos(time / 1000));
    meshes.forEach((mesh, m) => {
      mesh.skeleton.bones[1].rotation.z = m === 0 ? -angle : angle;
      mesh.updateMatrixWorld(true);
      mesh.skeleton.bones.forEach((bone, b) => batches[m].poses().set(bone.matrixWorld.elements, 16 * b));
      mesh.geometry.attributes.color.array.fill(0.6);
      mesh.geometry.attributes.color.needsUpdate = true;
    });
    const hits = world.runFrame({rules: [{a: batches[0], b: batches[1]}], policies: {exact: 'surface'}});
    const touching = world.findTouchingTriangles(hits);
    const redden = (mesh, leaf, triangle) => {
      for (const corner of desc.leaves[leaf].triangles.slice(3 * triangle, 3 * triangle + 3)) {
        mesh.geometry.attributes.color.setXYZ(corner, 1, 0.05, 0.05);
      }
    };
    for (const {leafA, triangleA, leafB, triangleB} of touching) {
      redden(meshes[0], leafA, triangleA);
      redden(meshes[1], leafB, triangleB);
    }
    document.title = `${touching.length} pairs of triangles touch`;
    renderer.render(scene, camera);
  });
}
main();
