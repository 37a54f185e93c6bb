// explain_job, explain_mask, stats_line: each fault of a job by its member, index and value, beside the frame's status.
#include "perf/harness/random_world.h"
#include "tests/rounds.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <functional>
#include <limits>
#include <string>

namespace cab::tests {
namespace {

using namespace cab::oracle;

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

template <class Call>
std::string text_of(Call&& call) {
  std::string text(call(Span<char>{}), '\0');
  std::vector<char> room(text.size() + 1);
  REQUIRE(call(Span<char>(room)) == text.size());
  return room.data();
}

std::string explained(Engine& engine, const FrameJob& job) {
  return text_of([&](Span<char> text) { return explain_job(engine, job, text); });
}

// Batches 1 and 2 are characters of three links, 3 and 4 sequences, 5 static bodies, 6 a level of nodes of batch 1's
// articulation.
struct Setting {
  Rig rig;
  EnginePtr engine = make_engine();
  Poses poses;
  std::vector<double> origins = std::vector<double>(12, 0.0);
  std::vector<float> floats = std::vector<float>(24, 0.0f);
  std::vector<std::uint32_t> words = {0, 1, 2, 3};
  std::vector<BatchInput> inputs;
  std::vector<PairRule> rules = {{{1}, {2}, Pairing::kBetween}, {{1}, {1}, Pairing::kWithin}};
  std::vector<Hit> hits = std::vector<Hit>(4);
  std::vector<Contact> contacts = std::vector<Contact>(4);
  FrameJob job;

