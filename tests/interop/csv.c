#include "csv.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "node.h"

static void expect_success(bool success, const char* what) {
  if (success) return;
  say("%s: %s", what, strerror(errno));
  exit(1);
}

void open_csv(CsvFile* file, const char* folder, const char* name, const char* header) {
  char path[4096];
  snprintf(path, sizeof path, "%s/%s", folder, name);
  expect_success(mkdir(folder, 0777) == 0 || errno == EEXIST, folder);
  file->stream = fopen(path, "w");
  expect_success(file->stream != NULL, path);
  file->is_in_row = false;
  add_text(file, header);
  end_row(file);
}

void close_csv(CsvFile* file) {
  expect_success(!ferror(file->stream) && fclose(file->stream) == 0, "cannot write");
}

void add_text(CsvFile* file, const char* text) {
  if (file->is_in_row) putc(',', file->stream);
  file->is_in_row = true;
  fputs(text, file->stream);
}

void end_row(CsvFile* file) {
  putc('\n', file->stream);
  file->is_in_row = false;
}

void add_number(CsvFile* file, double value) {
  char scientific[32], plain[512];
  int digits = 0;  // after the first
  do {
    snprintf(scientific, sizeof scientific, "%.*e", digits, value);
  } while (strtod(scientific, NULL) != value && ++digits < 17);
  const char* exponent = strchr(scientific, 'e');
  const int decimals = exponent ? digits - atoi(exponent + 1) : 0;
  snprintf(plain, sizeof plain, "%.*f", decimals > 0 ? decimals : 0, value);
  add_text(file, strlen(plain) <= strlen(scientific) ? plain : scientific);
}

void add_integer(CsvFile* file, uint64_t value) {
  char text[32];
  snprintf(text, sizeof text, "%llu", (unsigned long long)value);
  add_text(file, text);
}
