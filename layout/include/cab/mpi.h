// One crowd on several machines, by MPI: each rank has characters of its own, and all ranks together find the hits that
// one engine finds. Target cab::mpi. docs/scale.md says what is exchanged. The conventions are those of cab/types.h.
//
// All calls but `cut` and `to_string` are collective: every rank of the communicator calls them in the same order. All
// ranks run one program on machines with the same byte order. Nothing is thrown. If a rank runs out of memory, all
// answer kOutOfMemory of that rank. Errors of MPI, which has memory of its own, end all ranks, as its error handler
// says.
#pragma once

#include <cab/types.h>

#include <cstdint>

#include <mpi.h>

namespace cab::mpi {

// Engines of all ranks that stand for one. Its contents are private to the library.
struct DistributedEngine;

// What differs between ranks and must not.
enum class Difference : std::uint8_t {
  kNone,
  kVersion,  // the version of cab, or which exact tests it was built with
  kProgram,  // DistributedDesc::program
  kAdded,    // articulations, batches and static bodies that were added
  kJob,      // rules, policies, margin, min_depth, containment, report or contacts of a frame
  kMembers,  // the format of poses, or which spans are given, for a batch of which both ranks have characters
  kNumbers,  // two ranks have the same instance, as far as a frame sees it: where one rank tests both against others.
             // Elsewhere the hits of both are reported, and nothing tells
};

// What a collective call answers. It is the same on every rank.
struct Answer {
  Status status = Status::kOk;                // of the lowest rank whose own call failed
  Difference difference = Difference::kNone;  // between rank 0 and another, if no call failed
  std::int32_t rank = -1;                     // the rank that failed or differs; -1: none
  bool ok() const { return rank < 0; }
};

// What create needs to know.
struct DistributedDesc {
  // Of each rank's engines. Instruction sets and threads may differ between ranks.
  EngineDesc engine;

  // A text that must be the same on all ranks, such as the program's version and options. Null (default): none.
  const char* program = nullptr;
};

// A batch of one rank in one frame.
struct RankInput {
  // As run_frame takes it, with entries for this rank's characters alone, in the order of `numbers`. `count`,
  // `instances`, `bounds`, `moved` and `in_contact` must be empty or at their defaults, except for static bodies, whose
  // input is that of run_frame and the same on every rank. Poses must be there only if there are characters.
  BatchInput input;

  // The number of each of the rank's characters in the whole batch, ascending. No two ranks may have the same, which is
  // the caller's to see to: see kNumbers. Instances that no rank has take no part. Empty for static bodies.
  Span<const std::uint32_t> numbers;
};

// Messages of one kind that a rank sends in a frame, and their bytes, without what MPI adds.
struct MessageCount {
  std::uint64_t messages = 0;
  std::uint64_t bytes = 0;
};

// What a rank sends in a frame.
struct Traffic {
  MessageCount regions;           // where its characters are, to every other rank
  MessageCount bounds;            // of characters that reach into another rank's region
  MessageCount requests;          // for poses of those whose bounds meet a character's
  MessageCount poses;             // of characters that were asked for
  std::uint64_t bounds_sent = 0;  // characters whose bounds were sent, for each rank that got them
  std::uint64_t poses_sent = 0;   // characters whose poses were sent, likewise
};

// One frame.
struct DistributedJob {
  // The batches that take part, each once. Every rank names the same.
  Span<const RankInput> inputs;

  // As in FrameJob, the same on every rank. Report::kInContact is refused.
  Span<const PairRule> rules;
  Policies policies;
  float margin = 0;
  float min_depth = 0;
  bool containment = true;
  Report report = Report::kHits;

  // Whether to find contacts. The same on every rank.
  bool contacts = false;

  // Output: the hits that this rank found, in the order of run_frame, by the numbers of instances in whole batches. The
  // lists of all ranks, merged in this order, are the list of one engine, bit for bit. They stay until the next frame.
  // Empty when the answer is not kOk.
  Span<const Hit> hit_list;

  // Output: the contact of each hit, if asked for. Empty when the answer is not kOk.
  Span<const Contact> contact_list;

  // Output: of this rank's characters among themselves and with static bodies, and of those near other ranks.
  FrameStats own_stats;
  FrameStats border_stats;

  // Output: what this rank sent.
  Traffic traffic;
};

// Makes an engine of all ranks of a communicator, which is duplicated, and writes its address to *out. The caller
// frees it by destroy.
[[nodiscard]] Answer create(MPI_Comm comm, const DistributedDesc& desc, DistributedEngine** out) noexcept;

// Frees an engine and all that it owns, before MPI_Finalize. Null is allowed and does nothing.
void destroy(DistributedEngine* engine) noexcept;

// As the calls of cab.h, on all ranks with the same content. Ids are slots, and the same on every rank. The count of
// instances is that of the whole batch, and not limited to kMaxInstances, which is a limit per rank. Sequences are
// refused by kBadBatchKind: their frames do not touch, so that ranks need no common engine for them. After an answer
// that is not ok the engine may only be destroyed.
[[nodiscard]] Answer add_articulation(DistributedEngine& engine, const ArticulationDesc& desc,
                                      ArticulationId* out) noexcept;
[[nodiscard]] Answer add_batch(DistributedEngine& engine, const BatchDesc& desc, BatchId* out) noexcept;
[[nodiscard]] Answer add_static_batch(DistributedEngine& engine, const StaticDesc& desc, BatchId* out) noexcept;

// Runs one frame. If the answer is not ok, the outputs of the job are unspecified, and the engine is ready for another,
// after kOutOfMemory too.
// Statuses: those of cab::run_frame without kHitsOverflow; kBadInstances (numbers do not ascend, are not as many as the
// entries or not below the batch's count); kBadReport (also Report::kInContact).
[[nodiscard]] Answer run_frame(DistributedEngine& engine, DistributedJob& job) noexcept;

// Cuts a crowd into regions with equally many characters: recursively in two along the longer side of what is left.
// places: x y z per character. owners[i] receives the region of character i, 0 to region_count - 1. The counts of two
// regions differ by at most one per cut above them. Not collective. Returns kBadOutput if owners is not as long as
// there are places or region_count is below 1, kBadOrigins for places that are not finite, and kOutOfMemory.
[[nodiscard]] Status cut(Span<const double> places, std::int32_t region_count, Span<std::int32_t> owners) noexcept;

// A difference in words, without a capital at the start or a period at the end.
const char* to_string(Difference difference) noexcept;

}  // namespace cab::mpi
