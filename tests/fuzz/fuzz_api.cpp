// Turns bytes into calls of the public API, right and wrong. A call answers by its status, a call that fails changes
// nothing, and lack of memory is a status too.
#include "perf/harness/world.h"
#include "tests/fuzz/bytes.h"

#include <list>

namespace {

using namespace cab;

// An allocator that has at most this many bytes allocated at a time.
struct Budget {
  std::size_t left;
  std::size_t used = 0;

  static void* take(void* user, std::size_t bytes, std::size_t alignment) {
    Budget& budget = *static_cast<Budget*>(user);
    if (bytes > budget.left) return nullptr;
    budget.left -= bytes;
    budget.used += bytes;
    return ::operator new (bytes, std::align_val_t{alignment});
  }
  static void give_back(void* user, void* memory, std::size_t bytes, std::size_t alignment) {
    Budget& budget = *static_cast<Budget*>(user);
    budget.left += bytes;
    budget.used -= bytes;
    ::operator delete (memory, std::align_val_t{alignment});
  }
};

// A scheduler that runs the last task first, by the last worker.
void run_backwards(void* user, std::uint32_t count, void (*task)(void*, std::uint32_t, std::uint32_t), void* context) {
  const std::uint32_t workers = *static_cast<const std::uint32_t*>(user);
  while (count-- > 0) task(context, count, workers - 1);
}

// Returns the span itself, without its last entry, or with a size and no data.
template <class T>
Span<T> spoiled(fuzz::Bytes& bytes, Span<T> span) {
  if (!bytes.rarely()) return span;
  if (bytes.below(2) == 0) return {nullptr, span.size};
  return {span.data, span.size - (span.size > 0 ? 1 : 0)};
}

// What the test knows of a batch of the engine.
struct Known {
  std::uint32_t links, nodes, instances;
  bool is_static = false;
};

// What the test knows of a history of the engine.
struct KnownHistory {
  HistoryId id;
  std::uint32_t batch, most;
  HistorySpan span;
};

struct Session {
  fuzz::Bytes bytes;
  Engine& engine;
  std::vector<ArticulationInfo> articulations;
  std::vector<Known> batches;
  std::vector<KnownHistory> histories = {};

  void add_shape(std::vector<ConvexPart>& parts, std::list<std::vector<float>>& vertices) {
    ConvexPart part;
    part.kind = static_cast<ShapeKind>(bytes.below(8));
    for (float& value : part.position) value = bytes.number() / 32;
    for (float& value : part.size) value = std::fabs(bytes.number()) / 32;
    if (bytes.rarely()) part.rotation[bytes.below(4)] = bytes.number();
    vertices.emplace_back(3 * bytes.below(9));
    for (float& value : vertices.back()) value = bytes.number() / 32;
    part.vertices = {vertices.back().data(), vertices.back().size()};
    parts.push_back(part);
  }

