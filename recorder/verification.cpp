#include "recorder/verification.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <limits>
#include <map>
#include <set>
#include <type_traits>

#include "common/config/yaml_node.hpp"
#include "recorder/certificate.hpp"

namespace sls::record {
namespace {

namespace fs = std::filesystem;

// --- one recording -------------------------------------------------------------------------------

/// Hash and number of rows of a file, in one pass.
ManifestFile::File measure(const fs::path& path) {
  std::ifstream stream = open_recorded_file(path);
  text::Sha256 hash;
  std::uint64_t lines = 0;
  bool is_quoted = false;
  using Block = std::array<char, 1 << 16>;
  static const Block zeros = {};
  Block block;
  while (stream.read(block.data(), block.size()) || stream.gcount() > 0) {
    const std::string_view bytes(block.data(), static_cast<std::size_t>(stream.gcount()));
    // A hole in a file, which may be larger than any disk.
    if (bytes.size() == block.size() && block == zeros)
      throw DamagedError(path.string() + ": expected data, got zeros");
    hash.add(bytes);
    for (const char letter : bytes) {
      is_quoted = is_quoted != (letter == '"');
      lines += letter == '\n' && !is_quoted ? 1 : 0;
    }
  }
  if (stream.bad()) throw DamagedError(path.string() + ": cannot read");
  return {lines > 0 ? lines - 1 : 0, text::to_hex(hash.finish())};
}

void check_file(const fs::path& path, const ManifestFile::File& expected,
                std::vector<std::string>& problems) {
  const ManifestFile::File found = measure(path);
  if (expected.rows && *expected.rows != *found.rows)
    problems.push_back(
        fmt::format("{}: {} rows, manifest: {}", path.string(), *found.rows, *expected.rows));
  if (expected.sha256 != found.sha256)
    problems.push_back(
        fmt::format("{}: SHA-256 {}, manifest: {}", path.string(), found.sha256, expected.sha256));
}

/// A segment whose recorder was killed lists no files: the segment after it covers its rows.
void check_files(const RecordedSegment& segment, bool is_last, std::vector<std::string>& problems) {
  if (is_last && segment.manifest.files.empty())
    problems.push_back((segment.folder / "manifest.json").string() +
                       ": lists no files: the recorder is running, or was killed");
  for (const auto& [name, expected] : segment.manifest.files) {
    try {
      check_file(segment.folder / name, expected, problems);
    } catch (const DamagedError& error) {
      problems.push_back(error.what());
    }
  }
}

void certify(const OpenedRecording& flight, Inspection& inspection) {
  Certificate certificate;
  std::map<std::uint32_t, std::uint64_t> steps;
  StepReader reader(flight);
  while (const auto rows = reader.next()) {
    certificate.add(*rows);
    inspection.steps = std::max(inspection.steps, ++steps[rows->vehicle_id]);
  }
  inspection.certificate = certificate.finish();
}

// --- two recordings ------------------------------------------------------------------------------

/// The fields of a row as text for people; empty for a field that can differ between equal flights.
struct FieldLister {
  std::vector<std::string> texts;
  std::vector<bool> are_nan;
  std::vector<double> numbers;  // NaN for a text

