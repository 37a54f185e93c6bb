// Bodies for an articulation from the skin of a character: vertices, weights and inverse bind matrices as plain arrays.
// They are solids on links (bodies_from_skin), or the skin itself in leaves of triangles (surface_from_skin).
//
// The target cab::rig has these calls. They are for the time of loading: they allocate, and take milliseconds to
// seconds. No call throws. All lengths are in one unit, that of the joints' matrices.
//
// Matrices are 16 floats by columns, as in glTF and ozz; the last row is not read. A joint's matrix takes points of the
// joint to the model ("model space"). It may scale, shear and mirror: that goes into the bodies, and poses of links
// stay rigid. A link's frame is that of its joint without scale, shear and mirroring, as rigid_pose gives it.
#pragma once

#include <cab/types.h>

#include <cstddef>
#include <cstdint>

namespace cab::rig {

// What a call answers. The comments are the words of to_string(SkinStatus). A call that does not answer kOk leaves its
// outputs as they were.
enum class SkinStatus : std::int32_t {
  kOk = 0,         // ok
  kOutOfMemory,    // an allocation failed
  kBadJoints,      // joint_parents must hold -1 or an earlier joint for each joint, of which there is at least one
  kBadPoses,       // poses must hold one finite matrix per joint, once or several times
  kBadVertices,    // vertices must hold x y z of at least one vertex, all finite and at most 1e18 in the link's frame
  kBadTriangles,   // triangles must hold three indices of vertices each
  kBadBones,       // inverse_bind and bone_joints must hold a finite matrix and an existing joint per bone
  kBadInfluences,  // influences must be existing bones with finite weights of 0 or more, influence_count per vertex
  kBadRules,       // a rule is out of its range
  kBadOutput,      // an output is null or of the wrong size
  kBadBodies,      // bodies are empty, are no solids, or were made for another number of joints
  kNoBodies,       // no vertex has a weight, or no triangle of a surface has an area
  kTooManyLinks,   // more than 1024 links; a coarser skeleton has fewer
  kTooManyLeaves,  // more than 1024 leaves; fewer per link, more triangles in each, or a coarser skeleton
  kNoInverse,      // the matrix of a bone in the first pose has no inverse
  kBindsDiffer,    // two bones of one joint have other matrices than moving the vertices of one of them makes up for
  kTooManyInfluences,  // a triangle is moved by more than 33 joints
};

// Returns a status in words. The string lives as long as the program.
const char* to_string(SkinStatus status) noexcept;

// A skinned mesh. All spans are borrowed for the call.
struct Skin {
  // The parent of each joint: -1 for a root, of which there may be several, and an earlier joint for every other.
  Span<const std::int32_t> joint_parents;

  // One matrix per joint, from joint to model, for one pose or for several, one pose after the other. The first is the
  // rest pose, in which bodies are made. Coverage is measured in all of them, and BodyRules::inflate uses all.
  Span<const float> poses;

  // x y z per vertex, in the mesh's own space. In the frame of a link that it moves with, a coordinate is at most 1e18.
  Span<const float> vertices;

  // Three indices of vertices per triangle, counter-clockwise from outside. Empty (default): bodies and coverage are
  // about vertices alone.
  Span<const std::uint32_t> triangles;

  // How many bones influence a vertex at most, the bone of each influence, and its weight: influence_count values per
  // vertex. A weight of 0 has no effect. The weights of a vertex are divided by their sum. Triangles with a vertex
  // without weight are left out.
  std::uint32_t influence_count = 4;
  Span<const std::uint32_t> influence_bones;
  Span<const float> influence_weights;

  // One matrix per bone, from the mesh to the joint.
  Span<const float> inverse_bind;

  // The joint of each bone. Several bones may have the same joint, as in a file with several skins. Empty (default):
  // bone b is joint b.
  Span<const std::uint32_t> bone_joints;
};

// The kinds of bodies. BodyRules::kinds combines these bits.
enum BodyKind : std::uint32_t {
  kHullBody = 1,       // a convex hull of at most BodyRules::max_hull_vertices vertices
  kBoxBody = 2,        // a box by fit_box
  kCapsuleBody = 4,    // a capsule along one of that box's axes
  kSphereBody = 8,     // a sphere
  kEllipsoidBody = 16  // an ellipsoid
};

// How bodies are made.
struct BodyRules {
  // The kinds to choose from. Each leaf takes the one with the least volume. Default: hulls.
  std::uint32_t kinds = kHullBody;

