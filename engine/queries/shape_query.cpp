// Spheres, boxes and capsules that overlap links, and points that are near them.
#include "engine/queries/shape_query.h"

#include "engine/exact/convex_in_double.h"
#include "engine/queries/box_point.h"
#include "layout/convex_shapes.h"
#include "layout/error_bounds.h"

#include <cmath>

namespace cab {
namespace {

double sum_of(const Double3& v) { return kernel::sum(kernel::abs(v)); }

// The shape of a query, about its position.
ConvexShape shape_of(const Query& query) {
  const bool is_box = query.kind == QueryKind::kBox;
  const float* const half = query.half;
  ConvexShape out = {};
  out.unit = 1;
  for (int k = 0; k < 3; ++k) {
    out.column[k][k] = 1;
    out.axis[k][k] = 1;
  }
  out.kind = is_box ? ConvexKind::kBox : ConvexKind::kRound;
  const Double3 extent = double3(half);
  if (is_box) {
    std::copy_n(half, 3, out.size);
    out.reach = rounded_up(std::sqrt(kernel::dot(extent, extent)));
  } else {
    out.size[0] = query.kind == QueryKind::kPoint ? 0 : query.radius;
    out.size[2] = query.kind == QueryKind::kCapsule ? half[2] : 0;
    out.reach = rounded_up(static_cast<double>(out.size[0]) + static_cast<double>(out.size[2]));
  }
  return out;
}

constexpr float kIdentity[7] = {0, 0, 0, 1, 0, 0, 0};

StoredPose pose_at(const float* pose) {
  return {{PoseFormat::kQuaternionTranslation, Scaling::kNone}, pose, nullptr, 1};
}

// How far a query's shape extends along each axis of the world.
void bound_shape(const Query& query, const ConvexShape& shape, const float (&pose)[7], double (&half)[3]) {
  const bool is_box = shape.kind == ConvexKind::kBox;
  const bool is_turned = is_box || query.kind == QueryKind::kCapsule;
  const double radius = is_box ? 0 : static_cast<double>(shape.size[0]);
  for (double& h : half) h = radius;
  if (!is_turned) return;
  const kernel::RigidLanes<double> posed = pose_in_double(pose_at(pose));
  for (int k = is_box ? 0 : 2; k < 3; ++k) {
    const Double3 along = static_cast<double>(shape.size[k]) * posed.column[k];
    half[0] += std::fabs(along.x);
    half[1] += std::fabs(along.y);
    half[2] += std::fabs(along.z);
  }
}

// A posed leaf box as a shape in the frame of its instance. It is larger by the errors of its axes, 16 u.
ConvexShape posed_box(const BoxAos& from) {
  Box box;
  const float sum = from.half[0] + from.half[1] + from.half[2];
  for (int k = 0; k < 3; ++k) {
    box.center[k] = from.center[k];
    box.half[k] = from.half[k] + static_cast<float>(kQueryRayPad) * sum;
    for (int c = 0; c < 3; ++c) box.axis[k][c] = from.axis[3 * k + c];
  }
  return shape_of_box(box);
}

double length_of(const Double3& v) { return std::sqrt(kernel::dot(v, v)); }

}  // namespace

ShapeQuery::ShapeQuery(const QueryRun& run, const Query& query, LinkHits& hits)
    : run_(run), query_(query), hits_(hits), shape_(shape_of(query)) {
  std::copy_n(query.orientation, 4, pose_);
  std::fill_n(pose_ + 4, 3, 0.0f);
  if (is_round()) std::copy_n(kIdentity, 4, pose_);
  bound_shape(query, shape_, pose_, half_);
}

// The distance beyond which a sphere or a point wants nothing. Distances of hits are rounded.
double ShapeQuery::most() const {
  if (query_.kind == QueryKind::kSphere) return static_cast<double>(query_.radius);
  return std::min(static_cast<double>(query_.length), (1 + kOutwards) * static_cast<double>(hits_.most()));
}

// Takes the bounds of the query's shape to a frame: `at` is its position, `scale` what lengths are multiplied by, and
// `pad` how far rounding may move anything.
void ShapeQuery::set_bounds(const Double3& at, double pad, double scale, Bounds& bounds) const {
  const double center[3] = {at.x, at.y, at.z};
  for (int c = 0; c < 3; ++c) {
    bounds.lo[c] = float_below(center[c] - (scale * half_[c] + pad));
    bounds.hi[c] = float_above(center[c] + (scale * half_[c] + pad));
  }
}

std::uint32_t ShapeQuery::meets(const kernel::BoundsRow& row, const Bounds& bounds, float* entry) const {
  std::fill_n(entry, kLanes, 0.0f);
  return run_.frame.kernels.overlap_bounds(row, bounds.lo, bounds.hi);
}

bool ShapeQuery::next(kernel::IndexWalk& walk, kernel::MetBounds* met) const {
  const kernel::IndexNodes nodes = run_.index.view();
  if (is_round()) return run_.frame.kernels.walk_point(nodes, point_, walk, met);
  return kernel::walk_on<float>(
      nodes, [this](const kernel::BoundsRow& row, float* entry) { return meets(row, bounds_, entry); },
      [](float) { return false; }, kernel::ReadNothingAhead(), walk, met);
}

// The lanes whose boxes a query may meet, and for a sphere or a point the squares of their distances.
std::uint32_t ShapeQuery::meets_boxes(const BoxTile& boxes, const Local& local, float* distance_sq) const {
  if (!is_round()) return meets(BoundsOfBoxes(run_, boxes).row(), local.bounds, distance_sq);
  run_.frame.kernels.point_boxes(boxes, local.point, distance_sq);
  std::uint32_t out = 0;
  for (std::uint32_t lane = 0; lane < kLanes; ++lane)
    out |= std::uint32_t{!(distance_sq[lane] > local.most_sq)} << lane;
  return out;
}

bool ShapeQuery::enter() {
  const QueryIndex& index = run_.index;
  if (is_round()) {
    point_ = point_in_index(index, query_, most());
    return true;
  }
  const double* const at = query_.position;
  const Double3 in_index = {index.scale * (at[0] - index.center[0]), index.scale * (at[1] - index.center[1]),
                            index.scale * (at[2] - index.center[2])};
  const double pad = kQueryRayPad * (1 + sum_of(in_index));
  set_bounds(in_index, pad, index.scale, bounds_);
  return true;
}

// Whether the query meets the posed box of a leaf: asked where its shape is a half space, which goes on beyond it.
bool ShapeQuery::meets_box(const PosedInstance& one, const Local& local, std::uint32_t leaf) const {
  const BoxAos box = one.box(leaf);
  if (is_round()) { return BoxPoint(box, local.at).is_within(most() + local.error); }
  const ConvexShape shape = posed_box(box);
  const ConvexPair pair({&shape_, pose_at(pose_)}, {&shape, pose_at(kIdentity)},
                        {one.apart[0], one.apart[1], one.apart[2]});
  return answer_pair_in_double(pair, 0).apart == 0;
}

// The posed box of a leaf, which decides without shapes for spheres and points.
void ShapeQuery::test_box(const PosedInstance& one, const Local& local, std::uint32_t leaf) {
  const BoxAos box = one.box(leaf);
  BoxPoint at(box, local.at);
  const bool inside = at.is_inside(), is_point = query_.kind == QueryKind::kPoint;
  if (!at.is_within(most() + local.error)) return;
  if (!is_point && !query_.with_depth) return hits_.add(one, leaf, 0, {0, 0, 0}, {0, 0, 0}, false);
  if (is_point && inside) return hits_.add(one, leaf, 0, {0, 0, 0}, {0, 0, 0}, true);
  at.refine();
  const double distance = length_of(at.outside);
  const Double3 normal = inside ? at.normal_of_face() : distance > 0 ? (1 / distance) * at.outside : Double3{0, 0, 0};
  const Double3 point = inside ? at.to_face * normal : -1.0 * at.outside;
  const double depth = std::max(most() - (inside ? -at.to_face : distance), 0.0);
  hits_.add(one, leaf, is_point ? static_cast<float>(distance) : -static_cast<float>(depth), floats(point),
            floats(normal), is_point && distance == 0);
}

// What is done with a full queue of shapes: which of them the query meets.
struct ShapeQuery::Run {
  ShapeQuery& query;
  const PosedInstance& one;
  const Local& local;

