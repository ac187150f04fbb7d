// The options of the library as keyword arguments, under the names that they have in C++.
#pragma once

#include <globalmatch/execution.hpp>
#include <globalmatch/refinement_options.hpp>
#include <globalmatch/registration_options.hpp>
#include <globalmatch/survey_options.hpp>

#include <chrono>
#include <tuple>

#include "keywords.hpp"

namespace globalmatch::python {

/// What all functions take.
struct run_options {
  int threads = 0;
  py::object progress = py::none();
};

/// Those of functions over scans or stems in one frame.
struct frame_options {
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
};

void read_fields(keywords& from, run_options& options);
void read_fields(keywords& from, frame_options& options);
void read_fields(keywords& from, mapping_options& options);
void read_fields(keywords& from, matching_options& options);
void read_fields(keywords& from, icp_options& options);
void read_fields(keywords& from, survey_options& options);
void read_fields(keywords& from, refinement_options& options);

/// All options of a function, from its keyword arguments. Throws for those that it has not.
template <class... Options>
std::tuple<Options...> read_options(const py::dict& given, py::dict* defaults = nullptr) {
  std::tuple<Options...> options;
  keywords from(given);
  std::apply([&](auto&... each) { (read_fields(from, each), ...); }, options);
  if (defaults) *defaults = from.defaults();
  from.finish();
  return options;
}

/// The documentation of a function: `text`, and the keyword arguments with their defaults, which go to
/// `module.defaults` as well.
std::string document(py::module_& module, const char* function, const std::string& text,
                     const py::dict& defaults);
template <class... Options>
std::string document(py::module_& module, const char* function, const std::string& text) {
  py::dict defaults;
  read_options<Options...>(py::dict(), &defaults);
  return document(module, function, text, defaults);
}

/// The ICP of a registration: the name of its metric, or a dictionary of its options.
struct registration_icp {
  icp_options icp;
};
inline void read_fields(keywords& from, registration_icp& options) {
  from.group("icp", options.icp, "metric");
}

/// Calls `callback(fraction, stage)` unless it is None. Whether to go on: None says so, anything else by its
/// truth value.
bool ask(const py::object& callback, const progress& at);

/// Runs `work(exec)` without the GIL. Where the library asks, every 20 ms at most, signals are looked at and
/// `progress(fraction, stage)` is called. What either raises, as KeyboardInterrupt, is raised once all
/// threads have stopped.
template <class Work>
auto run(const run_options& options, const Work& work) {
  using clock = std::chrono::steady_clock;
  constexpr std::chrono::milliseconds interval{20};  // taking the GIL may have to wait for other threads
  clock::time_point asked = {};
  execution exec;
  exec.threads = options.threads;
  exec.on_progress = [&](const progress& p) {
    if (clock::now() - asked < interval) return true;
    const py::gil_scoped_acquire gil;
    if (PyErr_CheckSignals() != 0) throw py::error_already_set();
    const bool goes_on = ask(options.progress, p);
    asked = clock::now();
    return goes_on;
  };
  const py::gil_scoped_release release;
  return work(exec);
}

}  // namespace globalmatch::python
