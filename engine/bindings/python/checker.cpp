// States of robots: cab::CollisionChecker, as Python has it.
#include <cab/attached_object.h>
#include <cab/collision_checker.h>
#include <cab/files.h>

#include <pybind11/stl.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "engine/bindings/python/arrays.h"
#include "engine/bindings/python/body_data.h"
#include "engine/bindings/python/engine_handle.h"
#include "engine/bindings/python/errors.h"

namespace cab::python {
namespace {

// A touching pair of links of one state: cab.STATE_HIT.
struct StateHit {
  std::uint32_t state;
  std::int32_t fixed;  // the fixed body that link_b is of; -1: the robot
  std::uint32_t link_a, link_b;
  float depth;  // in metres; NaN unless depths are asked for
};

// What is known of a motion: cab.EDGE.
struct Edge {
  bool free, colliding;
  double moment;
};

EngineDesc desc_of(const std::string& isa, std::uint32_t thread_count) {
  EngineDesc desc;
  desc.isa = isa_of(isa);
  desc.thread_count = thread_count;
  return desc;
}

// Raises ValueError for a state that was not tested.
[[noreturn]] void raise_not_tested(std::size_t state) {
  throw py::value_error("states[" + std::to_string(state) + "]: a number is not finite, or moves a link beyond 1e18");
}

// Raises the exception of a status for a length that the caller has given.
[[noreturn]] void raise_length(Status status, const char* name, double given, const char* wanted) {
  const auto number = py::repr(py::float_(given)).cast<std::string>();
  raise_message(status, std::string(name) + ": " + number + " is not a length " + wanted + " metres");
}

// Words for a call that triangles have no answer for; empty for any other status.
std::string refused_surface(Status status, const char* why) {
  return status == Status::kSkinNotTaken ? std::string(why) + "; take a robot of hulls" : std::string();
}

constexpr const char* kNoDepth = "triangles have no depth and no distance";

class Checker {
 public:
  // `robot` must outlive this. padding: one length per link and object, or none. attached: objects as (name, body,
  // link, pose, links that may be touched).
  Checker(const files::Robot& robot, const BodyData& body, const std::string& isa, std::uint32_t thread_count,
          float margin, const std::vector<float>& padding, const py::sequence& attached)
      : variables_(robot.variables().size), checker_(desc_of(isa, thread_count)) {
    require(checker_.status());
    ArticulationDesc desc = body.desc();
    KinematicsDesc kinematics = robot.kinematics();
    std::vector<std::pair<std::string, std::uint32_t>> held;  // names, and the first leaf of each
    for (const py::handle item : attached) {
      const auto fields = py::reinterpret_borrow<py::tuple>(item);
      held.emplace_back("attached '" + fields[0].cast<std::string>() + "'",
                        static_cast<std::uint32_t>(desc.leaves.size));
      const auto touch = fields[4].cast<std::vector<std::uint32_t>>();
      const Span<const double> pose = span_of<const double>(fields[3], {"pose", {7}, "(7,)"});
      AttachedDesc object;
      object.link = fields[2].cast<std::uint32_t>();
      std::copy_n(pose.data, 4, object.rotation);
      std::copy_n(pose.data + 4, 3, object.translation);
      object.leaves = fields[1].cast<const BodyData&>().desc().leaves;
      object.touch_links = touch;
      const Status status = attached_.set(desc, kinematics, object);
      // Pairs are those that are given to be ignored: links that may be touched are there.
      require(status, status == Status::kBadIgnoredPair ? std::string() : held.back().first);
      desc = attached_.desc();
      kinematics = attached_.kinematics();
    }
    std::uint32_t bad_leaf = 0;
    const auto require_robot = [&](Status status) {
      const std::string words = refused(status, bad_leaf);
      const auto object =
          std::find_if(held.rbegin(), held.rend(), [&](const auto& of) { return of.second <= bad_leaf; });
      if (words.empty() || object == held.rend()) return require(status, words);
      require(status, object->first + ", " + refused(status, bad_leaf - object->second));
    };
    require_robot(checker_.set_robot(desc, kinematics, &bad_leaf));
    checker_.world().job().margin = margin;
    if (padding.empty()) return;
    const Status padded = checker_.set_padding(desc, padding, &bad_leaf);
    if (padded == Status::kSkinNotTaken) require(padded, refused_surface(padded, "triangles are not padded"));
    require_robot(padded);
  }