  // masked: with hops and a rest pose where the bytes say so.
  void add_rig(bool masked) {
    oracle::Rig rig = bytes.rig(4);
    std::list<std::vector<ConvexPart>> parts;
    std::list<std::vector<float>> vertices;
    for (Leaf& leaf : rig.leaves) {
      for (parts.emplace_back(); bytes.rarely();) add_shape(parts.back(), vertices);
      leaf.parts = spoiled(bytes, Span<const ConvexPart>{parts.back().data(), parts.back().size()});
      if (bytes.rarely()) leaf.link = bytes.raw<std::uint32_t>();
      if (bytes.rarely()) leaf.box.axis[bytes.below(3)][bytes.below(3)] = bytes.number();
      if (bytes.rarely()) leaf.box.half[bytes.below(3)] = bytes.number();
    }
    if (bytes.rarely()) rig.parents[bytes.below(rig.link_count())] = bytes.raw<std::int32_t>();
    if (bytes.rarely()) rig.ignored.push_back({bytes.raw<std::uint32_t>(), 0});
    ArticulationDesc desc = rig.desc();
    desc.link_parents = spoiled(bytes, desc.link_parents);
    desc.link_joints = spoiled(bytes, desc.link_joints);
    desc.leaves = spoiled(bytes, desc.leaves);
    desc.ignored_pairs = spoiled(bytes, desc.ignored_pairs);
    std::vector<float> rest(16 * rig.parents.size());
    if (masked) {
      desc.ignored_hops = bytes.rarely() ? bytes.raw<std::uint32_t>() : bytes.below(4);
      for (float& value : rest) value = bytes.number();
      desc.rest_pose.format = static_cast<PoseFormat>(bytes.below(4));
      if (bytes.rarely()) desc.rest_pose.link_stride = bytes.below(68);
      if (bytes.rarely()) desc.rest_pose.instance_stride = bytes.raw<std::uint64_t>();
      desc.rest_pose.data = bytes.below(2) ? rest.data() : nullptr;
    }
    ArticulationId id = {77};
    std::uint32_t bad_element = 0;
    if (add_articulation(engine, desc, &id, &bad_element) != Status::kOk) {
      FUZZ_CHECK(id.value == 77);
      return;
    }
    articulations.emplace_back();
    FUZZ_CHECK(static_cast<std::uint32_t>(id.value) == articulations.size());
    FUZZ_CHECK(articulation_info(engine, id, &articulations.back()) == Status::kOk);
    std::vector<MergeStep> steps(articulations.back().leaf_count - 1);
    FUZZ_CHECK(merge_steps(engine, id, spoiled(bytes, Span<MergeStep>(steps))) <= Status::kBadOutput);
    std::vector<IgnoredPair> pairs(articulations.back().ignored_pair_count);
    FUZZ_CHECK(ignored_pairs(engine, id, spoiled(bytes, Span<IgnoredPair>(pairs))) <= Status::kBadOutput);
  }

  void add_level_of_detail() {
    const std::uint32_t of = bytes.rarely() ? bytes.below(5) : 1 + bytes.below(3);
    const bool is_there = of > 0 && of <= articulations.size();
    const std::uint32_t links = is_there ? articulations[of - 1].link_count : 1;
    std::vector<float> rest(std::size_t{links} * 7 * 2);
    for (std::size_t i = 0; i < rest.size(); ++i) rest[i] = bytes.rarely() ? bytes.number() : i % 7 == 3 ? 1.0f : 0.0f;
    std::vector<std::uint32_t> all(links);
    for (std::uint32_t l = 0; l < links; ++l) all[l] = bytes.rarely() ? bytes.raw<std::uint32_t>() : l;
    std::vector<LodLeaf> leaves(bytes.rarely() ? bytes.below(3) : 0);
    for (LodLeaf& leaf : leaves) {
      leaf.link = bytes.below(links + 1);
      const float half = bytes.rarely() ? bytes.number() : 1e6f;
      leaf.box = {{0, 0, 0}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {half, half, half}};
      leaf.links = spoiled(bytes, Span<const std::uint32_t>(all));
    }
    LodDesc desc;
    desc.of = {of};
    desc.kind = static_cast<LodKind>(bytes.rarely() ? 2 : bytes.below(2));
    desc.max_leaves = bytes.rarely() ? bytes.raw<std::uint32_t>() : 1 + bytes.below(8);
    desc.leaves = spoiled(bytes, Span<const LodLeaf>(leaves));
    desc.rest_poses.data = rest.data();
    desc.rest_pose_count = bytes.below(3);
    if (bytes.rarely()) desc.joint_play = bytes.number();
    ArticulationId id = {77};
    std::uint32_t bad_leaf = 0;
    if (add_lod(engine, desc, &id, &bad_leaf) != Status::kOk) {
      FUZZ_CHECK(id.value == 77);
      return;
    }
    articulations.emplace_back();
    FUZZ_CHECK(static_cast<std::uint32_t>(id.value) == articulations.size());
    FUZZ_CHECK(articulation_info(engine, id, &articulations.back()) == Status::kOk);
    std::vector<std::uint16_t> leaf_of_link(links);
    FUZZ_CHECK(lod_leaves(engine, id, leaf_of_link) == Status::kOk);
    for (const std::uint16_t leaf : leaf_of_link) FUZZ_CHECK(leaf == kNoLeaf || leaf < articulations.back().leaf_count);
  }

