// Two arms of two jointed links each: which links touch, in words.
const half = [0.5, 0.1, 0.1], center = [0.5, 0, 0];

export function touching(cab) {
  const world = cab.createWorld();
  const arm = world.addArticulation({
    linkParents: [-1, 0], leaves: [0, 1].map((link) => ({link, box: {center, half}})),
  });
  const arms = world.addBatch(arm, 2);
  arms.poses().set([0, 0, 0, 1, 0, 0, 0, 0, 0, 0.7071068, 0.7071068, 1, 0, 0,  // bent upwards
                    0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 1, 1, 0, 0]);                // straight
  arms.origins().set([0, 0, 0, 0.6, 0.5, 0]);
  const lines = world.runFrame({rules: [{a: arms}]}).toArray().map((hit) =>
    `link ${hit.linkA} of arm ${hit.instanceA} touches link ${hit.linkB} of arm ${hit.instanceB}`);
  world.destroy();
  return lines.join('; ');
}