  // The most vertices of a hull, 4 to 1024. A hull that needs more is replaced by a slightly larger one, which also
  // covers some of what moves out where joints bend.
  std::uint32_t max_hull_vertices = 40;

  // The most leaves on a link, 1 to 64. A link's triangles are cut in two where that saves most volume, until there are
  // so many leaves or a cut would save less than a twentieth of the leaf's volume.
  std::uint32_t leaves_per_link = 1;

  // A triangle belongs to the link with most of its weight, and to all links with at least this share of it. Above 0,
  // at most 1.
  float shared_weight = 0.2f;

  // Whether bodies grow until every triangle of every pose is inside. Default: they contain the triangles that they
  // own, as these are in the rest pose.
  bool inflate = false;

  // The joints that get links. Empty (default): all that move vertices and whose reach is at least least_reach. The
  // vertices of all other joints go to the nearest joint above that has a link, or else to the first link.
  Span<const std::uint32_t> kept_joints;

  // A length, 0 or more. A joint's reach is the distance in the rest pose to its farthest child or vertex. Default:
  // every joint that moves vertices has a link.
  float least_reach = 0;
};

struct SkinBodyStorage;

// Bodies, and the memory of their description.
class SkinBodies {
 public:
  // Empty.
  SkinBodies() noexcept = default;

  // Takes over what `other` holds, which is empty afterwards.
  SkinBodies(SkinBodies&& other) noexcept : storage_(other.storage_) { other.storage_ = nullptr; }
  SkinBodies& operator=(SkinBodies&& other) noexcept;
  ~SkinBodies();

  // The articulation for add_articulation. Its spans live as long as this object. Links are in the order of their
  // joints, and the first is the root. A leaf has one part, or none if it is a box. Links that own a triangle together,
  // and parents with their children, are ignored pairs. Empty before bodies_from_skin.
  ArticulationDesc desc() const noexcept;

  // The joint of each link, by its index.
  Span<const std::uint32_t> joints() const noexcept;

  // Of surface_from_skin: for every triangle of the leaves, one leaf after the other, its index in Skin::triangles,
  // over 3. Empty for other bodies.
  Span<const std::uint32_t> source_triangles() const noexcept;

 private:
  friend struct SkinBodiesAccess;
  SkinBodyStorage* storage_ = nullptr;
};

// Makes links and leaves for a skin, and writes them to *out. A leaf contains the triangles of its link as they are in
// the rest pose. Hulls and flat boxes far from their joint may leave out what rounding to float takes from them: up to
// 2^-23 of their largest coordinate in the link's frame. Points in one plane make a flat box, whatever the kinds are.
// Statuses: those of SkinStatus down to kTooManyLeaves, but for kBadBodies. kBadVertices also if a body reaches beyond
// 1e18 in the link's frame, which add_articulation does not take.
[[nodiscard]] SkinStatus bodies_from_skin(const Skin& skin, const BodyRules& rules, SkinBodies* out) noexcept;

// How a surface is cut into leaves.
struct SurfaceRules {
  // The most triangles of a leaf, 1 or more. It is doubled until there are at most max_leaves leaves.
  std::uint32_t most_triangles = 128;

  // The most leaves, 1 to kMaxLeaves.
  std::uint32_t max_leaves = kMaxLeaves;

  // Leaves are halved while their boxes, which grow with the poses of links, have more than this many times the surface
  // of boxes about the vertices where these are, over at most 64 of the skin's poses. A skin of one pose is bent by up
  // to 40 degrees at each joint for that. A cut that does not bring the boxes closer is not made. At least 1; infinite:
  // leaves are not cut for this reason.
  float most_growth = 2;