  void add_instances() {
    const std::uint32_t articulation =
        bytes.rarely() ? bytes.below(5) : static_cast<std::uint32_t>(articulations.size());
    const std::uint32_t count = bytes.rarely() ? bytes.raw<std::uint32_t>() : 1 + bytes.below(20);
    const auto kind = static_cast<BatchKind>(bytes.rarely() ? 2 : bytes.below(2));
    BatchId id = {77};
    if (add_batch(engine, {{articulation}, count, kind}, &id) != Status::kOk) {
      FUZZ_CHECK(id.value == 77);
      return;
    }
    const ArticulationInfo& info = articulations.at(articulation - 1);
    note_batch(id, {info.link_count, info.node_count, count});
    FUZZ_CHECK(remove_articulation(engine, {articulation}) == Status::kArticulationInUse);
  }

  // A batch is in the first slot that is free.
  void note_batch(BatchId id, const Known& known) {
    const auto free = std::find_if(batches.begin(), batches.end(), [](const Known& k) { return k.instances == 0; });
    FUZZ_CHECK(slot_of(id).value == static_cast<std::size_t>(free - batches.begin()) + 1);
    if (free == batches.end()) batches.emplace_back();
    batches[slot_of(id).value - 1] = known;
  }

  void add_level() {
    std::vector<StaticBody> bodies(bytes.below(20));
    std::vector<float> mesh(3 * bytes.below(8));
    std::vector<std::uint32_t> triangles(3 * bytes.below(8));
    std::vector<ConvexPart> parts;
    std::list<std::vector<float>> vertices;
    while (bytes.rarely()) add_shape(parts, vertices);
    for (StaticBody& body : bodies) {
      body.box = {{0, 0, 0}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {1, 1, 1}};
      if (bytes.rarely()) body.box.half[bytes.below(3)] = bytes.number();
      if (bytes.rarely()) body.box.axis[bytes.below(3)][bytes.below(3)] = bytes.number();
      if (bytes.rarely()) body.rotation[bytes.below(4)] = bytes.number();
      for (double& at : body.origin) at = static_cast<double>(bytes.number());
      if (bytes.rarely()) body.parts = spoiled(bytes, Span<const ConvexPart>(parts));
    }
    for (float& value : mesh) value = bytes.number();
    const auto corners = static_cast<std::uint32_t>(mesh.size() / 3);
    for (std::uint32_t& corner : triangles)
      corner = bytes.rarely() ? bytes.raw<std::uint32_t>() : bytes.below(std::max(corners, 1u));
    StaticDesc desc;
    desc.bodies = spoiled(bytes, Span<const StaticBody>(bodies));
    desc.vertices = spoiled(bytes, Span<const float>(mesh));
    desc.triangles = spoiled(bytes, Span<const std::uint32_t>(triangles));
    if (bytes.rarely()) desc.origin[bytes.below(3)] = static_cast<double>(bytes.number());
    BatchId id = {77};
    const auto count = static_cast<std::uint32_t>(desc.bodies.size + desc.triangles.size / 3);
    std::uint32_t bad_element = count;
    const Status status = add_static_batch(engine, desc, &id, &bad_element);
    if (status == Status::kOk) return note_batch(id, {1, 1, count, true});
    FUZZ_CHECK(id.value == 77);
    FUZZ_CHECK(bad_element <= count);
  }

  void remove() {
    const std::uint32_t slot = bytes.below(6);
    const bool is_there = slot > 0 && slot <= batches.size() && batches[slot - 1].instances > 0;
    const BatchId id = {bytes.rarely() ? bytes.raw<std::uint64_t>() : slot};
    if (id.value != slot) return (void)spatial_order(engine, id, {});
    FUZZ_CHECK(remove_batch(engine, id) == (is_there ? Status::kOk : Status::kUnknownBatch));
    if (is_there) batches[slot - 1] = {1, 1, 0};
  }

