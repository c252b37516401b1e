#include "tools/view/options.hpp"

#include "common/config/config_error.hpp"
#include "tools/view/web/access.hpp"

namespace sls::view {

void add_options(CLI::App& cli, Options& options) {
  app::add_common_options(cli, options.common);
  cli.add_option("DIR", options.recordings,
                 "one or two recordings to replay (default: the live flight on the domain)")
      ->expected(0, 2)
      ->type_name("")
      ->default_str("");
  cli.add_option("--vehicle", options.vehicle_id, "watch the server that flies vehicle N")
      ->type_name("N");
  cli.add_option("--listen", options.server.address,
                 "address to listen on; addresses other than loopback need --token-file")
      ->type_name("ADDRESS");
  cli.add_option("--port", options.server.port, "port to listen on; 0: any free port")
      ->type_name("N");
  cli.add_option("--token-file", options.token_file,
                 "file whose first line is the token that enables a page's buttons")
      ->type_name("FILE");
  cli.add_flag("--read-only", options.server.access.is_read_only, "show no buttons on any page");
  cli.add_option("--allow-origin", options.server.access.allowed_origins,
                 "other origin whose pages may connect, and operate with the token, such as "
                 "https://app.foxglove.dev; repeatable")
      ->type_name("URL")
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll)
      ->default_str("");
  cli.add_flag("--ros", options.has_ros_face, "also publish the flight on ROS 2 topics");
  cli.add_option("--identity", options.identity,
                 "role whose keys to use on a secured domain; operator enables buttons")
      ->type_name("NAME");
  cli.add_option("--export", options.export_file,
                 "write a page that contains the recordings to FILE and exit")
      ->type_name("FILE");
  cli.add_option("--most-bytes", options.most_bytes,
                 "largest size of the file of --export; steps are left out to fit")
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
