// Cuts the triangles of a surface into leaves: by links, by place, and where the surface bends.
#include "scenes/rig/surface_cuts.h"

#include <cab/cab.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <map>

namespace cab::scenes {
namespace {

using rig::SkinStatus;
using rig::SurfaceRules;

// How many links may move the vertices of a leaf, its own included: Status::kTooManyInfluences.
constexpr std::uint32_t kMaxLinksOfLeaf = 33;

// A cut where the surface bends must bring the growth below this share of what it was.
constexpr double kLeastGain = 0.95;

double weight_of(const SurfaceMesh& mesh, std::size_t influence) {
  return static_cast<double>(mesh.skin.influence_weights[influence]);
}

// Calls use(link, weight) for every influence on a triangle.
template <class Use>
void for_influences(const SurfaceMesh& mesh, std::uint32_t triangle, const Use& use) {
  const std::size_t count = mesh.skin.influence_count;
  for (const std::uint32_t v : mesh.triangles[triangle])
    for (std::size_t i = v * count; i < (v + 1) * count; ++i)
      if (weight_of(mesh, i) > 0) use(mesh.skin.influence_links[i], weight_of(mesh, i));
}

// The direction in which vertices differ most.
Eigen::Vector3d longest_axis(const SurfaceMesh& mesh, const std::vector<std::uint32_t>& vertices) {
  // In loops of three numbers, so that Eigen uses no SIMD and cuts are the same on every processor.
  const auto point = [&mesh](std::uint32_t vertex) { return Eigen::Vector3d(place_of(mesh, vertex).data()); };
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const std::uint32_t vertex : vertices) mean += point(vertex);
  mean /= static_cast<double>(vertices.size());
  Eigen::Matrix3d moments = Eigen::Matrix3d::Zero();
  for (const std::uint32_t vertex : vertices) {
    const Eigen::Vector3d away = point(vertex) - mean;
    moments += away * away.transpose();
  }
  return Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(moments).eigenvectors().col(2);
}

// Moves the half of the triangles that is far along the longest axis of all of them to another cluster.
Cluster take_half(const SurfaceMesh& mesh, Cluster& cluster) {
  const Eigen::Vector3d longest = longest_axis(mesh, vertices_of(mesh, cluster));
  const Vec3 axis = {longest[0], longest[1], longest[2]};
  std::vector<std::pair<double, std::uint32_t>> sorted;
  for (const std::uint32_t t : cluster.triangles) {
    const auto& [a, b, c] = mesh.triangles[t];
    sorted.push_back({dot(axis, place_of(mesh, a) + place_of(mesh, b) + place_of(mesh, c)), t});
  }
  std::sort(sorted.begin(), sorted.end());
  Cluster half;
  half.link = cluster.link;
  cluster.triangles.clear();
  for (std::size_t n = 0; n < sorted.size(); ++n)
    (n < sorted.size() / 2 ? cluster : half).triangles.push_back(sorted[n].second);
  return half;
}

// Boxes of clusters, and what they hold, in several poses.
class GrowthMeter {
 public:
  GrowthMeter(const SurfaceMesh& mesh, const std::vector<std::int32_t>& link_parents,
              const std::vector<RigidFrame>& poses)
      : mesh_(mesh), parents_(link_parents), poses_(poses), count_(poses.size() / link_parents.size()) {}
  ~GrowthMeter() {
    if (engine_ != nullptr) destroy_engine(engine_);
  }
  GrowthMeter(const GrowthMeter&) = delete;
  GrowthMeter& operator=(const GrowthMeter&) = delete;

  // Writes the surfaces of clusters.
  SkinStatus measure(std::vector<Cluster>& clusters);

 private:
  Status boxes_of(const std::vector<Cluster>& clusters, std::vector<Box>& boxes, std::size_t& stride,
                  std::vector<std::uint8_t>& flags);