  void make_room() {
    const Status status = reserve(engine, {bytes.below(8), bytes.below(200)});
    FUZZ_CHECK(status == Status::kOk || status == Status::kOutOfMemory);
    EngineMemory memory;
    FUZZ_CHECK(engine_memory(engine, &memory) == Status::kOk);
    FUZZ_CHECK(memory.articulations + memory.batches + memory.workers + memory.broad_phase + memory.hits <=
               memory.total);
  }

  // The memory that an input points to. It is exactly as large as the strides require.
  struct Arrays {
    std::vector<float> poses, orientations;
    std::vector<double> origins;
    std::vector<std::uint8_t> flags, in_contact, moved;
    std::vector<std::uint32_t> layers, instances;
    std::vector<float> scales, bounds, margins;
  };

  BatchInput make_input(std::uint32_t batch, Arrays& arrays) {
    const bool is_there = batch > 0 && batch <= batches.size() && batches[batch - 1].instances > 0;
    const Known known = is_there ? batches[batch - 1] : Known{1, 1, 1};
    BatchInput input;
    input.batch = {batch};
    if (known.is_static && !bytes.rarely()) {
      arrays.flags.assign(known.instances, 0xee);
      input.flags = spoiled(bytes, Span<std::uint8_t>(arrays.flags));
      if (bytes.rarely()) {
        for (std::size_t i = 0; i < known.instances; ++i) arrays.margins.push_back(std::fabs(bytes.number()));
        input.margins = spoiled(bytes, Span<const float>(arrays.margins));
      }
      if (bytes.rarely()) input.count = bytes.below(known.instances + 2);
      return input;
    }
    input.poses.format = static_cast<PoseFormat>(bytes.below(4));
    const std::size_t pose = input.poses.format == PoseFormat::kQuaternionTranslation ? 28
                             : input.poses.format == PoseFormat::kMatrix3x4Rows       ? 48
                                                                                      : 64;
    if (bytes.rarely())
      input.poses.link_stride = bytes.below(2) ? pose + 4 * bytes.below(4) : bytes.raw<std::uint64_t>();
    const std::size_t link_stride = input.poses.link_stride ? input.poses.link_stride : pose;
    const std::size_t span = (known.links - 1) * link_stride + pose;
    if (bytes.rarely()) input.poses.instance_stride = bytes.below(2) ? span + 4 * bytes.below(4) : bytes.below(256);
    const std::size_t instance_stride =
        input.poses.instance_stride ? input.poses.instance_stride : known.links * link_stride;
    const bool far_apart = link_stride > 1024 || instance_stride > 8192;
    // Larger strides stay as they are, and the input gets no data.
    if (!far_apart) arrays.poses.resize(((known.instances - 1) * instance_stride + span + 3) / 4);
    float pattern[16];
    for (float& value : pattern) value = bytes.number();
    for (std::size_t f = 0; f < arrays.poses.size(); ++f) arrays.poses[f] = pattern[(f + f / 7) % 16];
    input.poses.data = far_apart || bytes.rarely() ? nullptr : arrays.poses.data();
    for (std::size_t i = 0; i < known.instances; ++i) {
      for (int c = 0; c < 3; ++c) arrays.origins.push_back(static_cast<double>(pattern[(i + 5) % 16]));
      for (int c = 0; c < 4; ++c) arrays.orientations.push_back(pattern[(3 * i + static_cast<std::size_t>(c)) % 16]);
    }
    arrays.flags.assign(known.instances, 0xee);
    if (bytes.below(2)) input.origins = spoiled(bytes, Span<const double>(arrays.origins));
    if (bytes.below(2)) input.orientations = spoiled(bytes, Span<const float>(arrays.orientations));
    if (bytes.rarely()) {
      arrays.in_contact.assign(known.instances, 0xee);
      input.in_contact = spoiled(bytes, Span<std::uint8_t>(arrays.in_contact));
    }
    if (bytes.rarely()) {
      for (std::size_t i = 0; i < known.instances; ++i) arrays.layers.push_back(bytes.below(4));
      (bytes.below(2) ? input.layers : input.layer_masks) = spoiled(bytes, Span<const std::uint32_t>(arrays.layers));
    }
    input.poses.has_scale = bytes.rarely();
    if (bytes.rarely()) {
      for (std::size_t i = 0; i < known.instances; ++i) arrays.scales.push_back(std::fabs(bytes.number()));
      input.scales = spoiled(bytes, Span<const float>(arrays.scales));
    }
    if (bytes.rarely()) {
      for (std::size_t i = 0; i < 6 * std::size_t{known.instances}; ++i)
        arrays.bounds.push_back(i % 6 < 3 ? -std::fabs(pattern[i % 16]) : std::fabs(pattern[i % 16]));
      input.bounds = spoiled(bytes, Span<const float>(arrays.bounds));
    }
    if (bytes.rarely()) {
      for (std::size_t i = 0; i < known.instances; ++i)
        arrays.moved.push_back(static_cast<std::uint8_t>(bytes.below(2)));
      input.moved = spoiled(bytes, Span<const std::uint8_t>(arrays.moved));
    }
    if (bytes.rarely()) input.count = bytes.below(static_cast<std::uint32_t>(known.instances) + 2);
    if (bytes.rarely()) {
      for (std::uint32_t i = 0; i < known.instances; ++i)
        if (bytes.below(2)) arrays.instances.push_back(i);
      if (bytes.rarely()) arrays.instances.push_back(bytes.below(70));
      input.instances = spoiled(bytes, Span<const std::uint32_t>(arrays.instances));
    }
    input.flags = spoiled(bytes, Span<std::uint8_t>(arrays.flags));
    return input;
  }

