// 300 frames whose hits have one hash in every language and on every platform. Poses come from whole numbers, so that
// nothing is rounded before the engine gets them. golden.c is the same program in C.
#include <cab/cab.h>

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <vector>

namespace {

constexpr std::uint32_t kLinks = 8, kInstances = 64, kFrames = 300;

void check(cab::Status status) {
  if (status == cab::Status::kOk) return;
  std::fprintf(stderr, "golden: %s\n", cab::to_string(status));
  std::exit(1);
}

// Multiples of 2^-15 from -1 to 1.
struct Numbers {
  std::uint32_t state = 1;
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
};

cab::BatchId add_characters(cab::Engine& engine) {
  std::vector<std::int32_t> parents;
  std::vector<cab::Leaf> leaves;
  for (std::uint32_t link = 0; link < kLinks; ++link) {
    parents.push_back(static_cast<std::int32_t>(link) - 1);
    leaves.push_back({link, {{.5f, 0, 0}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {.5f, .125f, .125f}}, {}});
  }
  cab::ArticulationDesc chain;
  chain.link_parents = parents;
  chain.leaves = leaves;
  cab::BatchDesc batch;
  batch.instance_count = kInstances;
  check(cab::add_articulation(engine, chain, &batch.articulation));
  cab::BatchId id;
  check(cab::add_batch(engine, batch, &id));
  return id;
}

cab::Policies policies_of(std::uint32_t frame) {
  cab::Policies policies;
  policies.refit = static_cast<cab::Refit>(frame % cab::kRefitCount);
  policies.strategy = static_cast<cab::Strategy>(frame % 4);  // tree, rows, links, brute
  policies.extents = static_cast<cab::Extents>(frame % cab::kExtentsCount);
  policies.exact = frame % 3 == 2 ? cab::Exact::kConvex : cab::Exact::kNone;
  return policies;
}

}  // namespace

// `golden ISA` takes an instruction set by its name.
int main(int argument_count, char** arguments) {
  cab::EngineDesc desc;
  if (argument_count > 1) {
    std::uint32_t isa = 0;
    while (isa < cab::kIsaCount && std::strcmp(cab::to_string(static_cast<cab::Isa>(isa)), arguments[1]) != 0) ++isa;
    desc.isa = static_cast<cab::Isa>(isa);
  }
  cab::Engine* engine = nullptr;
  check(cab::create_engine(desc, &engine));

  std::vector<float> poses(kInstances * kLinks * 7);
  std::vector<double> origins;
  for (std::uint32_t i = 0; i < kInstances; ++i) origins.insert(origins.end(), {1.5 * (i % 8), 1.5 * (i / 8), 0});
  cab::BatchInput input;
  input.batch = add_characters(*engine);
  input.poses.data = poses.data();
  input.origins = origins;
  const cab::PairRule rules[] = {{input.batch, input.batch, cab::Pairing::kBetween},
                                 {input.batch, input.batch, cab::Pairing::kWithin}};
  std::vector<cab::Hit> hits;
  std::vector<cab::Contact> contacts;
  cab::FrameJob job;
  job.inputs = {&input, 1};
  job.rules = rules;

  Numbers numbers;
  Hash hash;
  for (std::uint32_t frame = 0; frame < kFrames; ++frame) {
    for (std::size_t i = 0; i < poses.size(); ++i) poses[i] = i % 7 < 4 ? numbers.next() : 2 * numbers.next();
    job.policies = policies_of(frame);
    const bool has_contacts = job.policies.exact == cab::Exact::kConvex;
    const auto run = [&] {
      contacts.resize(has_contacts ? hits.size() : 0);
      job.hits = hits;
      job.contacts = contacts;
      return cab::run_frame(*engine, job);
    };
    cab::Status status = run();
    if (status == cab::Status::kHitsOverflow) {
      hits.resize(job.hits_needed);
      status = run();
    }
    check(status);
    hash.add(static_cast<std::uint32_t>(job.hit_count));
    for (std::size_t i = 0; i < job.hit_count; ++i) {
      const cab::Hit& hit = hits[i];
      for (const std::uint32_t word : {hit.batch_a.value, hit.instance_a, hit.batch_b.value, hit.instance_b,
                                       std::uint32_t{hit.link_a}, std::uint32_t{hit.link_b}})
        hash.add(word);
      if (!has_contacts) continue;
      std::uint32_t depth;
      std::memcpy(&depth, &contacts[i].depth, sizeof depth);
      hash.add(depth);
    }
  }
  cab::destroy_engine(engine);
  std::printf("%08x%08x\n", static_cast<unsigned>(hash.value >> 32), static_cast<unsigned>(hash.value));
}
