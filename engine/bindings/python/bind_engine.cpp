// The classes of engine_handle.h in Python.
#include "engine/bindings/python/engine_handle.h"

#include <pybind11/stl.h>

#include <string>

namespace cab::python {
namespace {

// A class of numbers for Python, member by member, whose repr shows those that are not 0.
template <class Numbers>
class NumbersClass {
 public:
  NumbersClass(py::module_& module, const char* name, const char* doc) : class_(module, name, doc) {
    class_.attr("__module__") = "cab";
    class_.def("__repr__", [names = names_, title = std::string("cab.") + name](const py::object& self) {
      py::list shown;
      for (const py::handle member : names) {
        const py::object value = self.attr(member);
        if (value.cast<double>() == 0) continue;
        shown.append(py::str(py::isinstance<py::float_>(value) ? "{}={:.6g}" : "{}={}").format(member, value));
      }
      return title + "(" + py::str(", ").attr("join")(shown).cast<std::string>() + ")";
    });
  }

  template <class Number>
  NumbersClass& add(const char* name, Number Numbers::*member, const char* doc) {
    class_.def_readonly(name, member, doc);
    names_.append(name);
    return *this;
  }

 private:
  py::class_<Numbers> class_;
  py::list names_;
};

void bind_stats(py::module_& module) {
  NumbersClass<FrameStats>(module, "FrameStats",
                           "What a frame did. Counts, and seconds as sums over threads, but for seconds_total.")
      .add("candidates", &FrameStats::candidates,
           "Pairs of characters whose bounds overlap, and characters tested within.")
      .add("box_tests", &FrameStats::box_tests, "Overlap tests of two boxes, inner ones and those of links.")
      .add("leaf_pairs", &FrameStats::leaf_pairs, "Pairs of boxes of links that overlap.")
      .add("exact_tests", &FrameStats::exact_tests, "Of these the ones that went to the exact test.")
      .add("false_positives", &FrameStats::false_positives, "Exact tests that found the two apart.")
      .add("instances_masked", &FrameStats::instances_masked, "Characters that took no part; `Posed.flags` says which.")
      .add("instances_beyond_bounds", &FrameStats::instances_beyond_bounds,
           "Characters whose boxes leave the `bounds` that were given.")
      .add("instances_resting", &FrameStats::instances_resting,
           "Characters and static bodies that were not bounded again.")
      .add("hits_kept", &FrameStats::hits_kept, "Hits of two that rest, taken over from the last frame.")
      .add("leaves_skinned", &FrameStats::leaves_skinned,
           "How often triangles of a box were skinned; depends on the threads.")
      .add("leaves_replaced", &FrameStats::leaves_replaced,
           "Of these, in the place of another box that had been skinned.")
      .add("instances_posed", &FrameStats::instances_posed,
           "How often a character was posed again for tests; depends on the threads.")
      .add("candidates_apart", &FrameStats::candidates_apart,
           "Candidates without two boxes of links whose bounds overlap.")
      .add("seconds_update", &FrameStats::seconds_update, "Posing, and boxes from poses.")
      .add("seconds_broad", &FrameStats::seconds_broad, "Finding characters whose bounds overlap.")
      .add("seconds_test", &FrameStats::seconds_test, "Testing boxes against each other.")
      .add("seconds_query", &FrameStats::seconds_query, "Exact tests, reporting hits, and contacts.")
      .add("seconds_contact", &FrameStats::seconds_contact, "Contacts, which seconds_query includes.")
      .add("seconds_total", &FrameStats::seconds_total, "Wall time of the call.")
      .add("seconds_bound", &FrameStats::seconds_bound, "Of seconds_update: posing every character for its bounds.")
      .add("seconds_sort", &FrameStats::seconds_sort, "Of seconds_broad: sorting.")
      .add("seconds_filter", &FrameStats::seconds_filter, "Of seconds_test: comparing the bounds of boxes of links.")
      .add("seconds_write", &FrameStats::seconds_write, "Of seconds_query: writing the hits in their order.");
  NumbersClass<QueryStats>(
      module, "QueryStats",
      "What a call with queries did. Counts, and seconds as sums over threads, but for seconds_total.")
      .add("nodes", &QueryStats::nodes, "Nodes of the index that were compared with a query, sixteen bounds at a time.")
      .add("instances", &QueryStats::instances, "Characters whose bounds a query met.")
      .add("leaf_tests", &QueryStats::leaf_tests, "Boxes of links that a query may meet.")
      .add("exact_tests", &QueryStats::exact_tests, "Of these the ones whose exact shapes were tested.")
      .add("leaves_skinned", &QueryStats::leaves_skinned,
           "How often triangles of a box were skinned; depends on the threads.")
      .add("leaves_replaced", &QueryStats::leaves_replaced,
           "Of these, in the place of another box that had been skinned.")
      .add("instances_posed", &QueryStats::instances_posed,
           "How often characters were posed for tests; depends on the threads.")
      .add("instances_masked", &QueryStats::instances_masked, "Characters that took no part.")
      .add("clamped", &QueryStats::clamped, "How often a query's time was before or after all that a history has.")
      .add("seconds_bound", &QueryStats::seconds_bound, "Posing characters for their bounds.")
      .add("seconds_index", &QueryStats::seconds_index, "Making the index.")
      .add("seconds_search", &QueryStats::seconds_search, "Everything that is done per query.")
      .add("seconds_total", &QueryStats::seconds_total, "Wall time of the call.");
  NumbersClass<EngineMemory>(module, "Memory", "How many bytes the engine of a world holds for what.")
      .add("articulations", &EngineMemory::articulations, "Bodies: joints, boxes, shapes.")
      .add("batches", &EngineMemory::batches, "Bounds of characters, and static bodies.")
      .add("workers", &EngineMemory::workers, "Boxes and lists of the threads.")
      .add("broad_phase", &EngineMemory::broad_phase, "Bounds and strips of characters.")
      .add("hits", &EngineMemory::hits, "Hits, until they are written.")
      .add("queries", &EngineMemory::queries, "The index of characters, and what is kept per query.")
      .add("histories", &EngineMemory::histories, "The moments that are kept.")
      .add("total", &EngineMemory::total, "All of these, and what rules take.");
}

}  // namespace

void bind_engine(py::module_& module) {
  bind_stats(module);
  py::class_<FrameInput>(module, "FrameInput")
      .def_property_readonly("count", &FrameInput::count)
      .def_property_readonly("poses_address", &FrameInput::poses_address)
      .def_property_readonly("flags", &FrameInput::flags)
      .def_property_readonly("in_contact", &FrameInput::in_contact);
  py::class_<EngineHandle>(module, "Engine")
      .def(py::init<const std::string&, std::uint32_t>(), py::arg("isa"), py::arg("thread_count"))
      .def("close", &EngineHandle::close)
      .def("add_articulation", &EngineHandle::add_articulation)
      .def("remove_articulation", &EngineHandle::remove_articulation)
      .def("add_batch", &EngineHandle::add_batch)
      .def("add_static", &EngineHandle::add_static)
      .def("remove_batch", &EngineHandle::remove_batch)
      .def("grow_batch", &EngineHandle::grow_batch)
      .def("has_batch", &EngineHandle::has_batch)
      .def("reserve", &EngineHandle::reserve)
      .def("make_input", &EngineHandle::make_input)
      .def("run_frame",
           [](EngineHandle& engine, const std::vector<FrameInput*>& inputs, const std::vector<RuleTuple>& rules,
              const PolicyNames& policies, float margin, float min_depth, std::uint8_t report, bool contacts,
              bool containment) {
             FrameResult result =
                 engine.run_frame(inputs, rules, {policies, margin, min_depth, report, contacts, containment});
             return py::make_tuple(result.hits, result.contacts, result.stats);
           })
      .def("run_queries",
           [](EngineHandle& engine, const std::vector<FrameInput*>& inputs, const std::vector<std::uint64_t>& histories,
              const py::object& queries, const py::object& planes, const std::string& exact, bool reuse_bounds,
              std::uint8_t report, bool surface_points) {
             QueryResult result = engine.run_queries(inputs, histories, queries, planes, exact, reuse_bounds,
                                                     static_cast<QueryReport>(report), surface_points);
             return py::make_tuple(result.hits, result.counts, result.found, result.surface_points, result.stats);
           })
      .def("compute_contacts", &EngineHandle::compute_contacts)
      .def("find_touching_triangles", &EngineHandle::find_touching_triangles)
      .def("compute_boxes", &EngineHandle::compute_boxes)
      .def("sweep_margins", &EngineHandle::sweep_margins)
      .def("find_touching_moments", &EngineHandle::find_touching_moments)
      .def("spatial_order", &EngineHandle::spatial_order)
      .def("why_masked", &EngineHandle::why_masked)
      .def("find_masked", &EngineHandle::find_masked)
      .def("add_history", &EngineHandle::add_history)
      .def("remove_history", &EngineHandle::remove_history)
      .def("record_tick", &EngineHandle::record_tick)
      .def("history_span",
           [](const EngineHandle& engine, std::uint64_t id) {
             const HistorySpan span = engine.history_span(id);
             return py::make_tuple(span.ticks, span.first, span.last);
           })
      .def("ignored_pairs", &EngineHandle::ignored_pairs)
      .def_property_readonly("memory", &EngineHandle::memory)
      .def_property_readonly("isa", &EngineHandle::isa)
      .def_property_readonly("thread_count", &EngineHandle::thread_count);
}

}  // namespace cab::python
