#include "engine/bindings/python/engine_handle.h"

#include "engine/bindings/python/arrays.h"
#include "engine/bindings/python/dtypes.h"
#include "engine/bindings/python/errors.h"

#include <pybind11/stl.h>

#include <algorithm>
#include <cstdint>
#include <string>
#include <thread>
#include <unordered_map>
#include <utility>

namespace cab::python {

std::string refused(Status status, std::uint32_t index) {
  switch (status) {
    case Status::kBadParent:
    case Status::kBadJoint: return element("link", index);
    case Status::kBadLeafLink:
    case Status::kBadLeafBox:
    case Status::kBadLeafAxes:
    case Status::kBadShape:
    case Status::kShapeOutsideLeafBox: return element("box", index);
    case Status::kBadIgnoredPair: return element("ignored pair", index);
    default: return {};
  }
}

Isa isa_of(const std::string& name) {
  for (std::uint32_t value = 0; value < kIsaCount; ++value)
    if (name == to_string(static_cast<Isa>(value))) return static_cast<Isa>(value);
  std::string names;
  for (std::uint32_t value = 0; value < kIsaCount; ++value)
    names += std::string(value > 0 ? ", " : "") + to_string(static_cast<Isa>(value));
  throw py::value_error("isa: '" + name + "' is none of " + names);
}

namespace {

// How many queries are worked on at a time: more take more memory and hardly less time.
constexpr std::uint32_t kMostQueryMemory = 4096;

// A value of policies by its name, or ValueError with the names that there are.
void set_policy(Policies& policies, std::uint32_t field, const std::string& name) {
  if (name.find('\0') == std::string::npos && policy_set(policies, field, name.c_str())) return;
  const PolicyField& row = policy_table()[field];
  std::string names;
  for (std::uint32_t v = 0; v < row.value_count; ++v) names += std::string(v > 0 ? ", " : "") + row.values[v].name;
  throw py::value_error(std::string(row.name) + ": '" + name + "' is none of " + names);
}

std::uint32_t field_of(const char* name) {
  const Span<const PolicyField> table = policy_table();
  for (std::uint32_t f = 0; f < table.size; ++f)
    if (std::string(table[f].name) == name) return f;
  throw py::value_error(name);
}

Policies policies_of(const PolicyNames& names) {
  const Span<const PolicyField> table = policy_table();
  if (names.size() != table.size) throw py::value_error("policies: one name per field is wanted");
  Policies policies;
  for (std::uint32_t f = 0; f < table.size; ++f) set_policy(policies, f, names[f]);
  return policies;
}

// The inputs of one call. What the engine uses as an index is copied, with the interpreter's lock: another thread may
// write into arrays while the call runs, when the engine has checked them.
class CallInputs {
 public:
  explicit CallInputs(const std::vector<FrameInput*>& inputs) : CallInputs(inputs.begin(), inputs.end()) {}
  explicit CallInputs(const FrameInput& input) : CallInputs(&input, &input + 1) {}

  Span<const BatchInput> all() const { return inputs_; }
  const BatchInput& only() const { return inputs_[0]; }

 private:
  template <class Iterator>
  CallInputs(Iterator begin, Iterator end) {
    for (; begin != end; ++begin) add(*begin);
  }
  void add(const FrameInput* input) { add(*input); }
  void add(const FrameInput& input) {
    inputs_.push_back(input.input());
    Span<const std::uint32_t>& instances = inputs_.back().instances;
    listed_.emplace_back(instances.begin(), instances.end());
    instances = listed_.back();
  }

