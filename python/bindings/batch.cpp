#include "python/bindings/bindings.hpp"

namespace sls::python {

void add_batch(pybind11::module_&) {}

}  // namespace sls::python
