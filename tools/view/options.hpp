/// The command line of sls_view.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "common/app/options.hpp"
#include "tools/view/replay/export.hpp"
#include "tools/view/web/server.hpp"

namespace sls::view {

struct Options {
  app::CommonOptions common;
  std::vector<std::filesystem::path> recordings;  ///< empty: live
  std::filesystem::path export_file;              ///< empty: serve the page
  std::size_t most_bytes = kMostExportedBytes;    ///< size limit of `export_file`
  std::uint32_t vehicle_id = 0;
  std::string identity = "viewer";  ///< role whose keys it uses on a secured domain
  bool has_ros_face = false;
  std::filesystem::path token_file;  ///< empty: no token
  ServerOptions server;

  /// Puts the token and the address into `server`.
  /// @throws config::ConfigError as load_token and `check` (web/access.hpp), and if two options
  ///   exclude each other.
  void complete();
};

/// Declares the flags; `options` must outlive `cli`'s parsing.
void add_options(CLI::App& cli, Options& options);

}  // namespace sls::view