  const SurfaceMesh& mesh_;
  const std::vector<std::int32_t>& parents_;
  const std::vector<RigidFrame>& poses_;
  std::size_t count_;
  Engine* engine_ = nullptr;
};

Status GrowthMeter::boxes_of(const std::vector<Cluster>& clusters, std::vector<Box>& boxes, std::size_t& stride,
                             std::vector<std::uint8_t>& flags) {
  std::vector<std::vector<std::uint32_t>> corners;
  for (const Cluster& cluster : clusters) {
    corners.emplace_back();
    for (const std::uint32_t t : cluster.triangles)
      corners.back().insert(corners.back().end(), mesh_.triangles[t].begin(), mesh_.triangles[t].end());
  }
  std::vector<Leaf> leaves;
  for (std::size_t n = 0; n < clusters.size(); ++n) {
    leaves.emplace_back();
    leaves.back().link = clusters[n].link;
    leaves.back().triangles = corners[n];
  }
  ArticulationDesc desc;
  desc.link_parents = parents_;
  desc.leaves = leaves;
  desc.skin = mesh_.skin.desc();
  std::vector<float> numbers;
  for (const RigidFrame& pose : poses_) {
    for (const double x : pose.rotation) numbers.push_back(static_cast<float>(x));
    for (const double x : pose.position) numbers.push_back(static_cast<float>(x));
  }
  if (engine_ == nullptr)
    if (const Status status = create_engine({}, &engine_); status != Status::kOk) return status;
  BatchDesc batch;
  if (const Status status = add_articulation(*engine_, desc, &batch.articulation); status != Status::kOk) return status;
  batch.instance_count = static_cast<std::uint32_t>(count_);
  ArticulationInfo info;
  BatchInput input;
  Status status = articulation_info(*engine_, batch.articulation, &info);
  if (status == Status::kOk) status = add_batch(*engine_, batch, &input.batch);
  if (status == Status::kOk) {
    input.poses.data = numbers.data();
    input.flags = flags;
    stride = info.node_count;
    boxes.resize(count_ * stride);
    status = compute_boxes(*engine_, input, {}, boxes);
    const Status removed = remove_batch(*engine_, input.batch);
    if (status == Status::kOk) status = removed;
  }
  const Status removed = remove_articulation(*engine_, batch.articulation);
  return status == Status::kOk ? removed : status;
}

double surface_of(double x, double y, double z) { return x * y + y * z + z * x; }

SkinStatus GrowthMeter::measure(std::vector<Cluster>& clusters) {
  if (clusters.empty()) return SkinStatus::kOk;
  std::vector<Box> boxes;
  std::size_t stride = 0;
  std::vector<std::uint8_t> flags(count_);
  switch (boxes_of(clusters, boxes, stride, flags)) {
    case Status::kOk: break;
    case Status::kOutOfMemory: return SkinStatus::kOutOfMemory;
    default: return SkinStatus::kBadVertices;
  }
  const std::vector<Affine> bones = link_bones(mesh_, poses_);
  for (std::size_t n = 0; n < clusters.size(); ++n) {
    const std::vector<std::uint32_t> vertices = vertices_of(mesh_, clusters[n]);
    clusters[n].grown = clusters[n].tight = 0;
    for (std::size_t pose = 0; pose < count_; ++pose) {
      if (flags[pose] != kInstanceOk) continue;  // a pose that frames mask says nothing
      const Box& box = boxes[pose * stride + n];
      Vec3 low = {HUGE_VAL, HUGE_VAL, HUGE_VAL}, high = {-HUGE_VAL, -HUGE_VAL, -HUGE_VAL};
      for (const std::uint32_t v : vertices) {
        const Vec3 at = posed_vertex(mesh_, bones.data() + pose * parents_.size(), v);
        for (std::size_t k = 0; k < 3; ++k) {
          const double x = dot({box.axis[k][0], box.axis[k][1], box.axis[k][2]}, at);
          low[k] = std::min(low[k], x);
          high[k] = std::max(high[k], x);
        }
      }
      clusters[n].grown += surface_of(2.0 * static_cast<double>(box.half[0]), 2.0 * static_cast<double>(box.half[1]),
                                      2.0 * static_cast<double>(box.half[2]));
      clusters[n].tight += surface_of(high[0] - low[0], high[1] - low[1], high[2] - low[2]);
    }
  }
  return SkinStatus::kOk;
}

}  // namespace

std::vector<std::uint32_t> vertices_of(const SurfaceMesh& mesh, const Cluster& cluster) {
  std::vector<std::uint32_t> vertices;
  for (const std::uint32_t t : cluster.triangles)
    vertices.insert(vertices.end(), mesh.triangles[t].begin(), mesh.triangles[t].end());
  std::sort(vertices.begin(), vertices.end());
  vertices.erase(std::unique(vertices.begin(), vertices.end()), vertices.end());
  return vertices;
}

