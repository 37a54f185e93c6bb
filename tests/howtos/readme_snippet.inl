cab::BatchInput input;
input.batch = crowd;                     // 10 000 instances of one articulation, added once
input.poses.data = poses;                // per instance and link: quaternion x y z w, translation x y z
input.origins = {origins, 3 * 10000};    // per instance: x y z of its position in the world, in double
const cab::PairRule rule = {crowd, crowd, cab::Pairing::kBetween};
cab::FrameJob job;
job.inputs = {&input, 1};
job.rules = {&rule, 1};
job.hits = {hits, hit_capacity};
const cab::Status status = cab::run_frame(*engine, job);
for (const cab::Hit* hit = hits; hit != hits + job.hit_count; ++hit) {
  use(hit->instance_a, hit->link_a, hit->instance_b, hit->link_b);
}
