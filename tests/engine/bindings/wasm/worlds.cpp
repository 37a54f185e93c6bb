// Frames and queries with all that worlds.test.mjs asks of the ES module, by the C++ API: shapes, formats of poses,
// scales, layers, margins, static bodies, contacts, distances, and all kinds of queries. Prints one hash of all
// answers, and counts of hits; worlds.txt has them. Input comes from whole numbers, so that nothing is rounded before
// the engine gets it. usage: worlds [ISA]
#include <cab/cab.h>

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <vector>

namespace {

using namespace cab;

constexpr std::uint32_t kLinks = 6, kFigures = 48, kCrates = 16, kFrames = 24;

void check(Status status) {
  if (status == Status::kOk) return;
  std::fprintf(stderr, "worlds: %s\n", to_string(status));
  std::exit(1);
}

// Multiples of 2^-15 from -1 to 1.
struct Numbers {
  std::uint32_t state = 7;
  float next() {
    state = state * 1664525u + 1013904223u;
    return static_cast<float>(static_cast<std::int32_t>(state >> 16) - 32768) / 32768;
  }
};

// FNV-1a of words, their lowest byte first.
struct Hash {
  std::uint64_t value = 14695981039346656037u;
  void add(std::uint32_t word) {
    for (int shift = 0; shift < 32; shift += 8) {
      value ^= (word >> shift) & 0xffu;
      value *= 1099511628211u;
    }
  }
  void add(float number) {
    std::uint32_t word;
    std::memcpy(&word, &number, sizeof word);
    add(word);
  }
  template <std::size_t kCount>
  void add(const float (&numbers)[kCount]) {
    for (const float number : numbers) add(number);
  }
};

Box box_of(float x, float y, float z, float along) {
  return {{along, 0, 0}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {x, y, z}};
}

ArticulationId add_figure(Engine& engine) {
  static const float hull[] = {-.5f, 0, -.25f, .5f, .25f, 0, .5f, -.25f, 0, -.5f, 0, .25f};
  const ShapeKind kinds[] = {ShapeKind::kBox,        ShapeKind::kSphere,   ShapeKind::kCapsule,
                             ShapeKind::kConvexHull, ShapeKind::kCylinder, ShapeKind::kEllipsoid};
  const float sizes[][3] = {{.5f, .25f, .125f}, {.25f, 0, 0},     {.125f, .125f, 0},
                            {0, 0, 0},          {.125f, .25f, 0}, {.5f, .25f, .125f}};
  std::vector<std::int32_t> parents;
  std::vector<float> joints;
  std::vector<Leaf> leaves;
  std::vector<ConvexPart> parts(kLinks);
  for (std::uint32_t link = 0; link < kLinks; ++link) {
    parents.push_back(static_cast<std::int32_t>(link) - 1);
    joints.insert(joints.end(), {link == 0 ? 0 : .0625f, 0, 0});
    parts[link].kind = kinds[link];
    parts[link].position[0] = .5f;
    for (int c = 0; c < 3; ++c) parts[link].size[c] = sizes[link][c];
    if (kinds[link] == ShapeKind::kConvexHull) parts[link].vertices = hull;
    leaves.push_back({link, box_of(.5f, .25f, .25f, .5f), {&parts[link], 1}});
  }
  ArticulationDesc desc;
  desc.link_parents = parents;
  desc.link_joints = joints;
  desc.leaves = leaves;
  desc.ignored_hops = 1;
  ArticulationId id;
  check(add_articulation(engine, desc, &id));
  return id;
}

ArticulationId add_crate(Engine& engine) {
  const std::int32_t parents[] = {-1};
  const Leaf leaves[] = {{0, box_of(.5f, .375f, .25f, 0), {}}};
  ArticulationDesc desc;
  desc.link_parents = parents;
  desc.leaves = leaves;
  ArticulationId id;
  check(add_articulation(engine, desc, &id));
  return id;
}

BatchId add_level(Engine& engine) {
  StaticBody floor;
  floor.origin[2] = -3.5;
  floor.box = box_of(8, 8, .5f, 0);
  const float vertices[] = {-4, -4, -2, 4, -4, -2, 4, 4, 1, -4, 4, 1};
  const std::uint32_t triangles[] = {0, 1, 2, 0, 2, 3};
  StaticDesc desc;
  desc.bodies = {&floor, 1};
  desc.vertices = vertices;
  desc.triangles = triangles;
  desc.origin[0] = .25;
  BatchId id;
  check(add_static_batch(engine, desc, &id));
  return id;
}

BatchId add_instances(Engine& engine, ArticulationId of, std::uint32_t count) {
  BatchId id;
  check(add_batch(engine, {of, count, BatchKind::kCharacters}, &id));
  return id;
}

// Queries of every kind.
struct Asked {
  std::vector<Query> queries;
  std::vector<QueryPlane> planes;
};

Asked ask(Numbers& numbers, BatchId ignored) {
  Asked out;
  for (std::uint32_t i = 0; i < 36; ++i) {
    Query query;
    query.kind = static_cast<QueryKind>(i % 6);
    query.want = static_cast<QueryWant>(i / 6 % 3);
    for (double& c : query.position) c = 4 * static_cast<double>(numbers.next());
    for (float& c : query.direction) c = numbers.next();
    for (float& c : query.orientation) c = numbers.next();
    query.orientation[3] += 2;
    query.length = 4;
    query.radius = query.kind == QueryKind::kRay ? .125f : .75f;
    for (float& c : query.half) c = .5f;
    query.with_depth = i % 4 == 1;
    query.max_hits = 5;
    query.layer_mask = i % 5 ? 0xffffffffu : 3u;
    if (i % 7 == 3) {
      query.ignored_batch = ignored;
      query.ignored_instance = i;
    }
    if (query.kind == QueryKind::kRegion) {
      query.first_plane = static_cast<std::uint32_t>(out.planes.size());
      query.plane_count = 2;
      for (int p = 0; p < 2; ++p) {
        QueryPlane plane;
        for (float& c : plane.normal) c = numbers.next();
        plane.offset = .25f;
        out.planes.push_back(plane);
      }
    }
    out.queries.push_back(query);
  }
  return out;
}

}  // namespace

