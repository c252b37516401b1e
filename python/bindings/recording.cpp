#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include <algorithm>
#include <charconv>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "common/config/config_error.hpp"
#include "common/config/yaml_node.hpp"
#include "control_client/laws/qsf/lqr.hpp"
#include "python/bindings/bindings.hpp"
#include "recorder/recording_reader.hpp"
#include "recorder/sinks/csv/csv_reader.hpp"
#include "recorder/verification.hpp"

namespace sls::python {
namespace {

namespace py = pybind11;

/// (steps, certificate, problems)
py::tuple inspect(const std::string& folder) {
  record::Inspection inspection;
  {
    const py::gil_scoped_release released;
    inspection = record::inspect(record::open_recording(folder));
  }
  return py::make_tuple(inspection.steps, inspection.certificate, inspection.problems);
}

/// (first difference or None, notes)
py::tuple compare(const std::string& folder_a, const std::string& folder_b) {
  std::optional<record::Difference> difference;
  std::vector<std::string> notes;
  {
    const py::gil_scoped_release released;
    const record::OpenedRecording a = record::open_recording(folder_a);
    const record::OpenedRecording b = record::open_recording(folder_b);
    difference = record::find_first_difference(a, b);
    notes = record::list_notes(a, b);
  }
  return py::make_tuple(difference ? py::object(py::str(difference->text)) : py::none(), notes);
}

/// A column of numbers, or of texts as indices into `texts`.
struct TableColumn {
  bool is_text = false, is_wanted = true;
  std::vector<double> numbers;
  std::vector<std::string> texts;
  std::vector<std::int64_t> indices;
  std::map<std::string, std::int64_t, std::less<>> known;  // by text

  void add_text(std::string_view text) {
    auto found = known.find(text);
    if (found == known.end()) {
      found = known.emplace(text, static_cast<std::int64_t>(texts.size())).first;
      texts.emplace_back(text);
    }
    indices.push_back(found->second);
  }
  /// False if `text` is no number.
  bool add_number(std::string_view text) {
    const auto [end, error] =
        std::from_chars(text.data(), text.data() + text.size(), numbers.emplace_back());
    return error == std::errc() && end == text.data() + text.size();
  }
};

/// An array that takes over the numbers.
template <class Number>
py::array_t<Number> to_array(std::vector<Number>& numbers) {
  auto* owned = new std::vector<Number>(std::move(numbers));
  const py::capsule owner(owned, [](void* it) { delete static_cast<std::vector<Number>*>(it); });
  return py::array_t<Number>(static_cast<py::ssize_t>(owned->size()), owned->data(), owner);
}

std::size_t count_lines(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return static_cast<std::size_t>(
      std::count(std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>(), '\n'));
}

/// The columns of a CSV file whose first line is `header`: arrays (rows,) of float64, and for the
/// columns `text` a tuple of the different texts and an index for each row. A last row without a
/// line break is left out. Columns that are not among `wanted` are not read: None.
/// @throws config::ConfigError with file and line for a row that cannot be read.
py::list read_table(const std::string& path, const std::string& header,
                    const std::set<std::string>& text,
                    const std::optional<std::set<std::string>>& wanted) {
  std::vector<TableColumn> columns;
  try {
    record::CsvReader file(path, header);
    columns.resize(file.columns().size());
    std::vector<std::size_t> read;
    // A row has a byte for each column at least.
    const std::size_t lines =
        std::min<std::size_t>(count_lines(path), std::filesystem::file_size(path) / columns.size());
    for (std::size_t i = 0; i < columns.size(); ++i) {
      columns[i].is_text = text.count(file.columns()[i]) > 0;
      columns[i].is_wanted = !wanted || wanted->count(file.columns()[i]) > 0;
      if (!columns[i].is_wanted) continue;
      read.push_back(i);
      columns[i].is_text ? columns[i].indices.reserve(lines) : columns[i].numbers.reserve(lines);
    }
    while (file.next())
      for (const std::size_t i : read) {
        const std::string_view field = file.fields()[i];
        if (columns[i].is_text && !config::is_utf8(std::string(field)))
          throw config::ConfigError(file.place() + file.columns()[i] +
                                    ": expected UTF-8 text, got '" +
                                    config::to_printable(std::string(field)) + "'");
        if (columns[i].is_text)
          columns[i].add_text(field);
        else if (!columns[i].add_number(field))
          throw config::ConfigError(file.place() + file.columns()[i] +
                                    ": expected a number, got '" +
                                    config::to_printable(std::string(field)) + "'");
      }
  } catch (const record::DamagedError& error) {
    throw config::ConfigError(error.what());
  }
  py::list result;
  for (TableColumn& column : columns)
    if (!column.is_wanted)
      result.append(py::none());
    else if (column.is_text)
      result.append(py::make_tuple(column.texts, to_array(column.indices)));
    else
      result.append(to_array(column.numbers));
  return result;
}

py::dict to_dict(const control::AxisGains& gains, bool has_rod) {
  py::dict dict;
  dict["position"] = gains.position;
  dict["velocity"] = gains.velocity;
  if (has_rod) {
    dict["acceleration"] = gains.acceleration;
    dict["jerk"] = gains.jerk;
  }
  return dict;
}

py::dict calc_lqr(double horizontal, double vertical) {
  const control::NamedGains gains =
      control::make_named_gains(control::LqrWeights{horizontal, vertical});
  py::dict dict;
  dict["horizontal"] = to_dict(gains.horizontal, true);
  dict["vertical"] = to_dict(gains.vertical, false);
  return dict;
}

}  // namespace

void add_recording(py::module_& module) {
  module.def("inspect_recording", &inspect, py::arg("folder"));
  module.def("compare_recordings", &compare, py::arg("a"), py::arg("b"));
  module.def("read_table", &read_table, py::arg("path"), py::arg("header"), py::arg("text"),
             py::arg("wanted") = py::none());
  module.def("lqr", &calc_lqr, py::arg("horizontal"), py::arg("vertical"));
}

}  // namespace sls::python
