#include "engine/mpi/distributed_engine.h"

#include "engine/mpi/agreement.h"
#include "engine/mpi/digest.h"
#include "engine/mpi/out_of_memory.h"
#include "engine/mpi/part_of.h"

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <utility>

namespace cab::mpi {
namespace {

// Bytes of boxes that are computed at a time.
constexpr std::size_t kSliceBytes = std::size_t{4} << 20;

void add_leaf_shape(Digest& digest, const Box& box, Span<const ConvexPart> parts) {
  digest.add(box);
  digest.add(parts.size);
  for (const ConvexPart& part : parts) {
    digest.add(part.kind);
    digest.add(part.position);
    digest.add(part.rotation);
    digest.add(part.size);
    digest.add_all(part.vertices);
  }
}

void add_poses(Digest& digest, const PoseView& poses, std::size_t link_count) {
  digest.add(poses.format);
  digest.add(poses.has_scale);
  for (std::size_t link = 0; link < link_count; ++link) {
    const float* const pose = pose_at(poses, 0, 0, link);
    // The last row of four is not read.
    for (std::size_t i = 0; i < floats_of(poses.format); ++i)
      if (poses.format != PoseFormat::kMatrix4x4Columns || i % 4 != 3) digest.add(pose[i]);
  }
}

// desc: as add_articulation has taken it.
std::uint64_t digest_of(const ArticulationDesc& desc) {
  Digest digest;
  digest.add_all(desc.link_parents);
  digest.add_all(desc.link_joints);
  digest.add(desc.leaves.size);
  for (const Leaf& leaf : desc.leaves) {
    digest.add(leaf.link);
    add_leaf_shape(digest, leaf.triangles.empty() ? leaf.box : Box(), leaf.parts);
    digest.add_all(leaf.triangles);
  }
  digest.add_all(desc.skin.vertices);
  digest.add(desc.skin.influence_count);
  digest.add_all(desc.skin.influence_links);
  digest.add_all(desc.skin.influence_weights);
  digest.add_all(desc.skin.inverse_bind);
  digest.add_all(desc.ignored_pairs);
  digest.add(desc.ignored_hops);
  if (desc.rest_pose.data) add_poses(digest, desc.rest_pose, desc.link_parents.size);
  return digest.value();
}

std::uint64_t digest_of(const BatchDesc& desc) {
  Digest digest;
  digest.add(desc.articulation.value);
  digest.add(desc.instance_count);
  return digest.value();
}

std::uint64_t digest_of(const StaticDesc& desc) {
  Digest digest;
  digest.add(desc.bodies.size);
  for (const StaticBody& body : desc.bodies) {
    digest.add(body.origin);
    digest.add(body.rotation);
    add_leaf_shape(digest, body.box, body.parts);
  }
  digest.add_all(desc.vertices);
  digest.add_all(desc.triangles);
  digest.add(desc.origin);
  return digest.value();
}

Status add_engine(const EngineDesc& desc, EnginePtr& out) {
  Engine* engine = nullptr;
  const Status status = create_engine(desc, &engine);
  out.reset(engine);
  return status;
}

// Adds an articulation to each engine. They all have the same ones, so the slots are the same.
Status add_to_all(DistributedEngine& engine, const ArticulationDesc& desc, ArticulationId& out) {
  ArticulationId id;
  for (Engine* const one : {engine.own.get(), engine.border.get(), engine.bounds.get()})
    if (const Status status = cab::add_articulation(*one, desc, &id); status != Status::kOk) return status;
  out.value = static_cast<std::uint32_t>(id.value);
  ArticulationInfo info;
  if (const Status status = articulation_info(*engine.bounds, out, &info); status != Status::kOk) return status;
  const std::size_t fit = kSliceBytes / (info.node_count * sizeof(Box));
  const auto slice = static_cast<std::uint32_t>(std::clamp<std::size_t>(fit / 16 * 16, 16, 1024));
  engine.slices.push_back(slice);
  engine.reaches.push_back(link_reaches(desc));
  BatchId batch;
  return cab::add_batch(*engine.bounds, {out, slice, BatchKind::kCharacters}, &batch);
}

Status add_to_both(DistributedEngine& engine, const BatchDesc& desc, BatchId& out) {
  if (desc.kind != BatchKind::kCharacters) return Status::kBadBatchKind;
  if (desc.instance_count == 0) return Status::kNoInstances;
  Batch batch;
  batch.articulation = desc.articulation;
  batch.instance_count = desc.instance_count;
  batch.own_room = batch.border_room = 1;
  ArticulationInfo info;
  if (const Status status = articulation_info(*engine.bounds, desc.articulation, &info); status != Status::kOk)
    return status;
  batch.link_count = info.link_count;
  BatchId id;
  for (Engine* const one : {engine.own.get(), engine.border.get()})
    if (const Status status = cab::add_batch(*one, {desc.articulation, 1, desc.kind}, &id); status != Status::kOk)
      return status;
  out = {slot_of(id).value};
  engine.batches.push_back(batch);
  return Status::kOk;
}

// Near other ranks static bodies take no part. One of them keeps the slot.
Status add_to_both(DistributedEngine& engine, const StaticDesc& desc, BatchId& out) {
  BatchId id;
  if (const Status status = cab::add_static_batch(*engine.own, desc, &id); status != Status::kOk) return status;
  StaticBody body;
  body.box = {{0, 0, 0}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {0, 0, 0}};
  StaticDesc one;
  one.bodies = {&body, 1};
  if (const Status status = cab::add_static_batch(*engine.border, one, &id); status != Status::kOk) return status;
  out = {slot_of(id).value};
  engine.batches.emplace_back();
  return Status::kOk;
}

// Calls `add`, and has all ranks agree on what was added. The digest may read only what an engine has checked.
template <class Desc, class Add>
Answer add_on_all(DistributedEngine& engine, const Desc& desc, Add&& add) {
  const Status status = or_out_of_memory(add);
  return agree(engine.comm, status, status == Status::kOk ? digest_of(desc) : 0, Difference::kAdded);
}

}  // namespace

// A batch is added to the lowest empty slot, so the slots are filled from the lowest one on.
Status refill_slots(const Rooms& rooms) {
  for (Batch& batch : rooms.batches) {
    if (batch.is_static() || batch.*rooms.room > 0) continue;
    BatchId id;
    if (const Status status = cab::add_batch(rooms.engine, {batch.articulation, 1, BatchKind::kCharacters}, &id);
        status != Status::kOk)
      return status;
    batch.*rooms.room = 1;
  }
  return Status::kOk;
}

Status make_room(const Rooms& rooms, std::uint32_t slot, std::uint32_t needed) {
  Batch& batch = rooms.batches[slot - 1];
  std::uint32_t& room = batch.*rooms.room;
  if (needed <= room) return Status::kOk;
  if (needed > kMaxInstances) return Status::kTooManyInstances;
  // The old batch goes first, so that both need not fit.
  if (const Status status = remove_batch(rooms.engine, {slot}); status != Status::kOk) return status;
  const std::uint32_t before = std::exchange(room, 0);
  for (const std::uint32_t wanted : {std::min(needed + needed / 8, kMaxInstances), needed, before}) {
    BatchId id;
    if (cab::add_batch(rooms.engine, {batch.articulation, wanted, BatchKind::kCharacters}, &id) != Status::kOk)
      continue;
    room = wanted;
    break;
  }
  return room >= needed ? Status::kOk : Status::kOutOfMemory;
}

Answer create(MPI_Comm comm, const DistributedDesc& desc, DistributedEngine** out) noexcept {
  EnginePtr engines[3];
  Status status = out ? Status::kOk : Status::kBadOutput;
  EngineDesc alone = desc.engine;  // compute_boxes runs on the calling thread
  alone.thread_count = 1;
  alone.scheduler = nullptr;
  for (EnginePtr& engine : engines)
    if (status == Status::kOk) status = add_engine(&engine == &engines[2] ? alone : desc.engine, engine);
  int rank_count = 1;
  MPI_Comm_size(comm, &rank_count);
  std::unique_ptr<DistributedEngine> engine;
  if (const Status made = or_out_of_memory([&] {
        engine = std::make_unique<DistributedEngine>();
        engine->reached = engine->near = RegionTable(rank_count);
        engine->spare.resize(kPartBytes);
      });
      status == Status::kOk)
    status = made;

  // Of exact tests only FCL's may be missing, which a frame would refuse.
  Digest version;
  version.add_bytes(CAB_VERSION_STRING, std::strlen(CAB_VERSION_STRING));
  if (status == Status::kOk) {
    FrameJob with_fcl;
    with_fcl.policies.exact = Exact::kFcl;
    version.add(cab::run_frame(*engines[0], with_fcl) == Status::kExactNotBuilt);
  }
  if (const Answer answer = agree(comm, status, version.value(), Difference::kVersion); !answer.ok()) return answer;
  Digest program;
  if (desc.program) program.add_bytes(desc.program, std::strlen(desc.program));
  if (const Answer answer = agree(comm, status, program.value(), Difference::kProgram); !answer.ok()) return answer;

  MPI_Comm_dup(comm, &engine->comm);
  MPI_Comm_rank(engine->comm, &engine->rank);
  engine->rank_count = rank_count;
  engine->own = std::move(engines[0]);
  engine->border = std::move(engines[1]);
  engine->bounds = std::move(engines[2]);
  *out = engine.release();
  return {};
}

void destroy(DistributedEngine* engine) noexcept {
  if (!engine) return;
  MPI_Comm_free(&engine->comm);
  delete engine;
}

Answer add_articulation(DistributedEngine& engine, const ArticulationDesc& desc, ArticulationId* out) noexcept {
  ArticulationId id;
  const Answer answer = add_on_all(engine, desc, [&] { return add_to_all(engine, desc, id); });
  if (out) *out = id;
  return answer;
}

Answer add_batch(DistributedEngine& engine, const BatchDesc& desc, BatchId* out) noexcept {
  BatchId id;
  const Answer answer = add_on_all(engine, desc, [&] { return add_to_both(engine, desc, id); });
  if (out) *out = id;
  return answer;
}

Answer add_static_batch(DistributedEngine& engine, const StaticDesc& desc, BatchId* out) noexcept {
  BatchId id;
  const Answer answer = add_on_all(engine, desc, [&] { return add_to_both(engine, desc, id); });
  if (out) *out = id;
  return answer;
}

}  // namespace cab::mpi
