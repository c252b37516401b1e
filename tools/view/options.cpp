#include "tools/view/options.hpp"

#include "common/config/config_error.hpp"
#include "tools/view/web/access.hpp"

namespace sls::view {

void add_options(CLI::App& cli, Options& options) {
  app::add_common_options(cli, options.common);
  cli.add_option("DIR", options.recordings,
                 "recordings to replay, at most two, overlaid; none: the flight on the domain")
      ->expected(0, 2)
      ->default_str("");
  cli.add_option("--vehicle", options.vehicle_id, "of several servers, watch that of vehicle N")
      ->type_name("N");
  cli.add_option("--listen", options.server.address,
                 "address to listen on; others than loopback need --token-file")
      ->type_name("ADDRESS");
  cli.add_option("--port", options.server.port, "port to listen on; 0: any that is free")
      ->type_name("N");
  cli.add_option("--token-file", options.token_file,
                 "file whose first line is the token without which a page has no buttons")
      ->type_name("FILE");
  cli.add_flag("--read-only", options.server.access.is_read_only, "no page has buttons");
  cli.add_option("--allow-origin", options.server.access.allowed_origins,
                 "foreign page that may look, and operate with the token, such as "
                 "https://app.foxglove.dev; repeatable")
      ->type_name("URL")
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll)
      ->default_str("");
  cli.add_flag("--ros", options.has_ros_face, "write the flight on ROS 2 topics, too");
  cli.add_option("--identity", options.identity,
                 "keys of a secured domain to use; those of an operator give pages buttons")
      ->type_name("NAME");
  cli.add_option("--export", options.export_file,
                 "write the page with the recordings in it to FILE, and end")
      ->type_name("FILE");
  cli.add_option("--most-bytes", options.most_bytes,
                 "of the file of --export; steps are left out until it fits")
      ->type_name("N");
}

void Options::complete() {
  if (!export_file.empty() && recordings.empty())
    throw config::ConfigError("--export: expected a recording with it, got none");
  if (has_ros_face && !recordings.empty())
    throw config::ConfigError("--ros: expected no recording with it, got " +
                              recordings.front().string());
  if (!token_file.empty()) server.access.token = load_token(token_file.string());
  server.access.address = server.address;
  check(server.access);
}

}  // namespace sls::view