  std::vector<BatchInput> inputs_;
  std::vector<std::vector<std::uint32_t>> listed_;  // the instances of each
};

// An array of `room` values of which the first `count` are kept.
py::object cut(py::array array, std::size_t count) {
  array.resize({static_cast<py::ssize_t>(count)}, false);
  return std::move(array);
}

// The values of an array that this file has checked or made.
template <class T>
Span<T> values_of(py::array& array) {
  return Span<T>(static_cast<T*>(array.mutable_data()), static_cast<std::size_t>(array.size()));
}

template <class T>
Span<const T> constants_of(const py::array& array) {
  return Span<const T>(static_cast<const T*>(array.data()), static_cast<std::size_t>(array.size()));
}

// The same, copied as CallInputs copies.
template <class T>
std::vector<T> copy_of(const py::array& array) {
  const Span<const T> values = constants_of<T>(array);
  return {values.begin(), values.end()};
}

// Runs a call without the interpreter's lock.
template <class Call>
auto released(const Call& call) {
  const py::gil_scoped_release release;
  return call();
}

// Runs a call until no frame of another thread is in its way. For changes that must not stop halfway.
template <class Call>
Status insist(const Call& call) {
  for (;;) {
    const Status status = call();
    if (status != Status::kBusy) return status;
    std::this_thread::yield();
  }
}

// The engine writes nothing for instances that are not listed. So their flags go back to 0, if the list has changed.
void clear_flags_of_absent(const BatchInput& input) {
  if (input.instances.empty() && input.count != 0) return;
  std::size_t next = 0;
  for (const std::uint32_t listed : input.instances) {
    std::fill(input.flags.data + next, input.flags.data + listed, std::uint8_t{0});
    next = std::size_t{listed} + 1;
  }
  std::fill(input.flags.data + next, input.flags.data + input.flags.size, std::uint8_t{0});
}

// The text that a call writes.
template <class Write>
std::string text_of(const Write& write) {
  std::string text(write(Span<char>()) + 1, ' ');
  write(Span<char>(text.data(), text.size()));
  text.pop_back();
  return text;
}

// Raises ValueError if all batches have the same arrays before and now, so that nothing can have moved.
void require_two_moments(Span<const BatchInput> last, Span<const BatchInput> now) {
  std::unordered_map<std::uint64_t, const BatchInput*> before;
  for (const BatchInput& a : last) before[a.batch.value] = &a;
  const BatchInput* same = nullptr;
  for (const BatchInput& b : now) {
    const auto found = before.find(b.batch.value);
    if (found == before.end() || b.poses.data == nullptr || b.count == 0) continue;
    const BatchInput& a = *found->second;
    if (a.poses.data != b.poses.data || a.poses.instance_stride != b.poses.instance_stride ||
        a.poses.link_stride != b.poses.link_stride || a.origins.data != b.origins.data ||
        a.orientations.data != b.orientations.data || a.scales.data != b.scales.data)
      return;
    same = &b;
  }
  if (same)
    throw py::value_error("last and now: of the batch in slot " + std::to_string(same->batch.value & 0xFFFFFFFFu) +
                          " both have the same arrays, so that nothing can have moved; before an array is written " +
                          "into, keep a copy for last");
}

// What is wrong with a job that run_frame has refused.
[[noreturn]] void raise_job(Engine& engine, const FrameJob& job, Status status) {
  if (status == Status::kBusy || status == Status::kOutOfMemory) raise_status(status);
  raise_message(status, text_of([&](Span<char> text) { return explain_job(engine, job, text); }));
}

}  // namespace

template <class Call>
auto EngineHandle::changing(const Call& call) const {
  const py::gil_scoped_release release;
  const std::unique_lock lock(mutex_);
  return call();
}

template <class Call>
auto EngineHandle::reading(const Call& call) const {
  const py::gil_scoped_release release;
  const std::shared_lock lock(mutex_);
  return call();
}

EngineHandle::EngineHandle(const std::string& isa, std::uint32_t thread_count) {
  EngineDesc desc;
  desc.isa = isa_of(isa);
  desc.thread_count = thread_count;
  Engine* engine = nullptr;
  const Status status = released([&] { return create_engine(desc, &engine); });
  require(status);
  engine_ = std::shared_ptr<Engine>(engine, destroy_engine);
}

void EngineHandle::close() {
  std::shared_ptr<Engine> last;
  last.swap(engine_);
  const py::gil_scoped_release release;
  last.reset();
}

std::shared_ptr<Engine> EngineHandle::engine() const {
  if (!engine_) throw py::value_error("the engine is closed");
  return engine_;
}

BatchRecord EngineHandle::record(std::uint64_t batch) const {
  const auto found = batches_.find(batch);
  if (found == batches_.end()) raise_status(Status::kUnknownBatch);
  return found->second;
}

std::uint64_t EngineHandle::add_articulation(const BodyData& body) {
  const std::shared_ptr<Engine> held = engine();
  ArticulationId id;
  std::uint32_t bad = 0;
  const Status status = changing([&] { return cab::add_articulation(*held, body.desc(), &id, &bad); });
  require(status, refused(status, bad));
  return id.value;
}

void EngineHandle::remove_articulation(std::uint64_t id) {
  const std::shared_ptr<Engine> held = engine();
  require(changing([&] { return cab::remove_articulation(*held, {id}); }));
}

std::uint64_t EngineHandle::add_batch(std::uint64_t articulation, std::uint32_t instance_count, bool is_sequence) {
  const std::shared_ptr<Engine> held = engine();
  BatchRecord batch;
  batch.instance_count = instance_count;
  batch.kind = is_sequence ? BatchKind::kSequence : BatchKind::kCharacters;
  const ArticulationInfo info = articulation_info(articulation);
  batch.link_count = info.link_count;
  batch.node_count = info.node_count;
  const Status status = changing([&] {
    return cab::add_batch(*held, {{articulation}, instance_count, batch.kind}, &batch.id);
  });
  require(status);
  batches_[batch.id.value] = batch;
  return batch.id.value;
}

std::uint64_t EngineHandle::add_static(const py::object& origins, const py::object& rotations, const py::object& boxes,
                                       const py::sequence& parts, const py::object& vertices,
                                       const py::object& triangles, const py::object& origin) {
  const std::shared_ptr<Engine> held = engine();
  const py::array box_array = checked(boxes, box_dtype(), {"boxes", {-1}, "(bodies,)"});
  const Box* const box_data = static_cast<const Box*>(box_array.data());
  const py::ssize_t n = box_array.size();
  const auto places = span_of<const double>(origins, {"origins", {n, 3}, "(bodies, 3)"});
  const auto turns = span_of<const float>(rotations, {"rotations", {n, 4}, "(bodies, 4)"});
  const PartList part_list(parts, static_cast<std::size_t>(n));
  std::vector<StaticBody> bodies(static_cast<std::size_t>(n));
  for (std::size_t k = 0; k < bodies.size(); ++k) {
    for (std::size_t c = 0; c < 3; ++c) bodies[k].origin[c] = places[3 * k + c];
    for (std::size_t c = 0; c < 4; ++c) bodies[k].rotation[c] = turns[4 * k + c];
    bodies[k].box = box_data[k];
    bodies[k].parts = part_list.of_leaf(k);
  }
  StaticDesc desc;
  desc.bodies = bodies;
  desc.vertices = span_of<const float>(vertices, {"vertices", {-1, 3}, "(n, 3)"});
  desc.triangles = span_of<const std::uint32_t>(triangles, {"triangles", {-1, 3}, "(n, 3)"});
  const auto place = span_of<const double>(origin, {"origin", {3}, "(3,)"});
  for (std::size_t c = 0; c < 3; ++c) desc.origin[c] = place[c];
  BatchRecord batch;
  batch.instance_count = static_cast<std::uint32_t>(bodies.size() + desc.triangles.size / 3);
  batch.link_count = 1;
  batch.node_count = 1;
  batch.is_static = true;
  std::uint32_t bad = 0;
  const Status status = changing([&] { return add_static_batch(*held, desc, &batch.id, &bad); });
  const bool names_one = status == Status::kBadStaticBody || status == Status::kBadTriangles ||
                         status == Status::kBadLeafBox || status == Status::kBadLeafAxes ||
                         status == Status::kBadShape || status == Status::kShapeOutsideLeafBox;
  require(status, names_one ? element("instance", bad) : std::string());
  batches_[batch.id.value] = batch;
  return batch.id.value;
}

void EngineHandle::remove_batch(std::uint64_t id) {
  const std::shared_ptr<Engine> held = engine();
  require(changing([&] { return cab::remove_batch(*held, {id}); }));
  batches_.erase(id);
}

std::uint64_t EngineHandle::grow_batch(std::uint64_t id, std::uint64_t articulation, std::uint32_t instance_count) {
  const std::shared_ptr<Engine> held = engine();
  const BatchRecord old = record(id);
  BatchRecord grown = old;
  grown.instance_count = instance_count;
  const BatchDesc desc = {{articulation}, instance_count, old.kind};
  bool gone = false;
  const Status status = changing([&] {
    // Whatever refuses the larger batch does so while the old one is there. Then both go, so that the lowest free slot
    // is the old one's again.
    BatchId trial;
    const Status refusal = cab::add_batch(*held, desc, &trial);
    if (refusal != Status::kOk) return refusal;
    const Status removed = insist([&] { return cab::remove_batch(*held, {id}); });
    gone = removed == Status::kOk;
    const Status cleared = insist([&] { return cab::remove_batch(*held, trial); });
    if (removed != Status::kOk) return removed;
    if (cleared != Status::kOk) return cleared;
    return insist([&] { return cab::add_batch(*held, desc, &grown.id); });
  });
  if (gone) batches_.erase(id);
  require(status);
  batches_[grown.id.value] = grown;
  return grown.id.value;
}

bool EngineHandle::has_batch(std::uint64_t id) const { return batches_.find(id) != batches_.end(); }

void EngineHandle::reserve(std::uint32_t batches, std::uint32_t characters) {
  const std::shared_ptr<Engine> held = engine();
  const Status status = changing([&] { return cab::reserve(*held, {batches, characters, 0, 0}); });
  require(status);
}

std::unique_ptr<FrameInput> EngineHandle::make_input(std::uint64_t batch, const py::object& poses, bool column,
                                                     bool has_scale, const py::kwargs& rest) const {
  return std::make_unique<FrameInput>(record(batch), poses, column, has_scale, rest);
}

FrameResult EngineHandle::run_frame(const std::vector<FrameInput*>& inputs, const std::vector<RuleTuple>& rules,
                                    const FrameOptions& options) {
  const std::shared_ptr<Engine> held = engine();
  const CallInputs call_inputs(inputs);
  std::vector<PairRule> rule_list;
  for (const auto& [a, b, pairing, resting] : rules)
    rule_list.push_back({{a}, {b}, static_cast<Pairing>(pairing), static_cast<Resting>(resting)});
  FrameJob job;
  job.inputs = call_inputs.all();
  job.rules = rule_list;
  job.policies = policies_of(options.policies);
  job.margin = options.margin;
  job.min_depth = options.min_depth;
  job.report = static_cast<Report>(options.report);
  job.containment = options.containment;

  std::size_t room = job.report == Report::kInContact ? 0 : hit_room_;
  for (;;) {
    py::array hits = empty_array(hit_dtype(), room);
    py::array contacts = empty_array(contact_dtype(), options.contacts ? room : 0);
    job.hits = values_of<Hit>(hits);
    job.contacts = values_of<Contact>(contacts);
    const Status status = released([&] { return cab::run_frame(*held, job); });
    // The room of the next frame: as many as this one has, and a quarter more.
    if (job.report != Report::kInContact && (status == Status::kOk || status == Status::kHitsOverflow))
      hit_room_ = job.hits_needed + job.hits_needed / 4 + 64;
    if (status == Status::kHitsOverflow) {
      room = hit_room_;
      continue;
    }
    if (status != Status::kOk) raise_job(*held, job, status);
    for (const BatchInput& input : call_inputs.all()) clear_flags_of_absent(input);
    FrameResult result;
    result.hits = cut(std::move(hits), job.hit_count);
    result.contacts = options.contacts ? cut(std::move(contacts), job.hit_count) : py::object(py::none());
    result.stats = job.stats;
    return result;
  }
}

QueryResult EngineHandle::run_queries(const std::vector<FrameInput*>& inputs,
                                      const std::vector<std::uint64_t>& histories, const py::object& queries,
                                      const py::object& planes, const std::string& exact, bool reuse_bounds,
                                      QueryReport report, bool surface_points) {
  const std::shared_ptr<Engine> held = engine();
  const CallInputs call_inputs(inputs);
  std::vector<HistoryId> history_list;
  for (const std::uint64_t id : histories) history_list.push_back({id});
  const auto query_list = copy_of<Query>(checked(queries, query_dtype(), {"queries", {-1}, "(n,)"}));
  const py::array plane_array = checked(planes, query_plane_dtype(), {"planes", {-1}, "(n,)"});
  Policies policies;
  set_policy(policies, field_of("exact"), exact);
  QueryJob job;
  job.inputs = call_inputs.all();
  job.histories = history_list;
  job.queries = query_list;
  job.planes = constants_of<QueryPlane>(plane_array);
  job.exact = policies.exact;
  job.reuse_bounds = reuse_bounds;
  job.bad_query = job.queries.size;

  const auto wanted_room = static_cast<std::uint32_t>(std::clamp<std::size_t>(job.queries.size, 64, kMostQueryMemory));
  if (wanted_room > query_room_) {
    const Status status = changing([&] { return cab::reserve(*held, {0, 0, wanted_room, 0}); });
    require(status);
    query_room_ = std::max(query_room_, wanted_room);
  }
  py::array found(py::dtype::of<bool>(), static_cast<py::ssize_t>(job.queries.size));
  job.found = {static_cast<std::uint8_t*>(found.mutable_data()), job.queries.size};
  py::array counts(py::dtype::of<std::uint32_t>(), static_cast<py::ssize_t>(job.queries.size));
  job.counts = {static_cast<std::uint32_t*>(counts.mutable_data()), job.queries.size};
  const bool is_short = report != QueryReport::kHits;
  std::size_t room = report == QueryReport::kCounts ? 0 : query_hit_room_;
  for (;;) {
    py::array hits = empty_array(is_short ? query_link_dtype() : query_hit_dtype(), room);
    if (is_short)
      job.links = {static_cast<QueryLink*>(hits.mutable_data()), room};
    else
      job.hits = {static_cast<QueryHit*>(hits.mutable_data()), room};
    py::object points = py::none();
    if (surface_points) {
      py::array array = empty_array(surface_point_dtype(), job.hits.size);
      job.surface_points = {static_cast<SurfacePoint*>(array.mutable_data()), job.hits.size};
      points = std::move(array);
    }
    const Status status = reading([&] { return cab::run_queries(*held, job); });
    if (room > 0 && (status == Status::kOk || status == Status::kHitsOverflow))
      query_hit_room_ = job.hits_needed + job.hits_needed / 4 + 64;
    if (status == Status::kHitsOverflow) {
      room = query_hit_room_;
      continue;
    }
    require(status, job.bad_query < job.queries.size ? element("query", job.bad_query) : std::string());
    if (surface_points) points = cut(py::cast<py::array>(std::move(points)), job.hits.size > 0 ? job.hit_count : 0);
    return {cut(std::move(hits), job.hit_count), std::move(counts), std::move(found), std::move(points), job.stats};
  }
}

py::array EngineHandle::compute_contacts(const std::vector<FrameInput*>& inputs, const py::object& pairs) {
  const std::shared_ptr<Engine> held = engine();
  const CallInputs call_inputs(inputs);
  const auto pair_list = copy_of<Hit>(checked(pairs, hit_dtype(), {"pairs", {-1}, "(n,)"}));
  py::array contacts = empty_array(contact_dtype(), pair_list.size());
  const auto contact_list = values_of<Contact>(contacts);
  const Status status =
      reading([&] { return cab::compute_contacts(*held, call_inputs.all(), pair_list, contact_list); });
  require(status);
  return contacts;
}

py::array EngineHandle::find_touching_triangles(const std::vector<FrameInput*>& inputs, const py::object& pairs) {
  const std::shared_ptr<Engine> held = engine();
  const CallInputs call_inputs(inputs);
  const auto pair_list = copy_of<Hit>(checked(pairs, hit_dtype(), {"pairs", {-1}, "(n,)"}));
  std::size_t found = 64;
  for (;;) {
    py::array triangles = empty_array(touching_triangles_dtype(), found);
    const auto list = values_of<TouchingTriangles>(triangles);
    const Status status =
        reading([&] { return cab::find_touching_triangles(*held, call_inputs.all(), pair_list, list, &found); });
    if (status == Status::kHitsOverflow) continue;
    require(status);
    return triangles[py::slice(0, static_cast<py::ssize_t>(found), 1)];
  }
}

py::array EngineHandle::compute_boxes(const FrameInput& input, const PolicyNames& policies) {
  const std::shared_ptr<Engine> held = engine();
  const Policies values = policies_of(policies);
  const CallInputs call_input(input);
  const std::uint32_t nodes = record(call_input.only().batch.value).node_count;
  // Zeros, since boxes of instances that are not listed are not written.
  py::array boxes = py::module_::import("numpy").attr("zeros")(input.count() * nodes, box_dtype());
  const auto box_list = values_of<Box>(boxes);
  const Status status = reading([&] { return cab::compute_boxes(*held, call_input.only(), values, box_list); });
  require(status);
  return boxes.attr("reshape")(input.count(), nodes);
}

py::array EngineHandle::sweep_margins(const FrameInput& last, const FrameInput& input) {
  const std::shared_ptr<Engine> held = engine();
  py::array margins = py::module_::import("numpy").attr("zeros")(input.count(), py::dtype::of<float>());
  const Span<float> values = {static_cast<float*>(margins.mutable_data()), input.count()};
  const CallInputs before(last), now(input);
  require_two_moments(before.all(), now.all());
  const Status status = reading([&] { return cab::sweep_margins(*held, before.only(), now.only(), values); });
  require(status);
  return margins;
}

py::array EngineHandle::find_touching_moments(const std::vector<FrameInput*>& last,
                                              const std::vector<FrameInput*>& inputs, float resolution,
                                              const py::object& pairs) {
  const std::shared_ptr<Engine> held = engine();
  const CallInputs before(last), now(inputs);
  require_two_moments(before.all(), now.all());
  const auto pair_list = copy_of<Hit>(checked(pairs, hit_dtype(), {"pairs", {-1}, "(n,)"}));
  py::array moments = empty_array(py::dtype::of<float>(), pair_list.size());
  const auto values = values_of<float>(moments);
  const Status status = reading(
      [&] { return cab::find_touching_moments(*held, before.all(), now.all(), resolution, pair_list, values); });
  require(status);
  return moments;
}

py::array EngineHandle::spatial_order(std::uint64_t batch) {
  const std::shared_ptr<Engine> held = engine();
  py::array order = empty_array(py::dtype::of<std::uint32_t>(), record(batch).instance_count);
  const auto values = values_of<std::uint32_t>(order);
  const Status status = reading([&] { return cab::spatial_order(*held, {batch}, values); });
  require(status);
  return order;
}

py::tuple EngineHandle::why_masked(const FrameInput& input, std::uint32_t instance) {
  const std::shared_ptr<Engine> held = engine();
  const CallInputs call_input(input);
  MaskReason reason;
  require(reading([&] { return cab::why_masked(*held, call_input.only(), instance, &reason); }));
  return py::make_tuple(reason.cause != MaskCause::kNone, reason.link,
                        text_of([&](Span<char> text) { return explain_mask(reason, text); }));
}

py::object EngineHandle::find_masked(const std::vector<FrameInput*>& inputs) {
  const std::shared_ptr<Engine> held = engine();
  const CallInputs call_inputs(inputs);
  const Span<const BatchInput> input_list = call_inputs.all();
  MaskReason reason;
  std::size_t at = 0;
  std::uint32_t instance = 0;
  const Status status = released([&] {
    for (at = 0; at < input_list.size; ++at) {
      const BatchInput& input = input_list[at];
      if (input.flags.empty()) continue;  // static bodies
      const bool listed = !input.instances.empty() || input.count == 0;
      const std::size_t count = listed ? input.instances.size : input.flags.size;
      for (std::size_t k = 0; k < count; ++k) {
        instance = listed ? input.instances[k] : static_cast<std::uint32_t>(k);
        const Status answer = cab::why_masked(*held, input, instance, &reason);
        if (answer != Status::kOk || reason.cause != MaskCause::kNone) return answer;
      }
    }
    return Status::kOk;
  });
  require(status);
  if (at == input_list.size) return py::none();
  return py::make_tuple(at, instance, reason.link,
                        text_of([&](Span<char> text) { return explain_mask(reason, text); }));
}

std::uint64_t EngineHandle::add_history(std::uint64_t batch, std::uint32_t ticks) {
  const std::shared_ptr<Engine> held = engine();
  HistoryId id;
  const Status status = changing([&] { return cab::add_history(*held, {{batch}, ticks}, &id); });
  require(status);
  return id.value;
}

void EngineHandle::remove_history(std::uint64_t id) {
  const std::shared_ptr<Engine> held = engine();
  require(changing([&] { return cab::remove_history(*held, {id}); }));
}

void EngineHandle::record_tick(std::uint64_t id, const FrameInput& input, double time) {
  const std::shared_ptr<Engine> held = engine();
  const CallInputs call_input(input);
  const Status status = changing([&] { return cab::record_tick(*held, {id}, call_input.only(), time); });
  require(status);
}

HistorySpan EngineHandle::history_span(std::uint64_t id) const {
  const std::shared_ptr<Engine> held = engine();
  HistorySpan span;
  require(changing([&] { return cab::history_span(*held, {id}, &span); }));
  return span;
}

ArticulationInfo EngineHandle::articulation_info(std::uint64_t id) const {
  const std::shared_ptr<Engine> held = engine();
  ArticulationInfo info;
  require(changing([&] { return cab::articulation_info(*held, {id}, &info); }));
  return info;
}

py::array EngineHandle::ignored_pairs(std::uint64_t id) const {
  const std::shared_ptr<Engine> held = engine();
  py::array pairs = empty_array(ignored_pair_dtype(), articulation_info(id).ignored_pair_count);
  const auto values = values_of<IgnoredPair>(pairs);
  require(changing([&] { return cab::ignored_pairs(*held, {id}, values); }));
  return pairs;
}

EngineMemory EngineHandle::memory() const {
  const std::shared_ptr<Engine> held = engine();
  EngineMemory memory;
  require(changing([&] { return engine_memory(*held, &memory); }));
  return memory;
}

std::string EngineHandle::isa() const { return to_string(engine_isa(*engine())); }

std::uint32_t EngineHandle::thread_count() const { return engine_thread_count(*engine()); }

}  // namespace cab::python
