#include "perf/measure/crowd/checkpoint.h"

#include <filesystem>
#include <limits>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "layout/bit_hash.h"
#include "perf/base/report.h"
#include "perf/measure/crowd/hit_file.h"
#include "scenes/import/input_file.h"
#include "scenes/import/printable.h"

namespace cab::perf {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kFormat = "cab crowd --mpi 2";
constexpr std::size_t kMostReason = 160;  // of a parser's message, which may quote the file

// A number of all other fields, which tells a damaged file.
std::string check_of(Json json) {
  json.erase("check");
  cab::BitHash hash;
  for (const char c : to_text(json)) hash.add(std::uint32_t{static_cast<unsigned char>(c)});
  return hex(hash.value());
}

// nlohmann's own conversion would take -1 for 4294967295.
template <class Number>
void read_number(const Json& json, const char* key, Number& out) {
  const Json& value = json.at(key);
  if (!value.is_number_unsigned() || value.get<std::uint64_t>() > std::numeric_limits<Number>::max())
    throw std::runtime_error(std::string(key) + " is no number from 0 on");
  value.get_to(out);
}

void read_numbers(const Json& json, const char* key, std::array<std::uint64_t, 4>& out) {
  const Json& values = json.at(key);
  if (!values.is_array() || values.size() != out.size())
    throw std::runtime_error(std::string(key) + " is no list of " + std::to_string(out.size()) + " numbers");
  for (std::size_t i = 0; i < out.size(); ++i) {
    if (!values[i].is_number_unsigned()) throw std::runtime_error(std::string(key) + " has no numbers from 0 on");
    values[i].get_to(out[i]);
  }
}

}  // namespace

std::optional<Checkpoint> read_checkpoint(const std::string& path) {
  const std::string name = scenes::printable(path);
  if (!std::filesystem::exists(path)) return std::nullopt;
  const std::string text = scenes::read_bytes(path, name, scenes::check_file(path, name));
  try {
    const Json json = Json::parse(text);
    if (json.at("format") != kFormat)
      throw std::runtime_error("it has the format " + json.at("format").dump() + ", not \"" + kFormat + '"');
    Checkpoint out;
    json.at("program").get_to(out.program);
    read_number(json, "frames", out.frames);
    for (const Json& rank : json.at("ranks")) {
      RankTotals& totals = out.ranks.emplace_back();
      read_number(rank, "hits", totals.hits);
      read_number(rank, "hits_sum", totals.hits_sum);
      read_numbers(rank, "messages", totals.messages);
      read_numbers(rank, "bytes", totals.bytes);
      read_number(rank, "bounds_sent", totals.bounds_sent);
      read_number(rank, "poses_sent", totals.poses_sent);
    }
    if (json.at("check") != check_of(json)) throw std::runtime_error("damaged: its check does not fit its content");
    return out;
  } catch (const std::exception& error) {
    throw std::runtime_error(name + " is no checkpoint of this version: " +
                             scenes::printable(std::string(error.what()).substr(0, kMostReason)));
  }
}

void write_checkpoint(const std::string& path, const Checkpoint& checkpoint) {
  Json json;
  json["format"] = kFormat;
  json["program"] = checkpoint.program;
  json["frames"] = checkpoint.frames;
  json["ranks"] = Json::array();
  for (const RankTotals& totals : checkpoint.ranks)
    json["ranks"].push_back({{"hits", totals.hits},
                             {"hits_sum", totals.hits_sum},
                             {"messages", totals.messages},
                             {"bytes", totals.bytes},
                             {"bounds_sent", totals.bounds_sent},
                             {"poses_sent", totals.poses_sent}});
  json["check"] = check_of(json);
  replace_file(path, to_text(json));
}

}  // namespace cab::perf
