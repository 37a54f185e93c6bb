// Two arms of two jointed links each: which links touch?
import {load} from 'cab-collision';

const cab = await load();
const world = cab.createWorld();
const bone = {center: [0.5, 0, 0], axis: [[1, 0, 0], [0, 1, 0], [0, 0, 1]], half: [0.5, 0.1, 0.1]};
const arm = world.addArticulation({linkParents: [-1, 0], leaves: [{link: 0, box: bone}, {link: 1, box: bone}]});
const arms = world.addBatch(arm, 2);

// Every frame: a quaternion x y z w and a translation for each link of each arm, and where each arm stands.
arms.poses().set([0, 0, 0, 1, 0, 0, 0, 0, 0, 0.7071068, 0.7071068, 1, 0, 0,  // bent upwards
                  0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 1, 1, 0, 0]);                // straight
arms.origins().set([0, 0, 0, 0.6, 0.5, 0]);
for (const hit of world.runFrame({rules: [{a: arms}]})) {
  console.log(`link ${hit.linkA} of arm ${hit.instanceA} touches link ${hit.linkB} of arm ${hit.instanceB}`);
}
world.destroy();