  template <class Field>
  void operator()(const Column& column, const Field& field) {
    for_each_component(field, [&](const auto& component) {
      are_nan.push_back(component != component);
      texts.push_back(column.is_certified ? format(component) : "");
      numbers.push_back(to_number(component));
    });
  }
  template <class Number>
  static double to_number(const Number& number) {
    if constexpr (std::is_arithmetic_v<Number>) return static_cast<double>(number);
    return std::numeric_limits<double>::quiet_NaN();
  }
  template <class Number>
  static std::string format(const Number& number) {
    return fmt::format("{}", number);
  }
  static std::string format(const std::string& text) {
    return "'" + config::to_printable(text) + "'";
  }
};

template <class Row>
FieldLister list_fields(const StepRows& rows) {
  FieldLister lister;
  Row::visit(rows, lister);
  return lister;
}

template <class Row>
std::vector<std::string> read_columns(const OpenedRecording& flight) {
  return CsvReader(flight.folder / Row::kFile, "vehicle_id", CsvReader::Further::kAllowed)
      .columns();
}

template <class Row>
std::optional<std::string> compare_rows(const StepRows& a, const StepRows& b,
                                        const OpenedRecording& flight) {
  const bool is_in_a = a.*Row::kIsThere, is_in_b = b.*Row::kIsThere;
  if (!is_in_a && !is_in_b) return std::nullopt;
  const std::string place =
      fmt::format("{}, vehicle {}, step {}", Row::kFile, a.vehicle_id, a.step);
  if (!is_in_a || !is_in_b) return fmt::format("{}: a row in {} alone", place, is_in_a ? "A" : "B");
  if (to_bytes<Row>(a) == to_bytes<Row>(b)) return std::nullopt;
  const FieldLister of_a = list_fields<Row>(a), of_b = list_fields<Row>(b);
  const std::vector<std::string> columns = read_columns<Row>(flight);
  for (std::size_t i = 0; i < std::min({of_a.texts.size(), of_b.texts.size(), columns.size()}); ++i)
    if (of_a.texts[i] != of_b.texts[i])
      return fmt::format("{}, {}: {} in A, {} in B{}", place, config::to_printable(columns[i]),
                         of_a.texts[i], of_b.texts[i],
                         of_a.are_nan[i] && of_b.are_nan[i]
                             ? " (neither is a number; their signs differ)"
                         : of_a.numbers[i] == of_b.numbers[i] ? " (equal numbers of other bits)"
                                                              : "");
  return fmt::format("{}: {} fields in A, {} in B", place, of_a.texts.size(), of_b.texts.size());
}

std::optional<std::string> compare_steps(const StepRows& a, const StepRows& b,
                                         const OpenedRecording& flight) {
  if (auto text = compare_rows<StateRow>(a, b, flight)) return text;
  if (auto text = compare_rows<CommandRow>(a, b, flight)) return text;
  return compare_rows<ReferenceRow>(a, b, flight);
}

/// The first difference between `a` and `b`, the next steps of one vehicle in the two recordings.
std::optional<Difference> compare_next(const std::optional<StepRows>& a,
                                       const std::optional<StepRows>& b,
                                       const OpenedRecording& flight) {
  if (!a && !b) return std::nullopt;
  if (!a || !b || a->step != b->step) {
    const bool is_in_a = a && (!b || a->step < b->step);
    const StepRows& alone = is_in_a ? *a : *b;
    return Difference{alone.step, fmt::format("vehicle {}, step {}: in {} alone", alone.vehicle_id,
                                              alone.step, is_in_a ? "A" : "B")};
  }
  if (auto text = compare_steps(*a, *b, flight)) return Difference{a->step, *text};
  return std::nullopt;
}

/// Adds the deviations of a pair of rows to those of the columns of `file`.
template <class Row>
void add_deviations(const StepRows& a, const StepRows& b, const OpenedRecording& flight, int file,
                    std::map<std::pair<int, std::size_t>, Deviation>& worst) {
  const bool are_there = a.*Row::kIsThere && b.*Row::kIsThere;
  if (!are_there || to_bytes<Row>(a) == to_bytes<Row>(b)) return;
  const FieldLister of_a = list_fields<Row>(a), of_b = list_fields<Row>(b);
  for (std::size_t i = 0; i < std::min(of_a.texts.size(), of_b.texts.size()); ++i) {
    if (of_a.texts[i] == of_b.texts[i]) continue;
    const double size = std::abs(of_a.numbers[i] - of_b.numbers[i]);
    auto& entry = worst[{file, i}];
    const bool is_new = entry.column.empty();
    if (is_new) entry.column = fmt::format("{}, {}", Row::kFile, read_columns<Row>(flight).at(i));
    if (is_new || size > entry.largest || (std::isnan(size) && !std::isnan(entry.largest)))
      entry = {entry.column, size, a.vehicle_id, a.step};
  }
}

}  // namespace

Inspection inspect(const OpenedRecording& flight) {
  Inspection inspection;
  for (const RecordedSegment& segment : flight.segments)
    check_files(segment, &segment == &flight.segments.back(), inspection.problems);
  try {
    certify(flight, inspection);
  } catch (const DamagedError& error) {
    inspection.problems.push_back(error.what());
    return inspection;
  }
  const ManifestFile& manifest = flight.manifest();
  if (!manifest.files.empty() && inspection.certificate != manifest.certificate)
    inspection.problems.push_back(fmt::format("{}: certificate of the rows {}, manifest: {}",
                                              flight.folder.string(), inspection.certificate,
                                              manifest.certificate));
  return inspection;
}

std::optional<Difference> find_first_difference(const OpenedRecording& a,
                                                const OpenedRecording& b) {
  if (read_columns<StateRow>(a) != read_columns<StateRow>(b))
    return Difference{0, fmt::format("{}: other columns in A than in B", StateRow::kFile)};
  std::set<std::uint32_t> ids;
  for (const auto* flight : {&a, &b})
    for (const std::uint32_t id : flight->vehicle_ids()) ids.insert(id);
  StepReader reader_a(a), reader_b(b);
  std::optional<Difference> first;
  while (!ids.empty())
    for (auto id = ids.begin(); id != ids.end();) {
      const auto step_a = reader_a.next(*id), step_b = reader_b.next(*id);
      const auto difference = compare_next(step_a, step_b, a);
      if (difference && (!first || difference->step < first->step)) first = difference;
      const bool is_over = difference || !step_a || (first && step_a->step >= first->step);
      id = is_over ? ids.erase(id) : std::next(id);
    }
  return first;
}

std::vector<Deviation> list_deviations(const OpenedRecording& a, const OpenedRecording& b) {
  StepReader reader_a(a), reader_b(b);
  std::map<std::pair<int, std::size_t>, Deviation> worst;
  std::vector<std::uint32_t> ids = a.vehicle_ids();
  while (!ids.empty())
    for (auto id = ids.begin(); id != ids.end();) {
      auto step_a = reader_a.next(*id), step_b = reader_b.next(*id);
      while (step_a && step_b && step_a->step != step_b->step)
        if (step_a->step < step_b->step)
          step_a = reader_a.next(*id);
        else
          step_b = reader_b.next(*id);
      if (!step_a || !step_b) {
        id = ids.erase(id);
        continue;
      }
      add_deviations<StateRow>(*step_a, *step_b, a, 0, worst);
      add_deviations<CommandRow>(*step_a, *step_b, a, 1, worst);
      add_deviations<ReferenceRow>(*step_a, *step_b, a, 2, worst);
      ++id;
    }
  std::vector<Deviation> all;
  for (const auto& [column, deviation] : worst) all.push_back(deviation);
  return all;
}

std::string describe(const Deviation& deviation) {
  const std::string place =
      fmt::format(", vehicle {}, step {}", deviation.vehicle_id, deviation.step);
  if (std::isnan(deviation.largest)) return deviation.column + ": other values" + place;
  if (deviation.largest == 0) return deviation.column + ": other bits of equal numbers" + place;
  return fmt::format("{}: {:.3g}{}", deviation.column, deviation.largest, place);
}

std::vector<std::string> list_notes(const OpenedRecording& a, const OpenedRecording& b) {
  std::vector<std::string> notes;
  const ManifestFile &of_a = a.manifest(), &of_b = b.manifest();
  const auto compare = [&](const char* what, const auto& in_a, const auto& in_b) {
    if (!(in_a == in_b)) notes.push_back(fmt::format("{}: {} in A, {} in B", what, in_a, in_b));
  };
  compare("scenario's SHA-256", of_a.scenario_sha256, of_b.scenario_sha256);
  compare("period in force, s", of_a.period_s, of_b.period_s);
  compare("mode", of_a.mode, of_b.mode);
  const auto describe_gaps = [&](const char* name, const ManifestFile& manifest) {
    if (!manifest.missing.empty())
      notes.push_back(fmt::format("{}: {}", name, describe(manifest.missing)));
    if (!manifest.complete)
      notes.push_back(
          fmt::format("{}: not complete: {}: {}", name, manifest.outcome, manifest.reason));
  };
  describe_gaps("A", of_a);
  describe_gaps("B", of_b);
  return notes;
}

}  // namespace sls::record
