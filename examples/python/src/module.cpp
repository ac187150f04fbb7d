// The module: see docs/python.md.
#include "results.hpp"

PYBIND11_MODULE(_globalmatch, module) {
  using namespace globalmatch::python;
  module.attr("__version__") = GLOBALMATCH_VERSION;
  add_stem_maps(module);
  add_matchings(module);
  add_registrations(module);
  add_surveys(module);
}