int main(int argument_count, char** arguments) {
  EngineDesc desc;
  if (argument_count > 1) {
    std::uint32_t isa = 0;
    while (isa < kIsaCount && std::strcmp(to_string(static_cast<Isa>(isa)), arguments[1]) != 0) ++isa;
    desc.isa = static_cast<Isa>(isa);
  }
  Engine* engine = nullptr;
  check(create_engine(desc, &engine));
  const BatchId level = add_level(*engine), figures = add_instances(*engine, add_figure(*engine), kFigures),
                crates = add_instances(*engine, add_crate(*engine), kCrates);
  ReserveDesc room;
  room.queries = 36;
  check(reserve(*engine, room));

  std::vector<float> poses(kFigures * kLinks * 7), matrices(kCrates * 12), orientations(kFigures * 4), scales, margins;
  std::vector<double> origins, crate_origins;
  std::vector<std::uint32_t> layers, masks;
  std::vector<std::uint8_t> flags(kFigures), in_contact(kCrates);
  for (std::uint32_t i = 0; i < kFigures; ++i) {
    origins.insert(origins.end(), {1.25 * (i % 4) - 2, 1.25 * (i / 4 % 4) - 2, 1.25 * (i / 16) - 2});
    scales.push_back(i % 3 == 0 ? .5f : i % 3 == 1 ? 1.f : 1.25f);
    margins.push_back(static_cast<float>(i % 2) / 64);
    layers.push_back(1u << i % 3);
    masks.push_back(i % 5 == 0 ? 1u : 7u);
  }
  for (std::uint32_t i = 0; i < kCrates; ++i)
    crate_origins.insert(crate_origins.end(), {1.5 * (i % 4) - 2, 1.5 * (i / 4) - 2, -2.75});
  BatchInput inputs[3];
  inputs[0].batch = level;
  inputs[1].batch = figures;
  inputs[1].poses.data = poses.data();
  inputs[1].origins = origins;
  inputs[1].orientations = orientations;
  inputs[1].scales = scales;
  inputs[1].margins = margins;
  inputs[1].layers = layers;
  inputs[1].layer_masks = masks;
  inputs[1].flags = flags;
  inputs[2].batch = crates;
  inputs[2].poses.format = PoseFormat::kMatrix3x4Rows;
  inputs[2].poses.data = matrices.data();
  inputs[2].origins = crate_origins;
  inputs[2].in_contact = in_contact;
  const PairRule rules[] = {{figures, figures, Pairing::kBetween}, {figures, figures, Pairing::kWithin},
                            {figures, crates, Pairing::kBetween},  {crates, crates, Pairing::kBetween},
                            {crates, level, Pairing::kBetween},    {figures, level, Pairing::kBetween}};

  Numbers numbers;
  Hash hash;
  std::vector<Hit> hits(1 << 14);
  std::vector<Contact> contacts(hits.size());
  std::vector<QueryHit> found_hits(1 << 12);
  std::size_t hit_count = 0, query_hit_count = 0;
  for (std::uint32_t frame = 0; frame < kFrames; ++frame) {
    for (std::size_t i = 0; i < poses.size(); ++i) poses[i] = i % 7 == 3 ? numbers.next() + 1.25f : numbers.next();
    for (std::size_t i = 0; i < orientations.size(); ++i)
      orientations[i] = i % 4 == 3 ? numbers.next() + 2 : numbers.next();
    for (std::uint32_t i = 0; i < kCrates; ++i) {
      float* const matrix = matrices.data() + 12 * i;
      for (int c = 0; c < 12; ++c) matrix[c] = c % 4 == 3 ? numbers.next() : 0;
      matrix[i % 3] = matrix[4 + (i + 1) % 3] = matrix[8 + (i + 2) % 3] = frame % 2 ? -1.f : 1.f;
    }
    if (frame == 5) poses[70] = 2e18f;  // masks an instance

    const bool exact = frame % 4 != 3;
    FrameJob job;
    job.inputs = inputs;
    job.rules = rules;
    job.policies.refit = static_cast<Refit>(frame % kRefitCount);
    job.policies.strategy = frame % 6 < 4 ? static_cast<Strategy>(frame % 6) : Strategy::kAuto;
    job.policies.sat = static_cast<Sat>(frame / 2 % 2);
    job.policies.exact = exact ? Exact::kConvex : Exact::kNone;
    job.margin = static_cast<float>(frame % 3) / 64;
    job.min_depth = frame % 8 == 1 ? .0625f : 0;
    job.report = frame % 8 == 6 ? Report::kDistances : Report::kHits;
    job.hits = hits;
    if (exact) job.contacts = contacts;
    check(run_frame(*engine, job));
    hit_count += job.hit_count;
    hash.add(static_cast<std::uint32_t>(job.hit_count));
    hash.add(static_cast<std::uint32_t>(job.stats.candidates));
    hash.add(static_cast<std::uint32_t>(job.stats.box_tests));
    for (std::size_t i = 0; i < job.hit_count; ++i) {
      const Hit& hit = hits[i];
      for (const std::uint32_t word :
           {hit.batch_a.value, hit.instance_a, hit.batch_b.value, hit.instance_b, std::uint32_t{hit.link_a},
            std::uint32_t{hit.link_b}, std::uint32_t{hit.leaf_a}, std::uint32_t{hit.leaf_b}})
        hash.add(word);
      if (!exact) continue;
      hash.add(contacts[i].normal);
      hash.add(contacts[i].depth);
      hash.add(contacts[i].point_a);
      hash.add(contacts[i].point_b);
    }
    for (const std::uint8_t flag : flags) hash.add(std::uint32_t{flag});
    for (const std::uint8_t in : in_contact) hash.add(std::uint32_t{in});

    const Asked asked = ask(numbers, figures);
    std::vector<std::uint8_t> found(asked.queries.size());
    QueryJob queries;
    queries.inputs = inputs;
    queries.queries = asked.queries;
    queries.planes = asked.planes;
    queries.exact = frame % 2 ? Exact::kConvex : Exact::kNone;
    queries.reuse_bounds = frame % 3 == 1;
    queries.hits = found_hits;
    queries.found = found;
    check(run_queries(*engine, queries));
    query_hit_count += queries.hit_count;
    hash.add(static_cast<std::uint32_t>(queries.hit_count));
    for (const std::uint8_t one : found) hash.add(std::uint32_t{one});
    for (std::size_t i = 0; i < queries.hit_count; ++i) {
      const QueryHit& hit = found_hits[i];
      for (const std::uint32_t word : {hit.query, hit.batch.value, hit.instance, std::uint32_t{hit.link},
                                       std::uint32_t{hit.leaf}, std::uint32_t{hit.inside}})
        hash.add(word);
      hash.add(hit.distance);
      hash.add(hit.point);
      hash.add(hit.normal);
    }
  }
  destroy_engine(engine);
  std::printf("%08x%08x %zu %zu\n", static_cast<unsigned>(hash.value >> 32), static_cast<unsigned>(hash.value),
              hit_count, query_hit_count);
}