  void add_past() {
    HistoryDesc desc;
    desc.batch = {bytes.below(6)};
    desc.ticks = bytes.rarely() ? bytes.raw<std::uint32_t>() | 0x80000000u : bytes.below(5);
    HistoryId id = {77};
    const Status status = add_history(engine, desc, &id);
    if (status != Status::kOk) {
      FUZZ_CHECK(id.value == 77);
      return;
    }
    FUZZ_CHECK(desc.ticks > 0 && batches[slot_of(desc.batch).value - 1].instances > 0);
    histories.push_back({id, slot_of(desc.batch).value, desc.ticks, {}});
  }

  void record(KnownHistory& history) {
    Arrays arrays;
    const BatchInput input = make_input(bytes.rarely() ? bytes.below(6) : history.batch, arrays);
    const double time = bytes.rarely() ? static_cast<double>(bytes.number()) : history.span.last + bytes.below(8) - 0.5;
    if (record_tick(engine, history.id, input, time) != Status::kOk) return;
    FUZZ_CHECK(history.span.ticks == 0 || time > history.span.last);
    history.span.ticks = std::min(history.span.ticks + 1, history.most);
    history.span.last = time;
    HistorySpan span;
    FUZZ_CHECK(history_span(engine, history.id, &span) == Status::kOk && span.first <= time);
    history.span.first = span.first;
  }

  void forget(std::size_t which) {
    const HistoryId id = histories[which].id;
    FUZZ_CHECK(remove_history(engine, id) == Status::kOk);
    FUZZ_CHECK(remove_history(engine, id) == Status::kUnknownHistory);
    histories.erase(histories.begin() + static_cast<std::ptrdiff_t>(which));
  }

