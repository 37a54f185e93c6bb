// A hundred people of three.js walk in circles: links that touch another person are red.
import {load} from 'cab-collision/inline';
import * as THREE from 'three';

// A torso, and an arm that hangs on it: each is a mesh, and a box in its frame.
const BOXES = [{center: [0, 0.9, 0], half: [0.25, 0.9, 0.15]}, {center: [0.35, 0, 0], half: [0.35, 0.06, 0.06]}];
function makePerson() {
  const [torso, arm] = BOXES.map(({center, half}) => new THREE.Mesh(
    new THREE.BoxGeometry(...half.map((h) => 2 * h)).translate(...center), new THREE.MeshStandardMaterial()));
  arm.position.set(0.25, 1.4, 0);
  torso.add(arm);
  return [torso, arm];
}

async function main() {
  const renderer = new THREE.WebGLRenderer({antialias: true});
  renderer.setSize(innerWidth, innerHeight);
  document.body.append(renderer.domElement);
  const camera = new THREE.PerspectiveCamera(40, innerWidth / innerHeight, 0.1, 100);
  camera.position.set(0, 9, 16);
  camera.lookAt(0, 0, 1);
  const people = Array.from({length: 100}, makePerson), scene = new THREE.Scene();
  scene.add(new THREE.HemisphereLight(0xffffff, 0x444444, 4), ...people.map(([torso]) => torso));

  const world = (await load()).createWorld();
  const body = world.addArticulation({linkParents: [-1, 0], leaves: BOXES.map((box, link) => ({link, box}))});
  const batch = world.addBatch(body, people.length, {format: 'matrix4x4_columns'});

  renderer.setAnimationLoop((milliseconds) => {
    people.forEach((person, i) => {
      const [torso] = person, angle = milliseconds / 1000 + i;
      torso.position.set(1.5 * (i % 10 - 4.5) + Math.cos(angle), 0, 1.5 * (Math.floor(i / 10) - 4.5) + Math.sin(angle));
      torso.rotation.y = -angle;
      torso.updateMatrixWorld();
      person.forEach((link, l) => {
        batch.poses().set(link.matrixWorld.elements, 16 * (2 * i + l));
        link.material.color.set(0x8fa8c0);
      });
    });
    const hits = world.runFrame({rules: [{a: batch}]});
    for (const {instanceA, linkA, instanceB, linkB} of hits) {
      people[instanceA][linkA].material.color.set(0xe01010);
      people[instanceB][linkB].material.color.set(0xe01010);
    }
    document.title = `${hits.length} pairs of links touch`;
    renderer.render(scene, camera);
  });
}
main();
