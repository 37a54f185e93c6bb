#include "perf/tools/report/surface_touches.h"

#include <algorithm>
#include <tuple>

#include "layout/pose_coding.h"
#include "perf/tools/replay/hit_names.h"
#include "scenes/affine.h"

namespace cab::perf {
namespace {

using scenes::Affine;
using scenes::Vec3;
using scenes::operator+;
using scenes::operator-;
using scenes::operator*;

const BatchInput& input_of(const record::Recording& recording, const record::RecordedFrame& frame, BatchSlot slot) {
  const std::uint32_t batch = batch_of(recording, frame, slot);
  return *std::find_if(frame.job.inputs.begin(), frame.job.inputs.end(),
                       [batch](const BatchInput& input) { return input.batch.value == batch + 1; });
}

Affine rotation_by(const float* quaternion) {
  const scenes::Quat q = scenes::normalized({static_cast<double>(quaternion[0]), static_cast<double>(quaternion[1]),
                                             static_cast<double>(quaternion[2]), static_cast<double>(quaternion[3])});
  Affine out;
  for (std::size_t k = 0; k < 3; ++k) {
    Vec3 axis = {0, 0, 0};
    axis[k] = 1;
    out.columns[k] = scenes::rotate(q, axis);
  }
  return out;
}

// From a link to its instance's origin, along the world's axes.
Affine pose_of(const BatchInput& input, std::uint32_t link_count, std::uint32_t instance, std::uint32_t link) {
  const PoseView& poses = input.poses;
  const float* const pose = poses.data + (std::size_t{instance} * link_count + link) * pose_floats(poses.format);
  Affine out;
  if (poses.format == PoseFormat::kQuaternionTranslation) {
    out = rotation_by(pose);
    out.translation = {static_cast<double>(pose[4]), static_cast<double>(pose[5]), static_cast<double>(pose[6])};
  } else {
    const bool by_rows = poses.format == PoseFormat::kMatrix3x4Rows;
    const auto at = [&](std::size_t row, std::size_t column) {
      return static_cast<double>(pose[by_rows ? 4 * row + column : 4 * column + row]);
    };
    for (std::size_t row = 0; row < 3; ++row) {
      for (std::size_t column = 0; column < 3; ++column) out.columns[column][row] = at(row, column);
      out.translation[row] = at(row, 3);
    }
  }
  if (!input.scales.empty()) {
    const auto scale = static_cast<double>(input.scales[instance]);
    for (Vec3* const column : {&out.columns[0], &out.columns[1], &out.columns[2], &out.translation})
      *column = scale * *column;
  }
  if (input.orientations.empty()) return out;
  return scenes::multiply(rotation_by(input.orientations.data + 4 * std::size_t{instance}), out);
}

// Vertices of one instance of a skin in a frame.
class InstanceOfSkin {
 public:
  InstanceOfSkin(const record::Recording& recording, const BatchInput& input, std::uint32_t instance)
      : body_(recording.articulation(recording.batch(static_cast<std::uint32_t>(input.batch.value - 1)).articulation)),
        input_(input),
        instance_(instance) {
    if (!input.origins.empty()) std::copy_n(input.origins.data + 3 * std::size_t{instance}, 3, origin_.begin());
  }

  void corners(std::uint32_t leaf, std::uint32_t triangle, Vec3 (&out)[3]) const {
    for (std::size_t k = 0; k < 3; ++k) out[k] = vertex(body_.desc.leaves[leaf].triangles[3 * triangle + k]);
  }

 private:
  Vec3 vertex(std::size_t v) const {
    const SkinDesc& skin = body_.desc.skin;
    const float* const at = skin.vertices.data + 3 * v;
    const Vec3 rest = {static_cast<double>(at[0]), static_cast<double>(at[1]), static_cast<double>(at[2])};
    Vec3 sum = {0, 0, 0};
    double weights = 0;
    for (std::size_t i = v * skin.influence_count; i < (v + 1) * skin.influence_count; ++i) {
      const auto weight = static_cast<double>(skin.influence_weights[i]);
      if (!(weight > 0)) continue;
      const std::uint32_t link = skin.influence_links[i];
      sum = sum + weight * scenes::transform(pose_of(input_, body_.link_count, instance_, link), bound(link, rest));
      weights += weight;
    }
    return origin_ + (1 / weights) * sum;
  }

  Vec3 bound(std::uint32_t link, const Vec3& rest) const {
    if (body_.desc.skin.inverse_bind.empty()) return rest;
    const float* const m = body_.desc.skin.inverse_bind.data + 16 * std::size_t{link};
    Vec3 out;
    for (std::size_t c = 0; c < 3; ++c)
      out[c] = static_cast<double>(m[c]) * rest[0] + static_cast<double>(m[4 + c]) * rest[1] +
               static_cast<double>(m[8 + c]) * rest[2] + static_cast<double>(m[12 + c]);
    return out;
  }

