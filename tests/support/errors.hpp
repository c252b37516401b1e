#pragma once

#include <string>

namespace sls::test {

/// The message of the `Error` that `work` throws, or "no error".
template <class Error, class Work>
std::string find_error(const Work& work) {
  try {
    work();
  } catch (const Error& error) {
    return error.what();
  }
  return "no error";
}

}  // namespace sls::test