  void ask_the_past() {
    if (reserve(engine, {0, 0, 8}) != Status::kOk) return;
    std::vector<HistoryId> asked;
    for (const KnownHistory& history : histories)
      if (!bytes.rarely()) asked.push_back(history.id);
    if (bytes.rarely()) asked.push_back({bytes.raw<std::uint64_t>()});
    std::vector<Query> queries(bytes.below(12));
    for (Query& query : queries) {
      query.kind = static_cast<QueryKind>(bytes.below(kQueryKindCount));
      query.want = static_cast<QueryWant>(bytes.below(kQueryWantCount));
      query.time = bytes.rarely() ? kNow : static_cast<double>(bytes.number());
      query.direction[bytes.below(3)] = 1;
      query.length = query.radius = query.half[2] = std::fabs(bytes.number());
      for (double& c : query.position) c = static_cast<double>(bytes.number());
    }
    std::vector<QueryHit> hits(64);
    QueryJob job;
    job.histories = asked;
    job.queries = queries;
    job.hits = hits;
    job.exact = bytes.rarely() ? Exact::kConvex : Exact::kNone;
    Status status = run_queries(engine, job);
    if (status == Status::kHitsOverflow) {
      FUZZ_CHECK(job.hit_count == 0 && job.hits_needed > hits.size());
      hits.resize(job.hits_needed);
      job.hits = hits;
      status = run_queries(engine, job);
      FUZZ_CHECK(status == Status::kOk && job.hit_count == hits.size());
    }
    if (status != Status::kOk) return;
    for (std::size_t i = 0; i < job.hit_count; ++i) {
      const std::uint32_t batch = hits[i].batch.value;
      FUZZ_CHECK(hits[i].query < queries.size() && (i == 0 || hits[i - 1].query <= hits[i].query));
      FUZZ_CHECK(batch > 0 && batch <= batches.size() && hits[i].instance < batches[batch - 1].instances);
    }
  }

  // One call about histories, and whether all of them are as they should be.
  void use_past() {
    const std::uint32_t call = bytes.below(5);
    if (call == 0 && histories.size() < 4) add_past();
    if (call < 3 && !histories.empty()) record(histories[bytes.below(4) % histories.size()]);
    if (call == 3 && !histories.empty() && bytes.rarely()) forget(bytes.below(4) % histories.size());
    if (call > 2) ask_the_past();
    for (const KnownHistory& history : histories) {
      HistorySpan span;
      FUZZ_CHECK(history_span(engine, history.id, &span) == Status::kOk);
      FUZZ_CHECK(span.ticks == history.span.ticks);
      FUZZ_CHECK(span.ticks == 0 || (span.first == history.span.first && span.last == history.span.last));
    }
  }

  // A frame by run_frame, or by tasks that are run in descending order, and sometimes given up.
  Status run_any(FrameJob& job) {
    if (!bytes.rarely()) return run_frame(engine, job);
    Status status = begin_frame(engine, job);
    if (status != Status::kOk) return status;
    std::uint32_t count = 1;
    for (bool gives_up = false; count > 0 && !gives_up;) {
      status = next_tasks(engine, &count);
      FUZZ_CHECK(status == Status::kOk);
      for (std::uint32_t t = count; t-- > 0 && !gives_up;) {
        gives_up = bytes.below(200) == 0;
        if (!gives_up) FUZZ_CHECK(run_task(engine, t, engine_thread_count(engine) - 1) == Status::kOk);
      }
    }
    status = end_frame(engine);
    return status == Status::kTasksLeft ? run_frame(engine, job) : status;
  }

  // Runs the frame of a job twice more, with nothing that moves in the second.
  void run_at_rest(FrameJob job, std::vector<BatchInput> inputs, std::vector<Hit> hits) {
    const std::vector<std::uint8_t> none(64, 0);
    for (BatchInput& input : inputs) {
      const Known& known = batches[slot_of(input.batch).value - 1];
      if (!known.is_static) input.moved = {none.data(), known.instances};
      input.flags = {};
    }
    std::vector<Hit> again(hits.size());
    job.inputs = inputs;
    job.hits = again;
    job.contacts = {};
    if (job.report == Report::kDistances || run_frame(engine, job) != Status::kOk) return;  // a sequence has no rest
    const std::size_t first = job.hit_count;
    FUZZ_CHECK(run_frame(engine, job) == Status::kOk);
    const bool skips = std::any_of(job.rules.begin(), job.rules.end(),
                                   [](const PairRule& rule) { return rule.resting == Resting::kSkipped; });
    FUZZ_CHECK(skips ? job.hit_count <= first : job.hit_count == first);
  }

