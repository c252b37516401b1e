/// The command line of a program, read by CLI11. Only files that need more than this include the
/// header of CLI11, which takes seconds to compile.
#pragma once

#include <filesystem>
#include <functional>
#include <initializer_list>
#include <memory>
#include <string>

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace sls::app {

/// Flags that every program on a domain takes.
struct CommonOptions {
  std::filesystem::path qos_file;
  int domain = 0;
  std::string log_level = "info";
};

/// An option of a command line; its functions return it, so that calls can follow each other.
class Option {
 public:
  explicit Option(CLI::Option* option) : option_(option) {}

  Option type_name(const std::string& name) const;
  Option required() const;
  /// Takes `least` to `most` values each time it is given, and keeps those of all times.
  Option repeatable(int least, int most) const;
  Option no_default() const;  ///< the help shows none
  Option range(int least, int most) const;
  Option one_of(const std::initializer_list<std::string>& words) const;
  /// `find_defect` returns what is wrong with a value, or nothing.
  Option check(const std::function<std::string(const std::string&)>& find_defect) const;
  Option excludes(Option other) const;
  Option needs(Option other) const;

 private:
  CLI::Option* option_;
};

class CommandLine {
 public:
  /// `--help`, which begins with `description`, and `--version`.
  explicit CommandLine(const std::string& description);
  ~CommandLine();

  /// Declares `--qos`, `--domain` and `--log-level`; `--help` prints every default. The domain is
  /// that of `--domain`, else that of the environment variable SLS_DOMAIN, else 0.
  void add_common_options(CommonOptions& options);
  /// `Value`: one of those that command_line.cpp names. `value` is the default.
  template <class Value>
  Option add_option(const std::string& name, Value& value, const std::string& help);
  Option add_flag(const std::string& name, bool& value, const std::string& help);
  /// A flag that prints something and ends the program.
  void add_print_flag(const std::string& name, const std::function<void()>& print,
                      const std::string& help);
  void footer(const std::string& text);

  CLI::App& app() { return *app_; }

 private:
  std::unique_ptr<CLI::App> app_;
};

/// add_common_options for a command of a command line.
void add_common_options(CLI::App& app, CommonOptions& options);

}  // namespace sls::app