  // names: of its links.
  void add_fixed(const BodyData& body, const py::object& poses, const py::tuple& names) {
    const auto links = static_cast<py::ssize_t>(body.desc().link_parents.size);
    const Span<const float> given = span_of<const float>(poses, {"poses", {links, 7}, "(links, 7)"});
    auto copy = std::make_unique<std::vector<float>>(given.begin(), given.end());
    std::uint32_t bad_leaf = 0;
    const Status status = run([&] {
      const Status added = checker_.add_fixed(body.desc(), *copy, &bad_leaf);
      if (added == Status::kOk) {
        poses_.push_back(std::move(copy));
        note_fixed(names, false);
      }
      return added;
    });
    require(status, refused(status, bad_leaf));
  }

  // name: of all of them.
  void add_points(const py::object& points, double radius, const py::str& name) {
    const Span<const float> given = span_of<const float>(points, {"points", {-1, 3}, "(n, 3)"});
    if (given.empty()) raise_message(Status::kNoInstances, "points: there are none");
    std::uint32_t bad_point = 0;
    const Status status = run([&] {
      const Status added = checker_.add_points(given, static_cast<float>(radius), &bad_point);
      if (added == Status::kOk) note_fixed(name, true);
      return added;
    });
    if (status == Status::kBadShape) raise_length(status, "radius", radius, "above 0, up to 5e17");
    if (status == Status::kBadStaticBody)
      raise_message(status, "points[" + std::to_string(bad_point) + "]: a number is not finite");
    require(status);
  }

  py::array collides(const py::object& states) {
    const Span<const double> values = values_of(states);
    const auto count = static_cast<std::size_t>(states.cast<py::array>().shape(0));
    py::array_t<bool> out(static_cast<py::ssize_t>(count));
    static_assert(sizeof(bool) == sizeof(StateAnswer));
    auto* const answers = reinterpret_cast<StateAnswer*>(out.mutable_data());
    std::size_t first_not_tested = count;
    const Status status = run([&] {
      const Status answered = checker_.check(values, {answers, count});
      for (std::size_t i = count; i-- > 0;)
        if (answers[i] == StateAnswer::kNotTested) first_not_tested = i;
      return answered;
    });
    require(status);
    if (first_not_tested < count) raise_not_tested(first_not_tested);
    return std::move(out);
  }

  py::array hits(const py::object& states, bool depths) {
    const Span<const double> values = values_of(states);
    const auto count = static_cast<std::size_t>(states.cast<py::array>().shape(0));
    std::vector<StateHit> found;
    std::size_t first_not_tested = count;
    const Status status = run([&] {
      checker_.world().want_contacts(depths);
      Status tested = Status::kOk;
      for (std::size_t first = 0; first < count && tested == Status::kOk && first_not_tested == count;
           first += checker_.chunk()) {
        const auto size = static_cast<std::uint32_t>(std::min<std::size_t>(checker_.chunk(), count - first));
        tested = checker_.find_hits({values.data + first * variables_, size * variables_}, size);
        append(first, depths, found);
        const Span<const std::uint8_t> flags = checker_.flags();
        for (std::size_t i = flags.size; i-- > 0;)
          if (flags[i] != kInstanceOk) first_not_tested = first + i;
      }
      return tested;
    });
    require(status, refused_surface(status, kNoDepth));
    if (first_not_tested < count) raise_not_tested(first_not_tested);
    py::array_t<StateHit> out(static_cast<py::ssize_t>(found.size()));
    std::copy(found.begin(), found.end(), out.mutable_data());
    return std::move(out);
  }

  // Returns the nearest links, and their gradients, or an empty array if they are not asked for.
  py::tuple distances(const py::object& states, double most, bool gradients) {
    const Span<const double> values = values_of(states);
    const auto count = states.cast<py::array>().shape(0), variables = static_cast<py::ssize_t>(variables_);
    py::array_t<NearestLinks> out(count);
    py::array_t<double> slopes({gradients ? count : 0, variables});
    NearestLinks* const nearest = out.mutable_data();
    const Span<double> slope_span = {slopes.mutable_data(), static_cast<std::size_t>(slopes.size())};
    const Status status = run([&] {
      return checker_.find_nearest(values, {nearest, static_cast<std::size_t>(count)}, static_cast<float>(most),
                                   slope_span);
    });
    if (status == Status::kBadMargin) raise_length(status, "most", most, "from 0 to 1e18");
    require(status, refused_surface(status, kNoDepth));
    for (py::ssize_t i = 0; i < count; ++i)
      if (std::isnan(nearest[i].distance)) raise_not_tested(static_cast<std::size_t>(i));
    return py::make_tuple(std::move(out), std::move(slopes));
  }

