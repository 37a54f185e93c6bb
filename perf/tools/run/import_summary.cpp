// What the reading of files altered.
#include "perf/tools/run/import_summary.h"

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <string>

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
constexpr std::array<KindName, 4> kKinds = {{{AlterationKind::kDropped, "dropped"},
                                             {AlterationKind::kMerged, "merged"},
                                             {AlterationKind::kResampled, "resampled"},
                                             {AlterationKind::kGuessed, "guessed"}}};
constexpr const char* kMasked = "masked";

bool is_told(const scenes::ImportReport& report, const std::string& note) {
  // A guessed unit changes every length, so its note is printed too.
  const auto counts = [&](const Alteration& alteration) {
    return alteration.note == note && alteration.what != scenes::kGuessedUnits;
  };
  const auto doubts = [&](const std::string& doubt) {
    // A doubt is a note too, behind the character's name, which may be any text, and the word warning.
    const std::string warning = ": warning";
    for (std::size_t at = note.find(warning); at != std::string::npos; at = note.find(warning, at + 1))
      if (doubt == note.substr(0, at) + note.substr(at + warning.size())) return true;
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
  if (pairs.all > 0) json[kMasked] = {{"pairs of links", pairs.masked}};
  return json;
}

void print_import(const scenes::Scene& scene, const scenes::ImportReport& report, const MaskedPairs& pairs,
                  std::ostream& out) {
  for (const std::string& doubt : report.size_doubts) out << "warning: " << scenes::printable(doubt) << '\n';
  for (const std::string& note : scene.notes)
    if (!is_told(report, note)) out << "note: " << scenes::printable(note) << '\n';
  const Json json = import_json(report, pairs);
  for (const auto& [kind, counts] : json.items()) {
    out << "note: " << kind << ": ";
    bool is_first = true;
    for (const auto& [what, count] : counts.items()) {
      out << (is_first ? "" : ", ") << count.get<std::uint64_t>() << ' ';
      if (kind == kMasked) out << "of " << pairs.all << ' ';
      out << what;
      is_first = false;
    }
    out << '\n';
  }
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
