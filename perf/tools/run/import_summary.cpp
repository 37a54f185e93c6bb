// What the reading of files altered.
#include "perf/tools/run/import_summary.h"

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "scenes/import/printable.h"

namespace cab::perf {
namespace {

using Json = nlohmann::ordered_json;
using scenes::Alteration;
using scenes::AlterationKind;

struct KindName {
  AlterationKind kind;
  const char* name;
};
// By weight: what is guessed may be wrong, what is merged changes least.
constexpr std::array<KindName, 4> kKinds = {{{AlterationKind::kGuessed, "guessed"},
                                             {AlterationKind::kDropped, "dropped"},
                                             {AlterationKind::kResampled, "resampled"},
                                             {AlterationKind::kMerged, "merged"}}};
constexpr const char* kWarning = ": warning: ";  // between a character's name and a note that is one

// A note that is a warning, without that word at its place.
std::string without_warning(const std::string& note, std::size_t at) {
  constexpr std::size_t kWordSize = std::string_view(": warning").size();
  return note.substr(0, at) + note.substr(at + kWordSize);
}

bool is_told(const scenes::ImportReport& report, const std::string& note) {
  // A guessed unit changes every length, and links may touch in frames that are cut off: those notes are printed too.
  const auto counts = [&](const Alteration& alteration) {
    return alteration.note == note && alteration.what != scenes::kGuessedUnits && alteration.what != scenes::kCutFrames;
  };
  const auto doubts = [&](const std::string& doubt) {
    // A doubt is a note too, behind the character's name, which may be any text.
    for (std::size_t at = note.find(kWarning); at != std::string::npos; at = note.find(kWarning, at + 1))
      if (doubt == without_warning(note, at)) return true;
    return false;
  };
  return std::any_of(report.alterations.begin(), report.alterations.end(), counts) ||
         std::any_of(report.size_doubts.begin(), report.size_doubts.end(), doubts);
}

}  // namespace

Json import_json(const scenes::ImportReport& report, const MaskedPairs& pairs) {
  Json json = Json::object();
  for (const KindName& row : kKinds) {
    for (const Alteration& alteration : report.alterations) {
      if (alteration.kind != row.kind) continue;
      Json& count = json[row.name][alteration.what];
      count = (count.is_null() ? 0 : count.get<std::uint64_t>()) + alteration.count;
    }
  }
  if (pairs.all > 0) json["masked"] = {{"pairs of links", pairs.masked}};
  return json;
}

void print_notes(const scenes::Scene& scene, const scenes::ImportReport& report, bool quiet, std::ostream& out) {
  for (const std::string& doubt : report.size_doubts) out << "warning: " << scenes::printable(doubt) << '\n';
  std::vector<std::string> counted, others;
  for (const std::string& note : scene.notes) {
    if (is_told(report, note)) continue;
    const auto warns = [&](const scenes::Character& character) {
      return note.rfind(character.name + kWarning, 0) == 0;
    };
    const auto character = std::find_if(scene.characters.begin(), scene.characters.end(), warns);
    const auto is_of = [&](const Alteration& alteration) { return alteration.note == note; };
    if (character != scene.characters.end())
      out << "warning: " << scenes::printable(without_warning(note, character->name.size())) << '\n';
    else if (std::any_of(report.alterations.begin(), report.alterations.end(), is_of))
      counted.push_back(note);
    else
      others.push_back(note);
  }
  if (quiet) return;
  for (const std::vector<std::string>* const notes : {&counted, &others})
    for (const std::string& note : *notes) out << "note: " << scenes::printable(note) << '\n';
}

std::vector<std::string> alteration_lines(const scenes::ImportReport& report) {
  std::vector<std::string> lines;
  const Json json = import_json(report, {});
  for (const auto& [kind, counts] : json.items()) {
    std::string line = kind + ":";
    for (const auto& [what, count] : counts.items())
      line += (line.back() == ':' ? " " : ", ") + std::to_string(count.get<std::uint64_t>()) + " " + what;
    lines.push_back(std::move(line));
  }
  return lines;
}

void print_import(const scenes::Scene& scene, const scenes::ImportReport& report, bool quiet, std::ostream& out) {
  print_notes(scene, report, quiet, out);
  if (quiet) return;
  for (const std::string& line : alteration_lines(report)) out << "note: " << line << '\n';
}

void print_size_doubts(const scenes::ImportReport& report, std::ostream& out) {
  if (report.size_doubts.empty()) return;
  const std::size_t more = report.size_doubts.size() - 1;
  out << "warning: the hits say little, since a size is in doubt: " << scenes::printable(report.size_doubts.front());
  if (more > 0) out << " (and " << more << " more)";
  if (report.size_doubts.front().find("--units ") != std::string::npos) out << "; --units auto takes that unit";
  out << '\n';
}

}  // namespace cab::perf
