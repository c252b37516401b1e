/// Files of comma-separated values. Numbers have the fewest digits that keep every bit.
#pragma once

#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>

typedef struct CsvFile {
  FILE* stream;
  bool is_in_row;
} CsvFile;

/// Creates `folder` if it is missing, and creates or replaces the file `name` in it. Here and in
/// the functions below, a system error ends the program with exit code 1.
void open_csv(CsvFile* file, const char* folder, const char* name, const char* header);
void close_csv(CsvFile* file);

/// Adds the shortest digits that read back as `value`, in plain or scientific notation, whichever
/// is shorter.
void add_number(CsvFile* file, double value);
void add_integer(CsvFile* file, uint64_t value);
/// Adds `text`, which must contain no commas, quotes and line breaks, such as a name.
void add_text(CsvFile* file, const char* text);
void end_row(CsvFile* file);
