// Exact::kFcl: FCL with its libccd solver, in double. FCL and libccd have absolute thresholds. So each query is about
// the centre of part a, and scaled by a power of two to a size of about 1. FCL has contacts of half spaces for some
// shapes and gaps for none, so a half space is tested here: by the other part's lowest point.
#include "engine/exact/fcl.h"

#include "engine/exact/hull.h"
#include "engine/exact/leaf_pairs.h"
#include "layout/error_bounds.h"

#include <fcl/geometry/shape/box.h>
#include <fcl/narrowphase/collision.h>
#include <fcl/narrowphase/detail/convexity_based_algorithm/gjk_libccd.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <exception>
#include <vector>

namespace cab {
namespace {

using Transform = fcl::Transform3d;
using Matrix = fcl::Matrix3d;
using Vector = fcl::Vector3d;

// One convex part of a leaf, about its centre. The centre of a hull is the mean of its vertices.
struct FclPart {
  ShapeKind kind;
  Vector size;                   // as ConvexPart::size
  std::vector<Vector> vertices;  // of a hull, relative to its centre
  Transform in_link;             // from the part's axes and centre to the frame of the link
  double radius;                 // of the ball about the centre that contains the part
  double reach;                  // at least |position of the part| + |its centre| + radius
  bool is_flat;                  // a hull or a box that is in one plane, to kFlatShare of the radius
};

Vector vector_of(const float* v) {
  return {static_cast<double>(v[0]), static_cast<double>(v[1]), static_cast<double>(v[2])};
}

// The rotation of a quaternion x y z w, which may have any length but zero.
Matrix rotation_of(const float* q) {
  return fcl::Quaterniond(static_cast<double>(q[3]), static_cast<double>(q[0]), static_cast<double>(q[1]),
                          static_cast<double>(q[2]))
      .normalized()
      .toRotationMatrix();
}

// Makes the columns of a matrix orthonormal as the posing kernel does, but in double: Gram-Schmidt, where the first
// column keeps its direction. A mirrored matrix stays mirrored.
Matrix orthonormal(Matrix m) {
  m.col(0).normalize();
  m.col(1) -= m.col(1).dot(m.col(0)) * m.col(0);
  m.col(1).normalize();
  const Vector right_handed = m.col(0).cross(m.col(1));
  m.col(2) = right_handed.dot(m.col(2)) < 0 ? Vector(-right_handed) : right_handed;
  return m;
}

// The axes of a part in a query, from those of its posed frame. FCL takes rotations only. A mirrored part is the part
// rotated, if it is symmetric across its plane of y and z, as all but hulls are. Hulls are known by their vertices
// alone, which a mirrored matrix moves like any other.
Matrix query_axes(const FclPart& part, Matrix axes) {
  if (part.kind != ShapeKind::kConvexHull && axes.determinant() < 0) axes.col(0) = -axes.col(0);
  return axes;
}

Transform make_transform(const Matrix& rotation, const Vector& translation) {
  Transform out = Transform::Identity();
  out.linear() = rotation;
  out.translation() = translation;
  return out;
}

// The radius of the ball about the centre of a part.
double radius_of(const FclPart& part) {
  switch (part.kind) {
    case ShapeKind::kBox: return part.size.norm();
    case ShapeKind::kEllipsoid: return part.size.maxCoeff();
    case ShapeKind::kCapsule: return part.size[0] + part.size[1];
    case ShapeKind::kSphere: return part.size[0];
    case ShapeKind::kCylinder: return std::hypot(part.size[0], part.size[1]);
    case ShapeKind::kHalfSpace: return 0;
    case ShapeKind::kConvexHull: break;
  }
  double radius = 0;
  for (const Vector& vertex : part.vertices) radius = std::max(radius, vertex.norm());
  return radius;
}

// Whether vertices about their mean are in the plane through it, the vertex farthest from it, and the one farthest from
// the line through both.
bool are_flat(const std::vector<Vector>& vertices, double radius) {
  Vector along = Vector::Zero(), normal = Vector::Zero();
  for (const Vector& vertex : vertices)
    if (vertex.norm() > along.norm()) along = vertex;
  for (const Vector& vertex : vertices)
    if (along.cross(vertex).norm() > normal.norm()) normal = along.cross(vertex);
  normal.normalize();
  return std::all_of(vertices.begin(), vertices.end(), [&normal, radius](const Vector& vertex) {
    return std::fabs(normal.dot(vertex)) <= kFlatShare * radius;
  });
}

bool is_flat(const FclPart& part) {
  if (part.kind == ShapeKind::kBox) return part.size.minCoeff() <= kFlatShare * part.radius;
  return part.kind == ShapeKind::kConvexHull && are_flat(part.vertices, part.radius);
}

FclPart make_part(const ConvexPart& part) {
  FclPart out = {part.kind, vector_of(part.size), {}, {}, 0, 0, false};
  Vector center = Vector::Zero();
  if (part.kind == ShapeKind::kConvexHull) {
    const std::vector<float> vertices = hull_vertices(part.vertices);
    for (std::size_t v = 0; v < vertices.size(); v += 3) {
      out.vertices.push_back(vector_of(vertices.data() + v));
      center += out.vertices.back();
    }
    center /= static_cast<double>(out.vertices.size());
    for (Vector& vertex : out.vertices) vertex -= center;
  }
  const Matrix rotation = rotation_of(part.rotation);
  const Vector position = vector_of(part.position);
  out.in_link = make_transform(rotation, position + rotation * center);
  out.radius = radius_of(out);
  out.reach = position.norm() + center.norm() + out.radius;
  out.is_flat = is_flat(out);
  return out;
}

// A leaf box as a part.
FclPart box_part(const Box& box) {
  Matrix axes;
  for (int k = 0; k < 3; ++k) axes.col(k) = vector_of(box.axis[k]);
  const Vector half = vector_of(box.half), center = vector_of(box.center);
  const Transform in_link = make_transform(orthonormal(axes), center);
  FclPart out = {ShapeKind::kBox, half, {}, in_link, half.norm(), center.norm() + half.norm(), false};
  out.is_flat = is_flat(out);
  return out;
}

// The pose of a link in world axes, relative to the origin of its instance, in double, and its scale.
struct LinkPose {
  Transform rigid;
  double scale;
};

LinkPose link_pose(const InstanceBatch& batch, std::uint32_t instance, std::uint32_t link) {
  const PoseFormat format = batch.input->poses.format;
  const float* const from = pose_of(batch, instance, link);
  double scale = static_cast<double>(scale_of(batch, instance));
  Transform pose;
  if (format == PoseFormat::kQuaternionTranslation) {
    float f[7];
    std::memcpy(f, from, sizeof(f));
    pose = make_transform(rotation_of(f), vector_of(f + 4));
  } else {
    float f[16];
    const bool rows = format == PoseFormat::kMatrix3x4Rows;
    std::memcpy(f, from, rows ? 12 * sizeof(float) : sizeof(f));
    Matrix m;
    Vector t;
    for (int r = 0; r < 3; ++r) {
      for (int c = 0; c < 3; ++c) m(r, c) = static_cast<double>(rows ? f[4 * r + c] : f[4 * c + r]);
      t[r] = static_cast<double>(rows ? f[4 * r + 3] : f[12 + r]);
    }
    if (batch.input->poses.has_scale) scale = m.col(0).norm();
    pose = make_transform(orthonormal(m), t);
  }
  if (!batch.input->scales.empty()) pose.translation() *= scale;
  if (const float* const orientation = orientation_of(batch, instance))
    pose = make_transform(rotation_of(orientation), Vector::Zero()) * pose;
  return {pose, scale};
}

}  // namespace

// The shapes of one articulation.
class FclShapes {
 public:
  std::vector<std::vector<FclPart>> leaves;  // by leaf: its parts
  std::vector<std::uint32_t> leaf_link;      // by leaf: the index of its link
};

void FclShapesDelete::operator()(FclShapes* shapes) const { delete shapes; }

std::unique_ptr<FclShapes, FclShapesDelete> make_fcl_shapes(const Articulation& articulation) {
  std::unique_ptr<FclShapes, FclShapesDelete> shapes(new FclShapes);
  for (std::uint32_t leaf = 0; leaf < articulation.leaf_count; ++leaf) {
    std::vector<FclPart> parts;
    for (std::uint32_t p = articulation.leaf_part_begin[leaf]; p < articulation.leaf_part_begin[leaf + 1]; ++p)
      parts.push_back(make_part(articulation.parts[p]));
    if (parts.empty()) parts.push_back(box_part(articulation.leaf_box[leaf]));
    shapes->leaves.push_back(std::move(parts));
    shapes->leaf_link.push_back(articulation.leaf_link[leaf]);
  }
  return shapes;
}

namespace {

// ----------------------------------------------------------------------------------------------------- one query

// A part as a query sees it: in the query's unit and about its origin.
struct QueryPart {
  const FclPart* part;
  double scale;  // from the caller's unit to that of the query
  Matrix rotation;
  Vector center;
};

// The point of a part, about its centre and in its axes, that is farthest along a unit vector. Half spaces have none.
Vector farthest(const FclPart& part, const Vector& along) {
  const auto towards = [&along](int c) { return along[c] < 0 ? -1.0 : 1.0; };
  switch (part.kind) {
    case ShapeKind::kBox: return {towards(0) * part.size[0], towards(1) * part.size[1], towards(2) * part.size[2]};
    case ShapeKind::kEllipsoid: {
      const Vector scaled = part.size.cwiseProduct(along);
      return part.size.cwiseProduct(scaled) / scaled.norm();
    }
    case ShapeKind::kCapsule: return part.size[0] * along + Vector(0, 0, towards(2) * part.size[1]);
    case ShapeKind::kSphere: return part.size[0] * along;
    case ShapeKind::kCylinder: {
      const double across = std::hypot(along[0], along[1]), by = across > 0 ? part.size[0] / across : 0;
      return {by * along[0], by * along[1], towards(2) * part.size[1]};
    }
    case ShapeKind::kConvexHull:
    case ShapeKind::kHalfSpace: break;
  }
  const Vector* best = &part.vertices.front();
  for (const Vector& vertex : part.vertices)
    if (vertex.dot(along) > best->dot(along)) best = &vertex;
  return *best;
}

// The point of a part that is farthest along a unit vector of the query.
Vector farthest(const QueryPart& part, const Vector& along) {
  return part.rotation * (part.scale * farthest(*part.part, part.rotation.transpose() * along)) + part.center;
}

// libccd's view of a QueryPart: its farthest point along a vector of any length, and its centre.
void ccd_support(const void* part, const ccd_vec3_t* along, ccd_vec3_t* out) {
  const Vector direction(along->v[0], along->v[1], along->v[2]);
  const double length = direction.norm();
  const Vector point =
      farthest(*static_cast<const QueryPart*>(part), length > 0 ? Vector(direction / length) : Vector(Vector::UnitX()));
  ccdVec3Set(out, point[0], point[1], point[2]);
}

void ccd_center(const void* part, ccd_vec3_t* out) {
  const Vector& center = static_cast<const QueryPart*>(part)->center;
  ccdVec3Set(out, center[0], center[1], center[2]);
}

// A part of a leaf in a frame. The pose is relative to the origin of instance a, and the scale is that of the link.
struct PosedPart {
  const FclPart* part;
  Transform pose;
  double scale;
  double reach;  // at least the sum of the lengths that a coordinate of one of its points is the sum of
};

// Two parts about the centre of a. The unit is a power of two, and the sum of both radii and the distance of the
// centres is 1 to 2 units. So every multiplication by the unit is exact.
struct Query {
  QueryPart a, b;
  double unit;      // in the caller's unit
  Vector origin;    // relative to the origin of instance a, in the caller's unit
  double rounding;  // of a gap, in this unit