  Setting() {
    Random random(3);
    for (std::uint32_t link = 0; link < 3; ++link) {
      rig.parents.push_back(static_cast<std::int32_t>(link) - 1);
      rig.parent_offset.push_back({{0.3, 0, 0}});
      rig.leaves.push_back({link, random_box(random, {}, 0.1, 0.2), {}});
    }
    const ArticulationId id = add_rig(*engine, rig);
    add_instances(*engine, id, 4);
    add_instances(*engine, id, 4);
    add_instances(*engine, id, 4, BatchKind::kSequence);
    add_instances(*engine, id, 3, BatchKind::kSequence);
    StaticBody body;
    body.box = rig.leaves[0].box;
    StaticDesc statics;
    statics.bodies = {&body, 1};
    BatchId unused;
    REQUIRE(add_static_batch(*engine, statics, &unused) == Status::kOk);
    LodDesc level;
    level.of = id;
    level.kind = LodKind::kNodes;
    ArticulationId coarse;
    REQUIRE(add_lod(*engine, level, &coarse) == Status::kOk);
    add_instances(*engine, coarse, 4);
    poses = random_poses(random, rig, 4, PoseFormat::kQuaternionTranslation, {1, false, false, {}});
    for (const std::uint32_t batch : {1u, 2u}) inputs.push_back(input(batch));
    for (float& value : floats) value = 0.5f;
    job.hits = hits;
  }
  BatchInput input(std::uint32_t batch) const {
    BatchInput out = poses.input({batch});
    return out;
  }
};

struct Fault {
  const char* what;
  std::function<void(Setting&)> plant;
  const char* words;  // how the explanation begins
};

const Fault kFaults[] = {
    {"no data",
     [](Setting& s) {
       s.job.inputs = {nullptr, 3};
     },
     "inputs has 3 entries and no data"},
    {"id 0", [](Setting& s) { s.inputs[1].batch = {}; }, "inputs[1].batch is 0, the id of nothing: "},
    {"far slot", [](Setting& s) { s.inputs[0].batch = {77}; }, "inputs[0].batch names slot 77 of 6: "},
    {"removed", [](Setting& s) { REQUIRE(remove_batch(*s.engine, s.inputs[1].batch) == Status::kOk); },
     "inputs[1].batch names slot 2, which is empty: "},
    {"other engine", [](Setting& s) { s.inputs[0].batch.value = 1 | std::uint64_t{0xfffe} << 48; },
     "inputs[0].batch names what was in slot 1 before, or is of another engine: "},
    {"twice", [](Setting& s) { s.inputs[1].batch = {1}; }, "inputs[1].batch is that of inputs[0] too: "},
    {"static", [](Setting& s) { s.inputs[1].batch = {5}; },
     "inputs[1] is of static bodies and has more than a batch and layers: "},
    {"no poses", [](Setting& s) { s.inputs[0].poses.data = nullptr; }, "inputs[0].poses.data is null: "},
    {"format", [](Setting& s) { s.inputs[0].poses.format = static_cast<PoseFormat>(9); },
     "inputs[0].poses.format is 9: "},
    {"scale", [](Setting& s) { s.inputs[0].poses.has_scale = true; }, "inputs[0].poses.has_scale is set with"},
    {"stride", [](Setting& s) { s.inputs[0].poses.link_stride = 24; },
     "inputs[0].poses.link_stride is 24, for poses of 28 bytes: "},
    {"instance stride", [](Setting& s) { s.inputs[0].poses.instance_stride = 32; },
     "inputs[0].poses.instance_stride is 32, for 3 links of 28 bytes: "},
    {"count", [](Setting& s) { s.inputs[1].count = 5; }, "inputs[1].count is 5 of 4: "},
    {"instances far", [](Setting& s) { s.words[3] = 9, s.inputs[0].instances = s.words; },
     "inputs[0].instances[3] is 9, of 4 instances: "},
    {"instances order", [](Setting& s) { s.words[2] = 1, s.inputs[0].instances = s.words; },
     "inputs[0].instances[2] is 1, after 1: "},
    {"origins short",
     [](Setting& s) {
       s.inputs[0].origins = {s.origins.data(), 11};
     },
     "inputs[0].origins has 11 values for 4 instances of a batch of 4: "},
    {"origin nan",
     [](Setting& s) { s.origins[7] = std::numeric_limits<double>::infinity(), s.inputs[1].origins = s.origins; },
     "inputs[1].origins[7] is inf: "},
    {"orientations",
     [](Setting& s) {
       s.inputs[0].orientations = {nullptr, 16};
     },
     "inputs[0].orientations has 16 values and no data: "},
    {"scales",
     [](Setting& s) {
       s.inputs[0].scales = {s.floats.data(), 3};
     },
     "inputs[0].scales has 3 values for 4"},
    {"layers",
     [](Setting& s) {
       s.inputs[0].layers = {s.words.data(), 2};
     },
     "inputs[0].layers has 2 values for 4"},
    {"masks",
     [](Setting& s) {
       s.inputs[0].layer_masks = {s.words.data(), 2};
     },
     "inputs[0].layer_masks has 2 values for 4"},
    {"margins",
     [](Setting& s) {
       s.floats[2] = -1, s.inputs[0].margins = {s.floats.data(), 4};
     },
     "inputs[0].margins[2] is -1: "},
    {"bounds",
     [](Setting& s) {
       s.floats[9] = .25f, s.inputs[0].bounds = {s.floats.data(), 24};
     },
     "inputs[0].bounds[9] is 0.25: "},
    {"bounds nan",
     [](Setting& s) {
       s.floats[6] = kNan, s.inputs[0].bounds = {s.floats.data(), 24};
     },
     "inputs[0].bounds[6] is nan: "},
    {"rules",
     [](Setting& s) {
       s.job.rules = {nullptr, 2};
     },
     "rules has 2 entries and no data: "},
    {"rule without input", [](Setting& s) { s.rules[1].b = {3}; }, "rules[1].b is of no input: "},
    {"rule of two within", [](Setting& s) { s.rules[1].b = {2}; }, "rules[1] pairs two batches within: "},
    {"pairing", [](Setting& s) { s.rules[0].pairing = static_cast<Pairing>(7); }, "rules[0].pairing is 7: "},
    {"resting", [](Setting& s) { s.rules[0].resting = static_cast<Resting>(7); }, "rules[0].resting is 7: "},
    {"kinds", [](Setting& s) { s.inputs[1].batch = {3}, s.rules[0].b = {3}; },
     "rules[0] pairs characters with a sequence: "},
    {"rule twice",
     [](Setting& s) {
       s.rules[1] = {{2}, {1}};
     },
     "rules[0] and rules[1] pair the same: "},
    {"policy", [](Setting& s) { s.job.policies.strategy = static_cast<Strategy>(99); }, "policies.strategy is 99: "},
    {"report", [](Setting& s) { s.job.report = static_cast<Report>(3); }, "report is 3: "},
    {"margin", [](Setting& s) { s.job.margin = kNan; }, "margin is nan: "},
    {"min_depth", [](Setting& s) { s.job.min_depth = -2; }, "min_depth is -2: "},
    {"hits",
     [](Setting& s) {
       s.job.hits = {nullptr, 5};
     },
     "hits has room for 5 and no data, contacts for 0 and no"},
    {"contacts", [](Setting& s) { s.job.contacts = s.contacts; }, "policies.exact is none: "},
    {"level",
     [](Setting& s) {
       s.inputs[1].batch = {6}, s.rules[0].b = {6};
       s.job.policies.exact = Exact::kConvex;
     },
     "inputs[1] is of a level of nodes: "},
};

}  // namespace

TEST_CASE("what is wrong with a job is explained by member, index and value, and in the words of the status") {
  for (const Fault& fault : kFaults) {
    CAPTURE(fault.what);
    Setting setting;
    setting.job.inputs = setting.inputs;
    setting.job.rules = setting.rules;
    fault.plant(setting);
    const std::string text = explained(*setting.engine, setting.job);
    CHECK_MESSAGE(text.rfind(fault.words, 0) == 0, text);
    CHECK(text.find('\n') == std::string::npos);
    const Status status = run_frame(*setting.engine, setting.job);
    CHECK(status != Status::kOk);
    CHECK(status != Status::kHitsOverflow);
    if (fault.words[std::string(fault.words).size() - 2] == ':')
      CHECK(text == fault.words + std::string(to_string(status)));
  }
}

TEST_CASE("a job that a frame would take is explained by what may not be meant") {
  Setting setting;
  CHECK(explained(*setting.engine, setting.job) ==
        "inputs is empty: no batch takes part\nrules is empty: nothing is tested against anything");
  setting.job.inputs = setting.inputs;
  setting.job.rules = setting.rules;
  CHECK(explained(*setting.engine, setting.job) == "nothing is wrong");
  setting.job.margin = 100;  // then all are near each other
  REQUIRE(run_frame(*setting.engine, setting.job) == Status::kHitsOverflow);
  REQUIRE(setting.job.hits_needed > 4);
  CHECK(explained(*setting.engine, setting.job) == "hits has room for 4 of the " +
                                                       std::to_string(setting.job.hits_needed) +
                                                       " hits of its last frame: " + to_string(Status::kHitsOverflow));
  setting.hits.resize(setting.job.hits_needed);
  setting.job.hits = setting.hits;
  CHECK(explained(*setting.engine, setting.job) == "nothing is wrong");
  setting.job.rules.size = 0;
  CHECK(explained(*setting.engine, setting.job) == "rules is empty: nothing is tested against anything");
  setting.rules[0] = {{1}, {1}};
  setting.job.rules = setting.rules;
  CHECK(explained(*setting.engine, setting.job) == "inputs[1] is in no rule: its instances are in no pair");
  setting.rules[0] = {{1}, {6}};
  setting.inputs[1].batch = {6};
  CHECK(explained(*setting.engine, setting.job) ==
        "inputs[1] is of a level of an articulation of 3 boxes: with so few boxes no level saves time");
  setting.inputs[1].batch = {2};
  setting.rules[0] = {{1}, {2}};
  for (int k = 0; k < 4; ++k) setting.poses.pose(2, 1)[k] = 0;
  setting.poses.pose(3, 2)[5] = kNan;
  CHECK(explained(*setting.engine, setting.job) ==
        "inputs[0]: 2 of 4 instances are masked, the first is 2: the quaternion of link 1 has the length 0, below 0.001"
        "\ninputs[1]: 2 of 4 instances are masked, the first is 2: the quaternion of link 1 has the length 0, below "
        "0.001");
}

TEST_CASE("each cause of a mask has words of its own") {
  std::vector<std::string> texts;
  for (std::uint8_t cause = 0; cause <= static_cast<std::uint8_t>(MaskCause::kBox); ++cause) {
    const MaskReason reason = {kInstanceNotRigid, static_cast<MaskCause>(cause), 3, 5, 2.5f, 1.5f};
    texts.push_back(text_of([&](Span<char> text) { return explain_mask(reason, text); }));
    for (std::size_t i = 0; i + 1 < texts.size(); ++i) CHECK(texts[i] != texts.back());
    if (cause) CHECK(texts.back().find("2.5") != std::string::npos);
  }
  CHECK(texts[1] == "number 5 of the pose of link 3 is 2.5, not finite or above 1.5");
  CHECK(texts[8] == "the box of leaf 5 on link 3 reaches 2.5, above 1.5");
}

TEST_CASE("texts are cut where the buffer ends, and a 0 follows") {
  const Setting setting;
  char room[8] = {'x', 'x', 'x', 'x', 'x', 'x', 'x', 'x'};
  const std::size_t length = explain_job(*setting.engine, setting.job, {room, 5});
  CHECK(std::string(room) == "inpu");
  CHECK(room[5] == 'x');
  CHECK(length > 60);
  const std::string whole = explained(*setting.engine, setting.job);
  CHECK(whole.size() == length);
  for (const std::size_t size : {std::size_t{0}, std::size_t{1}, length - 1, length, length + 1}) {
    CAPTURE(size);
    std::vector<char> text(length + 8, 'x');
    CHECK(explain_job(*setting.engine, setting.job, {text.data(), size}) == length);
    if (size) CHECK(text.data() == whole.substr(0, size - 1));
    CHECK(std::count(text.begin() + static_cast<std::ptrdiff_t>(size), text.end(), 'x') ==
          static_cast<std::ptrdiff_t>(text.size() - size));
  }
  CHECK(explain_job(*setting.engine, setting.job, {nullptr, 100}) == length);
  FrameStats stats;
  stats.seconds_total = 0.0025;
  stats.candidates = 12345;
  CHECK(text_of([&](Span<char> text) {
          return stats_line(stats, text);
        }).rfind("2.500 ms (update 0.000, broad 0.000, test 0.000, query 0.000): 12345 candidates, ", 0) == 0);
}

TEST_CASE("explaining a job leaves its outputs and the next frame as they are") {
  std::size_t hits = 0;
  for (std::uint64_t seed = 1; seed <= rounds(40); ++seed) {
    CAPTURE(seed);
    Random random(seed + 7);
    World world;
    add_characters(random, world, 12);
    const EnginePtr engine = make_engine_for(world);
    const Outcome expected = run_on(*engine, world, {});
    const auto explained_first = [](Engine& of, FrameJob& job) noexcept {
      explain_job(of, job, {});
      return run_frame(of, job);
    };
    const Outcome found = run_on(*engine, world, {}, explained_first);
    CHECK(same_hits(found.hits, expected.hits));
    CHECK(found.flags == expected.flags);
    hits += found.hits.size();
  }
  CHECK(hits > 0);
}

}  // namespace cab::tests
