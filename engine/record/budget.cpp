#include "engine/record/budget.h"

namespace cab::record {
namespace {

namespace fb = flatbuffers;

// What a text or a list takes besides its values, once it is unpacked.
constexpr std::uint64_t kEach = 32;

template <class T>
std::uint64_t of_numbers(const fb::Vector<T>* list) {
  return list == nullptr ? 0 : kEach + std::uint64_t{list->size()} * sizeof(T);
}

std::uint64_t of_text(const fb::String* text) { return text == nullptr ? 0 : kEach + text->size(); }

template <class Entry, class Bytes>
std::uint64_t of_list(const fb::Vector<fb::Offset<Entry>>* list, Bytes bytes_of) {
  std::uint64_t bytes = 0;
  if (list != nullptr)
    for (const Entry* const entry : *list) bytes += kEach + bytes_of(*entry);
  return bytes;
}

std::uint64_t of_texts(const fb::Vector<fb::Offset<fb::String>>* list) {
  return of_list(list, [](const fb::String& text) { return std::uint64_t{text.size()}; });
}

std::uint64_t of_poses(const format::Poses* poses) {
  return poses == nullptr ? 0 : of_numbers(poses->values()) + of_numbers(poses->rounded());
}

std::uint64_t of_parts(const fb::Vector<fb::Offset<format::Part>>* parts) {
  return of_list(parts,
                 [](const format::Part& part) { return of_numbers(part.place()) + of_numbers(part.vertices()); });
}

std::uint64_t of_level(const format::Level* level) {
  if (level == nullptr) return 0;
  return of_poses(level->rest_poses()) + of_list(level->leaves(), [](const format::LevelLeaf& leaf) {
           return of_numbers(leaf.box()) + of_numbers(leaf.links());
         });
}

std::uint64_t of_skin(const format::Skin* skin) {
  if (skin == nullptr) return 0;
  return of_numbers(skin->vertices()) + of_numbers(skin->influence_links()) + of_numbers(skin->influence_weights()) +
         of_numbers(skin->inverse_bind());
}

}  // namespace

std::uint64_t expanded_bytes(const format::Articulation& table) {
  return of_text(table.name()) + of_texts(table.link_names()) + of_numbers(table.link_parents()) +
         of_numbers(table.link_joints()) + of_numbers(table.ignored_pairs()) + of_poses(table.rest_pose()) +
         of_level(table.level()) + of_skin(table.skin()) + of_list(table.leaves(), [](const format::Leaf& leaf) {
           return of_numbers(leaf.box()) + of_parts(leaf.parts()) + of_numbers(leaf.triangles());
         });
}

std::uint64_t expanded_bytes(const format::Batch& table) {
  std::uint64_t bytes = of_text(table.name()) + of_texts(table.instance_names());
  const format::StaticBodies* const bodies = table.static_bodies();
  if (bodies == nullptr) return bytes;
  return bytes + of_numbers(bodies->vertices()) + of_numbers(bodies->triangles()) + of_numbers(bodies->origin()) +
         of_list(bodies->bodies(), [](const format::StaticBody& body) {
           return of_numbers(body.place()) + of_numbers(body.rotation()) + of_numbers(body.box()) +
                  of_parts(body.parts());
         });
}

}  // namespace cab::record
