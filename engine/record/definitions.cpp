#include "engine/record/definitions.h"

#include <algorithm>
#include <cstring>
#include <utility>

#include "engine/record/words.h"
#include "layout/pose_coding.h"

namespace cab::record {
namespace {

std::string text_of(const char* text) { return text == nullptr ? std::string() : std::string(text); }

std::vector<std::string> texts_of(Span<const char* const> names) {
  std::vector<std::string> texts;
  for (const char* const name : names) texts.push_back(text_of(name));
  return texts;
}

template <class T>
std::vector<T> copy_of(Span<const T> span) {
  return std::vector<T>(span.begin(), span.end());
}

std::vector<float> box_floats(const Box& box) {
  std::vector<float> floats(kBoxFloats);
  std::memcpy(floats.data(), &box, sizeof box);
  return floats;
}

Box box_of(const std::vector<float>& floats) {
  Box box;
  std::memcpy(static_cast<void*>(&box), floats.data(), sizeof box);
  return box;
}

std::vector<std::unique_ptr<format::PartT>> part_tables(Span<const ConvexPart> parts) {
  std::vector<std::unique_ptr<format::PartT>> tables;
  for (const ConvexPart& part : parts) {
    auto table = std::make_unique<format::PartT>();
    table->kind = static_cast<std::uint8_t>(part.kind);
    table->place.insert(table->place.end(), part.position, part.position + 3);
    table->place.insert(table->place.end(), part.rotation, part.rotation + 4);
    table->place.insert(table->place.end(), part.size, part.size + 3);
    if (part.kind == ShapeKind::kConvexHull) table->vertices = copy_of(part.vertices);
    tables.push_back(std::move(table));
  }
  return tables;
}

// Appends the parts of one leaf or body, which point into the tables. Empty if they are sound.
std::string read_parts(const std::vector<std::unique_ptr<format::PartT>>& tables, std::vector<ConvexPart>& parts) {
  for (const auto& table : tables) {
    if (table->place.size() != kPlaceFloats) return "a part has no position, rotation and size";
    if (table->vertices.size() % 3 != 0) return "the vertices of a part are not x y z";
    if (table->kind > static_cast<std::uint8_t>(ShapeKind::kHalfSpace)) return "a part has a shape of no kind";
    ConvexPart part;
    part.kind = static_cast<ShapeKind>(table->kind);
    std::copy_n(table->place.data(), 3, part.position);
    std::copy_n(table->place.data() + 3, 4, part.rotation);
    std::copy_n(table->place.data() + 7, 3, part.size);
    part.vertices = table->vertices;
    parts.push_back(part);
  }
  return {};
}

std::unique_ptr<format::PosesT> poses_table(const PoseView& poses, std::uint32_t link_count, std::uint32_t instances) {
  if (poses.data == nullptr) return nullptr;
  auto table = std::make_unique<format::PosesT>();
  table->format = static_cast<std::uint8_t>(poses.format);
  table->has_scale = poses.has_scale;
  gather_poses(poses, link_count, instances, {}, table->values);
  return table;
}

std::string read_poses(const std::unique_ptr<format::PosesT>& table, std::uint64_t links, std::uint64_t instances,
                       PoseView& poses) {
  if (table == nullptr) return {};
  if (table->format > static_cast<std::uint8_t>(PoseFormat::kMatrix4x4Columns)) return "its poses have no known format";
  poses.format = static_cast<PoseFormat>(table->format);
  poses.has_scale = table->has_scale;
  if (table->values.size() != instances * links * pose_floats(poses.format))
    return "its poses are of another number of links";
  poses.data = table->values.data();
  return {};
}

std::unique_ptr<format::SkinT> skin_table(const SkinDesc& skin) {
  if (skin.vertices.empty()) return nullptr;
  auto table = std::make_unique<format::SkinT>();
  table->vertices = copy_of(skin.vertices);
  table->influence_count = skin.influence_count;
  table->influence_links = copy_of(skin.influence_links);
  table->influence_weights = copy_of(skin.influence_weights);
  table->inverse_bind = copy_of(skin.inverse_bind);
  return table;
}

// Empty if the skin is sound: whoever follows its indices finds what they name.
std::string read_skin(const std::unique_ptr<format::SkinT>& table, std::uint64_t links, SkinDesc& skin) {
  if (table == nullptr) return {};
  const std::uint64_t vertices = table->vertices.size() / 3, influences = vertices * table->influence_count;
  if (table->vertices.size() % 3 != 0) return "the vertices of its skin are not x y z";
  if (table->influence_links.size() != influences || table->influence_weights.size() != influences)
    return "its skin has influences of another number of vertices";
  if (!table->inverse_bind.empty() && table->inverse_bind.size() != 16 * links)
    return "its skin has matrices for another number of links";
  for (std::size_t i = 0; i < influences; ++i)
    if (table->influence_weights[i] != 0 && table->influence_links[i] >= links)
      return "its skin is moved by a link that it does not have";
  skin.vertices = table->vertices;
  skin.influence_count = table->influence_count;
  skin.influence_links = table->influence_links;
  skin.influence_weights = table->influence_weights;
  skin.inverse_bind = table->inverse_bind;
  return {};
}

// The names as pointers into the table. Empty if there are none, or one per link or instance.
std::string read_names(const std::vector<std::string>& names, std::size_t count, std::vector<const char*>& pointers) {
  if (!names.empty() && names.size() != count)
    return "it has " + std::to_string(names.size()) + " names for " + std::to_string(count);
  for (const std::string& name : names) pointers.push_back(name.c_str());
  return {};
}

}  // namespace

void gather_poses(const PoseView& poses, std::uint32_t link_count, std::size_t instances,
                  Span<const std::uint32_t> listed, std::vector<float>& values) {
  const std::size_t floats = pose_floats(poses.format);
  const std::size_t link_stride = link_bytes(poses), stride = instance_bytes(poses, link_count);
  const std::size_t row = floats * link_count;
  values.assign(instances * row, 0);
  const auto copy = [&](std::size_t instance) {
    const auto* const first = reinterpret_cast<const unsigned char*>(poses.data) + instance * stride;
    float* const to = values.data() + instance * row;
    if (link_stride == floats * sizeof(float)) {
      std::memcpy(to, first, row * sizeof(float));
      return;
    }
    for (std::size_t link = 0; link < link_count; ++link)
      std::memcpy(to + link * floats, first + link * link_stride, floats * sizeof(float));
  };
  if (listed.empty())
    for (std::size_t instance = 0; instance < instances; ++instance) copy(instance);
  for (const std::uint32_t instance : listed) copy(instance);
}

format::ArticulationT articulation_table(const ArticulationDesc& desc, const ArticulationNames& names) {
  format::ArticulationT table;
  const auto links = static_cast<std::uint32_t>(desc.link_parents.size);
  table.name = text_of(names.name);
  table.link_names = texts_of(names.links);
  for (const std::int32_t parent : desc.link_parents) table.link_parents.push_back(static_cast<std::int16_t>(parent));
  table.link_joints = copy_of(desc.link_joints);
  for (const Leaf& leaf : desc.leaves) {
    auto entry = std::make_unique<format::LeafT>();
    entry->link = static_cast<std::uint16_t>(leaf.link);
    if (leaf.triangles.empty()) entry->box = box_floats(leaf.box);
    entry->parts = part_tables(leaf.parts);
    entry->triangles = copy_of(leaf.triangles);
    table.leaves.push_back(std::move(entry));
  }
  for (const LinkPair& pair : desc.ignored_pairs)
    for (const std::uint32_t link : {pair.a, pair.b}) table.ignored_pairs.push_back(static_cast<std::uint16_t>(link));
  table.ignored_hops = desc.ignored_hops;
  table.rest_pose = poses_table(desc.rest_pose, links, 1);
  table.skin = skin_table(desc.skin);
  return table;
}

format::ArticulationT lod_table(const LodDesc& desc, std::uint32_t of, std::uint32_t link_count,
                                const ArticulationNames& names) {
  format::ArticulationT table;
  table.name = text_of(names.name);
  table.link_names = texts_of(names.links);
  table.level = std::make_unique<format::LevelT>();
  format::LevelT& level = *table.level;
  level.of = of;
  level.kind = static_cast<std::uint8_t>(desc.kind);
  level.max_leaves = desc.max_leaves;
  for (const LodLeaf& leaf : desc.leaves) {
    auto entry = std::make_unique<format::LevelLeafT>();
    entry->link = leaf.link;
    entry->box = box_floats(leaf.box);
    entry->links = copy_of(leaf.links);
    level.leaves.push_back(std::move(entry));
  }
  level.rest_poses = poses_table(desc.rest_poses, link_count, desc.rest_pose_count);
  level.rest_pose_count = desc.rest_pose_count;
  level.joint_play = desc.joint_play;
  return table;
}

format::BatchT batch_table(std::uint32_t slot, std::uint32_t articulation, std::uint32_t instance_count,
                           const BatchNames& names) {
  format::BatchT table;
  table.slot = slot;
  table.articulation = articulation;
  table.instance_count = instance_count;
  table.name = text_of(names.name);
  table.instance_names = texts_of(names.instances);
  return table;
}

format::BatchT static_batch_table(std::uint32_t slot, const StaticDesc& desc, const BatchNames& names) {
  const std::size_t count = desc.bodies.size + desc.triangles.size / 3;
  format::BatchT table = batch_table(slot, 0, static_cast<std::uint32_t>(count), names);
  table.static_bodies = std::make_unique<format::StaticBodiesT>();
  format::StaticBodiesT& bodies = *table.static_bodies;
  for (const StaticBody& body : desc.bodies) {
    auto entry = std::make_unique<format::StaticBodyT>();
    entry->place.assign(body.origin, body.origin + 3);
    entry->rotation.assign(body.rotation, body.rotation + 4);
    entry->box = box_floats(body.box);
    entry->parts = part_tables(body.parts);
    bodies.bodies.push_back(std::move(entry));
  }
  bodies.vertices = copy_of(desc.vertices);
  bodies.triangles = copy_of(desc.triangles);
  bodies.origin.assign(desc.origin, desc.origin + 3);
  return table;
}

std::string ReadArticulation::read(const format::Articulation& table,
                                   const std::vector<std::unique_ptr<ReadArticulation>>& before) {
  table.UnPackTo(&table_);
  view_.name = table_.name.c_str();
  if (table_.level != nullptr) return read_level(before);

  const std::size_t links = table_.link_parents.size();
  if (links == 0 || links > kMaxLinks) return "it has no links, or too many";
  view_.link_count = static_cast<std::uint32_t>(links);
  parents_.assign(table_.link_parents.begin(), table_.link_parents.end());
  if (!table_.link_joints.empty() && table_.link_joints.size() != 3 * links)
    return "it has joints for another number of links";
  if (table_.leaves.empty() || table_.leaves.size() > kMaxLeaves) return "it has no leaves, or too many";
  if (const std::string wrong = read_skin(table_.skin, links, view_.desc.skin); !wrong.empty()) return wrong;
  parts_.resize(table_.leaves.size());
  for (std::size_t n = 0; n < table_.leaves.size(); ++n)
    if (const std::string wrong = read_leaf(n); !wrong.empty()) return wrong;
  if (table_.ignored_pairs.size() % 2 != 0) return "its ignored pairs are not pairs";
  for (std::size_t k = 0; k < table_.ignored_pairs.size(); k += 2)
    ignored_.push_back({table_.ignored_pairs[k], table_.ignored_pairs[k + 1]});
  if (const std::string wrong = read_names(table_.link_names, links, names_); !wrong.empty()) return wrong;
  view_.link_names = names_;
  view_.desc.link_parents = parents_;
  view_.desc.link_joints = table_.link_joints;
  view_.desc.leaves = leaves_;
  view_.desc.ignored_pairs = ignored_;
  view_.desc.ignored_hops = table_.ignored_hops;
  return read_poses(table_.rest_pose, links, 1, view_.desc.rest_pose);
}

std::string ReadArticulation::read_leaf(std::size_t n) {
  const format::LeafT& leaf = *table_.leaves[n];
  if (leaf.link >= table_.link_parents.size()) return "a leaf is on no link";
  if (const std::string wrong = read_parts(leaf.parts, parts_[n]); !wrong.empty()) return wrong;
  leaves_.push_back({leaf.link, {}, parts_[n], leaf.triangles});
  if (leaf.triangles.empty()) {
    if (leaf.box.size() != kBoxFloats) return "a leaf has neither a box nor triangles";
    leaves_.back().box = box_of(leaf.box);
    return {};
  }
  const auto is_vertex = [vertices = view_.desc.skin.vertices.size / 3](std::uint32_t v) { return v < vertices; };
  if (leaf.triangles.size() % 3 != 0 || !std::all_of(leaf.triangles.begin(), leaf.triangles.end(), is_vertex))
    return "the triangles of a leaf are incomplete, or have vertices that its skin does not have";
  return {};
}

std::string ReadArticulation::read_level(const std::vector<std::unique_ptr<ReadArticulation>>& before) {
  const format::LevelT& level = *table_.level;
  if (level.of >= before.size() || before[level.of]->view().is_lod) return "it is a level of no articulation";
  if (level.kind > static_cast<std::uint8_t>(LodKind::kNodes)) return "it is a level of no kind";
  view_.is_lod = true;
  view_.link_count = before[level.of]->view().link_count;
  for (const auto& leaf : level.leaves) {
    if (leaf->box.size() != kBoxFloats) return "a leaf of a level has no box";
    lod_leaves_.push_back({leaf->link, box_of(leaf->box), leaf->links});
  }
  if (const std::string wrong = read_names(table_.link_names, view_.link_count, names_); !wrong.empty()) return wrong;
  view_.link_names = names_;
  view_.lod.of = {std::uint64_t{level.of} + 1};
  view_.lod.kind = static_cast<LodKind>(level.kind);
  view_.lod.max_leaves = level.max_leaves;
  view_.lod.leaves = lod_leaves_;
  view_.lod.rest_pose_count = level.rest_pose_count;
  view_.lod.joint_play = level.joint_play;
  return read_poses(level.rest_poses, view_.link_count, level.rest_pose_count, view_.lod.rest_poses);
}

std::string ReadBatch::read(const format::Batch& table,
                            const std::vector<std::unique_ptr<ReadArticulation>>& articulations) {
  table.UnPackTo(&table_);
  view_.name = table_.name.c_str();
  view_.slot = table_.slot;
  view_.articulation = table_.articulation;
  view_.instance_count = table_.instance_count;
  if (view_.slot == 0) return "it has no slot";
  if (view_.instance_count == 0 || view_.instance_count > kMaxInstances) return "it has no instances, or too many";
  if (const std::string wrong = read_names(table_.instance_names, view_.instance_count, names_); !wrong.empty())
    return wrong;
  view_.instance_names = names_;
  if (table_.static_bodies == nullptr)
    return view_.articulation < articulations.size() ? std::string() : "it is of no articulation";

  view_.is_static = true;
  const format::StaticBodiesT& bodies = *table_.static_bodies;
  if (bodies.origin.size() != 3 || bodies.vertices.size() % 3 != 0 || bodies.triangles.size() % 3 != 0)
    return "its triangles are incomplete";
  if (bodies.bodies.size() + bodies.triangles.size() / 3 != view_.instance_count)
    return "it has another number of bodies than of instances";
  parts_.resize(bodies.bodies.size());
  for (std::size_t n = 0; n < bodies.bodies.size(); ++n) {
    const format::StaticBodyT& body = *bodies.bodies[n];
    if (body.place.size() != 3 || body.rotation.size() != 4 || body.box.size() != kBoxFloats)
      return "a static body has no place or no box";
    if (const std::string wrong = read_parts(body.parts, parts_[n]); !wrong.empty()) return wrong;
    StaticBody& entry = bodies_.emplace_back();
    std::copy_n(body.place.data(), 3, entry.origin);
    std::copy_n(body.rotation.data(), 4, entry.rotation);
    entry.box = box_of(body.box);
    entry.parts = parts_[n];
  }
  view_.static_desc.bodies = bodies_;
  view_.static_desc.vertices = bodies.vertices;
  view_.static_desc.triangles = bodies.triangles;
  std::copy_n(bodies.origin.data(), 3, view_.static_desc.origin);
  return {};
}

}  // namespace cab::record
