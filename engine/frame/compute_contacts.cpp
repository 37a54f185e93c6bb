// compute_contacts: the contacts of links that a caller names.
#include "engine/exact/leaf_pairs.h"
#include "engine/frame/contacts.h"
#include "engine/session/validate.h"
#include "kernels/float_mode.h"

#include <algorithm>
#include <limits>

namespace cab {
namespace {

// Writes contacts[i] for pairs[i]. Those of a link with an invalid pose have depth minus infinity, and 0 else.
void measure_pairs(const FrameContext& frame, WorkerPool& pool, Span<const Hit> pairs, Contact* contacts) {
  const ExactTest& test = *find_exact_test(frame.policies.exact);
  pool.tasks->for_each(contact_tasks(pairs.size), [&](std::uint32_t task, std::uint32_t w) {
    const std::size_t begin = std::size_t{task} * kContactsPerTask,
                      end = std::min(begin + kContactsPerTask, pairs.size);
    test.contacts(frame, {pairs.data + begin, end - begin}, contacts + begin, pool.exact_of(w));
    for (std::size_t i = begin; i < end; ++i) {
      const Hit& pair = pairs[i];
      if (is_valid_pose(frame.batch(pair.batch_a.value - 1), pair.instance_a, pair.link_a) &&
          is_valid_pose(frame.batch(pair.batch_b.value - 1), pair.instance_b, pair.link_b))
        continue;
      contacts[i] = {};
      contacts[i].depth = -std::numeric_limits<float>::infinity();
    }
  });
}

}  // namespace

Status compute_contacts(Engine& engine, Span<const BatchInput> inputs, Span<const Hit> pairs,
                        Span<Contact> contacts) noexcept {
  return guarded([&] {
    Call call(engine, Access::kReads);
    if (!call.admitted()) return Status::kBusy;
    const kernel::FloatMode mode;
    Policies policies;
    policies.exact = Exact::kConvex;
    if (const Status status = bind_inputs(engine, call, inputs); status != Status::kOk) return status;
    for (const BatchInput& input : inputs)
      if (has_skin(*call.batch(input.batch).articulation)) return Status::kSkinNotTaken;
    if (const Status status = validate_pairs(engine, call, pairs); status != Status::kOk) return status;
    if (contacts.size < pairs.size || (pairs.size && !contacts.data)) return Status::kBadOutput;
    WorkerPool& pool = *call.reader().pool;
    pool.tasks->alone = pairs.size <= kContactsPerTask;
    const float any_distance = std::numeric_limits<float>::infinity();
    measure_pairs(call.context(policies, any_distance), pool, pairs, contacts.data);
    return Status::kOk;
  });
}

}  // namespace cab