std::uint32_t count_links(const SurfaceMesh& mesh, const Cluster& cluster) {
  std::vector<std::uint32_t> links;
  for (const std::uint32_t t : cluster.triangles)
    for_influences(mesh, t, [&](std::uint32_t link, double) {
      if (std::find(links.begin(), links.end(), link) == links.end()) links.push_back(link);
    });
  return static_cast<std::uint32_t>(links.size());
}

SkinStatus cut_by_place(const SurfaceMesh& mesh, const SurfaceRules& rules, std::vector<Cluster>& clusters) {
  std::map<std::uint32_t, Cluster> of_link;
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    std::map<std::uint32_t, double> weights;
    for_influences(mesh, t, [&](std::uint32_t link, double weight) { weights[link] += weight; });
    of_link[owner_of(weights)].triangles.push_back(t);
  }
  for (auto& [link, whole] : of_link) {
    whole.link = link;
    std::vector<Cluster> open = {std::move(whole)};
    while (!open.empty()) {
      if (clusters.size() + open.size() > rules.max_leaves) return SkinStatus::kTooManyLeaves;
      Cluster& last = open.back();
      const bool is_moved_by_few = count_links(mesh, last) <= kMaxLinksOfLeaf;
      if (last.triangles.size() <= rules.most_triangles && is_moved_by_few) {
        clusters.push_back(std::move(last));
        open.pop_back();
        continue;
      }
      if (last.triangles.size() == 1) return SkinStatus::kTooManyInfluences;
      Cluster half = take_half(mesh, last);
      open.push_back(std::move(half));
    }
  }
  return SkinStatus::kOk;
}

SkinStatus cut_where_it_bends(const SurfaceMesh& mesh, const std::vector<std::int32_t>& link_parents,
                              const std::vector<RigidFrame>& poses, const SurfaceRules& rules,
                              std::vector<Cluster>& clusters) {
  GrowthMeter meter(mesh, link_parents, poses);
  if (const SkinStatus status = meter.measure(clusters); status != SkinStatus::kOk) return status;
  std::vector<Cluster> done, fresh = std::move(clusters);
  while (!fresh.empty()) {
    std::vector<std::pair<double, std::size_t>> loose;  // how much too large, and which
    for (std::size_t n = 0; n < fresh.size(); ++n)
      if (fresh[n].triangles.size() / 2 >= rules.least_triangles &&
          fresh[n].grown > static_cast<double>(rules.most_growth) * fresh[n].tight)
        loose.push_back({fresh[n].tight - fresh[n].grown, n});
    std::sort(loose.begin(), loose.end());
    const std::size_t room = rules.max_leaves - done.size() - fresh.size();
    if (loose.size() > room) loose.resize(room);
    std::vector<Cluster> halves;
    for (const auto& entry : loose) {
      halves.push_back(fresh[entry.second]);
      halves.push_back(take_half(mesh, halves.back()));
    }
    if (const SkinStatus status = meter.measure(halves); status != SkinStatus::kOk) return status;
    std::vector<bool> is_cut(fresh.size(), false);
    std::vector<Cluster> next;
    for (std::size_t n = 0; n < loose.size(); ++n) {
      const Cluster &whole = fresh[loose[n].second], &low = halves[2 * n], &high = halves[2 * n + 1];
      if ((low.grown + high.grown) * whole.tight > kLeastGain * whole.grown * (low.tight + high.tight)) continue;
      is_cut[loose[n].second] = true;
      next.push_back(low);
      next.push_back(high);
    }
    for (std::size_t n = 0; n < fresh.size(); ++n)
      if (!is_cut[n]) done.push_back(std::move(fresh[n]));
    fresh = std::move(next);
  }
  // By link, then by the lowest triangle.
  std::sort(done.begin(), done.end(), [](const Cluster& a, const Cluster& b) {
    return a.link != b.link ? a.link < b.link
                            : *std::min_element(a.triangles.begin(), a.triangles.end()) <
                                  *std::min_element(b.triangles.begin(), b.triangles.end());
  });
  clusters = std::move(done);
  return SkinStatus::kOk;
}

}  // namespace cab::scenes