  void operator()(ConvexQueue& queue) const {
    const kernel::KernelTable& kernels = query.run_.frame.kernels;
    const bool is_point = query.query_.kind == QueryKind::kPoint;
    kernel::ConvexAnswer answer;
    kernel::ConvexContacts contacts;
    if (!is_point) answer = kernels.test_convex_pairs(queue.block);
    if (is_point || query.query_.with_depth) kernels.contact_pairs(queue.block, contacts);
    for (std::uint32_t lane = 0; lane < queue.count && !query.is_done(); ++lane) {
      const std::uint32_t leaf = queue.asks[lane];
      if (is_point)
        add_near(contacts, *queue.block.b.shape[lane], lane, leaf);
      else if (lane_touches(queue.block, answer, lane))
        add_touching(contacts, lane, leaf);
    }
  }

  // A half space is no nearer than its leaf's box.
  void add_near(const kernel::ConvexContacts& contacts, const ConvexShape& shape, std::uint32_t lane,
                std::uint32_t leaf) const {
    if (shape.kind == ConvexKind::kHalfSpace) {
      const BoxAos of = one.box(leaf);
      const BoxPoint box(of, local.at);
      if (!box.is_inside() && length_of(box.outside) > -contacts.depth[lane]) return query.test_box(one, local, leaf);
    }
    const double distance = std::max(-contacts.depth[lane], 0.0);
    if (!(distance <= query.most())) return;
    const bool inside = distance <= 16 * local.error;  // the slack of step 9.7
    add(contacts, lane, leaf, inside ? 0.0f : static_cast<float>(distance), inside);
  }

  void add_touching(const kernel::ConvexContacts& contacts, std::uint32_t lane, std::uint32_t leaf) const {
    if (!query.query_.with_depth) return query.hits_.add(one, leaf, 0, {0, 0, 0}, {0, 0, 0}, false);
    add(contacts, lane, leaf, -std::max(rounded_up(contacts.depth[lane]), 0.0f), false);
  }

