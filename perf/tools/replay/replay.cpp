// `cab replay`: runs the frames of a recording again, and compares what comes out bit by bit.
#include <cab/cab.h>
#include <cab/replay.h>

#include <cstring>
#include <iostream>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>
#include <vector>

#include "layout/bit_hash.h"
#include "perf/base/option_values.h"
#include "perf/base/report.h"
#include "perf/base/usage.h"
#include "perf/tools/replay/hit_names.h"
#include "perf/tools/replay/options.h"

namespace cab::perf {
namespace {

using Json = nlohmann::ordered_json;

// How the frames of a recording came out with one engine.
struct ReplayResult {
  Isa isa = Isa::kAuto;
  std::uint64_t frames = 0, unread_frames = 0, hits = 0, different_frames = 0;
  cab::BitHash hash;             // of the hashes of all frames
  std::string first_difference;  // in words; empty if there is none
  double seconds = 0;            // of run_frame
};

template <class T>
bool same_bits(const T& a, const T& b) {
  return std::memcmp(&a, &b, sizeof a) == 0;
}

std::string words_of(const record::Recording& recording, const record::RecordedFrame& frame, const Hit& hit,
                     const Contact* contact) {
  const auto side = [&](BatchSlot slot, std::uint32_t instance, std::uint32_t link, std::uint32_t leaf) {
    const std::uint32_t batch = batch_of(recording, frame, slot);
    return instance_name(recording, batch, instance) + " " + link_name(recording, batch, link) + " (leaf " +
           std::to_string(leaf) + ")";
  };
  std::string words = side(hit.batch_a, hit.instance_a, hit.link_a, hit.leaf_a) + " and " +
                      side(hit.batch_b, hit.instance_b, hit.link_b, hit.leaf_b);
  if (contact != nullptr) words += ", depth " + shortest(contact->depth);
  return words;
}

// The first hit of a frame that is not the recorded one, in words.
std::string first_difference(const record::Recording& recording, const record::RecordedFrame& frame,
                             std::uint32_t index, Span<const Hit> hits, Span<const Contact> contacts) {
  const auto contact_of = [](Span<const Contact> list, std::size_t h) { return h < list.size ? &list[h] : nullptr; };
  std::size_t h = 0;
  const auto same = [&] {
    const Contact *const then = contact_of(frame.contacts, h), *const now = contact_of(contacts, h);
    return same_bits(frame.hits[h], hits[h]) && (then == nullptr) == (now == nullptr) &&
           (then == nullptr || same_bits(*then, *now));
  };
  while (h < frame.hits.size && h < hits.size && same()) ++h;
  const auto side = [&](Span<const Hit> list, Span<const Contact> of) {
    return h < list.size ? words_of(recording, frame, list[h], contact_of(of, h)) : std::string("nothing");
  };
  return "frame " + std::to_string(index) + ", hit " + std::to_string(h) + " of " + std::to_string(frame.hits.size) +
         " recorded and " + std::to_string(hits.size) + " now: recorded is " + side(frame.hits, frame.contacts) +
         "; now it is " + side(hits, contacts);
}

ReplayResult replay(record::Recording& recording, const ReplayOptions& options, Isa isa) {
  ReplayResult result;
  record::Player player;
  if (!player.open(recording, {.isa = isa, .thread_count = options.thread_count}))
    throw std::runtime_error(options.file + ": " + player.error());
  result.isa = engine_isa(*player.engine());
  ProgressBar bar(to_string(result.isa), recording.frame_count());
  record::RecordedFrame frame;
  for (std::uint32_t f = 0, next = 0; f < recording.frame_count(); bar.advance(next - f), f = next) {
    const bool is_read = recording.read_frame(f, &frame);
    next = recording.next_frame(f);
    if (!is_read) {
      if (result.unread_frames == 0) tell("warning", recording.error());
      result.unread_frames += next - f;
      continue;
    }
    Policies policies = frame.job.policies;
    for (std::uint32_t field = 0; field < policy_table().size; ++field)
      if ((options.changed_policies >> field & 1) != 0) {
        const PolicyField& row = policy_table()[field];
        policy_set(policies, field, row.values[policy_get(options.policies, field)].name);
      }
    if (!player.run(frame, &policies))
      throw std::runtime_error(options.file + ": frame " + std::to_string(f) + ": " + player.error());
    const std::uint64_t hash = record::hash_hits(player.hits(), player.contacts());
    result.hash.add(hash);
    ++result.frames;
    result.hits += player.hits().size;
    result.seconds += player.stats().seconds_total;
    if (hash == frame.hash && hash == record::hash_hits(frame.hits, frame.contacts)) continue;
    if (result.different_frames++ == 0)
      result.first_difference = first_difference(recording, frame, f, player.hits(), player.contacts());
  }
  return result;
}

void print(const record::Recording& recording, const ReplayOptions& options, const std::vector<ReplayResult>& results) {
  const record::RecordingInfo info = recording.info();
  TextTable about;
  about.add_row({"recording", options.file});
  if (*info.title != 0) about.add_row({"title", info.title});
  about.add_row({"recorded by", std::string("cab ") + info.library});
  if (*info.isa != 0)
    about.add_row({"recorded with", std::string(info.isa) + ", " + std::to_string(info.thread_count) + " threads"});
  about.add_row({"frames", std::to_string(recording.frame_count())});
  about.print(std::cout);
  std::cout << '\n';
  TextTable table;
  table.add_row({"ISA", "frames", "hits", "ms", "hash", "same bits"});
  for (const ReplayResult& result : results)
    table.add_row({to_string(result.isa), std::to_string(result.frames), std::to_string(result.hits),
                   fixed(1e3 * result.seconds, 2), hex(result.hash.value()),
                   result.frames == 0             ? "-"
                   : result.different_frames == 0 ? "yes"
                                                  : "no, in " + std::to_string(result.different_frames)});
  table.print(std::cout);
  for (const ReplayResult& result : results)
    if (!result.first_difference.empty())
      std::cout << "\nthe first difference with " << to_string(result.isa) << ": " << result.first_difference << '\n';
}

Json to_json(const record::Recording& recording, const ReplayOptions& options,
             const std::vector<ReplayResult>& results) {
  Json json = {{"cab_version", CAB_VERSION_STRING},
               {"recording", options.file},
               {"frame_count", recording.frame_count()},
               {"results", Json::array()}};
  json["problems"] = Json::array();
  for (const char* const problem : recording.problems()) json["problems"].push_back(problem);
  for (const ReplayResult& result : results) {
    Json entry = {{"isa", to_string(result.isa)},
                  {"frames", result.frames},
                  {"unread_frames", result.unread_frames},
                  {"hits", result.hits},
                  {"run_frame_seconds", result.seconds},
                  {"hash", hex(result.hash.value())},
                  {"different_frames", result.different_frames}};
    if (!result.first_difference.empty()) entry["first_difference"] = result.first_difference;
    json["results"].push_back(std::move(entry));
  }
  return json;
}

}  // namespace

int replay_command(const ReplayOptions& options) {
  check_outputs({{"--json", options.json_path}}, {options.file});
  OutputFile json(options.json_path);
  record::Recording recording;
  if (!recording.open(options.file.c_str())) throw std::runtime_error(recording.error());
  for (const char* const problem : recording.problems()) tell("warning", options.file + ": " + problem);
  std::vector<Isa> isas = options.isas;
  if (isas.empty()) isas.push_back(Isa::kAuto);
  std::vector<ReplayResult> results;
  for (const Isa isa : isas) results.push_back(replay(recording, options, isa));
  print(recording, options, results);
  write_json(json, to_json(recording, options, results));
  bool all_same = recording.problems().empty();
  for (const ReplayResult& result : results)
    all_same = all_same && result.different_frames == 0 && result.unread_frames == 0;
  return all_same ? 0 : 1;
}

}  // namespace cab::perf
