#include "python/bindings/bindings.hpp"

namespace sls::python {

void add_campaign(pybind11::module_&) {}

}  // namespace sls::python
