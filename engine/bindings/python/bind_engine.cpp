// The classes of engine_handle.h in Python.
#include "engine/bindings/python/engine_handle.h"

#include <pybind11/stl.h>

namespace cab::python {
namespace {

void bind_stats(py::module_& module) {
  py::class_<FrameStats>(module, "FrameStats")
      .def_readonly("candidates", &FrameStats::candidates)
      .def_readonly("box_tests", &FrameStats::box_tests)
      .def_readonly("leaf_pairs", &FrameStats::leaf_pairs)
      .def_readonly("exact_tests", &FrameStats::exact_tests)
      .def_readonly("false_positives", &FrameStats::false_positives)
      .def_readonly("instances_masked", &FrameStats::instances_masked)
      .def_readonly("instances_beyond_bounds", &FrameStats::instances_beyond_bounds)
      .def_readonly("instances_resting", &FrameStats::instances_resting)
      .def_readonly("hits_kept", &FrameStats::hits_kept)
      .def_readonly("leaves_skinned", &FrameStats::leaves_skinned)
      .def_readonly("leaves_replaced", &FrameStats::leaves_replaced)
      .def_readonly("instances_posed", &FrameStats::instances_posed)
      .def_readonly("candidates_apart", &FrameStats::candidates_apart)
      .def_readonly("seconds_update", &FrameStats::seconds_update)
      .def_readonly("seconds_broad", &FrameStats::seconds_broad)
      .def_readonly("seconds_test", &FrameStats::seconds_test)
      .def_readonly("seconds_query", &FrameStats::seconds_query)
      .def_readonly("seconds_contact", &FrameStats::seconds_contact)
      .def_readonly("seconds_total", &FrameStats::seconds_total)
      .def_readonly("seconds_bound", &FrameStats::seconds_bound)
      .def_readonly("seconds_sort", &FrameStats::seconds_sort)
      .def_readonly("seconds_filter", &FrameStats::seconds_filter)
      .def_readonly("seconds_write", &FrameStats::seconds_write);
  py::class_<QueryStats>(module, "QueryStats")
      .def_readonly("nodes", &QueryStats::nodes)
      .def_readonly("instances", &QueryStats::instances)
      .def_readonly("leaf_tests", &QueryStats::leaf_tests)
      .def_readonly("exact_tests", &QueryStats::exact_tests)
      .def_readonly("leaves_skinned", &QueryStats::leaves_skinned)
      .def_readonly("leaves_replaced", &QueryStats::leaves_replaced)
      .def_readonly("instances_posed", &QueryStats::instances_posed)
      .def_readonly("instances_masked", &QueryStats::instances_masked)
      .def_readonly("clamped", &QueryStats::clamped)
      .def_readonly("seconds_bound", &QueryStats::seconds_bound)
      .def_readonly("seconds_index", &QueryStats::seconds_index)
      .def_readonly("seconds_search", &QueryStats::seconds_search)
      .def_readonly("seconds_total", &QueryStats::seconds_total);
  py::class_<EngineMemory>(module, "Memory")
      .def_readonly("articulations", &EngineMemory::articulations)
      .def_readonly("batches", &EngineMemory::batches)
      .def_readonly("workers", &EngineMemory::workers)
      .def_readonly("rows", &EngineMemory::rows)
      .def_readonly("hits", &EngineMemory::hits)
      .def_readonly("queries", &EngineMemory::queries)
      .def_readonly("histories", &EngineMemory::histories)
      .def_readonly("total", &EngineMemory::total);
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
              const PolicyNames& policies, float margin, float min_depth, std::uint8_t report, bool contacts) {
             FrameResult result = engine.run_frame(inputs, rules, {policies, margin, min_depth, report, contacts});
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
