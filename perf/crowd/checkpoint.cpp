#include "perf/crowd/checkpoint.h"

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <stdexcept>

#include "perf/base/report.h"
#include "perf/crowd/hit_file.h"

namespace cab::perf {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kFormat = "cab crowd --mpi 1";

}  // namespace

std::optional<Checkpoint> read_checkpoint(const std::string& path) {
  if (!std::filesystem::exists(path)) return std::nullopt;
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  text << file.rdbuf();
  if (!file) throw std::runtime_error("cannot read " + path + ": " + std::strerror(errno));
  try {
    const Json json = Json::parse(text.str());
    if (json.at("format") != kFormat) throw std::runtime_error("another format");
    Checkpoint out;
    json.at("program").get_to(out.program);
    json.at("frames").get_to(out.frames);
    for (const Json& rank : json.at("ranks")) {
      RankTotals& totals = out.ranks.emplace_back();
      rank.at("file_bytes").get_to(totals.file_bytes);
      rank.at("hits").get_to(totals.hits);
      rank.at("hits_sum").get_to(totals.hits_sum);
      rank.at("messages").get_to(totals.messages);
      rank.at("bytes").get_to(totals.bytes);
      rank.at("bounds_sent").get_to(totals.bounds_sent);
      rank.at("poses_sent").get_to(totals.poses_sent);
    }
    return out;
  } catch (const std::exception& error) {
    throw std::runtime_error(path + " is no checkpoint of this version: " + error.what());
  }
}

void write_checkpoint(const std::string& path, const Checkpoint& checkpoint) {
  Json json;
  json["format"] = kFormat;
  json["program"] = checkpoint.program;
  json["frames"] = checkpoint.frames;
  json["ranks"] = Json::array();
  for (const RankTotals& totals : checkpoint.ranks)
    json["ranks"].push_back({{"file_bytes", totals.file_bytes},
                             {"hits", totals.hits},
                             {"hits_sum", totals.hits_sum},
                             {"messages", totals.messages},
                             {"bytes", totals.bytes},
                             {"bounds_sent", totals.bounds_sent},
                             {"poses_sent", totals.poses_sent}});
  replace_file(path, to_text(json));
}

}  // namespace cab::perf