  void run() {
    const std::size_t input_count = bytes.rarely() ? bytes.below(5) : batches.size();
    std::vector<Arrays> arrays(input_count);
    std::vector<BatchInput> inputs;
    for (std::size_t n = 0; n < input_count; ++n) {
      const std::uint32_t batch = bytes.rarely() ? bytes.below(6) : static_cast<std::uint32_t>(n + 1);
      if (batch > 0 && batch <= batches.size() && batches[batch - 1].instances > 64)
        continue;  // took raw bytes for a count
      inputs.push_back(make_input(batch, arrays[n]));
    }
    std::vector<PairRule> rules;
    for (std::uint32_t rule = bytes.below(5); rule > 0; --rule) {
      const auto count = static_cast<std::uint32_t>(batches.size());
      const std::uint32_t a = bytes.rarely() ? bytes.below(6) : 1 + bytes.below(std::clamp(count, 1u, 256u));
      const std::uint32_t b = bytes.rarely() ? bytes.below(6) : 1 + bytes.below(std::clamp(count, 1u, 256u));
      const auto pairing = static_cast<Pairing>(bytes.rarely() ? 2 : bytes.below(2));
      rules.push_back({{a},
                       {pairing == Pairing::kWithin && !bytes.rarely() ? a : b},
                       pairing,
                       static_cast<Resting>(bytes.rarely() ? 2 : bytes.below(2))});
    }
    FrameJob job;
    job.inputs = spoiled(bytes, Span<const BatchInput>(inputs));
    job.rules = spoiled(bytes, Span<const PairRule>(rules));
    // Every value of every field, and one value too many.
    const auto any = [&](std::uint32_t field) { return bytes.below(policy_table()[field].value_count + 1); };
    job.policies = {static_cast<Refit>(any(0)), static_cast<Strategy>(any(1)),
                    static_cast<Exact>(bytes.rarely() ? 1 + bytes.below(2) : 0), static_cast<Extents>(any(3)),
                    static_cast<Sat>(bytes.rarely() ? 1 + bytes.below(2) : 0)};
    if (!inputs.empty()) {
      const std::uint32_t batch = slot_of(inputs[0].batch).value;
      std::vector<Box> boxes(
          batch > 0 && batch <= batches.size() ? batches[batch - 1].nodes * batches[batch - 1].instances : 1);
      (void)compute_boxes(engine, inputs[0], job.policies, spoiled(bytes, Span<Box>(boxes)));
      for (Arrays& each : arrays) each.flags.assign(each.flags.size(), 0xee);
    }
    if (inputs.size() > 1 && bytes.rarely()) {
      const BatchInput& now = inputs[bytes.below(2)];
      const std::uint32_t batch = slot_of(now.batch).value;
      std::vector<float> margins(batch > 0 && batch <= batches.size() ? batches[batch - 1].instances : 1, -1.0f);
      if (sweep_margins(engine, inputs[0], now, spoiled(bytes, Span<float>(margins))) == Status::kOk)
        for (const float margin : margins) FUZZ_CHECK(margin == -1 || (margin >= 0 && margin <= kMaxCoordinate));
    }
    if (!inputs.empty() && bytes.rarely()) {
      Hit pair = {};
      pair.batch_a = {1 + bytes.below(2)}, pair.batch_b = {1 + bytes.below(2)};
      pair.instance_a = bytes.below(8), pair.instance_b = bytes.below(8);
      pair.link_a = static_cast<std::uint16_t>(bytes.below(3)),
      pair.link_b = static_cast<std::uint16_t>(bytes.below(3));
      const Span<const BatchInput> all = inputs;
      float moment = -1;
      const Status found = find_touching_moments(engine, spoiled(bytes, all), all,
                                                 bytes.rarely() ? bytes.number() : 0.05f, {&pair, 1}, {&moment, 1});
      FUZZ_CHECK(found == Status::kOk ? (moment >= 0 && moment <= 1) || moment == kNeverTouch : moment == -1);
    }
    if (bytes.rarely()) job.margin = bytes.number();
    if (bytes.rarely()) job.min_depth = bytes.number();
    if (bytes.rarely()) job.report = static_cast<Report>(bytes.below(4));
    if (bytes.rarely()) {
      std::vector<InstancePair> pairs(bytes.below(64));
      CandidateList list;
      list.pairs = spoiled(bytes, Span<InstancePair>(pairs));
      const Status found = find_candidates(engine, job, list);
      FUZZ_CHECK(found != Status::kOk || (list.pair_count == list.pairs_needed && list.pair_count <= list.pairs.size));
    }
    job.hit_count = 77;
    const auto in_order = [](const Hit& a, const Hit& b) { return !oracle::link_less(a, b); };
    std::vector<Hit> hits(bytes.below(64));
    std::vector<Contact> contacts(bytes.rarely() ? hits.size() : 0);
    job.hits = spoiled(bytes, Span<Hit>(hits));
    job.contacts = spoiled(bytes, Span<Contact>(contacts));
    Status status = run_any(job);
    if (status == Status::kHitsOverflow) {
      FUZZ_CHECK(job.hit_count == 0 && job.hits_needed > job.hits.size);
      hits.resize(job.hits_needed);
      contacts.resize(contacts.empty() ? 0 : hits.size());
      job.hits = hits;
      job.contacts = contacts;
      status = run_frame(engine, job);
      FUZZ_CHECK(status == Status::kOk && job.hits_needed == hits.size() && job.hit_count <= hits.size());
    }
    if (status != Status::kOk) {
      FUZZ_CHECK(job.hit_count == 77);
      for (const Arrays& each : arrays)
        for (const std::uint8_t flag : each.flags) FUZZ_CHECK(flag == 0xee);
      return;
    }
    for (std::uint32_t b = 0; b < batches.size(); ++b) {
      if (batches[b].instances > 64 || batches[b].instances == 0) continue;
      std::vector<std::uint32_t> order(batches[b].instances);
      FUZZ_CHECK(spatial_order(engine, {b + 1}, order) == Status::kOk);
      std::sort(order.begin(), order.end());
      for (std::uint32_t i = 0; i < order.size(); ++i) FUZZ_CHECK(order[i] == i);
    }
    FUZZ_CHECK(job.hit_count <= job.hits.size);
    hits.resize(job.hit_count);
    FUZZ_CHECK(std::adjacent_find(hits.begin(), hits.end(), in_order) == hits.end());
    if (bytes.rarely() && job.inputs.data == inputs.data() && job.inputs.size == inputs.size())
      run_at_rest(job, inputs, hits);
  }
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  fuzz::Bytes bytes(data, size);
  Budget budget{bytes.rarely() ? std::size_t{bytes.raw<std::uint16_t>()} << 6 : std::size_t{1} << 26};
  const Allocator allocator = {&budget, Budget::take, Budget::give_back};
  std::uint32_t worker_count = bytes.below(4);
  const Scheduler scheduler = {&worker_count, worker_count, run_backwards};
  EngineDesc desc;
  desc.isa = static_cast<Isa>(bytes.below(7));
  desc.allocator = &allocator;
  desc.scheduler = bytes.below(2) ? &scheduler : nullptr;
  Engine* engine = nullptr;
  if (create_engine(desc, &engine) != Status::kOk) {
    FUZZ_CHECK(engine == nullptr && budget.used == 0);
    return 0;
  }
  Session session{bytes, *engine, {}, {}};
  session.add_rig(false);
  session.add_instances();
  for (bool ran = false; !ran || !session.bytes.empty(); ran = true) {
    const std::uint32_t call = session.bytes.below(7);
    if (call == 0) session.add_rig(true);
    if (call == 1 && session.batches.size() < 4) session.add_instances();
    if (call == 2) session.remove();
    if (call == 3) session.make_room();
    if (call == 4 && session.batches.size() < 4) session.add_level();
    if (call == 4 && session.articulations.size() < 5) session.add_level_of_detail();
    if (call > 4) session.run();
    if (call == 3) session.use_past();
  }
  destroy_engine(engine);
  FUZZ_CHECK(budget.used == 0);
  return 0;
}
