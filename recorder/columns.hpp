/// The columns of all files. Each row type of rows.hpp visits its fields with their columns; this
/// one list gives header, row, reader, certificate and reference page.
#pragma once

#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "common/bus/topics.hpp"

namespace sls::record {

struct Column {
  const char* name;  ///< of a vector with '?' for its components: x, y, z; of four: w, x, y, z
  const char* unit;
  const char* meaning;
  const char* source;        ///< field of idl/sls.idl, or of the other files
  bool is_certified = true;  ///< false if the field can differ between equal flights
};

/// Calls `work` with a scalar or text, or with each component of a vector.
template <class Field, class Work>
void for_each_component(Field& field, Work work) {
  if constexpr (std::is_arithmetic_v<Field> || std::is_convertible_v<Field, std::string_view>)
    work(field);
  else
    for (auto& component : field) work(component);
}

/// A visitor that lists the columns of a row, with '?' in names replaced.
struct ColumnLister {
  struct Entry {
    Column column;
    std::vector<std::string> names;
  };
  std::vector<Entry> entries;

  template <class Field>
  void operator()(const Column& column, const Field& field) {
    std::size_t size = 0;
    for_each_component(field, [&](const auto&) { ++size; });
    add(column, size);
  }
  void add(const Column& column, std::size_t size);
};

std::string join_names(const std::vector<ColumnLister::Entry>& columns);

/// The first line of state.csv and measured.csv, with the attitude and signals of the plant, if
/// any.
/// @throws config::ConfigError if a signal's name cannot be a column.
std::string make_state_header(const Parameters& parameters);
std::string make_flight_header(bool is_of_fleet);

/// Every file's columns as Markdown, for docs/reference/recordings.md.
std::string describe_columns();

}  // namespace sls::record
