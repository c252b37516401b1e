#include "common/app/run_main.hpp"

#include <fcntl.h>
#include <spdlog/spdlog.h>
#include <sys/resource.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cctype>
#include <cerrno>
#include <exception>
#include <new>
#include <regex>
#include <sstream>
#include <string>
#include <system_error>
#include <vector>

#include "common/app/log.hpp"
#include "common/app/stop_signal.hpp"
#include "common/config/config_error.hpp"
#include "common/text/edit_distance.hpp"

namespace sls::app {
namespace {

constexpr std::size_t kColumns = 80;

/// `a, b or c`.
std::string list_choices(std::vector<std::string> names) {
  if (names.empty()) return "";
  std::string text = names.back();
  names.pop_back();
  if (!names.empty()) text = CLI::detail::join(names, ", ") + " or " + text;
  return text;
}

std::string suggest(const std::string& word, const std::vector<std::string>& known) {
  const auto similar = text::find_similar(word, known);
  return similar ? "; did you mean '" + *similar + "'?" : "";
}

/// An argument that fits no option, subcommand or positional argument.
std::string describe_extra(const std::string& word, const CLI::App& cli) {
  const CLI::App* used = &cli;
  while (!used->get_subcommands().empty()) used = used->get_subcommands().back();
  if (word.rfind('-', 0) == 0) {
    std::vector<std::string> known;
    for (const CLI::Option* option : used->get_options())
      for (const std::string& name : option->get_lnames()) known.push_back("--" + name);
    return "unknown option '" + word + "'" + suggest(word, known);
  }
  std::vector<std::string> names;
  for (const CLI::App* command : used->get_subcommands([](const CLI::App*) { return true; }))
    names.push_back(command->get_name());
  if (names.empty()) return "expected no further argument, got '" + word + "'";
  return "expected " + list_choices(names) + ", got '" + word + "'" + suggest(word, names);
}

/// CLI11's error as `PLACE: expected X, got 'Y'`. `words` are the arguments of the program.
std::string describe_usage_error(const CLI::ParseError& error, const CLI::App& cli,
                                 const std::vector<std::string>& words) {
  std::string text = error.what();
  std::smatch found;
  const auto matches = [&](const char* pattern) {
    return std::regex_match(text, found, std::regex(pattern));
  };
  if (matches("The following arguments? w(?:as|ere) not expected: (.*)")) {
    const std::vector<std::string> extras = CLI::detail::split(found[1], ' ');
    // The first of several as the user typed them; one with spaces is not among the words.
    const auto first = std::find_first_of(words.begin(), words.end(), extras.begin(), extras.end());
    return describe_extra(first == words.end() ? found[1].str() : *first, cli);
  }
  if (matches("Could not convert: (\\S+) = (.*)")) {
    text = found[1].str() + ": expected a number, got '" + found[2].str() + "'";
  } else if (matches("(\\S+): (.*) not in \\{(.*)\\}")) {
    text = found[1].str() + ": expected " + list_choices(CLI::detail::split(found[3], ',')) +
           ", got '" + found[2].str() + "'";
  } else if (matches("(\\S+): Value (.*) not in range \\[?(\\S+) (?:to|-) ([^\\s\\]]+)\\]?")) {
    text = found[1].str() + ": expected " + found[3].str() + " to " + found[4].str() + ", got '" +
           found[2].str() + "'";
  } else if (matches("(\\S+): \\d+ required .* missing")) {
    text = found[1].str() + ": expected a value";
  }
  // A variable of the environment in the place of an option.
  const std::string domain = "--domain: ";
  const bool is_given = std::any_of(words.begin(), words.end(), [](const std::string& word) {
    return word.rfind("--domain", 0) == 0;
  });
  if (!is_given && text.rfind(domain + "expected", 0) == 0)
    return "SLS_DOMAIN: " + text.substr(domain.size());
  return text;
}

/// An option's line of CLI11 since 2.5 as earlier versions write it.
std::string to_earlier_line(std::string line) {
  const std::regex start("  (?:(-\\w), {5}| {8})(--.*)"),
      default_value("(.*) \\[([^\\]]*)\\](| \\(Env:\\w+\\))");
  std::smatch found;
  if (!std::regex_match(line, found, start)) return line;
  std::string spec = std::regex_replace(found[2].str(), std::regex(" +\\(Env:"), " (Env:");
  const std::size_t gap = std::min(spec.find("  "), spec.size());
  const std::string meaning = spec.substr(std::min(spec.find_first_not_of(' ', gap), spec.size()));
  spec = spec.substr(0, gap);
  line = found[1].matched ? "  " + found[1].str() + "," : "  ";
  std::smatch value;
  const bool has_default =
      std::regex_match(spec, value, default_value) &&
      !std::regex_match(value[1].str(), std::regex(".* in"));  // that is a range
  line += has_default ? value[1].str() + "=" + value[2].str() + value[3].str() : spec;
  constexpr std::size_t kMeaning = 30;
  if (meaning.empty()) return line;
  return line +
         (line.size() + 2 > kMeaning ? "\n" + std::string(kMeaning, ' ')
                                     : std::string(kMeaning - line.size(), ' ')) +
         meaning;
}

/// Help of CLI11 since 2.5 in the form of earlier versions, which the documents have.
std::string to_earlier_form(const std::string& help) {
  const std::regex title("(OPTIONS|POSITIONALS|SUBCOMMANDS):");
  std::istringstream lines(help);
  std::vector<std::string> before;
  std::string text;
  for (std::string line; std::getline(lines, line);) {
    line.erase(line.find_last_not_of(' ') + 1);
    if (std::regex_match(line, title)) {
      if (!before.empty()) {  // the description, then the usage
        const std::string usage = before.back();
        before.pop_back();
        for (const std::string& words : before) text += words + "\n";
        text += "Usage: " + usage + "\n\n";
        before.clear();
      }
      std::transform(line.begin() + 1, line.end(), line.begin() + 1,
                     [](unsigned char letter) { return std::tolower(letter); });
      text += line + "\n";
    } else if (text.empty()) {
      if (!line.empty()) before.push_back(line);
    } else {
      text += to_earlier_line(line) + "\n";
    }
  }
  return text.empty() ? help : text;  // without such a title it has the form
}

/// CLI11's help text with lines of at most 80 columns where words allow.
std::string fit(const std::string& help) {
  std::istringstream lines(to_earlier_form(help));
  std::string text;
  for (std::string line; std::getline(lines, line); text += line + "\n") {
    // An option and its meaning are apart by two spaces at least.
    const std::size_t start = std::min(line.find_first_not_of(' '), line.size());
    const std::size_t gap = std::min(line.find("  ", start), line.size());
    const std::size_t meaning = line.find_first_not_of(' ', gap);
    const std::string margin(meaning == line.npos ? start : meaning, ' ');
    while (line.size() > kColumns) {
      const std::size_t end = line.rfind(' ', kColumns);
      if (end == line.npos || end <= margin.size()) break;
      text += line.substr(0, line.find_last_not_of(' ', end) + 1) + "\n";
      line = margin + line.substr(end + 1);
    }
  }
  return text;
}

/// Opens the standard descriptors that are closed. Otherwise the first files that are opened get
/// their numbers, and what a library prints goes into a recording.
void keep_standard_descriptors() {
  while (true) {
    const int lowest = ::open("/dev/null", O_RDWR);
    if (lowest < 0 || lowest > STDERR_FILENO) {
      if (lowest >= 0) ::close(lowest);
      return;
    }
  }
}

/// "; the limit is 64 (ulimit -u)", if the shell has set one.
std::string describe_limit(decltype(RLIMIT_AS) resource, const char* name, rlim_t unit = 1) {
  struct rlimit limit {};
  if (::getrlimit(resource, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY) return "";
  return "; the limit is " + std::to_string(limit.rlim_cur / unit) + " (" + name + ")";
}

/// What an exception says, and which limit of the system is behind it.
std::string describe_failure(const std::exception& error) {
  if (dynamic_cast<const std::bad_alloc*>(&error))
    return "expected more memory, got none" + describe_limit(RLIMIT_AS, "ulimit -v", 1024);
  const auto* system = dynamic_cast<const std::system_error*>(&error);
  if (!system || system->code().category() != std::generic_category()) return error.what();
  if (system->code().value() == EAGAIN)
    return "expected another thread, got none" + describe_limit(RLIMIT_NPROC, "ulimit -u");
  if (system->code().value() == EMFILE)
    return "expected another descriptor, got none" + describe_limit(RLIMIT_NOFILE, "ulimit -n");
  return error.what();
}

/// Says in one line what would otherwise abort: threads of the middleware throw, too.
[[noreturn]] void end_with_a_line() {
  try {
    if (const auto thrown = std::current_exception()) std::rethrow_exception(thrown);
  } catch (const std::exception& error) {
    spdlog::error("{}", describe_failure(error));
    ::_exit(kExitRunFailed);
  } catch (...) {
  }
  std::abort();
}

}  // namespace

int run_main(int argc, char** argv, CommandLine& command_line, const CommonOptions& options,
             const std::string& program, const std::function<void()>& work) {
  keep_standard_descriptors();
  start_log(program, "info");
  std::set_terminate(end_with_a_line);
  CLI::App& cli = command_line.app();
  cli.name(program);
  try {
    cli.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_name() == "CallForHelp") {
      std::fputs(fit(cli.help()).c_str(), stdout);
      return kExitDone;
    }
    if (error.get_exit_code() == static_cast<int>(CLI::ExitCodes::Success))
      return cli.exit(error);  // --version
    spdlog::error("{} (see --help)", describe_usage_error(error, cli, {argv + 1, argv + argc}));
    return kExitBadUsage;
  }
  start_log(program, options.log_level);
  install_stop_signals();
  int code = kExitDone;
  try {
    work();
  } catch (const config::ConfigError& error) {
    spdlog::error("{}", error.what());
    code = kExitBadUsage;
  } catch (const std::exception& error) {
    spdlog::error("{}", describe_failure(error));
    code = kExitRunFailed;
  } catch (...) {
    spdlog::error("an exception of unknown type");
    code = kExitRunFailed;
  }
  return stop_signal() == 0 ? code : 128 + stop_signal();
}

}  // namespace sls::app