  // Leaves are not cut for that reason into leaves of fewer triangles than this, 1 or more.
  std::uint32_t least_triangles = 16;
};

// What became of a surface.
struct SurfaceInfo {
  std::uint32_t triangle_count = 0;   // in leaves, each in one
  std::uint32_t left_out_count = 0;   // triangles with two corners at one place, or with a corner without weight
  std::uint32_t vertex_count = 0;     // of the triangles in leaves
  std::uint32_t welded_count = 0;     // vertices of the skin that are one with another
  std::uint32_t link_count = 0;       // links that have leaves
  std::uint32_t most_triangles = 0;   // of a leaf
  std::uint32_t most_influences = 0;  // links that move the vertices of a leaf, its own included; the most
  std::uint32_t part_count = 0;       // connected parts
  std::uint32_t open_part_count = 0;  // of these, those with open edges, which have no inside
  std::uint32_t open_edge_count = 0;  // edges that an odd number of triangles have
  double growth =
      0;  // the surface of all boxes over that of boxes about their vertices, over the poses of SurfaceRules
  double worst_distance = 0;     // the largest of a vertex from where Skin moves it, over all poses
  std::uint32_t worst_pose = 0;  // the pose of that vertex
};

// Makes links for a skin, and leaves of its triangles, which follow it in every pose, and writes them to *out. Vertices
// of equal place and weights become one. Triangles that then have two equal corners are left out, and so are vertices
// and triangles without weight. Every joint that moves triangles has a link. A leaf is on the link with most of the
// weight of its triangles; Leaf::box is about them as that link alone would move them. Links are ignored pairs as by
// bodies_from_skin with its default rules.
//
// Poses of links are rigid: scale, shear and mirroring of joints are those of the first pose. In others a vertex is
// elsewhere than Skin says if they change, by at most SurfaceInfo::worst_distance. An articulation has one matrix per
// link. Where bones of one joint have different ones, as in a file with several meshes, the vertices of one mesh are
// moved so that they agree.
//
// *info (may be null) receives what became of the skin, and *bad_bone (may be null) the bone for kNoInverse and
// kBindsDiffer.
// Statuses: all of SkinStatus but kBadBodies. kBadTriangles also without triangles.
[[nodiscard]] SkinStatus surface_from_skin(const Skin& skin, const SurfaceRules& rules, SkinBodies* out,
                                           SurfaceInfo* info = nullptr, std::uint32_t* bad_bone = nullptr) noexcept;

// How well bodies cover a skin.
struct Coverage {
  double share_inside;        // of the area of all triangles in all poses, 0 to 1; without triangles of the vertices
  double worst_protrusion;    // the largest distance of a point of the surface from all bodies, over all poses
  std::uint32_t worst_pose;   // the pose of that point
  std::uint32_t worst_joint;  // the joint of the link that owns its triangle
  double mesh_volume;         // what the mesh encloses in the first pose
  double bodies_volume;       // the union of all bodies in the first pose
  double median_box_ratio;    // the median over all leaves of the volume of the box over that of the body
  std::uint32_t flat_count;   // leaves without a volume, which have no part in that median
};

// Measures solids that bodies_from_skin made for the same skin, in all of its poses. Each triangle is looked at in its
// corners and in the middles of its four quarters, which give the share. A point of the surface is inside if it is in a
// body or at most 2^-20 of the body's size from it. Distances to ellipsoids are upper limits. Volumes are counted on a
// grid of 96 cells along the longest side. A point is in the mesh if the winding number on a line through it is not 0.
// Statuses: kBadBodies, and those of a bad skin.
[[nodiscard]] SkinStatus measure_coverage(const Skin& skin, const SkinBodies& bodies, Coverage* out) noexcept;

// Writes the rigid part of a matrix, the pose of a link: quaternion x y z w, then translation x y z. The rotation's x
// axis is that of the matrix, its y axis is in the plane of the matrix's x and y axes, and its determinant is 1.
void rigid_pose(const float (&matrix)[16], float (&pose)[7]) noexcept;

// Writes the pose of every link, seven floats each, from the matrices of all joints in one pose. Allocates nothing.
// Statuses: kBadBodies, kBadPoses (not one matrix per joint), kBadOutput (not seven floats per link).
[[nodiscard]] SkinStatus link_poses(const SkinBodies& bodies, Span<const float> matrices, Span<float> poses) noexcept;

}  // namespace cab::rig