  void add(const kernel::ConvexContacts& contacts, std::uint32_t lane, std::uint32_t leaf, float distance,
           bool inside) const {
    std::array<float, 3> point, normal;
    for (std::size_t c = 0; c < 3; ++c) {
      point[c] = static_cast<float>(inside ? 0 : contacts.point_b[c][lane]);
      normal[c] = static_cast<float>(inside ? 0 : -contacts.normal[c][lane]);
    }
    query.hits_.add(one, leaf, distance, point, normal, inside);
  }
};

// The posed boxes near a point or a sphere, the nearest of every sixteen first.
void ShapeQuery::test_boxes(const PosedInstance& one, Local& local) {
  for_each_leaf(
      run_, one, [&](const BoxTile& boxes, float* entry) { return meets_boxes(boxes, local, entry); },
      [&](float entry) { return entry > local.most_sq; },
      [&](std::uint32_t leaf) {
        test_box(one, local, leaf);
        if (query_.kind == QueryKind::kPoint)
          local.most_sq = std::min(local.most_sq, kernel::square_above(most() + local.off));
      },
      [&] { return hits_.is_done(); });
}

// The shapes of the leaves whose bounds the query meets, sixteen at a time. Without an exact test they are the leaves'
// boxes.
void ShapeQuery::test_shapes(const PosedInstance& one, const Local& local) {
  const bool is_exact = run_.job.exact != Exact::kNone;
  const LeafShapes own = {{&shape_, 1}, pose_at(pose_), 1};
  const double shift[3] = {-local.at.x, -local.at.y, -local.at.z};
  ConvexShape boxes[kLanes];  // of the leaves that wait in the queue, which runs when it has sixteen
  std::uint32_t count = 0;
  ConvexQueues queues(run_.exact, Run{*this, one, local});
  for_each_leaf(
      run_, one, [&](const BoxTile& tile, float* entry) { return meets_boxes(tile, local, entry); },
      [](float) { return false; },
      [&](std::uint32_t leaf) {
        queues.asks = leaf;
        if (!is_exact) {
          ConvexShape& box = boxes[count++ % kLanes];
          box = posed_box(one.box(leaf));
          const LeafShapes leaf_box = {{&box, 1}, pose_at(kIdentity), 1};
          return queues.add(own, shape_, leaf_box, box, shift, 0);
        }
        ++run_.own.stats.exact_tests;
        const LeafShapes shapes = shapes_of(run_, one, leaf);
        for (const ConvexShape& shape : shapes.shapes)
          if (shape.kind != ConvexKind::kHalfSpace || meets_box(one, local, leaf))
            queues.add(own, shape_, shapes, shape, shift, 0);
      },
      [&] { return hits_.is_done(); });
  queues.finish();
}

ShapeQuery::Local ShapeQuery::at_instance(const PosedInstance& one) const {
  Local local;
  local.at = {-one.apart[0], -one.apart[1], -one.apart[2]};
  const double size = sum_of(local.at) + static_cast<double>(one.reach);
  local.error = kQueryRounding * (size + (half_[0] + half_[1] + half_[2]));
  local.pad = local.error + kQueryLeafPad * size;
  if (!is_round()) set_bounds(local.at, local.pad, 1, local.bounds);
  const double at[3] = {local.at.x, local.at.y, local.at.z};
  for (int c = 0; c < 3; ++c) local.point[c] = static_cast<float>(at[c]);
  local.off = local.error + kQueryBoxDistance * size;
  local.most_sq = kernel::square_above(most() + local.off);
  return local;
}

void ShapeQuery::test(const PosedInstance& one) {
  Local local = at_instance(one);
  if (run_.job.exact == Exact::kNone && is_round())
    test_boxes(one, local);
  else
    test_shapes(one, local);
  hits_.finish();
  if (query_.kind == QueryKind::kPoint) {
    const double pad = kQueryPad + kQueryRayPad * std::fabs(run_.index.scale * most());
    point_.most_sq = std::min(point_.most_sq, kernel::square_above(run_.index.scale * most() + pad));
  }
}

void ShapeQuery::finish(kernel::PointSearch& search) {
  finish_search(run_, run_.frame.kernels.search_points, query_, search, hits_,
                [this](const PosedInstance& one, std::uint32_t leaf) { test_box(one, at_instance(one), leaf); });
}

void search_together(const QueryRun& run, Span<const std::uint32_t> numbers, kernel::PointSearch* searches) {
  for (std::uint32_t i = 0; i < numbers.size; ++i) {
    const Query& query = run.job.queries[numbers[i]];
    kernel::PointSearch& out = searches[i];
    out.filter = filter_of(query);
    out.end = static_cast<double>(query.length);
    out.lanes = point_in_index(run.index, query, out.end);
    out.scale = run.index.scale;
    out.any = query.want == QueryWant::kAny;
  }
  search_by_turns(run, run.frame.kernels.search_points, searches, static_cast<std::uint32_t>(numbers.size));
}

}  // namespace cab