  double length(double l) const { return l * unit; }
  Vector point(const Vector& p) const { return p * unit + origin; }
};

Query make_query(const PosedPart& a, const PosedPart& b) {
  const Vector between = b.pose.translation() - a.pose.translation();
  const double size = a.scale * a.part->radius + b.scale * b.part->radius + between.norm();
  const double unit = size > 0 ? std::ldexp(1.0, std::ilogb(size)) : 1, scale = 1 / unit;
  return {{a.part, scale * a.scale, query_axes(*a.part, a.pose.linear()), Vector::Zero()},
          {b.part, scale * b.scale, query_axes(*b.part, b.pose.linear()), between * scale},
          unit,
          a.pose.translation(),
          kGapRounding * (a.reach + b.reach) * scale};
}

// Calls visit(query) for every part of leaf a with every part of leaf b, until visit returns true.
template <class Visit>
bool visit_parts(const ExactLeaf& a, const ExactLeaf& b, Visit&& visit) {
  const LinkPose pose_a = link_pose(*a.batch, a.instance, a.fcl_shapes->leaf_link[a.shape]);
  LinkPose pose_b = link_pose(*b.batch, b.instance, b.fcl_shapes->leaf_link[b.shape]);
  double by[3];
  origin_difference(a, b, by);
  const Vector shift(by[0], by[1], by[2]);
  const double away_a = pose_a.rigid.translation().norm(), away_b = pose_b.rigid.translation().norm() + shift.norm();
  pose_b.rigid.translation() += shift;
  const auto posed = [](const FclPart& part, const LinkPose& pose, double away) {
    Transform in_link = part.in_link;
    in_link.translation() *= pose.scale;
    return PosedPart{&part, pose.rigid * in_link, pose.scale, away + pose.scale * part.reach};
  };
  for (const FclPart& part_a : a.fcl_shapes->leaves[a.shape])
    for (const FclPart& part_b : b.fcl_shapes->leaves[b.shape])
      if (visit(make_query(posed(part_a, pose_a, away_a), posed(part_b, pose_b, away_b)))) return true;
  return false;
}

// FCL's own defaults: libccd's tolerance and steps of a query for contacts, and the steps of a query for distances.
constexpr double kContactTolerance = 1e-6;
constexpr unsigned kContactSteps = 500;
constexpr unsigned kDistanceSteps = 1000;

// FCL's distance query stops when an iteration gains less than this.
constexpr double kDistanceStep = 1e-10;

// A contact of two parts, as FCL gives it.
struct FclContact {
  double depth;
  Vector normal;
  Vector point;
};

bool are_boxes(const Query& query) {
  return query.a.part->kind == ShapeKind::kBox && query.b.part->kind == ShapeKind::kBox;
}

// Returns whether two parts touch, and writes their contact unless it is null. FCL has a test of its own for two boxes.
bool find_contact(Query query, FclContact* contact) {
  if (are_boxes(query)) {
    const auto box_of = [](const QueryPart& part) { return fcl::Boxd(2 * part.scale * part.part->size); };
    fcl::CollisionRequestd request;
    request.num_max_contacts = 1;
    request.enable_contact = contact != nullptr;
    request.gjk_solver_type = fcl::GST_LIBCCD;
    fcl::CollisionResultd result;
    const fcl::Boxd a = box_of(query.a), b = box_of(query.b);
    fcl::collide(&a, make_transform(query.a.rotation, query.a.center), &b,
                 make_transform(query.b.rotation, query.b.center), request, result);
    if (!result.isCollision()) return false;
    if (contact) {
      const fcl::Contactd& found = result.getContact(0);
      *contact = {found.penetration_depth, found.normal, found.pos};
    }
    return true;
  }
  return fcl::detail::GJKCollide<double>(&query.a, ccd_support, ccd_center, &query.b, ccd_support, ccd_center,
                                         kContactSteps, kContactTolerance, contact ? &contact->point : nullptr,
                                         contact ? &contact->depth : nullptr, contact ? &contact->normal : nullptr);
}

bool is_half_space(const QueryPart& part) { return part.part->kind == ShapeKind::kHalfSpace; }
bool has_half_space(const Query& query) { return is_half_space(query.a) || is_half_space(query.b); }

// Where a half space and the other part are nearest to each other, or overlap most deeply.
struct PlaneContact {
  double depth;   // below 0: minus the gap
  Vector normal;  // from a to b
  Vector point;   // halfway between the plane and the other part's lowest point
};

// One of the two parts is a half space. Two half spaces touch, without a contact.
PlaneContact plane_contact(const Query& query) {
  const bool is_a = is_half_space(query.a);
  if (is_a && is_half_space(query.b)) return {0, Vector::Zero(), Vector::Zero()};
  const QueryPart &plane = is_a ? query.a : query.b, &other = is_a ? query.b : query.a;
  const Vector up = plane.rotation.col(2), lowest = farthest(other, -up);
  const double height = up.dot(lowest - plane.center);
  return {query.length(-height), is_a ? up : Vector(-up), query.point(lowest - 0.5 * height * up)};
}

// The gap between two parts that do not touch. Their true distance is that of their nearest points.
struct Gap {
  double distance;  // found by FCL; never below the true distance
  Vector normal;    // unit vector along that distance, from a to b
  Vector middle;    // halfway between the two points that FCL found
  double at_least;  // a lower bound of the true distance
};

// Parts that are this many times their radii apart are as good as balls. FCL's query ends the process by an assertion
// where a distance is much larger.
constexpr double kBallDistance = 65536;

// Returns whether FCL finds two parts apart, and writes their gap. FCL returns the distance between one point of each
// part. It is never below the true distance, but may exceed it by any amount. The distance between the supports of both
// parts along the same direction is never above the true distance, so it gives at_least.
bool find_gap(Query query, Gap* out) {
  const Vector between = query.b.center - query.a.center;
  const double away = between.norm(),
               radii = (query.a.part->radius * query.a.scale) + (query.b.part->radius * query.b.scale);
  if (away > kBallDistance * radii) {
    const Vector on_a = query.a.part->radius * query.a.scale / away * between;
    const Vector on_b = between - query.b.part->radius * query.b.scale / away * between;
    *out = {query.length(away - radii), between / away, query.point(0.5 * (on_a + on_b)),
            query.length(away - radii - query.rounding)};
    return true;
  }
  double distance = 0;
  Vector on_a, on_b;
  try {
    if (!fcl::detail::GJKDistance<double>(&query.a, ccd_support, &query.b, ccd_support, kDistanceSteps, kDistanceStep,
                                          &distance, &on_a, &on_b))
      return false;
  } catch (const std::exception&) { return false; }
  const double length = (on_b - on_a).norm();
  if (!(distance > 0 && length > 0)) return false;
  out->normal = (on_b - on_a) / length;
  out->distance = query.length(distance);
  out->middle = query.point(0.5 * (on_a + on_b));
  const double end_a = out->normal.dot(farthest(query.a, out->normal)),
               end_b = out->normal.dot(farthest(query.b, -out->normal));
  out->at_least = query.length(end_b - end_a - query.rounding);
  return true;
}

bool fcl_leaves_touch(const ExactLeaf& a, const ExactLeaf& b, float margin) {
  return visit_parts(a, b, [limit = static_cast<double>(margin)](const Query& query) {
    if (has_half_space(query)) return !(-plane_contact(query).depth - query.length(query.rounding) > limit);
    // libccd calls two parts in one plane apart, since their difference has no volume. Their gap is known. Two boxes
    // are tested by their axes.
    if (limit > 0 || (query.a.part->is_flat && query.b.part->is_flat && !are_boxes(query))) {
      Gap gap;
      return !find_gap(query, &gap) || !(gap.at_least > limit);
    }
    try {
      return find_contact(query, nullptr);
    } catch (const std::exception&) { return true; }
  });
}

// The deepest contact of two links, so far.
class DeepestContact {
 public:
  void keep(const ExactLeaf& a, const ExactLeaf& b, double depth, const Vector& normal, const Vector& middle) {
    if (found_ && !(static_cast<float>(depth) > contact_.depth)) return;
    found_ = true;
    contact_.depth = static_cast<float>(depth);
    for (int c = 0; c < 3; ++c) {
      contact_.normal[c] = static_cast<float>(normal[c]);
      contact_.point_a[c] = static_cast<float>(middle[c] + 0.5 * depth * normal[c]);
      contact_.point_b[c] = static_cast<float>(middle[c] - 0.5 * depth * normal[c]);
    }
    contact_.leaf_a = static_cast<std::uint16_t>(a.leaf);
    contact_.leaf_b = static_cast<std::uint16_t>(b.leaf);
  }
  const Contact& contact() const { return contact_; }

