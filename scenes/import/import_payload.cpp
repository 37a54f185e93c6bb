// What import reads as bytes, from a child process. The structured bindings name every field, so that a new field does
// not compile until it is written and read here.
#include "scenes/import/import_payload.h"

#include <algorithm>

#include "scenes/import/printable.h"

namespace cab::scenes {

std::vector<std::string> printable_texts(PayloadReader& reader) {
  std::vector<std::string> all = reader.texts();
  for (std::string& one : all) one = printable(one);
  return all;
}

std::string skeleton_payload(const Skeleton& skeleton) {
  const auto& [names, parents, is_end_site, rest_offsets, frame_seconds, frame_count, rotations, positions, is_static,
               skin, unit, notes, alterations] = skeleton;
  const auto& [vertices, triangles, influence_count, influence_bones, influence_weights, inverse_bind, bone_joints,
               bone_meshes, mesh_names, stretches] = skin;
  PayloadWriter writer;
  writer.texts(names);
  writer.array(parents);
  writer.array(std::vector<std::uint8_t>(is_end_site.begin(), is_end_site.end()));
  writer.array(rest_offsets);
  writer.value(frame_seconds);
  writer.value(frame_count);
  writer.array(rotations);
  writer.array(positions);
  writer.value(is_static);
  writer.array(vertices);
  writer.array(triangles);
  writer.value(influence_count);
  writer.array(influence_bones);
  writer.array(influence_weights);
  writer.array(inverse_bind);
  writer.array(bone_joints);
  writer.array(bone_meshes);
  writer.texts(mesh_names);
  writer.array(stretches);
  writer.value(unit.metres);
  writer.value(unit.source);
  writer.texts(notes);
  std::vector<std::uint8_t> kinds;
  std::vector<std::uint64_t> counts;
  std::vector<std::string> whats, their_notes;
  for (const auto& [kind, what, count, note] : alterations) {
    kinds.push_back(static_cast<std::uint8_t>(kind));
    whats.push_back(what);
    counts.push_back(count);
    their_notes.push_back(note);
  }
  writer.array(kinds);
  writer.texts(whats);
  writer.array(counts);
  writer.texts(their_notes);
  return writer.take();
}

Skeleton read_skeleton_payload(const std::string& bytes) {
  PayloadReader reader(bytes);
  Skeleton skeleton;
  auto& [names, parents, is_end_site, rest_offsets, frame_seconds, frame_count, rotations, positions, is_static, skin,
         unit, notes, alterations] = skeleton;
  auto& [vertices, triangles, influence_count, influence_bones, influence_weights, inverse_bind, bone_joints,
         bone_meshes, mesh_names, stretches] = skin;
  names = printable_texts(reader);
  parents = reader.array<std::int32_t>();
  const std::vector<std::uint8_t> ends = reader.array<std::uint8_t>();
  is_end_site.assign(ends.begin(), ends.end());
  rest_offsets = reader.array<double>();
  frame_seconds = reader.value<double>();
  frame_count = reader.value<std::uint32_t>();
  rotations = reader.array<double>();
  positions = reader.array<double>();
  is_static = reader.value<std::uint8_t>() != 0;
  vertices = reader.array<float>();
  triangles = reader.array<std::uint32_t>();
  influence_count = reader.value<std::uint32_t>();
  influence_bones = reader.array<std::uint32_t>();
  influence_weights = reader.array<float>();
  inverse_bind = reader.array<float>();
  bone_joints = reader.array<std::uint32_t>();
  bone_meshes = reader.array<std::uint32_t>();
  mesh_names = printable_texts(reader);
  stretches = reader.array<float>();
  unit.metres = reader.value<double>();
  const auto source = reader.value<std::uint8_t>();
  notes = printable_texts(reader);
  const std::vector<std::uint8_t> kinds = reader.array<std::uint8_t>();
  const std::vector<std::string> whats = printable_texts(reader);
  const std::vector<std::uint64_t> counts = reader.array<std::uint64_t>();
  const std::vector<std::string> their_notes = printable_texts(reader);
  reader.finish();
  require_payload(unit.metres > 0 && source <= static_cast<std::uint8_t>(UnitSource::kGuessed),
                  "its length unit is none");
  unit.source = static_cast<UnitSource>(source);
  require_payload(whats.size() == kinds.size() && counts.size() == kinds.size() && their_notes.size() == kinds.size(),
                  "the arrays of alterations differ in size");
  for (std::size_t a = 0; a < kinds.size(); ++a) {
    require_payload(kinds[a] <= static_cast<std::uint8_t>(AlterationKind::kGuessed), "an alteration is of no kind");
    alterations.push_back({static_cast<AlterationKind>(kinds[a]), whats[a], counts[a], their_notes[a]});
  }

  // Every count is at most the number of bytes, so that no product overflows.
  const std::size_t joints = names.size();
  require_payload(
      joints > 0 && parents.size() == joints && is_end_site.size() == joints && rest_offsets.size() == 3 * joints,
      "the arrays of joints differ in size");
  require_payload(frame_count > 0 && rotations.size() / 4 / joints == frame_count &&
                      rotations.size() == 4 * joints * frame_count && positions.size() == 3 * joints * frame_count,
                  "there is not one pose for each joint and frame");
  require_payload(bone_meshes.size() == bone_joints.size() &&
                      std::all_of(bone_meshes.begin(), bone_meshes.end(),
                                  [&names_of = mesh_names](std::uint32_t mesh) { return mesh < names_of.size(); }),
                  "a bone is of no mesh");
  // The other arrays of a skin are checked where bodies are made of them.
  require_payload(stretches.empty() || stretches.size() == 6 * joints * frame_count,
                  "there is not one stretch for each joint and frame");
  for (std::size_t j = 0; j < joints; ++j) {
    const auto most = static_cast<std::int64_t>(j) - 1;
    require_payload(parents[j] >= (j == 0 ? -1 : 0) && parents[j] <= most, "a joint comes before its parent");
  }
  return skeleton;
}

std::string trajectories_payload(const Trajectories& trajectories) {
  const auto& [tracks, notes] = trajectories;
  PayloadWriter writer;
  writer.value(std::uint64_t{tracks.size()});
  for (const auto& [seconds, places, headings] : tracks) {
    writer.array(seconds);
    writer.array(places);
    writer.array(headings);
  }
  writer.texts(notes);
  return writer.take();
}

Trajectories read_trajectories_payload(const std::string& bytes) {
  PayloadReader reader(bytes);
  Trajectories trajectories;
  auto& [tracks, notes] = trajectories;
  constexpr std::size_t kLeastTrackBytes = 3 * sizeof(std::uint64_t);
  tracks.resize(reader.count(kLeastTrackBytes));
  for (auto& [seconds, places, headings] : tracks) {
    seconds = reader.array<double>();
    places = reader.array<double>();
    headings = reader.array<double>();
    require_payload(seconds.size() >= 2 && places.size() == 2 * seconds.size() && headings.size() == seconds.size(),
                    "the arrays of samples differ in size");
  }
  notes = printable_texts(reader);
  reader.finish();
  return trajectories;
}

}  // namespace cab::scenes
