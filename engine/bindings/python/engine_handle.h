// An engine as Python has it: calls release the lock of the interpreter, and statuses become exceptions.
#pragma once

#include <pybind11/numpy.h>

#include <cab/cab.h>

#include <cstdint>
#include <memory>
#include <mutex>
#include <shared_mutex>
#include <string>
#include <unordered_map>
#include <vector>

#include "engine/bindings/python/body_data.h"
#include "engine/bindings/python/frame_input.h"

namespace cab::python {

// (a, b, pairing, resting): slots of batches as PairRule has them.
using RuleTuple = std::tuple<std::uint64_t, std::uint64_t, std::uint8_t, std::uint8_t>;

// What an element is called that add_articulation refuses.
std::string refused(Status status, std::uint32_t index);

// An instruction set by its name. Raises ValueError with the names that there are.
Isa isa_of(const std::string& name);

// The names of the values of Policies, in the order of policy_table().
using PolicyNames = std::vector<std::string>;

struct FrameResult {
  py::object hits;
  py::object contacts;
  FrameStats stats;
};

struct QueryResult {
  py::object hits;
  py::object counts;
  py::object found;
  py::object surface_points;  // None unless they were asked for
  QueryStats stats;
};

// What becomes of the hits of queries: they are returned in full, as a short list, or counted alone.
enum class QueryReport { kHits, kLinks, kCounts };

// What a frame asks for beside its inputs and rules.
struct FrameOptions {
  PolicyNames policies;
  float margin = 0;
  float min_depth = 0;
  std::uint8_t report = 0;
  bool contacts = false;
  bool containment = true;
};

class EngineHandle {
 public:
  EngineHandle(const std::string& isa, std::uint32_t thread_count);

  // Frees the engine once no call uses it. Further calls raise ValueError.
  void close();

  std::uint64_t add_articulation(const BodyData& body);
  void remove_articulation(std::uint64_t id);
  std::uint64_t add_batch(std::uint64_t articulation, std::uint32_t instance_count, bool is_sequence);
  std::uint64_t add_static(const py::object& origins, const py::object& rotations, const py::object& boxes,
                           const py::sequence& parts, const py::object& vertices, const py::object& triangles,
                           const py::object& origin);
  void remove_batch(std::uint64_t id);

  // Replaces a batch by a larger one, and returns its id. If it is refused, the old one stays. Only memory that runs
  // out in the middle leaves none: has_batch says so.
  std::uint64_t grow_batch(std::uint64_t id, std::uint64_t articulation, std::uint32_t instance_count);
  bool has_batch(std::uint64_t id) const;

  void reserve(std::uint32_t batches, std::uint32_t characters);

  std::unique_ptr<FrameInput> make_input(std::uint64_t batch, const py::object& poses, bool column, bool has_scale,
                                         const py::kwargs& rest) const;

  FrameResult run_frame(const std::vector<FrameInput*>& inputs, const std::vector<RuleTuple>& rules,
                        const FrameOptions& options);
  QueryResult run_queries(const std::vector<FrameInput*>& inputs, const std::vector<std::uint64_t>& histories,
                          const py::object& queries, const py::object& planes, const std::string& exact,
                          bool reuse_bounds, QueryReport report, bool surface_points);
  py::array compute_contacts(const std::vector<FrameInput*>& inputs, const py::object& pairs);
  py::array find_touching_triangles(const std::vector<FrameInput*>& inputs, const py::object& pairs);
  py::array compute_boxes(const FrameInput& input, const PolicyNames& policies);
  py::array sweep_margins(const FrameInput& last, const FrameInput& input);
  py::array find_touching_moments(const std::vector<FrameInput*>& last, const std::vector<FrameInput*>& inputs,
                                  float resolution, const py::object& pairs);
  py::array spatial_order(std::uint64_t batch);
  py::tuple why_masked(const FrameInput& input, std::uint32_t instance);

  // The first masked instance: (index of its input, instance, link, why). None without one.
  py::object find_masked(const std::vector<FrameInput*>& inputs);

  std::uint64_t add_history(std::uint64_t batch, std::uint32_t ticks);
  void remove_history(std::uint64_t id);
  void record_tick(std::uint64_t id, const FrameInput& input, double time);
  HistorySpan history_span(std::uint64_t id) const;

  ArticulationInfo articulation_info(std::uint64_t id) const;
  py::array ignored_pairs(std::uint64_t id) const;
  EngineMemory memory() const;
  std::string isa() const;
  std::uint32_t thread_count() const;

 private:
  // Runs a call that changes what the engine has, without the interpreter's lock: alone, but for frames.
  template <class Call>
  auto changing(const Call& call) const;

  // Runs a read without the interpreter's lock: beside other reads.
  template <class Call>
  auto reading(const Call& call) const;

  std::shared_ptr<Engine> engine() const;
  BatchRecord record(std::uint64_t batch) const;

  std::shared_ptr<Engine> engine_;
  mutable std::shared_mutex mutex_;  // of `changing` and `reading`; never waited for with the interpreter's lock
  std::unordered_map<std::uint64_t, BatchRecord> batches_;
  std::size_t hit_room_ = 64;        // of the next frame
  std::size_t query_hit_room_ = 64;  // of the next queries
  std::uint32_t query_room_ = 0;     // what was reserved
};

// Adds the classes to the module.
void bind_engine(pybind11::module_& module);

}  // namespace cab::python