 private:
  bool found_ = false;
  Contact contact_ = {};
};

// Offers every contact of a part of a with a part of b, or with a margin their gap.
void keep_contacts(const ExactLeaf& a, const ExactLeaf& b, float margin, DeepestContact& deepest) {
  visit_parts(a, b, [&](const Query& query) {
    if (has_half_space(query)) {
      const PlaneContact contact = plane_contact(query);
      if (margin > 0)
        deepest.keep(a, b, contact.depth, contact.normal, contact.point);
      else if (contact.depth >= -query.length(query.rounding))
        deepest.keep(a, b, std::max(contact.depth, 0.0), contact.normal, contact.point);
      return false;
    }
    try {
      FclContact contact;
      Gap gap;
      if (find_contact(query, &contact))
        deepest.keep(a, b, query.length(contact.depth), contact.normal, query.point(contact.point));
      else if (margin > 0 && find_gap(query, &gap))
        deepest.keep(a, b, -gap.distance, gap.normal, gap.middle);
    } catch (const std::exception&) {}
    return false;
  });
}

void fcl_contacts(const FrameContext& frame, Span<const Hit> hits, Contact* contacts, ExactScratch&) {
  for (std::size_t i = 0; i < hits.size; ++i) {
    DeepestContact deepest;
    for_each_leaf_pair(frame, hits[i], [&](const ExactLeaf& a, const ExactLeaf& b) {
      keep_contacts(a, b, margin_between(a, b, frame.margin), deepest);
    });
    contacts[i] = deepest.contact();
  }
}

}  // namespace

const ExactTest* fcl_test() {
  static constexpr ExactTest kTest = {fcl_leaves_touch, fcl_contacts};
  return &kTest;
}

}  // namespace cab
