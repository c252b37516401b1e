/// Files of comma-separated values, with numbers as short as they can be without losing a bit.
#pragma once

#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>

typedef struct CsvFile {
  FILE* stream;
  bool is_in_row;
} CsvFile;

/// Makes `folder` where it is missing, and in it the file `name` anew. A refusal of the system ends
/// the program with exit code 1, also in the functions below.
void open_csv(CsvFile* file, const char* folder, const char* name, const char* header);
void close_csv(CsvFile* file);

/// The shortest digits that read back as `value`, in the shorter notation, plain or scientific.
void add_number(CsvFile* file, double value);
void add_integer(CsvFile* file, uint64_t value);
/// `text` is without commas, quotes and line breaks: a name.
void add_text(CsvFile* file, const char* text);
void end_row(CsvFile* file);
