#include "perf/tools/query/aimed_rays.h"

#include <stdexcept>

#include "scenes/random.h"
#include "scenes/vec3d.h"

namespace cab::perf {
namespace {

using scenes::operator+, scenes::operator*;

constexpr double kLeastAway = 2, kMostAway = 20;  // metres between a ray's beginning and the point that it is aimed at

template <class T>
scenes::Vec3 vector_of(const T* v) {
  return {static_cast<double>(v[0]), static_cast<double>(v[1]), static_cast<double>(v[2])};
}

scenes::Quat rotation_of(const float* q) {
  return scenes::normalized(
      {static_cast<double>(q[0]), static_cast<double>(q[1]), static_cast<double>(q[2]), static_cast<double>(q[3])});
}

// A random point of a random leaf of an instance, in the world.
scenes::Vec3 random_point(const TargetGroup& group, const BatchInput& input, std::size_t instance,
                          scenes::Random& random) {
  if (input.poses.format != PoseFormat::kQuaternionTranslation)
    throw std::logic_error(group.name + ": its poses are not quaternions with translations");
  const scenes::Character& figure = *group.figure;
  const scenes::BodyLeaf& leaf = figure.leaves[random.index(static_cast<std::uint32_t>(figure.leaves.size()))];
  scenes::Vec3 point = vector_of(leaf.box.center);
  for (std::size_t k = 0; k < 3; ++k)
    point = point + random.uniform(-1, 1) * static_cast<double>(leaf.box.half[k]) * vector_of(leaf.box.axis[k]);
  const float* const pose = input.poses.data + 7 * (instance * figure.link_parents.size() + leaf.link);
  point = scenes::rotate(rotation_of(pose), point) + vector_of(pose + 4);
  if (!input.orientations.empty()) point = scenes::rotate(rotation_of(input.orientations.data + 4 * instance), point);
  return input.origins.empty() ? point : point + vector_of(input.origins.data + 3 * instance);
}

Query random_ray(const Targets& targets, std::uint32_t character, scenes::Random& random) {
  std::size_t g = 0;  // the first group has characters: a level comes last
  for (; character >= targets.groups()[g].count; ++g) character -= targets.groups()[g].count;
  const scenes::Vec3 point = random_point(targets.groups()[g], targets.inputs()[g], character, random);
  const scenes::Vec3 direction = random.unit_vector();
  const double away = random.uniform(kLeastAway, kMostAway);
  Query ray;
  ray.kind = QueryKind::kRay;
  ray.length = static_cast<float>(2 * away);
  for (std::size_t k = 0; k < 3; ++k) {
    ray.position[k] = point[k] - away * direction[k];
    ray.direction[k] = static_cast<float>(direction[k]);
  }
  return ray;
}

}  // namespace

std::vector<Query> aimed_rays(const Targets& targets, std::uint32_t count, std::uint64_t seed) {
  std::uint32_t characters = 0;
  for (const TargetGroup& group : targets.groups()) characters += group.figure ? group.count : 0;
  std::vector<Query> rays;
  rays.reserve(count);
  for (std::uint32_t i = 0; i < count; ++i) {
    scenes::Random random = scenes::Random::of(seed, i);
    const std::uint32_t character = random.index(characters);
    rays.push_back(random_ray(targets, character, random));
  }
  return rays;
}

}  // namespace cab::perf