  record::RecordedArticulation body_;
  const BatchInput& input_;
  std::uint32_t instance_;
  Vec3 origin_ = {0, 0, 0};
};

// Whether two hits are of the same links, as no frame has them.
bool has_doubles(std::vector<Hit> hits) {
  const auto links = [](const Hit& hit) {
    return std::make_tuple(hit.batch_a.value, hit.instance_a, hit.link_a, hit.batch_b.value, hit.instance_b,
                           hit.link_b);
  };
  std::sort(hits.begin(), hits.end(), [&links](const Hit& x, const Hit& y) { return links(x) < links(y); });
  const auto same = [&links](const Hit& x, const Hit& y) { return links(x) == links(y); };
  return std::adjacent_find(hits.begin(), hits.end(), same) != hits.end();
}

// Adds the points in which the sides of `sides` pass through `triangle`. Returns how many there are.
std::uint32_t add_points(const Vec3 (&sides)[3], const Vec3 (&triangle)[3], Vec3& sum) {
  const Vec3 u = triangle[1] - triangle[0], v = triangle[2] - triangle[0], normal = scenes::cross(u, v);
  const double uu = scenes::dot(u, u), uv = scenes::dot(u, v), vv = scenes::dot(v, v), area = uu * vv - uv * uv;
  std::uint32_t count = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const Vec3 &from = sides[k], way = sides[(k + 1) % 3] - from;
    const double at = scenes::dot(triangle[0] - from, normal) / scenes::dot(way, normal);
    if (!(at >= 0 && at <= 1)) continue;
    const Vec3 point = from + at * way, in = point - triangle[0];
    const double s = (vv * scenes::dot(in, u) - uv * scenes::dot(in, v)) / area,
                 t = (uu * scenes::dot(in, v) - uv * scenes::dot(in, u)) / area;
    if (!(s >= 0 && t >= 0 && s + t <= 1)) continue;
    sum = sum + point;
    ++count;
  }
  return count;
}

}  // namespace

Vec3 meeting_place(const Vec3 (&a)[3], const Vec3 (&b)[3]) {
  Vec3 sum = {0, 0, 0};
  const std::uint32_t count = add_points(a, b, sum) + add_points(b, a, sum);
  if (count > 0) return (1.0 / count) * sum;
  for (std::size_t k = 0; k < 3; ++k) sum = sum + a[k] + b[k];
  return (1.0 / 6) * sum;
}

bool SurfaceTouches::has_triangles(const record::RecordedFrame& frame, BatchSlot slot, std::uint32_t link) const {
  const record::RecordedBatch batch = recording_.batch(batch_of(recording_, frame, slot));
  if (batch.is_static) return false;
  const Span<const Leaf> leaves = recording_.articulation(batch.articulation).desc.leaves;  // none of a level
  return std::any_of(leaves.begin(), leaves.end(),
                     [link](const Leaf& leaf) { return leaf.link == link && !leaf.triangles.empty(); });
}

const std::vector<SurfaceTouch>& SurfaceTouches::of(const record::RecordedFrame& frame) {
  touches_.clear();
  if (frame.job.policies.exact != Exact::kSurface || !error_.empty()) return touches_;
  std::vector<Hit> pairs;
  std::vector<std::size_t> hit_of;
  for (std::size_t h = 0; h < frame.hits.size; ++h) {
    const Hit& hit = frame.hits[h];
    if (!has_triangles(frame, hit.batch_a, hit.link_a) || !has_triangles(frame, hit.batch_b, hit.link_b)) continue;
    pairs.push_back(hit);
    hit_of.push_back(h);
  }
  if (pairs.empty()) return touches_;
  if (has_doubles(pairs)) {
    error_ = "a frame has two hits of the same links";
    return touches_;
  }
  const auto refuse = [&]() -> const std::vector<SurfaceTouch>& {
    error_ = player_->error();
    return touches_;
  };
  if (!player_ && !player_.emplace().open(recording_)) return refuse();
  if (!player_->find_triangles(frame, pairs)) return refuse();
  touches_.resize(frame.hits.size);
  const Span<const TouchingTriangles> found = player_->triangles();
  for (std::size_t t = 0; t < found.size;) {
    const Hit& hit = pairs[found[t].pair];
    SurfaceTouch& touch = touches_[hit_of[found[t].pair]];
    const InstanceOfSkin a(recording_, input_of(recording_, frame, hit.batch_a), hit.instance_a);
    const InstanceOfSkin b(recording_, input_of(recording_, frame, hit.batch_b), hit.instance_b);
    for (const std::uint32_t pair = found[t].pair; t < found.size && found[t].pair == pair; ++t) {
      Vec3 of_a[3], of_b[3];
      a.corners(found[t].leaf_a, found[t].triangle_a, of_a);
      b.corners(found[t].leaf_b, found[t].triangle_b, of_b);
      touch.place = touch.place + meeting_place(of_a, of_b);
      ++touch.triangles;
    }
    touch.place = (1.0 / touch.triangles) * touch.place;
  }
  return touches_;
}

}  // namespace cab::perf
