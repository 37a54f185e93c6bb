// The C API: the same answers as the C++ API, its defaults, and what it refuses by itself.
#include "perf/harness/random_world.h"
#include "perf/judge/oracle/random_queries.h"
#include "tests/rounds.h"

#include <cab/cab_c.h>

#include <doctest/doctest.h>

#include <cstring>

namespace cab::tests {
namespace {

using namespace cab::oracle;

template <class Twin, class T>
Twin* as(T* value) {
  return reinterpret_cast<Twin*>(value);
}

// run_frame, by the C API.
Status run_frame_in_c(Engine& engine, FrameJob& job) noexcept {
  return static_cast<Status>(cab_run_frame(as<cab_Engine>(&engine), as<cab_FrameJob>(&job)));
}

}  // namespace

TEST_CASE("c api: frames of random worlds have the hits, contacts and counts that they have in C++") {
  std::size_t hits = 0;
  for (std::uint64_t seed = 1; seed <= rounds(40); ++seed) {
    CAPTURE(seed);
    Random random(seed);
    World world;
    add_characters(random, world);
    add_frames(random, world);
    world.contacts = random.chance(0.5);
    Policies policies;
    if (world.contacts) policies.exact = Exact::kConvex;
    const EnginePtr engine = make_engine_for(world);
    const Outcome expected = run_on(*engine, world, policies), found = run_on(*engine, world, policies, run_frame_in_c);
    CHECK(same_hits(expected.hits, found.hits));
    CHECK(same_counts(expected.stats, found.stats));
    CHECK(expected.flags == found.flags);
    CHECK(expected.in_contact == found.in_contact);
    REQUIRE(expected.contacts.size() == found.contacts.size());
    CHECK((expected.contacts.empty() || std::memcmp(expected.contacts.data(), found.contacts.data(),
                                                    expected.contacts.size() * sizeof(Contact)) == 0));
    hits += found.hits.size();
  }
  CHECK(hits >= least_count(1000, 40));
}

TEST_CASE("c api: an engine that C makes is one, and its ids and statuses are those of C++") {
  cab_EngineDesc desc = cab_default_engine_desc();
  desc.isa = CAB_ISA_SCALAR;
  cab_Engine* engine = nullptr;
  REQUIRE(cab_create_engine(CAB_ABI_VERSION, &desc, &engine) == CAB_STATUS_OK);
  CHECK(cab_engine_isa(engine) == CAB_ISA_SCALAR);
  CHECK(cab_engine_thread_count(engine) == 1);
  Random random(5);
  const Rig rig = any_rig(random, 5);
  const ArticulationDesc of = rig.desc();
  cab_ArticulationId articulation;
  REQUIRE(cab_add_articulation(engine, as<const cab_ArticulationDesc>(&of), &articulation, nullptr) == CAB_STATUS_OK);
  cab_ArticulationInfo info;
  REQUIRE(cab_articulation_info(engine, articulation, &info) == CAB_STATUS_OK);
  CHECK(info.link_count == rig.link_count());
  cab_BatchDesc batch = cab_default_batch_desc();
  batch.articulation = articulation;
  cab_BatchId id;
  CHECK(cab_add_batch(engine, &batch, &id) == CAB_STATUS_NO_INSTANCES);
  batch.instance_count = 3;
  REQUIRE(cab_add_batch(engine, &batch, &id) == CAB_STATUS_OK);
  CHECK(cab_slot_of(id).value == 1);
  CHECK(cab_remove_articulation(engine, articulation) == CAB_STATUS_ARTICULATION_IN_USE);
  CHECK(cab_remove_batch(engine, id) == CAB_STATUS_OK);
  CHECK(cab_remove_batch(engine, id) == CAB_STATUS_UNKNOWN_BATCH);
  CHECK(cab_remove_articulation(engine, articulation) == CAB_STATUS_OK);
  CHECK(std::strcmp(cab_status_to_string(CAB_STATUS_UNKNOWN_BATCH), to_string(Status::kUnknownBatch)) == 0);
  CHECK(std::strcmp(cab_isa_to_string(CAB_ISA_AVX2), "avx2") == 0);
  CHECK(std::strcmp(cab_version().text, CAB_VERSION_STRING) == 0);
  cab_destroy_engine(engine);
  cab_destroy_engine(nullptr);
}

TEST_CASE("c api: another ABI and null are refused, and outputs stay") {
  const cab_EngineDesc desc = cab_default_engine_desc();
  cab_Engine* engine = nullptr;
  for (const std::uint32_t abi : {0u, CAB_ABI_VERSION + 1}) {
    CHECK(cab_create_engine(abi, &desc, &engine) == CAB_STATUS_BAD_ABI_VERSION);
    CHECK(engine == nullptr);
  }
  CHECK(cab_create_engine(CAB_ABI_VERSION, nullptr, &engine) == CAB_STATUS_NULL_ARGUMENT);
  CHECK(cab_create_engine(CAB_ABI_VERSION, &desc, nullptr) == CAB_STATUS_BAD_OUTPUT);
  REQUIRE(cab_create_engine(CAB_ABI_VERSION, &desc, &engine) == CAB_STATUS_OK);
  cab_FrameJob job = cab_default_frame_job();
  CHECK(cab_run_frame(nullptr, &job) == CAB_STATUS_NULL_ARGUMENT);
  CHECK(cab_run_frame(engine, nullptr) == CAB_STATUS_NULL_ARGUMENT);
  CHECK(cab_run_queries(engine, nullptr) == CAB_STATUS_NULL_ARGUMENT);
  CHECK(cab_add_batch(engine, nullptr, nullptr) == CAB_STATUS_NULL_ARGUMENT);
  CHECK(cab_engine_thread_count(nullptr) == 0);
  CHECK(cab_policy_get(nullptr, 0) == 0);
  CHECK(!cab_policy_set(nullptr, 0, "cab"));
  CHECK(!cab_preset_set(nullptr, "tight"));
  cab_Policies policies = cab_default_policies();
  CHECK(cab_preset_set(&policies, "paper"));
  CHECK(cab_policy_table().size == policy_table().size);
  cab_destroy_engine(engine);
}

TEST_CASE("c api: defaults are those of the members in C++") {
  CHECK(cab_default_engine_desc().thread_count == EngineDesc().thread_count);
  CHECK(cab_default_engine_desc().isa == CAB_ISA_AUTO);
  CHECK(cab_default_engine_desc().allocator == nullptr);
  CHECK(cab_default_articulation_desc().link_parents.size == 0);
  CHECK(cab_default_convex_part().rotation[3] == 1);
  CHECK(cab_default_static_body().rotation[3] == 1);
  CHECK(cab_default_leaf().parts.data == nullptr);
  for (int k = 0; k < 3; ++k)
    for (int c = 0; c < 3; ++c) {
      CHECK(cab_default_box().axis[k][c] == (k == c));
      CHECK(cab_default_leaf().box.axis[k][c] == (k == c));
    }
  CHECK(cab_default_lod_desc().max_leaves == LodDesc().max_leaves);
  CHECK(cab_default_lod_desc().rest_pose_count == LodDesc().rest_pose_count);
  CHECK(cab_default_batch_desc().kind == CAB_BATCH_KIND_CHARACTERS);
  CHECK(cab_default_batch_input().count == CAB_ALL_INSTANCES);
  CHECK(cab_default_pair_rule().pairing == CAB_PAIRING_BETWEEN);
  CHECK(cab_default_pair_rule().resting == CAB_RESTING_REPORTED);
  const cab_Policies policies = cab_default_policies(), of_job = cab_default_frame_job().policies;
  for (std::uint32_t field = 0; field < policy_table().size; ++field) {
    CHECK(cab_policy_get(&policies, field) == policy_get(Policies(), field));
    CHECK(cab_policy_get(&of_job, field) == policy_get(Policies(), field));
  }
  CHECK(cab_default_frame_job().report == CAB_REPORT_HITS);
  const cab_Query query = cab_default_query();
  CHECK(query.want == CAB_QUERY_WANT_CLOSEST);
  CHECK(query.time == kNow);
  CHECK(query.max_hits == Query().max_hits);
  CHECK(query.layer_mask == Query().layer_mask);
  CHECK(query.orientation[3] == 1);
  CHECK(cab_default_query_job().exact == CAB_EXACT_NONE);
  CHECK(!cab_default_query_job().reuse_bounds);
}

}  // namespace cab::tests