  py::array edges(const py::object& from, const py::object& to, double resolution, bool first) {
    const Span<const double> starts = values_of(from), ends = values_of(to);
    const auto count = static_cast<std::size_t>(from.cast<py::array>().shape(0));
    if (starts.size != ends.size) throw py::value_error("ends: as many states as starts are wanted");
    std::vector<MotionAnswer> answers(count);
    std::vector<double> moments(first ? count : 0, std::numeric_limits<double>::quiet_NaN());
    MotionSearch search;
    search.resolution = resolution;
    search.first_moments = moments;
    const Status status = run([&] { return checker_.check_motions(starts, ends, answers, search); });
    if (status == Status::kBadResolution) raise_length(status, "resolution", resolution, "above 0, up to 1e18");
    require(status);
    py::array_t<Edge> out(static_cast<py::ssize_t>(count));
    Edge* const edges = out.mutable_data();
    for (std::size_t i = 0; i < count; ++i) {
      if (answers[i] == MotionAnswer::kNotTested)
        throw py::value_error("starts[" + std::to_string(i) + "], ends[" + std::to_string(i) +
                              "]: a number is not finite, or moves links by more than 5e17");
      edges[i] = {answers[i] == MotionAnswer::kFree, answers[i] == MotionAnswer::kColliding,
                  first ? moments[i] : std::numeric_limits<double>::quiet_NaN()};
    }
    return std::move(out);
  }

  // By number of what is fixed: the names of links, or the one name of points. Changed under mutex_ and the
  // interpreter's lock, so that either is enough to read it.
  py::list fixed_names() const { return fixed_names_; }

  std::string isa() { return to_string(engine_isa(checker_.world().engine())); }
  std::uint32_t thread_count() { return engine_thread_count(checker_.world().engine()); }

 private:
  // Runs a call alone, without the interpreter's lock.
  template <class Call>
  Status run(const Call& call) {
    const py::gil_scoped_release release;
    const std::lock_guard lock(mutex_);
    return call();
  }

  // For `run`: notes what was added, before any call can meet it.
  void note_fixed(const py::object& names, bool is_points) {
    is_points_.push_back(is_points);
    const py::gil_scoped_acquire acquire;
    fixed_names_.append(names);
  }

  Span<const double> values_of(const py::object& states) const {
    return span_of<const double>(states, {"states", {-1, static_cast<py::ssize_t>(variables_)}, "(n, variables)"});
  }

  // Hits with points come after those of all states with the rest.
  void append(std::size_t first, bool depths, std::vector<StateHit>& found) {
    World& world = checker_.world();
    const auto before = static_cast<std::ptrdiff_t>(found.size());
    for (std::size_t h = 0; h < world.hits().size; ++h) {
      const Hit& hit = world.hits()[h];
      const std::int32_t fixed = checker_.fixed_of(hit);
      const std::uint32_t link_b =
          fixed >= 0 && is_points_[static_cast<std::size_t>(fixed)] ? hit.instance_b : hit.link_b;
      found.push_back({static_cast<std::uint32_t>(first + hit.instance_a), fixed, hit.link_a, link_b,
                       depths ? world.contacts()[h].depth : std::numeric_limits<float>::quiet_NaN()});
    }
    std::stable_sort(found.begin() + before, found.end(),
                     [](const StateHit& a, const StateHit& b) { return a.state < b.state; });
  }

  std::size_t variables_;
  std::vector<std::unique_ptr<std::vector<float>>> poses_;  // of the fixed bodies
  std::vector<bool> is_points_;                             // by number of what is fixed
  py::list fixed_names_;                                    // the same
  AttachedObject attached_;                                 // if there are objects: the robot with them
  CollisionChecker checker_;
  std::mutex mutex_;  // never waited for with the interpreter's lock
};

}  // namespace

void bind_checker(py::module_& module) {
  PYBIND11_NUMPY_DTYPE(StateHit, state, fixed, link_a, link_b, depth);
  PYBIND11_NUMPY_DTYPE(NearestLinks, distance, fixed, link_a, link_b, normal, point_a, point_b);
  PYBIND11_NUMPY_DTYPE(Edge, free, colliding, moment);
  py::class_<Checker>(module, "Checker")
      .def(py::init<const files::Robot&, const BodyData&, const std::string&, std::uint32_t, float,
                    const std::vector<float>&, const py::sequence&>(),
           py::keep_alive<1, 2>())
      .def("add_fixed", &Checker::add_fixed)
      .def("add_points", &Checker::add_points)
      .def("collides", &Checker::collides)
      .def("hits", &Checker::hits)
      .def("distances", &Checker::distances)
      .def("edges", &Checker::edges)
      .def_property_readonly("fixed_names", &Checker::fixed_names)
      .def_property_readonly("isa", &Checker::isa)
      .def_property_readonly("thread_count", &Checker::thread_count);
}

}  // namespace cab::python
