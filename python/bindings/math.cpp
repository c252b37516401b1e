/// Our own elementary functions for numpy arrays and numbers: the same bits on every processor and
/// C library.
#include "common/model/math.hpp"

#include <pybind11/numpy.h>

#include "python/bindings/bindings.hpp"

namespace sls::python {

void add_math(pybind11::module_& module) {
  using pybind11::vectorize;
  pybind11::module_ functions = module.def_submodule(
      "math", "Functions of numbers or arrays that return the same bits on every machine.");
  functions.def("sin", vectorize(math::sin), pybind11::arg("x"));
  functions.def("cos", vectorize(math::cos), pybind11::arg("x"));
  functions.def("exp", vectorize(math::exp), pybind11::arg("x"));
  functions.def("log", vectorize(math::log), pybind11::arg("x"));
  functions.def("atan2", vectorize(math::atan2), pybind11::arg("y"), pybind11::arg("x"));
}

}  // namespace sls::python
